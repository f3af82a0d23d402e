"""Label files in every form give the same labels; bad ones get one line."""

from pathlib import Path

import pytest

from tomr_fault_diag.diagnosis.labels import (
    TRUTH_TOPIC,
    Label,
    known_states,
    load_labels,
    recorded_labels,
    simulated,
    split_state,
)
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import Level, Status, diagnostics
from tomr_power_model.messages.types import DIAGNOSTICS
from tomr_power_model.recordings import RecordingWriter

SAME = {
    "labels.yaml": "- {bag: a, state: motor system fault 2, onset: 8.0, end: 14.0, severity: 0.6, "
    "accept: [unknown]}\n- {bag: b}\n",
    "labels.json": '[{"bag": "a", "state": "motor system fault", "wheel": 2, "onset": 8.0, '
    '"end": 14, "severity": 0.6, "accept": ["unknown"]}, {"bag": "b"}]',
    "labels.csv": "bag,state,wheel,onset,end,severity,accept\n"
    "a,motor system fault,2,8.0,14.0,0.6,unknown\nb,,,,,,\n",
}


@pytest.mark.parametrize("name", SAME)
def test_all_forms_say_the_same(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(SAME[name])
    labels = load_labels(path)
    assert labels.of(Path("drives/a")) == (
        Label("a", "motor system fault", 2, 8.0, 14.0, 0.6, ("unknown",)),
    )
    assert labels.of(Path("drives/b.mcap")) == (Label("b"),)
    assert labels.of(Path("drives/c")) is None


def test_a_name_may_be_the_end_of_a_path(tmp_path: Path) -> None:
    path = tmp_path / "labels.yaml"
    path.write_text("- {bag: gray/exp05, state: slip}\n")
    labels = load_labels(path)
    assert labels.of(Path("robotino/gray/exp05"))
    assert labels.of(Path("robotino/green/exp05")) is None


def test_a_folder_names_recordings_by_its_files(tmp_path: Path) -> None:
    (tmp_path / "first.yaml").write_text("- {state: slip, onset: 2.0}\n")
    (tmp_path / "second.yaml").write_text(
        "base: circle\nname: second\nfaults:\n"
        "  - {fault: bearing_dragging, start: 3.0, end: 5.0, wheel: 3, severity: 0.5}\n"
    )
    (tmp_path / "third.yaml").write_text("name: third\nphases: []\nfaults: []\n")
    labels = load_labels(tmp_path)
    assert labels.of(Path("first")) == (Label("first", "slip", onset=2.0),)
    (drag,) = labels.of(Path("second")) or ()
    assert (drag.state, drag.wheel, drag.onset, drag.end) == ("dragging wheel", 3, 3.0, 5.0)
    assert (drag.severity, drag.title) == (0.5, "bearing_dragging")
    assert drag.is_right("motor system fault 3", 3)
    assert not drag.is_right("motor system fault 1", 1)
    assert labels.of(Path("third")) == (Label("third"),)


def test_faults_of_the_simulator_have_their_states() -> None:
    assert simulated("b", "floor_slippery", {}).state == "slip"
    assert not simulated("b", "pushed", {}).is_fault
    towed = simulated("b", "load_towed", {})
    assert towed.is_right("unknown", 0)
    assert not towed.is_right("slip", 0)


def test_recorded_faults_begin_when_they_were_not_yet_there(tmp_path: Path) -> None:
    """In force at 1 s, at 2 s, which is the same fault, and at 4 s, another."""
    path = tmp_path / "drive"
    with RecordingWriter(path) as writer:
        for number in range(10):
            stamp_ns = 1_700_000_000_000_000_000 + number * 500_000_000
            active = str(int(number in (2, 4, 8)))
            values = (("active", active), ("severity", "0.7"), ("wheel", "2"))
            status = Status("bearing_dragging", Level.OK, "", values, "simulator")
            message = to_bag(diagnostics(stamp_ns, [status]))
            writer.write(TRUTH_TOPIC, DIAGNOSTICS, message, stamp_ns)
    labels = recorded_labels(path) or ()
    assert [(label.onset, label.end) for label in labels] == [(0.5, 2.0), (3.5, 4.0)]
    assert {(label.state, label.wheel, label.severity) for label in labels} == {
        ("dragging wheel", 2, 0.7)
    }


def test_states_without_their_wheel() -> None:
    assert split_state("motor system fault 2") == ("motor system fault", 2)
    assert split_state("slip") == ("slip", 0)
    assert {"normal", "slip", "unknown", "motor system fault"} <= known_states()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("- {bag: a, state: slipp}", "label 1: state 'slipp' is unknown: did you mean slip"),
        ("- {bag: a, onsett: 1.0}", "onsett is unknown: did you mean onset"),
        ("- {state: slip}", "label 1: bag is missing"),
        ("- {bag: a, wheel: 4}", "wheel = 4: give 1, 2 or 3"),
        ("- {bag: a, onset: 3, end: 2}", "end = 2 s is not after onset = 3 s"),
        ("- {bag: a, severity: much}", "severity = 'much': give a number"),
        ("- {bag: a, observable: [[1.0]]}", "is no pair"),
        ("bag: a", "is no list of labels"),
        ("- [", "mend the YAML"),
        ("- 7", "is no mapping"),
    ],
)
def test_bad_labels_get_one_line(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "labels.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=words.replace("[", r"\[")) as caught:
        load_labels(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_missing_labels_get_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        load_labels(tmp_path / "nowhere.yaml")
    with pytest.raises(InputError, match="no label file in it"):
        load_labels(tmp_path)
