"""What a soak has shown: delays of verdicts, false words, memory, what was left behind."""

import statistics
from collections.abc import Iterable, Sequence

from attrs import define, field, frozen

WITHIN = 2.0  # s in which a verdict must be found again
HEARS_WITHIN = 2.0  # s in which DDS must find a restarted node its messages
FLAT = 0.05  # of the memory after warm-up
_BASE = 0.1  # share of a process's samples that its memory is held against


@define
class Process:
    """Memory of one process of a node over its life."""

    name: str
    samples: list[tuple[float, float]] = field(factory=list)  # s since its start, MB

    def after(self, warm_up: float) -> list[float]:
        """Samples from `warm_up` [s] on [MB]."""
        return [memory for age, memory in self.samples if age >= warm_up]


@frozen
class Item:
    """A line of the table."""

    what: str
    found: str
    passed: bool


@define
class Delays:
    """How long something took, by what it waited for."""

    what: str = "verdict after"
    within: float = WITHIN  # s
    _taken: dict[str, list[float]] = field(factory=dict)  # s, NaN-free: the limit where never

    def add(self, what: str, seconds: float) -> None:
        """Note one."""
        self._taken.setdefault(what, []).append(seconds)

    def items(self) -> list[Item]:
        """A line for each thing waited for."""
        return [self._item(cause, taken) for cause, taken in sorted(self._taken.items())]

    def _item(self, cause: str, taken: Sequence[float]) -> Item:
        late = sum(seconds > self.within for seconds in taken)
        median, most = statistics.median(taken), max(taken)
        times = f"{len(taken)} times, within {self.within:g} s"
        found = f"{times}, median {median:.2f} s, most {most:.2f} s"
        words = f"{self.what}: {cause}"
        return Item(words, found + (f", {late} late" if late else ""), not late)


def memory_items(processes: Iterable[Process], warm_up: float) -> list[Item]:
    """A line for each node: how far its memory went from where it stood after warm-up."""
    found: dict[str, list[tuple[float, float, float]]] = {}  # base, lowest, highest [MB]
    for process in processes:
        samples = process.after(warm_up)
        if len(samples) < 10:  # killed before there was anything to judge
            continue
        base = statistics.median(samples[: max(3, round(_BASE * len(samples)))])
        found.setdefault(process.name, []).append((base, min(samples), max(samples)))
    return [_memory(name, spans) for name, spans in found.items()]


def _memory(name: str, spans: Sequence[tuple[float, float, float]]) -> Item:
    base, low, high = max(
        spans, key=lambda span: max(span[2] - span[0], span[0] - span[1]) / span[0]
    )
    change = max(high - base, base - low) / base
    words = f"{base:.0f} MB, {low:.1f} to {high:.1f} MB ({change:.1%}) in {len(spans)} lives"
    return Item(f"memory of {name}", words, all(_is_flat(*span) for span in spans))


def _is_flat(base: float, low: float, high: float) -> bool:
    return high <= (1.0 + FLAT) * base and low >= (1.0 - FLAT) * base


def table(items: Iterable[Item]) -> str:
    """The items as a Markdown table."""
    rows = [
        f"| {item.what} | {item.found} | {'pass' if item.passed else 'FAIL'} |" for item in items
    ]
    return "\n".join(["| what | found | |", "|---|---|---|", *rows])
