"""A small campaign of hostile input: see bench/attack.py."""

# ruff: noqa: E402 (bench/ is no package)

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "bench"))

from attack.case import HEALTHY, Attack, Raw
from attack.judge import problem_of
from attack.recordings import SECOND, _is_dead, restamped

from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.recordings import open_recording

STATES = ("power sensor fault 1", "dragging wheel 2", "external load", "slip")


def test_hostile_input_is_answered_as_promised(tmp_path: Path) -> None:
    run = subprocess.run(
        [
            *(sys.executable, ROOT / "bench" / "attack.py", "--out", tmp_path),
            *("--seconds", "30", "--tries", "60", "--seed", "7"),
        ],
        capture_output=True,
        text=True,
        timeout=170,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "| all |" in run.stdout


@pytest.mark.parametrize("stamp_ns", [0, 5 * SECOND - 1, -7 * SECOND, 2**31 * SECOND - 1])
def test_a_message_with_another_stamp_can_be_read(stamp_ns: int) -> None:
    decode = jazzy_typestore().deserialize_cdr
    with open_recording(HEALTHY) as recording:
        raws = {item[0]: Raw(*item) for item in recording.raw_messages()}
    assert len(raws) > 5
    for raw in raws.values():
        message = decode(restamped(raw, stamp_ns).data, raw.type_name)
        assert header_stamp_ns(message) == stamp_ns
        assert message.header.frame_id == decode(raw.data, raw.type_name).header.frame_id


@pytest.mark.parametrize("state", [*STATES, "does not follow its commands"])
def test_every_accusation_that_is_not_true_is_a_false_word(state: str) -> None:
    def judged(*names: str) -> str:
        given = Attack("tomr_diagnose", ("bag", "--json"), "", frozenset(names))
        return problem_of(given, 1, "", json.dumps({"ticks": 9, "shares": {state: 0.1}}))

    assert judged() == judged("another") == f"false word: {state}"
    assert judged(state) == ""
    allowed = json.dumps({"ticks": 9, "shares": {"unknown": 0.1, "pushed": 0.1, "normal": 0.8}})
    given = Attack("tomr_diagnose", ("bag", "--json"), "", frozenset())
    assert problem_of(given, 1, "", allowed) == ""


@pytest.mark.parametrize(("silent_s", "dead"), [(0.0, False), (2.0, False), (2.6, True)])
def test_a_sensor_is_dead_that_is_silent_for_seconds(silent_s: float, dead: bool) -> None:
    stamps = [0.1 * k for k in range(1, 30) if not 0.2 < 0.1 * k < 0.2 + silent_s]
    kept = [Raw("power", "", b"", round(stamp * SECOND)) for stamp in stamps]
    assert _is_dead("power", kept, (0, 3 * SECOND)) is dead
    assert not _is_dead("power", [*kept, Raw("power", "", b"", SECOND)], (0, 3 * SECOND))
