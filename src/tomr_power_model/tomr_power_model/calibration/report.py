"""The calibration as one page of HTML that needs nothing beside it."""

from collections.abc import Callable
from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from tomr_power_model.calibration import figures
from tomr_power_model.calibration.calibrate import Result
from tomr_power_model.calibration.scoring import COLUMNS
from tomr_power_model.calibration.tables import rows, tables

_MOST_DRIVES = 10  # with a picture each


def report_page(result: Result, place: str, tick: Callable[[], None] = lambda: None) -> str:
    """The page as HTML; `place` is the description, `tick` is called after each picture."""
    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(
        files("tomr_power_model.calibration").joinpath("report.html.j2").read_text(encoding="utf-8")
    )
    shown = [*result.held_out, *result.samples][:_MOST_DRIVES]
    held_out = {item.name for item in result.held_out}
    drives = []
    for item in shown:
        kind = "held out" if item.name in held_out else "fitted"
        drives.append((item.name, kind, figures.over_time(item, result.robot)))
        tick()
    left_out = len(result.held_out) + len(result.samples) - len(shown)
    rest = figures.residuals(result.held_out or result.samples, result.robot)
    tick()
    return template.render(
        title="Calibration of a robot's power model",
        place=place,
        columns=COLUMNS,
        tables=tables(result),
        rows=rows(result),
        uncertainty=result.fitted.uncertainty,
        warnings=result.warnings,
        notes=result.notes,
        drives=drives,
        left_out=left_out,
        residuals=rest,
        residuals_of="held-out" if result.held_out else "fitted",
    )
