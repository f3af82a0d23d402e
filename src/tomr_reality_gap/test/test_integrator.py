"""Which way the drivers sum their error, once what was left out is named."""

from pathlib import Path

import pytest
from attrs import evolve

from tomr_power_model.estimation.parameter import per_wheel
from tomr_power_model.robot import read_description, shipped_robot
from tomr_reality_gap import explain
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.integrator import INTEGRATOR, summed_otherwise, sums_otherwise
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.progress import Progress
from tomr_reality_gap.request import Request

from .test_alignment import simulation  # noqa: F401 -- the fixture
from .test_forward_selection import searched

SQUARE = Path(__file__).parents[3] / "bags" / "square"
TRIED = ("body.payload", "parameter.controller.proportional")


@pytest.mark.parametrize("way", ["backward", "forward"])
def test_a_payload_does_not_pass_for_another_loop(
    simulation: RecordingSimulation,  # noqa: F811
    way: str,
) -> None:
    """The described way is found wrong, or right, beside a third of the mass more."""
    robot = simulation.robot
    controller = evolve(robot.controller, integrator=way)
    real = evolve(robot, mass=1.3 * robot.mass, controller=controller)
    dataset, found = searched(simulation, simulation.predict([real])[0], TRIED)
    assert "body.payload_mass" in {item.effect for item in found.best.model.hypotheses}
    assert sums_otherwise(dataset, found) is (way != robot.controller.integrator)


def test_there_are_two_ways() -> None:
    robot = shipped_robot("reference")
    base = per_wheel(dict(read_description("reference")), robot.wheel_names, "reference")
    other = summed_otherwise(base)
    assert {base.robot.controller.integrator, other.values[INTEGRATOR]} == {"forward", "backward"}
    assert summed_otherwise(other).robot == base.robot


@pytest.mark.parametrize("is_known", [False, True])
def test_the_way_is_asked_once_where_no_simulation_shows_it(
    is_known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def otherwise(*given: object) -> bool:
        asked.append(given)
        return True

    monkeypatch.setattr(explain, "sums_otherwise", otherwise)
    request = Request("reference", (SQUARE,))
    ready = prepared(request)
    silent: Progress = lambda stage, part: None  # noqa: E731
    found = explain._analysed(request, ready, silent, is_loop_known=is_known)
    expected = ready if is_known else ready.summed_otherwise()
    assert len(asked) == (not is_known)
    assert found.base == expected.base
    assert found.robot.controller.integrator == expected.base.values[INTEGRATOR]
