"""commissioned.yaml: the explained description, bands, alarm level, and the record of all that."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from attrs import asdict, frozen

from tomr_commission.alarm import AlarmLevel
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.calibration.fitted import sections_text
from tomr_power_model.robot import (
    COMMISSIONING,
    digest_of,
    read_description,
    read_sections,
    robot_from_parameters,
    suite_version,
)
from tomr_power_model.robot.commissioned import DATE, DIGEST
from tomr_power_model.robot.files import EVERY_NODE

FILE = "commissioned.yaml"
RESIDUALS, CLASSIFIER = "power_residuals", "fault_classifier"


@frozen
class Record:
    """How a robot was commissioned."""

    date: str
    drives: tuple[str, ...]
    held_out: str
    method: str
    level: AlarmLevel
    small_faults: bool  # whether they are looked for
    floors: Mapping[str, str]  # smallest size found, by fault
    verdict: str
    stamp: str  # for the status of the classifier; empty: it is not commissioned


def base_sections(robot: str, explained: Path | None) -> dict[str, dict[str, object]]:
    """Sections of the explained description, or of the plain one where nothing was missing.

    An earlier commissioning of it is left out. Raises InputError as `read_description` does.
    """
    source = robot if explained is None else explained
    sections = {name: dict(flat) for name, flat in read_sections(source).items()}
    sections[EVERY_NODE] = dict(read_description(source))
    sections.pop(COMMISSIONING, None)
    return sections


def commissioned_text(
    sections: Mapping[str, Mapping[str, object]], bands: BandSettings, record: Record, source: str
) -> str:
    """Text of commissioned.yaml."""
    merged = {name: dict(flat) for name, flat in sections.items()}
    merged.setdefault(RESIDUALS, {}).update(
        {f"band.{name}": value for name, value in asdict(bands).items()}
    )
    # Evidence in decades is the window classifier's.
    classifier = merged.setdefault(CLASSIFIER, {})
    classifier.update(
        classifier="window",
        caution=record.level.caution,
        small_faults=record.small_faults,
        commissioned=record.stamp,
    )
    merged[COMMISSIONING] = {
        DATE: record.date,
        "version": suite_version(),
        DIGEST: digest_of(robot_from_parameters(merged[EVERY_NODE], source)),
        "robot": source,
        "verdict": record.verdict,
        "drives": list(record.drives),
        "held_out": record.held_out,
        "method": record.method,
        "false_alarms_per_hour": record.level.wanted,
        **_expected(record.level),
        **{f"floors.{_key(name)}": size for name, size in record.floors.items()},
    }
    return sections_text(merged, _header(record, source))


def _expected(level: AlarmLevel) -> dict[str, object]:
    if not level.is_rate_known:
        return {}
    return {"expected_false_alarms_per_hour": float(f"{level.expected:.3g}")}


def _key(name: str) -> str:
    return name.replace(" ", "_").replace(",", "").replace(".", "_")


def _header(record: Record, source: str) -> Sequence[str]:
    return (
        f"{source}, commissioned on {record.date}: {record.verdict}.",
        "Give it as --robot or --params-file in place of robot.yaml; commission.html says more.",
    )
