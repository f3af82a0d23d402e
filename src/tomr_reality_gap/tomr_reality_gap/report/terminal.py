"""The explanation as lines on a terminal."""

from rich.console import Console
from rich.table import Table

from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.report.words import (
    estimate_words,
    number_words,
    percent_words,
    place_words,
)

_WIDTH, _WIDTH_OF_PIPE = 120, 240  # characters; a table that is cut off says nothing


def print_explanation(explanation: Explanation) -> None:
    """The verdict, the findings, and what is to be heeded."""
    console = Console(highlight=False, soft_wrap=True, markup=False)
    console.width = max(console.width, _WIDTH if console.is_terminal else _WIDTH_OF_PIPE)
    console.print(f"{explanation.verdict}: {explanation.sentence}")
    if explanation.findings:
        console.print(_table(explanation))
    if explanation.score is not None and explanation.findings:
        score = explanation.score
        console.print(
            f"held-out NRMSE of {score.quantity} {number_words(score.nrmse_before)} -> "
            f"{number_words(score.nrmse_after)}, accuracy {100 * score.accuracy_before:.1f} % -> "
            f"{100 * score.accuracy_after:.1f} %; "
            f"{percent_words(explanation.unexplained_share)} of the mismatch unexplained"
        )
    for finding in explanation.findings:
        for rival in finding.rivals:
            advice = f": to separate them, {rival.experiment}" if rival.experiment else ""
            console.print(
                f"{finding.effect} at {place_words(finding.where)} cannot be separated from "
                f"{rival.effect} at {place_words(rival.where)}{advice}"
            )
    for note in explanation.notes:
        console.print(f"note: {note}")


def _table(explanation: Explanation) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("effect", "where", "value, 95 %", "of the mismatch", "confidence", "shows"):
        table.add_column(heading, no_wrap=heading != "shows")
    for finding in explanation.findings:
        table.add_row(
            finding.effect,
            place_words(finding.where),
            "\n".join(f"{name} {estimate_words(at)}" for name, at in finding.parameters.items()),
            percent_words(finding.located.share),
            percent_words(finding.confidence),
            finding.located.regime,
        )
    return table
