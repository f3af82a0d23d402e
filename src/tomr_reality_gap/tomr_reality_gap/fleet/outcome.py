"""One case explained, wherever that runs: what goes back is text and a few numbers."""

import time
from collections.abc import Mapping
from pathlib import Path

from attrs import field, frozen

from tomr_power_model.errors import InputError
from tomr_reality_gap.explanation import Explanation, Score
from tomr_reality_gap.fleet.cases import Case

BAD_INPUT, FAILED = "bad input", "failed"


@frozen
class Found:
    """A finding in short."""

    effect: str
    where: tuple[str, ...]
    values: tuple[str, ...]  # of its parameters, with intervals, in words
    confidence: float
    rivals: tuple[str, ...]  # effects


@frozen
class Outcome:
    """What came of one case."""

    name: str
    verdict: str  # "match", "mismatch", BAD_INPUT or FAILED
    sentence: str  # the verdict, or the error, in one sentence
    seconds: float
    findings: tuple[Found, ...] = ()
    score: Score | None = None
    unexplained: float = 0.0
    texts: Mapping[str, str] = field(factory=dict, repr=False)  # of the report, by file name

    @property
    def explained(self) -> bool:
        """Whether there is a report."""
        return self.verdict not in (BAD_INPUT, FAILED)


def explain_case(case: Case) -> Outcome:
    """Explain one case; bad input becomes an outcome, so that the others go on."""
    # What a worker needs and the command does not.
    from tomr_reality_gap.explain import explain
    from tomr_reality_gap.report.write import report_files

    start = time.monotonic()
    inputs = case.inputs
    try:
        explanation = explain(inputs, lambda stage, part: None)
        texts = report_files(explanation, f"{case.name}: {Path(inputs.robot).name}")
    except InputError as error:
        return Outcome(case.name, BAD_INPUT, str(error), time.monotonic() - start)
    return outcome_of(case.name, explanation, texts, time.monotonic() - start)


def outcome_of(
    name: str, explanation: Explanation, texts: Mapping[str, str], seconds: float
) -> Outcome:
    """The outcome of a case that could be explained."""
    from tomr_reality_gap.report.words import estimate_words

    return Outcome(
        name=name,
        verdict=explanation.verdict,
        sentence=explanation.sentence,
        seconds=seconds,
        findings=tuple(
            Found(
                effect=finding.effect,
                where=finding.where,
                values=tuple(
                    f"{key} {estimate_words(item)}" for key, item in finding.parameters.items()
                ),
                confidence=finding.confidence,
                rivals=tuple(rival.effect for rival in finding.rivals),
            )
            for finding in explanation.findings
        ),
        score=explanation.score,
        unexplained=explanation.unexplained_share,
        texts=texts,
    )
