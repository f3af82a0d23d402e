"""A commissioning as one page of HTML that needs nothing beside it."""

from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from tomr_commission.commission import Commissioned
from tomr_commission.report.figures import alarm_picture, held_picture
from tomr_commission.report.plain import decided_share, headline


def page(found: Commissioned) -> str:
    """The page, read from the top: go or no-go."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    text = files("tomr_commission").joinpath("report/page.html.j2").read_text(encoding="utf-8")
    return environment.from_string(text).render(
        found=found,
        outcome=found.outcome,
        level=found.outcome.level,
        report=found.outcome.explained["report"],
        headline=headline(found),
        decided=decided_share(found.outcome.held_together),
        alarm_picture=alarm_picture(found),
        held_picture=held_picture(found),
        kinds=list(dict.fromkeys(line.kind for line in found.regimes)),
        regimes=list(dict.fromkeys(line.regime for line in found.regimes)),
        cells={(line.regime, line.kind): line for line in found.regimes},
    )
