"""The files that an explanation leaves."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tomr_power_model.errors import InputError
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


def make_folder(folder: Path) -> None:
    """Make a folder for results. Raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: no folder can be made there ({error.strerror})") from None


def write_texts(folder: Path, texts: Mapping[str, str]) -> None:
    """Write files into a folder, and drop an explained description of an earlier run."""
    if EXPLAINED not in texts:
        (folder / EXPLAINED).unlink(missing_ok=True)
    for name, text in texts.items():
        write_text(folder / name, text)


def write_text(path: Path, text: str) -> None:
    """Write one file. Raises InputError where that cannot be."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}): give another") from None
