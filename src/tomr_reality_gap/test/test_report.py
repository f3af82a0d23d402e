"""The report: JSON as the contract has it, a page that needs nothing beside it."""

import base64
import json
import math
import re
from collections.abc import Callable
from html.parser import HTMLParser

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.effects import EFFECTS
from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_reality_gap.explanation import Estimate, Explanation, Learnt, Shape
from tomr_reality_gap.report.html import channel_lines, picture_count, report_page
from tomr_reality_gap.report.json import report_json
from tomr_reality_gap.report.showing import best_view
from tomr_reality_gap.report.terminal import print_explanation
from tomr_reality_gap.report.words import (
    effect_words,
    estimate_words,
    percent_words,
    shortened,
)

VOID = {"meta", "img", "br", "link", "hr", "input"}


class Page(HTMLParser):
    """Elements that are open, addresses that are referred to, pictures, and the words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []
        self.pictures: list[str] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "img":
            self.pictures.append(given["src"] or "")
            assert given["alt"]
        self.addresses += [value or "" for key, value in attrs if key in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.words += " ".join(data.replace("\N{NO-BREAK SPACE}", " ").split()) + " "


def test_json_is_as_the_contract_has_it(mismatch: Explanation) -> None:
    report = json.loads(report_json(mismatch))
    assert report["verdict"] == "mismatch"
    assert report["unexplained_share"] == 0.06
    (found,) = report["findings"]
    assert found["effect"] == "friction.stribeck"
    assert found["where"] == ["wheel_2_joint"]
    assert found["located"]["share_of_mismatch"] == 0.83
    assert found["located"]["regime"] == "|omega| < 2 rad/s"
    assert found["located"]["intervals_s"] == [[30.0, 36.0]]
    # Half width 0.0039: three significant digits of it are five decimal places.
    assert found["parameters"]["torque"] == {
        "value": 0.04101,
        "ci95": [0.0371, 0.0449],
        "unit": "N m",
    }
    assert found["holdout"] == {"nrmse_before": 0.21, "nrmse_after": 0.04}
    (rival,) = found["rivals"]
    assert rival == {
        "effect": "friction.coulomb",
        "where": ["wheel_2_joint"],
        "log_odds": -1.7,
        "experiment": "drive slowly for 30 s",
    }
    assert found["confidence"] == 0.972


def test_json_of_a_match_has_no_findings(match: Explanation) -> None:
    report = json.loads(report_json(match))
    assert report["verdict"] == "match"
    assert report["findings"] == []
    assert report["smallest_detectable"][0]["effect"] == "friction.viscous"


def test_json_has_no_numbers_that_json_does_not_know(
    with_rest: Callable[..., Explanation],
) -> None:
    at = np.array([0.0, 1.0])
    shape = Shape("wheel speed [rad/s]", "wheel_2_joint", at, at, at * np.nan, at)
    endless = {"order": Estimate(2.0, 1.0, math.inf, "1/rev")}
    text = report_json(evolve(with_rest(parameters=endless, shape=shape), score=None))
    found = json.loads(text, parse_constant=lambda word: pytest.fail(word))["findings"][0]
    assert found["holdout"] is None
    assert found["parameters"]["order"] == {"value": 2.0, "ci95": [None, None], "unit": "1/rev"}
    assert found["shape"]["low"] == [None, None]


def test_page_is_read_from_the_top_and_needs_nothing_beside_it(mismatch: Explanation) -> None:
    ticks: list[None] = []
    text = report_page(mismatch, "my_robot.yaml", lambda: ticks.append(None))
    page = Page(text)
    assert page.open == []
    assert page.addresses == page.pictures
    assert not re.search(r"https?://|@import|url\(", text)
    for picture in page.pictures:
        kind, _, data = picture.partition(",")
        assert kind == "data:image/png;base64"
        assert base64.b64decode(data).startswith(b"\x89PNG")
    # Verdict, place of the zoom, finding, rival, advice, what could have been missed.
    order = (
        "Wheel 2 has a Stribeck friction",
        "wheel_2/power of drive",
        "Stribeck friction, wheel_2_joint",
        "torque 0.0410 ± 0.0039 N m",
        "83 % of the mismatch; |omega| < 2 rad/s",
        "Coulomb friction, wheel_2_joint",
        "drive slowly for 30 s",
        "the gyro has 3 gaps & <odd> stamps",
        "0.0004 N m s/rad",
        "2.1 ms after the encoders",
    )
    places = [page.words.index(words) for words in order]
    assert places == sorted(places)
    assert len(ticks) == len(page.pictures) == picture_count(mismatch) == 6


def test_page_of_a_match_speaks_of_no_explanation(match: Explanation) -> None:
    page = Page(report_page(match, "my_robot.yaml"))
    assert "agree within noise" in page.words
    assert "explained" not in page.words.replace("the drives that were explained", "")
    assert "What differs" not in page.words


def test_page_shows_the_shape_of_what_has_no_name(with_rest: Callable[..., Explanation]) -> None:
    at = np.linspace(-3.0, 3.0, 7)
    shape = Shape("wheel speed [rad/s]", "wheel_2_joint", at, 0.01 * at, at - 1.0, at + 1.0)
    term = LearntTerm(FAMILIES["torque.speed"], (1,), (np.abs(at[3:]),), np.zeros((1, 4)))
    learnt = Learnt(term, np.zeros((1, 4)), 0.9, is_repeatable=True)
    explanation = with_rest(effect="unknown", parameters={}, rivals=(), shape=shape, learnt=learnt)
    explanation = evolve(explanation, comparisons=(), maps=())
    page = Page(report_page(explanation, "my_robot.yaml"))
    assert "Something outside the vocabulary" in page.words
    assert "The unnamed effect at wheel_2_joint" in page.words
    assert "Of what has no name, look at the wheel's bearings, seal and grease" in page.words
    assert len(page.pictures) == picture_count(explanation) == 1


def test_long_lists_of_a_description_show_their_beginning() -> None:
    numbers = ", ".join(str(number) for number in range(1000))
    text = f"wheels: [left, right]\nvalues: [{numbers}]\n"
    expected = "wheels: [left, right]\nvalues: [0, 1, 2, 3, 4, ... 1000 numbers in all]\n"
    assert shortened(text) == expected


def test_page_stands_without_drives_and_maps(match: Explanation) -> None:
    empty = evolve(match, comparisons=(), maps=(), detection_limits=(), alignment={}, whiteness={})
    page = Page(report_page(empty, "my_robot.yaml"))
    assert page.pictures == []
    assert page.open == []


def test_view_is_of_the_channel_and_seconds_that_matter(mismatch: Explanation) -> None:
    view = best_view(mismatch)
    assert view is not None
    assert view.name == "wheel_2/power"
    assert not view.comparison.held_out
    start, end = view.window
    assert 28.0 < start < 36.0
    assert 30.0 < end < 38.0


def test_view_of_a_match_is_where_the_residual_is_largest(match: Explanation) -> None:
    comparison = match.comparisons[0]
    before = [item.copy() for item in comparison.before]
    time = comparison.channels[2].time
    before[2][(time > 50.0) & (time < 52.0)] += 0.3
    view = best_view(evolve(match, comparisons=(evolve(comparison, before=tuple(before)),)))
    assert view is not None
    assert view.name == "wheel_3/power"
    assert view.window[0] < 50.5
    assert view.window[1] > 51.5


def test_nrmse_of_a_channel_is_the_residual_over_the_spread(mismatch: Explanation) -> None:
    one = mismatch.comparisons[0]
    line = next(item for item in channel_lines((one,)) if item.channel == "wheel_2/power")
    value = one.channels[1].value
    assert line.rms[0] == pytest.approx(np.sqrt(np.mean((value - one.before[1]) ** 2)))
    assert line.nrmse[1] == pytest.approx(np.std(value - one.after[1]) / np.std(value), rel=0.01)
    assert line.level[1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("estimate", "words"),
    [
        (Estimate(0.0410123, 0.0371, 0.0449, "N m"), "0.0410 ± 0.0039 N m"),
        (Estimate(0.8, 0.55, 1.35, "rad/s"), "0.80 (0.55 to 1.35) rad/s"),
        (Estimate(12345.6, 12000.0, 12691.2, ""), "12350 ± 350"),
        (Estimate(2.31e-7, 2.2e-7, 2.42e-7, "W s/rad"), "2.31e-7 ± 1.1e-8 W s/rad"),
        (Estimate(2.0, 1.0, math.inf, ""), "2.0 (1.0 to ∞)"),
        (Estimate(1.5, 1.5, 1.5, "W"), "1.5 W"),
        (Estimate(15.1, 12.6, 17.6, "kg", 20.0), "15.1 ± 2.5 kg, described as 20"),
    ],
)
def test_values_are_shown_to_the_digits_that_their_interval_warrants(
    estimate: Estimate, words: str
) -> None:
    assert estimate_words(estimate) == words


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.826, "83 %"),
        (0.004, "0.4 %"),
        (0.996, "99.6 %"),
        (1.0, "100 %"),
        (math.nan, "\N{EN DASH}"),
    ],
)
def test_shares_are_not_rounded_to_all_or_nothing(share: float, words: str) -> None:
    assert percent_words(share).replace("\N{NO-BREAK SPACE}", " ") == words


def test_every_effect_of_the_vocabulary_has_words() -> None:
    assert [effect for effect in EFFECTS if effect_words(effect) == effect] == []
    assert effect_words("parameter.robot.mass") == "Wrong value of robot.mass"


def test_what_a_description_names_is_escaped(mismatch: Explanation) -> None:
    (finding,) = mismatch.findings
    named = evolve(mismatch, findings=(evolve(finding, where=("<script>x",)),))
    page = report_page(named, "my_robot.yaml")
    assert "<script>x" not in page
    assert "&lt;script&gt;x" in page


def test_in_a_pipe_no_cell_of_a_finding_is_broken(
    mismatch: Explanation, capsys: pytest.CaptureFixture[str]
) -> None:
    first, *others = mismatch.findings
    regime = "4.62 < |omega| < 16.4 rad/s while the robot speeds up, and heads for its start"
    shown = evolve(first, located=evolve(first.located, regime=regime))
    print_explanation(evolve(mismatch, findings=(shown, *others)))
    assert regime in capsys.readouterr().out
