"""tomr_demo: its score, what it shows and what it leaves behind."""

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from rich.console import Console

from tomr_demo import acts
from tomr_demo.main import main
from tomr_demo.output import make_output
from tomr_demo.score import TRUTH, Named, Scoreboard, truth_in
from tomr_demo.view import PlainView, Scene, act_table, now_panel
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_fault_diag.residuals.messages import residual_message
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message, to_bag
from tomr_power_model.messages.types import DIAGNOSTICS
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.plant.simulation import Simulation

START = 1_700_000_000_000_000_000


def at(seconds: float) -> int:
    return START + round(seconds * 1e9)


def played(
    truths: Sequence[tuple[float, str | None, int]], named: Sequence[tuple[float, str]], end: float
) -> Scoreboard:
    """A board that was given the truth every 0.05 s and the diagnoses, each when it came."""
    board = Scoreboard()
    news = [(time, 0, state) for time, state in named]
    news += [(0.05 * tick, 1, "") for tick in range(1 + round(end / 0.05))]
    for moment, is_truth, state in sorted(news):
        if is_truth:
            *_, (_, fault, wheel) = [t for t in truths if t[0] <= moment + 1e-9]
            board.truth(at(moment), fault, wheel)
        else:
            board.diagnosis(Named(at(moment), state, 0.9, ("wheel_1 power: 3 W above",)))
    board.close()
    return board


SLIPPING = [(0.0, None, 1), (4.0, "floor_slippery", 1), (8.0, None, 1)]


@pytest.mark.parametrize(
    ("named", "verdicts", "delay"),
    [
        ([(-1, "normal"), (4.4, "slip"), (9.2, "normal")], [True, True, True], 0.45),
        ([(-1, "normal"), (4.95, "slip"), (9.2, "normal")], [True, True, True], 1.0),
        ([(-1, "normal"), (5.0, "slip"), (9.2, "normal")], [True, False, True], 1.05),
        ([(-1, "normal"), (9.2, "normal")], [True, False, True], None),
        # Another fault first, the right one in time after it.
        (
            [(-1, "normal"), (4.2, "control system fault"), (4.6, "slip"), (9.2, "normal")],
            [True, True, True],
            0.65,
        ),
        # Named while there was none, and merely repeated when it came.
        ([(-1, "normal"), (3.0, "slip"), (4.4, "slip"), (9, "normal")], [False, False, True], None),
        ([(4.4, "slip"), (9.2, "normal")], [False, True, True], 0.45),
        ([(-1, "normal"), (4.4, "slip")], [True, True, False], 0.45),
        ([(-1, "normal"), (4.4, "slip"), (10.97, "normal")], [True, True, False], 0.45),
        (
            [(-1, "normal"), (4.4, "slip"), (9, "normal"), (10, "motor system fault 2")],
            [True, True, False],
            0.45,
        ),
    ],
)
def test_a_fault_passes_if_named_within_a_second_and_health_if_nothing_is_invented(
    named: Sequence[tuple[float, str]], verdicts: list[bool], delay: float | None
) -> None:
    board = played(SLIPPING, named, 12.0)
    assert [stretch.passed(board.now_ns) for stretch in board.stretches] == verdicts
    # The last truth before the fault is that of 3.95 s.
    measured = board.stretches[1].delay_ns
    assert measured == (None if delay is None else round(delay * 1e9))
    assert board.passed is all(verdicts)


def test_the_wheel_of_a_lost_encoder_has_to_be_named() -> None:
    truths = [(0.0, None, 1), (2.0, "encoder_lost", 3)]
    right = played(truths, [(-1, "normal"), (2.5, "motor system fault 3")], 6.0)
    wrong = played(truths, [(-1, "normal"), (2.5, "motor system fault 1")], 6.0)
    assert right.stretches[1].title == "wheel 3: encoder lost"
    assert right.passed
    assert not wrong.passed
    assert wrong.stretches[1].strays == ("motor system fault 1",)


def test_share_of_the_time_in_which_the_right_name_stood() -> None:
    named = [(-1, "normal"), (4.45, "slip"), (6.45, "normal"), (6.95, "slip"), (9.0, "normal")]
    board = played(SLIPPING, named, 12.0)
    # Of the 3.5 s from the naming to 7.95 s, 0.5 s are called normal.
    assert board.stretches[1].held(board.now_ns) == pytest.approx(3.0 / 3.5)


def test_a_drive_without_a_fault_does_not_pass() -> None:
    assert not played([(0.0, None, 1)], [(-1, "normal")], 5.0).passed


def rendered(scene: Scene, width: int) -> str:
    console = Console(width=width, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(act_table(scene, width), now_panel(scene))
    return console.export_text()


def test_table_shows_what_was_named_how_late_and_what_is_still_to_come() -> None:
    board = played(SLIPPING[:2], [(-1, "normal"), (4.4, "slip")], 5.0)
    scene = Scene(acts.ACTS, board, board.now_ns, 40.0)
    for width in (80, 130):
        text = rendered(scene, width)
        row = next(line for line in text.splitlines() if "floor slippery" in line)
        assert [part in row for part in ("4.0 s", "slip", "0.90", "0.45 s", "PASS")] == [True] * 5
        assert "wheel 1: encoder lost" in text
        assert "wheel_1 power: 3 W above" in text
        assert max(len(line) for line in text.splitlines()) <= width
    assert text.count("PASS") == 2


def test_plain_lines_report_each_change_once(capsys: pytest.CaptureFixture[str]) -> None:
    view = PlainView(Console(width=130))
    board = Scoreboard()
    view.starting("no /joint_states from sim_bridge yet")
    view.starting("no /joint_states from sim_bridge yet")
    board.diagnosis(Named(at(-0.5), "normal", 1.0))
    for tick in range(60):
        moment = 0.05 * tick
        board.truth(at(moment), "encoder_lost" if tick >= 20 else None, 2)
        if tick % 20 == 19 or tick == 28:
            state = "motor system fault 2" if tick >= 28 else "normal"
            board.diagnosis(Named(at(moment), state, 0.8, ("total power: 70 W above",)))
        view.show(Scene(acts.ACTS, board, board.now_ns, 40.0))
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        "starting the nodes: no /joint_states from sim_bridge yet",
        "0.00 s  true: healthy",
        "0.00 s  /diagnostics: normal, p 1.00",
        "0.95 s  true: wheel 2: encoder lost",
        "1.40 s  /diagnostics: motor system fault 2, p 0.80, after 0.45 s",
        "total power: 70 W above",
    ]


def test_truth_is_read_as_the_simulator_publishes_it() -> None:
    simulation = Simulation(shipped_robot("reference"))
    simulation.set_fault("encoder_lost", wheel=3, severity=1.0)
    published = [s.message for s in simulation.step_to(60_000_000) if f"/{s.topic}" == TRUTH]
    assert [truth_in(to_bag(message)) for message in published[-1:]] == [("encoder_lost", 3)]
    simulation.set_fault("encoder_lost")
    published = [s.message for s in simulation.step_to(200_000_000) if f"/{s.topic}" == TRUTH]
    assert truth_in(to_bag(published[-1])) == (None, 1)


def test_only_a_folder_of_an_earlier_demo_is_replaced(tmp_path: Path) -> None:
    first = make_output(tmp_path / "demo_output")
    (first / "recording").mkdir()
    (first / "recording" / "old.mcap").write_text("old")
    (first / "notes.txt").write_text("mine")
    again = make_output(tmp_path / "demo_output")
    assert again == first
    assert not (again / "recording").exists()
    assert (again / "notes.txt").read_text() == "mine"
    other = tmp_path / "thesis"
    other.mkdir()
    (other / "README.txt").write_text("not to be lost")
    assert make_output(other) == tmp_path / "thesis_2"
    assert make_output(other) == tmp_path / "thesis_2"
    assert [entry.name for entry in other.iterdir()] == ["README.txt"]
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        make_output(tmp_path / "file" / "below")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Ten seconds of a robot that slips from 4 s to 8 s, named after 0.45 s."""
    path = tmp_path / "recording"
    with RecordingWriter(path) as writer:

        def write(topic: str, type_name: str, moment: float, **fields: object) -> None:
            message = bag_message(type_name, header=bag_header(at(moment)), **fields)
            writer.write(topic, type_name, message, at(moment))

        for tick in range(200):
            moment = 0.05 * tick
            slips = 4.0 <= moment < 8.0
            for number in (1, 2, 3):
                power = 4.0 + 2.0 * math.sin(2.5 * moment + number)
                measured = 4.0 if slips else power
                for name, value in (("power", measured), ("power/predicted", power)):
                    write(
                        f"wheel_{number}/{name}",
                        "sensor_msgs/msg/BatteryState",
                        moment,
                        voltage=24.0,
                        current=-value / 24.0,
                    )
            frame = ResidualFrame(at(moment), (Residual(4.0 if slips else 0.2, 1.0, 4.0),) * 10)
            message = residual_message(shipped_robot("reference"), frame)
            writer.write("residuals", DIAGNOSTICS, to_bag(message.plain), at(moment))
            truth = [("floor_slippery", {"active": float(slips), "severity": 0.8})]
            write_diagnostics(write, "ground_truth/faults", moment, truth)
            if tick % 20 == 0 or tick == 88:
                state = "slip" if 4.4 <= moment <= 9.0 else "normal"
                since = at({"slip": 4.3, "normal": 0.0}[state] if moment < 9.5 else 9.4)
                values = {
                    "state": state,
                    "since": f"{since // 10**9}.{since % 10**9:09d}",
                    f"p {state}": 0.9,
                }
                named = [("fault_classifier: drive", values)]
                write_diagnostics(write, "/diagnostics", moment, named)
    return path


def write_diagnostics(
    write: Callable[..., None],
    topic: str,
    moment: float,
    statuses: Sequence[tuple[str, dict[str, Any]]],
) -> None:
    made = [
        bag_message(
            "diagnostic_msgs/msg/DiagnosticStatus",
            name=name,
            values=[
                bag_message("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
                for key, value in values.items()
            ],
        )
        for name, values in statuses
    ]
    write(topic, DIAGNOSTICS, moment, status=made)


def share_of(image: Any, colour: str) -> float:
    """Share of an image's pixels that have a colour such as #8cb8e8."""
    wanted = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return float((np.abs(image[:, :, :3] - wanted).max(axis=2) < 0.01).mean())


def test_figure_is_drawn_from_a_recording(recording: Path) -> None:
    assert main(["--figure", str(recording)]) == 0
    image = matplotlib.image.imread(recording.parent / "timeline.png")
    height, width, _ = image.shape
    assert width > 1500
    assert height > 1000
    # Slip is true for 4 s and named for 4.6 s of 10 s on strips 0.035 of the height; then a heat
    # map that is beyond three bands for 4 s on a third of the height.
    assert share_of(image, "#8cb8e8") == pytest.approx(0.86 * 0.8 * 0.033, rel=0.2)
    assert share_of(image, "#a82a22") == pytest.approx(0.4 * 0.8 * 0.27, rel=0.25)
    assert share_of(image, "#e07b00") > 0.002


def test_figure_of_a_recording_without_predictions_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bag"
    with RecordingWriter(path) as writer:
        message = bag_message("sensor_msgs/msg/BatteryState", header=bag_header(START))
        writer.write("wheel_1/power", "sensor_msgs/msg/BatteryState", message, START)
    assert main(["--figure", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "wheel_1/power" in error
    assert main(["--figure", str(tmp_path / "nothing")]) == 2
