"""The files that an explanation leaves."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tomr_power_model.files import write_together
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.report.html import report_page
from tomr_reality_gap.report.json import report_json

JSON, HTML, EXPLAINED = "report.json", "report.html", "robot_explained.yaml"


def report_files(
    explanation: Explanation, robot: str, tick: Callable[[], None] = lambda: None
) -> dict[str, str]:
    """Texts by file name; `robot` names the description, `tick` is called after each picture."""
    texts = {JSON: report_json(explanation), HTML: report_page(explanation, robot, tick)}
    if explanation.explained:
        texts[EXPLAINED] = explanation.explained
    return texts


def write_report(
    folder: Path, texts: Mapping[str, str], others: Mapping[Path, str] | None = None
) -> None:
    """Write the files of a report, and others of the same run, together.

    An explained description of an earlier run goes.
    """
    files = {folder / name: text for name, text in texts.items()}
    stale = [] if EXPLAINED in texts else [folder / EXPLAINED]
    write_together({**files, **(others or {})}, stale)
