"""The page of a recording and what is said of it in lines, from a track of four ticks."""

import re
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.advice import CHECKS
from tomr_fault_diag.classifier.severity import Severity
from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.cli.diagnose import EXIT_UNDECIDED, _exit_code
from tomr_fault_diag.diagnosis.heard import Heard
from tomr_fault_diag.diagnosis.labels import Label
from tomr_fault_diag.diagnosis.page import colour_of, index_page, time_line
from tomr_fault_diag.diagnosis.replayed import Failed, Phase, Replayed, Task
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.diagnosis.summary import Episode, Summariser, Summary
from tomr_fault_diag.diagnosis.track import Health, Said, Track, Tracker
from tomr_fault_diag.diagnosis.words import (
    as_json,
    bag_line,
    phases_line,
    summary_lines,
    verdict,
)
from tomr_fault_diag.residuals.frame import MOTORS, SPEEDS, Residual, ResidualFrame
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Level, Status

S = 1_000_000_000
START = 1_700_000_000 * S
WHEELS = ("wheel_1", "wheel_2", "wheel_3")
JOINTS = ("right_joint", "left_joint", "back_joint")
TASK = Task(Path("a <b>drive.mcap"), "reference", DiagnosisSettings.of({}, "test"))


def summary(*faults: tuple[str, float]) -> Summary:
    """Normal from the start; faults named at times [s]."""
    named = [("normal", 0.0), *faults]
    episodes = [
        Episode(state, START + round(t * S), START + 4 * S, START + round(t * S) - S // 10)
        for state, t in named
    ]
    return Summary(80, {state: 1 / len(named) for state, _ in named}, (0.0,) * 10, tuple(episodes))


def replayed(*phases: Summary) -> Replayed:
    shares = [number / len(phases) for number in range(len(phases))]
    found = tuple(Phase(share, phase) for share, phase in zip(shares, phases, strict=True))
    return Replayed(TASK, START, START + 4 * S, found, {})


def track() -> Track:
    """One tick a second: normal, normal, slip, slip; motor 1 leaves its band at the third, wheel 1
    turns backwards and 1 rad/s slower than expected."""
    residual, modelled = np.zeros((4, 10)), np.zeros((4, 10))
    residual[2, MOTORS[0]] = 9.0
    residual[:, SPEEDS[0]], modelled[:, SPEEDS[0]] = -1.0, -5.0
    said = (*[Said("normal", 0)] * 2, *[Said("slip", 0)] * 2)
    stamps = START + S * np.arange(4)
    inputs = {
        "joint_states": (Health(START, Level.OK, "fine"), Health(START + S, Level.WARN, "bad"))
    }
    return Track(stamps, said, np.full(4, 0.9), residual, np.full((4, 10), 2.0), modelled, inputs)


@pytest.fixture(scope="module")
def page() -> str:
    labels = [Label("drive", "motor system fault", 2, onset=1.5, end=9.0)]
    return time_line(replayed(summary(("slip", 2.0))), [track()], labels, WHEELS)


def test_states_labels_and_inputs_stand_where_they_were(page: str) -> None:
    for words in (
        "normal: 0.00 to 2.00 s",
        "slip: 2.00 to 3.00 s",
        "motor system fault: 1.50 to 4.00 s",  # no longer than the recording
        "joint_states: fine, 0.00 to 1.00 s",
        "joint_states: bad, 1.00 to 4.00 s",
    ):
        assert page.count(words) == 1, words
    bars = re.findall(r"<rect[^>]*>(?=<title>joint_states)", page)
    assert [bar.count("#f77f00") for bar in bars] == [0, 1]  # a warning has its colour


def test_what_is_out_of_its_band_is_drawn_apart(page: str) -> None:
    drawn = [path for path in re.findall(r'class="outside" d="([^"]*)"', page) if path]
    assert len(drawn) == 1
    assert drawn[0].startswith("M2000 ")


def test_a_wheel_that_lags_turns_slower_whichever_way(page: str) -> None:
    """Expected -5 rad/s and behind by 1 rad/s: it turns at -4 rad/s."""
    assert '["measured",[-4.0,-4.0,-4.0,-4.0]],["modelled",[-5.0,-5.0,-5.0,-5.0]]' in page


def test_names_are_text(page: str) -> None:
    assert "<b>drive" not in page
    assert "&lt;b&gt;drive" in page
    index = index_page([replayed(summary())], [Failed(TASK, "<i>bad</i>")], None)
    assert "<b>drive" not in index
    assert "<i>bad" not in index


def test_a_state_has_one_colour_on_every_page() -> None:
    assert colour_of("motor system fault 1") == colour_of("motor system fault 3")
    assert len({colour_of(state) for state in ("normal", "slip", "unknown", "stale")}) == 4


def test_how_bad_it_was_stands_on_the_page_in_the_lines_and_in_the_numbers() -> None:
    plain = summary(("slip", 2.0))
    severity = Severity("traction used", "of the load", 0.05, 0.04, 0.06)
    worst = evolve(plain.episodes[1], severity=severity)
    found = evolve(plain, episodes=(plain.episodes[0], worst))
    words = "traction used 0.05 of the load (0.04 to 0.06 of the load)"
    assert time_line(replayed(found), [track()], [], WHEELS).count(words) == 1
    assert [line.strip() for line in summary_lines(found, START)].count(words) == 1
    first, second = as_json(replayed(found))["episodes"]
    assert first["severity"] is None
    assert second["severity"]["value"] == 0.05
    assert second["severity"]["high"] == 0.06


def test_what_has_changed_slowly_stands_there_too() -> None:
    changes = (Severity("payload", "kg", 3.0, 2.5, 3.5),)
    found = evolve(summary(), conditions=changes)
    words = "payload 3 kg (2.5 to 3.5 kg)"
    page = time_line(replayed(found), [track()], [], WHEELS)
    assert f"Changed slowly, and no fault: {words}." in page
    assert f"  changed: {words}" in list(summary_lines(found, START))
    assert as_json(replayed(found))["conditions"][0]["value"] == 3.0
    assert "Changed slowly" not in time_line(replayed(summary()), [track()], [], WHEELS)


def test_the_conditions_reported_last_stand() -> None:
    summariser, frame = Summariser(JOINTS), ResidualFrame(START, (Residual(0.0, 1.0, 0.0),) * 10)
    changes = [(Severity("x", "kg", value, 0.0, 9.0),) for value in (1.0, 2.0)]
    for conditions in changes:
        diagnosis = Diagnosis(START, STATES[1], START, (), frame, False, conditions=conditions)
        summariser.diagnosis(diagnosis, [])
        summariser.frame(frame)
    assert summariser.summary().conditions == changes[1]


def test_a_fault_is_named_with_the_joint_that_it_concerns() -> None:
    """Of a control system fault nothing else says where it is."""
    summariser, frame = Summariser(JOINTS), ResidualFrame(START, (Residual(0.0, 1.0, 0.0),) * 10)
    for stamp, state, wheel in ((START, STATES[0], None), (START + S, STATES[2], 1)):
        diagnosis = Diagnosis(stamp, state, stamp, (), frame, True, wheel=wheel)
        summariser.diagnosis(diagnosis, [])
        summariser.frame(frame)
    found = replayed(summariser.summary())
    normal, fault = as_json(found)["episodes"]
    assert (normal["joint"], fault["joint"], fault["wheel"]) == ("", "left_joint", 2)
    assert fault["state"] == "control system fault"
    assert verdict(found) == "control system fault (left_joint) at 1.00 s"
    words = "control system fault (left_joint)"
    said = list(summary_lines(found.phases[0].summary, START))
    assert any(line.endswith(words) for line in said)
    assert said[-1] == f"check first, for {fault['state']}: {CHECKS['control system fault']}"
    page = time_line(found, [track()], [], WHEELS)
    assert words in page.partition("What was said")[2]


def test_an_episode_keeps_the_severity_reported_last() -> None:
    summariser = Summariser(JOINTS)
    frame = ResidualFrame(START, (Residual(0.0, 1.0, 0.0),) * 10)
    severities = [Severity("x", "N", value, 0.0, 9.0) for value in (1.0, 2.0)]
    for severity in (None, *severities, None):
        diagnosis = Diagnosis(START, STATES[1], START, (), frame, False, severity=severity)
        summariser.diagnosis(diagnosis, [])
        summariser.frame(frame)
    (episode,) = summariser.summary().episodes
    assert episode.severity == severities[1]


def test_a_fault_in_one_phase_only_is_a_fault() -> None:
    found = replayed(summary(), summary(("slip", 2.0)))
    assert found.has_fault
    assert verdict(found) == "slip at 2.00 s (1 of 2 phases)"
    assert bag_line(found).endswith("4.0 s  slip at 2.00 s (1 of 2 phases)")
    assert phases_line(found) == "2 phases: slip in 1, first named at 2.00 to 2.00 s"
    assert [len(phase["faults"]) for phase in as_json(found)["phases"]] == [0, 1]
    assert _exit_code([found], []) == 1


def test_a_fault_in_all_phases_is_reported_from_the_first() -> None:
    found = replayed(summary(("slip", 2.3), ("slip", 3.0)), summary(("slip", 2.0)))
    assert verdict(found) == "slip at 2.00 s"
    assert phases_line(found) == "2 phases: slip in 2, first named at 2.00 to 2.30 s"
    assert phases_line(replayed(summary(), summary())) == "2 phases: no fault in any"


def test_what_is_wrong_outweighs_what_is_not_known() -> None:
    well, sick = replayed(summary()), replayed(summary(("slip", 2.0)))
    blind = evolve(well, undecided="no cmd_vel")
    assert _exit_code([well], []) == 0
    assert _exit_code([well, blind], []) == EXIT_UNDECIDED == 3
    assert _exit_code([blind, sick], []) == 1
    assert _exit_code([sick], [Failed(TASK, "")]) == 2


def test_the_longest_silence_of_a_topic_counts() -> None:
    heard = Heard()
    for stamp in (0, 1, 4, 6):
        heard.note("x", None, stamp * S)
    assert (heard.streams["x"].count, heard.streams["x"].silence_ns) == (4, 3 * S)


def test_only_changes_of_an_input_are_kept() -> None:
    tracker = Tracker(detail=True)
    for t, level in enumerate((Level.OK, Level.OK, Level.WARN, Level.WARN, Level.OK)):
        status = Status("inputs: odd", level, f"at {t}", (), "")
        tracker.report(DiagnosticMessage("/diagnostics", t, (status,)))
    changes = tracker.track().inputs["odd"]
    assert [(item.stamp_ns, item.words) for item in changes] == [
        (0, "at 0"),
        (2, "at 2"),
        (4, "at 4"),
    ]
