"""The level that gives a rate of false alarms."""

from collections.abc import Sequence

import numpy as np
import pytest
from attrs import evolve
from scipy.signal import lfilter
from scipy.stats import norm

from tomr_commission.alarm import Tail, _is_exponential, alarm_level, block_peaks
from tomr_commission.evidence import MOST_CAUTION, SURE
from tomr_commission.request import AlarmChoice

CHOICE = AlarmChoice()


def exponential(scale: float, count: int = 4000, seed: int = 2) -> np.ndarray:
    return np.random.default_rng(seed).exponential(scale, count)


def test_exponential_peaks_give_the_level_that_their_law_has() -> None:
    tail = Tail.of("shoves", exponential(2.0), 10.0, CHOICE)
    level = alarm_level([tail], 0.01, 11.0, CHOICE)
    # 10 an hour, exp(-x / 2) of them beyond x: 0.01 an hour beyond 2 ln 1000 = 13.8 decades.
    assert level.needed + SURE == pytest.approx(13.8, rel=0.1)
    assert level.low < level.expected <= 0.0101
    assert level.high > 0.01
    assert level.is_enough


def kept_share(rates: Sequence[float], wanted: float) -> float:
    return float(np.mean(np.array(rates) <= wanted))


def test_rate_is_kept_as_often_as_the_confidence_says() -> None:
    """Independent peaks of a known law, time and again: the true rate at each level."""
    wanted, per_hour, scale = 0.05, 30.0, 3.0
    rates = []
    for seed in range(100):
        tail = Tail.of("shoves", exponential(scale, 390, seed), per_hour, CHOICE)
        level = alarm_level([tail], wanted, 11.0, CHOICE).needed + SURE
        rates.append(per_hour * np.exp(-level / scale))
    assert kept_share(rates, wanted) == pytest.approx(CHOICE.confidence, abs=0.12)
    assert np.median(rates) > 0.3 * wanted  # nor is it more careful than it has to be


@pytest.mark.parametrize("shown", [0.1, 0.24, 0.26])
def test_rate_is_kept_where_most_events_leave_nothing(shown: float) -> None:
    """Peaks of 5.5 decades and an exponential part, of so many of the events."""
    wanted, per_hour, scale, rates = 0.05, 30.0, 3.0, []
    for seed in range(30):
        random = np.random.default_rng(seed)
        peaks = np.where(random.random(390) < shown, 5.5 + random.exponential(scale, 390), 0.0)
        level = alarm_level([Tail.of("", peaks, per_hour, CHOICE)], wanted, 0.0, CHOICE)
        rates.append(per_hour * shown * np.exp(-(level.needed + SURE - 5.5) / scale))
    assert kept_share(rates, wanted) >= CHOICE.confidence
    assert np.median(rates) > 0.3 * wanted


def test_rate_is_kept_where_evidence_comes_in_clusters() -> None:
    """Each tick exponential, and like those of the second before: peaks of 10 s count once."""
    wanted, tick, hours = 2.0, 0.05, 100.0
    random = np.random.default_rng(5)
    stays = np.exp(-tick / 1.0)
    noise = np.sqrt(1.0 - stays**2) * random.normal(size=int(hours * 3600.0 / tick))
    evidence = -2.0 * norm.logsf(lfilter([1.0], [1.0, -stays], noise))
    peaks = evidence.reshape(-1, round(CHOICE.block / tick)).max(axis=1)
    rates = []
    for part in np.split(peaks, 100)[:50]:  # an hour each
        tail = Tail.of("driving", part, 3600.0 / CHOICE.block, CHOICE)
        level = alarm_level([tail], wanted, 11.0, CHOICE).needed + SURE
        rates.append(float((peaks > level).sum()) / hours)
    assert 0.7 <= kept_share(rates, wanted) < 1.0
    assert np.median(rates) > 0.3 * wanted


def test_a_rare_cause_of_much_evidence_is_not_hidden_by_a_frequent_one_of_little() -> None:
    """One shove in twenty leaves four times the evidence: its law is the tail's."""
    wanted, per_hour = 0.05, 30.0
    rates = []
    for seed in range(60):
        peaks = exponential(2.0, 390, seed)
        peaks[::20] = exponential(8.0, len(peaks[::20]), seed + 1000)
        level = alarm_level([Tail.of("", peaks, per_hour, CHOICE)], wanted, 11.0, CHOICE)
        beyond = level.needed + SURE
        rates.append(per_hour * (0.95 * np.exp(-beyond / 2.0) + 0.05 * np.exp(-beyond / 8.0)))
    assert kept_share(rates, 4.0 * wanted) > 0.8
    # By the frequent ones' law alone: level 2 ln 600 = 12.8, 30 x 0.05 exp(-12.8 / 8) = 0.3.
    assert np.median(rates) < 0.15


def test_rarer_alarms_ask_for_more_caution() -> None:
    tail = Tail.of("shoves", exponential(2.0, 300), 10.0, CHOICE)
    needed = [alarm_level([tail], rate, 11.0, CHOICE).needed for rate in (1.0, 0.1, 0.01)]
    assert needed == sorted(needed)
    assert needed[0] < needed[2]


def test_fewer_peaks_make_it_more_careful() -> None:
    many, few = (Tail.of("", exponential(2.0, count), 10.0, CHOICE) for count in (4000, 60))
    spread = [np.quantile(tail.draws(15.0), 0.8) / tail.rate(15.0) for tail in (many, few)]
    assert 1.0 < spread[0] < spread[1]


def test_without_evidence_the_level_is_the_shipped_one() -> None:
    tail = Tail.of("driving", [0.0] * 50, 360.0, CHOICE)
    level = alarm_level([tail], 0.05, 11.0, CHOICE)
    assert level.caution == 11.0
    assert level.expected == 0.0


def test_peaks_at_the_cap_are_longer_than_is_known() -> None:
    """A tenth of the peaks beyond all caution: no level helps, and that is said."""
    peaks = [*exponential(1.0, 90), *[40.0] * 10]
    level = alarm_level([Tail.of("shoves", peaks, 30.0, CHOICE)], 0.05, 11.0, CHOICE)
    assert level.caution == MOST_CAUTION
    assert not level.is_enough
    assert level.expected > 0.05


@pytest.mark.parametrize("rare", [1, 3, 5, 10, 20])
def test_a_few_peaks_beyond_the_cap_are_not_hidden_by_many_small_ones(rare: int) -> None:
    """Shoves that alarm whatever the caution, among hundreds of harmless ones."""
    peaks = [*exponential(1.0, 390 - rare), *[40.0] * rare]
    level = alarm_level([Tail.of("shoves", peaks, 30.0, CHOICE)], 0.05, 11.0, CHOICE)
    assert level.is_enough is (rare < 3)


def quantiles(scale: float, count: int) -> np.ndarray:
    """Exponential peaks that are spread as evenly as they can be."""
    return np.asarray(-scale * np.log((np.arange(count) + 0.5) / count))


def test_a_tail_begins_higher_by_halves_while_it_is_not_exponential_and_has_peaks_enough() -> None:
    """A quarter, or its half, of peaks that grow by the same factor, or by the same sum."""
    steep, few = (np.geomspace(1e-9, 30.0, count).tolist() for count in (400, 52))
    even, plain = np.linspace(0.1, 30.0, 400).tolist(), quantiles(2.0, 400)
    made = [Tail.of("", peaks, 30.0, CHOICE) for peaks in (steep, few, even, plain)]
    assert [tail.above for tail in made] == [50, 13, 13, 100]


def test_one_low_peak_tells_nothing_of_how_high_ones_go_on() -> None:
    """Eighty of 6 decades and more, of which one in e is a decade beyond another."""
    high = [*[0.0] * 309, *(6.0 + quantiles(1.0, 80))]
    with_it, without = (
        alarm_level([Tail.of("", [*high, low], 30.0, CHOICE)], 0.05, 0.0, CHOICE).needed
        for low in (3.3, 0.0)
    )
    assert with_it == pytest.approx(without, abs=1.0)
    # 30 an hour, 80 of 390 beyond 6, e^-x of these x beyond it: 6 + ln(600 * 80 / 390) = 10.8.
    assert 10.8 < with_it + SURE < 14.0


def test_peaks_at_the_cap_count_for_the_scale_by_their_length_alone() -> None:
    """2, 4 and one of 32 decades at least, over 1: the usual scale of 4 counts as four more."""
    choice = evolve(CHOICE, kept=1.0, least_peaks=2)
    tail = Tail.of("", [1.0, 3.0, 5.0, 40.0], 30.0, choice)
    assert (tail.threshold, tail.above, tail.certain) == (1.0, 3, 6)
    assert tail.scale == pytest.approx((4 * 4.0 + 2.0 + 4.0 + MOST_CAUTION + SURE - 1.0) / 6)


@pytest.mark.parametrize("without", [59, 60, 61, 80, 370, 3000])  # a quarter of 79 or 80: 20
def test_where_most_events_leave_nothing_the_tail_begins_at_the_lowest_peak(without: int) -> None:
    """Twenty peaks of 6 decades and more, the usual scale of 4 as four more."""
    peaks = [*[0.0] * without, *(6.0 + quantiles(1.0, 20))]
    tail = Tail.of("shoves", peaks, 30.0, CHOICE)
    lowest = min(quantiles(1.0, 20))
    assert (tail.threshold, tail.above) == (6.0 + lowest, 19)
    excess = float((quantiles(1.0, 20) - lowest).sum())
    assert tail.scale == pytest.approx((4 * 4.0 + excess) / 23)
    assert alarm_level([tail], 0.05, 0.0, CHOICE).needed < 16.0


def test_exponential_excesses_are_taken_for_others_once_in_twenty() -> None:
    random = np.random.default_rng(0)
    others = np.mean([not _is_exponential(random.exponential(2.0, 100)) for _ in range(1000)])
    assert others == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize(
    "peaks", [[], [0.0], [3.0], [3.0] * 50, [40.0] * 50, [0.0] * 49 + [5.0]], ids=str
)
def test_peaks_that_show_nothing_of_a_tail_are_no_error(peaks: list[float]) -> None:
    tail = Tail.of("shoves", peaks, 30.0, CHOICE)
    assert tail.above == sum(peak > 0.0 for peak in peaks)
    assert np.isfinite([tail.scale, tail.rate(15.0), *tail.draws(15.0)]).all()


def test_block_peaks() -> None:
    """Two ticks to a second, and half a minute that was left out."""
    seconds = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 32.0])
    evidence = np.array([1.0, 3.0, 2.0, 0.0, 4.0, 5.0])
    assert block_peaks(evidence, seconds, 1.0) == [3.0, 2.0, 4.0, 5.0]
