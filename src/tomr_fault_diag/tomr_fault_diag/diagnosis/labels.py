"""What was true of recordings: label files, mission files, and what a simulator recorded.

A label file is a list, as YAML or JSON, or a table with the same columns as CSV:

    - {bag: drive_17, state: motor system fault, wheel: 2, onset: 8.0, end: 14.0, severity: 0.6}
    - {bag: drive_17, state: slip, onset: 20.0, accept: [unknown]}
    - {bag: drive_18}                   # nothing is wrong from its start to its end

`bag` is the name of a recording, or enough of the end of its path. `onset` and `end` are seconds
after the recording's first message (absent: its start and its end); above 1e8 they are stamps.
`severity` is any number that grows with the fault. `accept`: further states that count as right.
`observable`: pairs of times in which the fault can be seen at all; absent: always. A folder holds a
file for each recording, named as it is, in which `bag` may be left out; a mission file of
tomr_simulate serves as well.
"""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from attrs import evolve, field, frozen

from tomr_fault_diag.classifier import states
from tomr_fault_diag.classifier.states import FAULTLESS, NORMAL, STATES, State
from tomr_power_model.errors import InputError
from tomr_power_model.files import load_yaml, read_text, real_path
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import open_recording, resolve_topic
from tomr_power_model.robot.description import closest

RECORDED = "recorded"  # in place of a file: what the simulator recorded
TRUTH_TOPIC = "ground_truth/faults"
_KEYS = ("bag", "state", "wheel", "onset", "end", "severity", "accept", "observable")
_STAMP = 1e8  # s: a greater time is a stamp
_MERGED = 1.0  # s: a fault that bears on no wheel for a shorter time is one fault
_SUFFIXES = (".csv", ".json", ".yaml", ".yml")
_HEALTHY = STATES[NORMAL].name

# What a simulated fault should be called, and what is right as well.
_FAULTS: Mapping[str, tuple[str, ...]] = {
    "floor_slippery": ("slip",),
    "control_signal_lost": ("control system fault",),
    "encoder_lost": ("motor system fault",),
    "drivers_off": ("does not follow its commands",),
    "commands_ignored": ("does not follow its commands",),
    "wheel_stuck": ("stuck wheel", "dragging wheel", "motor system fault"),
    "bearing_dragging": ("dragging wheel", "stuck wheel", "motor system fault"),
    "motor_resistance_high": ("degraded motor", "motor system fault"),
    "motor_torque_weak": ("degraded motor", "motor system fault"),
    "power_sensor_dead": ("power sensor fault", "not enough data"),
    "power_sensor_frozen": ("power sensor fault", "not enough data"),
    "power_sensor_scaled": ("power sensor fault",),
    "power_sensor_biased": ("power sensor fault",),
    "supply_low": ("low supply",),
    "pushed": (_HEALTHY,),
}
_UNKNOWN = ("unknown", "external load")  # of every other fault


@frozen
class Label:
    """Something that is true of a recording for a while."""

    bag: str
    state: str = _HEALTHY  # without the number of its wheel
    wheel: int | None = None  # 1..3
    onset: float = 0.0  # s after the first message, or a stamp [s]
    end: float | None = None  # None: to the end
    severity: float | None = None
    accept: tuple[str, ...] = ()
    observable: tuple[tuple[float, float], ...] = ()
    begun: float | None = None  # before it shows: from then on naming it is no false alarm
    kind: str = field(default="")  # what scores are given for, the state unless a fault has an id

    @property
    def is_fault(self) -> bool:
        return self.state not in FAULTLESS

    @property
    def title(self) -> str:
        return self.kind or self.state

    def is_right(self, state: str, wheel: int) -> bool:
        """Whether a state, and the wheel 1..3 or 0 that comes with it, is right."""
        name, own = split_state(state)
        number = own or wheel
        fits = not self.wheel or not number or number == self.wheel
        return fits and name in (self.state, *self.accept)

    def times(self, start_ns: int) -> "Label":
        """The same with all times in seconds after the first message of its recording."""
        start = start_ns / NANOSECONDS

        def after(time: float) -> float:
            return time - start if time > _STAMP else time

        return evolve(
            self,
            onset=after(self.onset),
            end=None if self.end is None else after(self.end),
            begun=None if self.begun is None else after(self.begun),
            observable=tuple((after(low), after(high)) for low, high in self.observable),
        )


def split_state(state: str) -> tuple[str, int]:
    """("motor system fault", 2) of "motor system fault 2"; 0: it names no wheel."""
    found = re.fullmatch(r"(.+) ([1-3])", state)
    return (found[1], int(found[2])) if found else (state, 0)


def known_states() -> set[str]:
    """Names of all states, without the numbers of their wheels."""
    found = {name for names in (*_FAULTS.values(), _UNKNOWN) for name in names}
    for item in vars(states).values():
        group = item if isinstance(item, tuple) else (item,)
        found |= {split_state(one.name)[0] for one in group if isinstance(one, State)}
    return found


def simulated(bag: str, fault_id: str, values: Mapping[str, float]) -> Label:
    """The label of a fault of the simulator; `values`: wheel, severity, onset, end."""
    state, *accept = _FAULTS.get(fault_id, _UNKNOWN)
    wheel = values.get("wheel")
    return Label(
        bag,
        state,
        None if wheel is None else int(wheel),
        values.get("onset", 0.0),
        values.get("end"),
        values.get("severity"),
        tuple(accept),
        kind=fault_id,
    )


class Labels:
    """The labels of many recordings."""

    def __init__(self, labels: Iterable[Label]) -> None:
        self._labels = tuple(labels)

    def of(self, bag: Path) -> tuple[Label, ...] | None:
        """The labels of a recording, none for a healthy one; None where nothing is said of it."""
        whole = real_path(bag)
        parts = (*whole.parts[:-1], whole.stem if whole.suffix in (".mcap", ".db3") else whole.name)
        found = [label for label in self._labels if _ends_with(parts, label.bag)]
        return tuple(found) if found else None

    def strangers(self, bags: Iterable[Path]) -> list[str]:
        """Names of which none of the recordings is one."""
        known = {label for bag in bags for label in self.of(bag) or ()}
        return sorted({label.bag for label in self._labels} - {label.bag for label in known})


def _ends_with(parts: Sequence[str], name: str) -> bool:
    wanted = Path(name).parts
    return bool(wanted) and tuple(parts[-len(wanted) :]) == wanted


def load_labels(path: Path) -> Labels:
    """Read a label file or a folder of them. Raises InputError."""
    if not path.is_dir():
        return Labels(_read(path, ""))
    files = sorted(file for file in path.iterdir() if file.suffix in _SUFFIXES)
    if not files:
        raise InputError(f"{path}: no label file in it: give {', '.join(_SUFFIXES)} files")
    return Labels(label for file in files for label in _read(file, file.stem))


def recorded_labels(bag: Path, namespace: str | None = None) -> tuple[Label, ...] | None:
    """What a simulator recorded beside a drive; None where it recorded nothing.

    A fault begins when something else was last true, so that no delay is flattered.
    """
    before = 0.0
    open_since: dict[str, dict[str, float]] = {}
    found: list[tuple[str, dict[str, float]]] = []
    with open_recording(bag) as recording:
        topic = resolve_topic(recording, TRUTH_TOPIC, namespace)
        if topic is None:
            return None
        for _, _, message, receive_ns in recording.messages([topic]):
            now = (receive_ns - recording.start_ns) / NANOSECONDS
            for status in message.status:
                values = {item.key: float(item.value) for item in status.values}
                state = open_since.get(status.name)
                if values.get("active", 0.0) > 0.0:
                    if state is None or now - state["end"] > _MERGED:
                        state = open_since[status.name] = {"onset": before}
                        found.append((status.name, state))
                    state.update({k: values[k] for k in ("wheel", "severity") if k in values})
                    state["end"] = now
            before = now
    return tuple(simulated(str(bag), fault_id, values) for fault_id, values in found)


def _read(path: Path, bag: str) -> list[Label]:
    text = read_text(path)
    if path.suffix == ".csv":
        rows: Any = [_cells(row, path) for row in csv.DictReader(text.splitlines())]
    else:
        rows = load_yaml(text, str(path))  # JSON is YAML too
    if isinstance(rows, Mapping) and "faults" in rows:
        return _mission(rows, bag or path.stem, path)
    if not isinstance(rows, list):
        raise InputError(f"{path}: is no list of labels: write one per line, each after -")
    return [_label(row, bag, f"{path}: label {n}") for n, row in enumerate(rows, start=1)]


def _cells(row: Mapping[str, str], path: Path) -> dict[str, object]:
    """Numbers as numbers; what is empty is absent; accepted states stand between bars."""
    found: dict[str, object] = {}
    for key, text in row.items():
        if key is None or text is None or not text.strip():
            continue
        value: object = text.strip()
        if key == "accept":
            value = text.split("|")
        elif key not in ("bag", "state"):
            value = load_yaml(text, str(path))
        found[key] = value
    return found


def _mission(document: Mapping[str, Any], bag: str, path: Path) -> list[Label]:
    faults = document["faults"] or []
    found = []
    for number, fault in enumerate(faults, start=1):
        if not isinstance(fault, Mapping) or "fault" not in fault:
            raise InputError(f"{path}: faults[{number}]: no mission: fault is missing")
        values = {"onset": fault.get("start", 0.0), "severity": fault.get("severity", 1.0)}
        values |= {key: fault[key] for key in ("end", "wheel") if key in fault}
        for key, value in values.items():
            _number(value, f"{path}: faults[{number}]: {key}")
        found.append(simulated(bag, str(fault["fault"]), values))
    return found or [Label(bag)]


def _label(row: object, bag: str, place: str) -> Label:
    if not isinstance(row, Mapping):
        raise InputError(f"{place}: {row!r} is no mapping: write it as {{key: value}}")
    for key in row:
        if key not in _KEYS:
            raise InputError(f"{place}: {key} is unknown: {closest(str(key), list(_KEYS))}")
    bag = str(row.get("bag", bag))
    if not bag:
        raise InputError(f"{place}: bag is missing: name the recording")
    state, own = split_state(_state(row.get("state", _HEALTHY), place))
    wheel = row.get("wheel", own or None)
    if wheel is not None and wheel not in (1, 2, 3):
        raise InputError(f"{place}: wheel = {wheel!r}: give 1, 2 or 3")
    onset = _number(row.get("onset", 0.0), f"{place}: onset")
    end = None if row.get("end") is None else _number(row["end"], f"{place}: end")
    if end is not None and end <= onset:
        raise InputError(f"{place}: end = {end:g} s is not after onset = {onset:g} s")
    severity = row.get("severity")
    return Label(
        bag,
        state,
        wheel,
        onset,
        end,
        None if severity is None else _number(severity, f"{place}: severity"),
        tuple(split_state(_state(name, place))[0] for name in _list(row, "accept", place)),
        tuple(_span(pair, place) for pair in _list(row, "observable", place)),
    )


def _state(name: object, place: str) -> str:
    known = known_states()
    if not isinstance(name, str) or split_state(name)[0] not in known:
        raise InputError(f"{place}: state {name!r} is unknown: {closest(str(name), sorted(known))}")
    return name


def _number(value: object, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise InputError(f"{place} = {value!r}: give a number")
    return float(value)


def _list(row: Mapping[Any, Any], key: str, place: str) -> list[object]:
    value = row.get(key, [])
    if not isinstance(value, list):
        raise InputError(f"{place}: {key} = {value!r}: give a list")
    return value


def _span(pair: object, place: str) -> tuple[float, float]:
    if not isinstance(pair, list) or len(pair) != 2:
        raise InputError(f"{place}: observable: {pair!r} is no pair: give [from, to] in seconds")
    low, high = (_number(value, f"{place}: observable") for value in pair)
    return low, high
