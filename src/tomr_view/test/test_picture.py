"""What the page is given, from residuals and statuses worked by hand."""

import json
import math
from pathlib import Path

import pytest

from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import shipped_robot
from tomr_view.picture import Gatherer, Status, spells
from tomr_view.recording import pictures_of

BAG = Path(__file__).parents[3] / "bags" / "circle_encoder_lost"
NAN = math.nan


def frame(seconds: float, speeds: tuple[float, float, float], total: float = 0.0) -> ResidualFrame:
    """All as modelled but the total; wheels at expected speeds [rad/s]."""
    return ResidualFrame(
        round(seconds * NANOSECONDS),
        (
            Residual(total, 2.0, 20.0),
            *(Residual(0.5, 1.0, 3.0) for _ in range(3)),
            *(Residual(0.0, 0.1, speed, "rad/s") for speed in speeds),
            *(Residual(NAN, NAN, NAN, missing="no encoders") for _ in range(3)),
        ),
    )


@pytest.fixture
def gatherer() -> Gatherer:
    return Gatherer(shipped_robot("reference"))


def test_powers_are_what_residuals_say_of_them(gatherer: Gatherer) -> None:
    assert gatherer.picture() is None
    gatherer.residuals(frame(7.0, (1.0, -2.0, 0.0), total=-1.5))
    picture = gatherer.picture()
    assert picture is not None
    assert picture["powers"] == [[3.5, 3.0], [3.5, 3.0], [3.5, 3.0], [18.5, 20.0]]
    assert picture["residuals"][0] == [-1.5, 2.0]
    assert picture["residuals"][9] == [None, None]
    assert picture["t"] == 0.0
    assert "NaN" not in json.dumps(picture, allow_nan=False)


def test_the_robot_moves_as_its_wheels_turn(gatherer: Gatherer) -> None:
    """All wheels at -4 rad/s turn on the spot: r omega = -R omega_z, 0.05 * 4 / 0.2 = 1 rad/s."""
    for tick in range(21):
        gatherer.residuals(frame(0.05 * tick, (-4.0, -4.0, -4.0)))
    assert gatherer.picture()["pose"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    # Time that goes back is another run; a silence is not driven through.
    gatherer.residuals(frame(0.5, (-4.0, -4.0, -4.0)))
    assert gatherer.picture()["pose"] == [0.0, 0.0, 0.0]
    gatherer.residuals(frame(60.5, (-4.0, -4.0, -4.0)))
    assert gatherer.picture()["pose"][2] == pytest.approx(0.5)


def test_speed_is_stated_in_the_direction_of_turning(gatherer: Gatherer) -> None:
    """Slower than expected is negative whichever way a wheel turns."""
    slow = Residual(-1.0, 0.1, -5.0, "rad/s")
    usual = frame(1.0, (2.0, 0.0, 0.0))
    residuals = (*usual.residuals[:5], slow, *usual.residuals[6:])
    gatherer.residuals(ResidualFrame(usual.stamp_ns, residuals))
    assert gatherer.picture()["speeds"] == [2.0, -4.0, 0.0]


def test_the_words_of_the_diagnosis(gatherer: Gatherer) -> None:
    gatherer.residuals(frame(1.0, (0.0, 0.0, 0.0)))
    assert gatherer.picture()["message"] == "no diagnosis yet"
    values = {"state": "slip", "p slip": "0.9", "p normal": "0.1", "evidence 1": "a", "x": "y"}
    values["severity"] = "traction used 0.05"
    values["conditions"] = "payload 3 kg"
    gatherer.diagnosis(
        [
            Status("/r1/fault_classifier: drive", 1, "slip", values),
            Status("/r1/inputs: joint_states", 0, "as it should be", {"rate": "100.0"}),
            Status("somebody: else", 2, "broken"),
        ]
    )
    picture = gatherer.picture()
    assert (picture["state"], picture["level"]) == ("slip", 1)
    assert picture["shares"] == {"slip": 0.9, "normal": 0.1}
    assert picture["evidence"] == ["a"]
    assert picture["severity"] == "traction used 0.05"
    assert picture["conditions"] == "payload 3 kg"
    assert [item["topic"] for item in picture["inputs"]] == ["joint_states"]


def test_what_anybody_may_publish_on_diagnostics_leaves_the_page_whole(gatherer: Gatherer) -> None:
    gatherer.residuals(frame(1.0, (0.0, 0.0, 0.0)))
    values = {"topic": "x", "level": "9", "message": "x"}
    inputs = [Status(f"inputs: {number:03}", 0, "fine", values) for number in range(1000)]
    gatherer.diagnosis([*inputs, Status("inputs: 000", 2, "late")])
    name = "fault_classifier: drive"
    gatherer.diagnosis([Status(name, 1, "slip", {"state": "slip", "p slip": "nan"})])
    with pytest.raises(ValueError, match="high"):
        gatherer.diagnosis([Status(name, 2, "bad", {"p slip": "high"})])
    picture = gatherer.picture()
    assert picture is not None
    assert len(picture["inputs"]) == 64
    assert picture["inputs"][:2] == [
        {"topic": "000", "level": 2, "message": "late"},
        {"topic": "001", "level": 0, "message": "fine"},
    ]
    assert (picture["message"], picture["shares"]) == ("slip", {"slip": None})
    assert "NaN" not in json.dumps(picture, allow_nan=False)


def test_faults_of_a_simulator_are_forgotten_when_it_is_silent(gatherer: Gatherer) -> None:
    gatherer.residuals(frame(1.0, (0.0, 0.0, 0.0)))
    assert gatherer.picture()["faults"] is None
    on = Status("encoder_lost", 0, "in force", {"severity": "1", "wheel": "2"})
    off = Status("floor_slippery", 0, "not in force", {"severity": "0"})
    gatherer.truth([on, off], NANOSECONDS)
    assert gatherer.picture()["faults"] == [{"id": "encoder_lost", "wheel": 2}]
    gatherer.residuals(frame(3.0, (0.0, 0.0, 0.0)))
    assert gatherer.picture()["faults"] is None


def test_a_recording_as_pictures() -> None:
    """22 s at ten a second; the fault of wheel 3 is in force from 8 s to 14 s."""
    _, pictures = pictures_of(BAG, "reference")
    assert len(pictures) == pytest.approx(219, abs=2)
    faulty = [p["t"] for p in pictures if p["state"] == "motor system fault 3"]
    true = [p["t"] for p in pictures if p["faults"]]
    assert (true[0], true[-1]) == pytest.approx((8.0, 14.0), abs=0.3)
    assert (faulty[0], faulty[-1]) == pytest.approx((8.3, 15.5), abs=0.3)
    states = [state for _, _, state, _ in spells(pictures)]
    assert "motor system fault 3" in states
    assert spells(pictures)[-1][1] == len(pictures) - 1
