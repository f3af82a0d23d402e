"""Parameters that are set while a node runs."""

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.diagnosis.settings import STAGE_NODES, DiagnosisSettings
from tomr_fault_diag.nodes.diagnosis_node import DiagnosisNode
from tomr_fault_diag.nodes.fault_classifier_node import FaultClassifierNode
from tomr_fault_diag.nodes.power_residuals_node import PowerResidualsNode
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Level, Status
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.nodes.stage_node import StageNode
from tomr_power_model.robot import read_node_sections

KINDS = {
    "residuals": PowerResidualsNode,
    "classifier": FaultClassifierNode,
    "diagnosis": DiagnosisNode,
    "managed": DiagnosisNode,
}
DONE = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def node(request: pytest.FixtureRequest) -> Iterator[StageNode]:
    robot = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
    managed = "true" if request.param == "managed" else "false"
    rclpy.init(args=["--ros-args", "--params-file", robot, "-p", f"managed:={managed}"])
    made = KINDS[request.param]()
    yield made
    made.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize("node", ["residuals"], indirect=True)
def test_bands_hold_from_the_next_tick_on(node: PowerResidualsNode) -> None:
    (result,) = node.set_parameters([Parameter("band.power", value=3.5)])
    assert result.successful
    assert node.stage.settings.bands.power == 3.5


@pytest.mark.parametrize("node", ["residuals"], indirect=True)
def test_a_band_that_does_not_fit_is_refused(node: PowerResidualsNode) -> None:
    before = node.stage.settings.bands
    (result,) = node.set_parameters([Parameter("band.power", value=-1.0)])
    assert not result.successful
    assert node.stage.settings.bands == before


@pytest.mark.parametrize("node", ["classifier"], indirect=True)
def test_times_of_the_classifier_hold_at_once(node: FaultClassifierNode) -> None:
    (result,) = node.set_parameters([Parameter("recovery_time", value=2.5)])
    assert result.successful
    assert node.classifier.settings.recovery_time == to_ns(2.5)


@pytest.mark.parametrize("node", ["diagnosis"], indirect=True)
def test_one_process_is_retuned_as_its_stages_are(node: DiagnosisNode) -> None:
    new = [Parameter("band.power", value=3.5), Parameter("recovery_time", value=2.5)]
    assert all(result.successful for result in node.set_parameters(new))
    assert node.pipeline.settings.residuals.bands.power == 3.5
    assert node.pipeline._residuals.settings.bands.power == 3.5
    assert node.pipeline._classifier.settings.recovery_time == to_ns(2.5)


@pytest.mark.parametrize("node", ["diagnosis"], indirect=True)
def test_what_was_heard_before_a_pause_counts_for_nothing(node: DiagnosisNode) -> None:
    before = node.pipeline
    node.on_deactivate()
    assert node.pipeline is not before
    assert not list(node.subscriptions)
    node.on_activate()
    assert "/joint_states" in {subscription.topic_name for subscription in node.subscriptions}


@pytest.mark.parametrize("node", ["diagnosis"], indirect=True)
def test_after_a_pause_what_is_retuned_and_cleared_is_the_new(
    node: DiagnosisNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    node.on_deactivate()
    node.on_activate()
    new = node.pipeline._classifier
    monkeypatch.setattr(FaultClassifier, "release", lambda self: "slip" if self is new else "")
    (result,) = node.set_parameters([Parameter("recovery_time", value=2.5)])
    assert result.successful
    assert new.settings.recovery_time == to_ns(2.5)
    answer = node._clearing.callback(Trigger.Request(), Trigger.Response())
    assert answer.message == "slip is cleared"


@pytest.mark.parametrize("node", ["classifier", "diagnosis"], indirect=True)
def test_a_node_to_which_nothing_comes_says_so(
    node: StageNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[DiagnosticMessage] = []
    monkeypatch.setattr(node, "send", sent.append)
    *_, timer = node.timers  # the one before looks which type cmd_vel has
    timer.callback()
    assert not sent  # it has only just begun
    monkeypatch.setattr(node, "_heard_at", node._heard_at - 3.5)
    timer.callback()
    (status,) = sent[0].statuses
    assert (status.level, sent[0].topic) == (Level.STALE, "/diagnostics")
    assert "is their namespace right?" in status.message
    node.heard_now()
    timer.callback()
    assert len(sent) == 1


@pytest.mark.parametrize("node", ["residuals", "diagnosis"], indirect=True)
def test_no_gyro_is_waited_for(node: StageNode) -> None:
    assert "/imu/data" in {subscription.topic_name for subscription in node.subscriptions}
    assert "imu/data" not in node._unheard
    assert "joint_states" in node._unheard


def held(node: DiagnosisNode) -> list[int]:
    """How much a node has, and how much it says that it has."""
    entities = (node.services, node.publishers, node.subscriptions, node.timers)
    return [len(list(items)) for items in (*entities, *node._topics.values())]


@pytest.mark.parametrize("node", ["managed"], indirect=True)
def test_a_managed_node_takes_back_all_that_it_had(
    node: DiagnosisNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    introduced: list[list[int]] = []
    monkeypatch.setattr(node, "introduce", lambda: introduced.append(held(node)))
    unconfigured = held(node)
    for _ in range(2):
        assert node.trigger_configure() == node.trigger_activate() == DONE
        active = held(node)
        assert node.trigger_deactivate() == DONE
        inactive = held(node)
        assert node.trigger_cleanup() == DONE
        assert held(node) == unconfigured
    assert introduced == [active, active]
    assert active > inactive > unconfigured
    assert node.trigger_configure() == node.trigger_activate() == node.trigger_shutdown() == DONE
    assert held(node)[:4] == unconfigured[:4]


@pytest.mark.parametrize("node", ["managed"], indirect=True)
def test_a_managed_node_that_never_began_is_not_activated_but_shut_down(
    node: DiagnosisNode,
) -> None:
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_ACTIVATE))
    answer = node._service_change_state.callback(request, ChangeState.Response(success=True))
    assert not answer.success
    assert node.trigger_shutdown() == DONE


@pytest.fixture
def named(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """The fault that is named, empty: none."""
    monkeypatch.setattr(FaultClassifier, "release", lambda _: request.param)
    return str(request.param)


@pytest.mark.parametrize("node", ["classifier", "diagnosis"], indirect=True)
@pytest.mark.parametrize("named", ["", "slip"], indirect=True)
def test_a_fault_is_cleared_by_service(named: str, node: StageNode) -> None:
    client = node.create_client(Trigger, "~/clear")
    assert client.wait_for_service(10.0)
    answer = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, answer, timeout_sec=10.0)
    assert answer.result().success
    assert answer.result().message == (f"{named} is cleared" if named else "no fault was named")


def test_one_process_takes_the_sections_of_the_stages(tmp_path: Path) -> None:
    reference = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml").read_text()
    file = tmp_path / "robot.yaml"
    file.write_text(
        reference
        + "power_residuals:\n  ros__parameters:\n    band.power: 2.2\n"
        + "tomr_diagnosis:\n  ros__parameters:\n    recovery_time: 2.5\n"
        + "    intermediate_topics: false\n"
    )
    rclpy.init(args=["--ros-args", "--params-file", str(file), "-p", "band.current:=0.3"])
    node = DiagnosisNode([str(file)])
    settings, offered = node.pipeline.settings, set(node._outlets)
    node.destroy_node()
    rclpy.shutdown()
    assert settings.residuals.bands.power == 2.2
    assert settings.residuals.bands.current == 0.3
    assert settings.classifier.recovery_time == to_ns(2.5)
    assert offered == {"/diagnostics"}
    read = DiagnosisSettings.of(read_node_sections(file, STAGE_NODES), "a tool")
    assert read.classifier.recovery_time == to_ns(2.5)


def test_a_namespace_is_the_name_of_a_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
    rclpy.init(args=["--ros-args", "--params-file", robot, "-r", "__ns:=/fleet/r1"])
    node = FaultClassifierNode()
    sent: dict[str, str] = {}
    monkeypatch.setattr(node, "is_heard", lambda topic: True)
    monkeypatch.setattr(
        node,
        "publish",
        lambda topic, plain: sent.update({topic: plain.fields["status"][0].fields["name"]}),
    )
    status = Status("inputs: cmd_vel", Level.OK, "", (), "")
    for topic in ("/diagnostics", "residuals"):
        node.send(DiagnosticMessage(topic, 0, (status,)))
    hardware_id = node.classifier.settings.hardware_id
    node.destroy_node()
    rclpy.shutdown()
    assert hardware_id == "fleet/r1"
    assert sent == {"/diagnostics": "/fleet/r1/inputs: cmd_vel", "residuals": "inputs: cmd_vel"}
