"""Effects, places and numbers as a person reads them."""

import math
import re
from collections.abc import Sequence

from tomr_power_model.effects import EFFECTS
from tomr_reality_gap.explanation import Estimate, Finding

_SHOWN = 5  # numbers of a long list
_ALIKE = 0.2  # of the width, by which the halves of an interval shown as ± may differ


def effect_words(effect: str) -> str:
    """What an effect is, in words."""
    if effect.startswith("parameter."):
        return f"Wrong value of {effect.removeprefix('parameter.')}"
    if effect == "unknown":
        return "Something outside the vocabulary"
    return EFFECTS[effect].label if effect in EFFECTS else effect


def shortened(text: str) -> str:
    """A description whose long lists of numbers show their beginning only."""

    def begun(found: re.Match[str]) -> str:
        numbers = found[1].split(",")
        return f"[{','.join(numbers[:_SHOWN])}, ... {len(numbers)} numbers in all]"

    return re.sub(r"\[([^\[\]]{400,})\]", begun, text)


def place_words(where: Sequence[str]) -> str:
    """Where it acts, in words."""
    return ", ".join("all wheels" if place == "all_wheels" else place for place in where)


def title(finding: Finding) -> str:
    """E.g. `Stribeck friction, wheel_2_joint`."""
    return f"{effect_words(finding.effect)}, {place_words(finding.where)}"


def decimals(estimate: Estimate, digits: int) -> int:
    """Decimal places at which the interval's half width has so many significant digits."""
    sides = (estimate.value - estimate.low, estimate.high - estimate.value)
    known = [side for side in sides if math.isfinite(side) and side > 0.0]
    half = sum(known) / len(known) if known else 1e-3 * abs(estimate.value) or 1.0
    return digits - 1 - math.floor(math.log10(half))


def estimate_words(estimate: Estimate) -> str:
    """E.g. `0.0410 ± 0.0035 N m`; both ends where the halves differ, none where it is fixed. Of a
    wrong value what it was described as, too."""
    before = "" if estimate.described is None else f", described as {estimate.described:.4g}"
    return _interval_words(estimate) + before


def _interval_words(estimate: Estimate) -> str:
    unit = f" {estimate.unit}" if estimate.unit else ""
    if estimate.low == estimate.high:
        return f"{estimate.value:.4g}{unit}"
    places = decimals(estimate, 2)
    value, low, high = (
        _fixed(number, places) for number in (estimate.value, estimate.low, estimate.high)
    )
    below, above = estimate.value - estimate.low, estimate.high - estimate.value
    if not math.isfinite(below + above) or abs(above - below) > _ALIKE * (above + below):
        return f"{value} ({low} to {high}){unit}"
    return f"{value} ± {_fixed(0.5 * (above + below), places)}{unit}"


def _fixed(number: float, places: int) -> str:
    """Plain digits; powers of ten where these would be many zeros."""
    if not math.isfinite(number):
        return "∞" if number > 0.0 else "-∞"
    if places > 6 and 0.0 < abs(number) < 1e-3:
        exponent = math.floor(math.log10(abs(number)))
        return f"{number / 10.0**exponent:.{max(0, places + exponent)}f}e{exponent}"
    rounded = round(number, places)
    return f"{rounded:.{max(0, places)}f}"


def number_words(number: float, digits: int = 3) -> str:
    """A number with so many significant digits; a dash where there is none."""
    return f"{number:.{digits}g}" if math.isfinite(number) else "\N{EN DASH}"


def percent_words(share: float) -> str:
    """E.g. `83 %`, `0.4 %`, `99.6 %`: never 100 % or 0 % of what is not all or nothing."""
    if not math.isfinite(share):
        return "\N{EN DASH}"
    percent = 100.0 * share
    near_an_end = 0.0 < percent < 1.0 or 99.0 < percent < 100.0
    return f"{percent:.{1 if near_an_end else 0}f}\N{NO-BREAK SPACE}%"
