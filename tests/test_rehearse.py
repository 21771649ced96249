"""The dress rehearsal of a user's own effect on the user's own readings."""

from __future__ import annotations

import json
import time
from functools import cache
from typing import TYPE_CHECKING

import pytest

from lutgen.criticism.rehearse import Rehearsal, rehearse
from lutgen.effects import catalogue
from lutgen.effects.expression import parse
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)
BUILT_IN = tuple(catalogue().values())

OWN = {
    "leak": "leak: xyz + k*tau*white; k=0.002[0,0.05]",
    "stairs": "stairs: linear*(1 + k*sin(40*code)); k=0.01[-0.5,0.5]",
    "fade": "fade: xyz*(1 - k*tau); k=0.1[-0.5,0.5]",
    "corner": "corner: xyz*(1 - k*(u-0.5)*(v-0.5)); k=0.1[-0.5,0.5]",
    "small": "small: xyz + k*white; k=0.0000001[0,0.000001]",
    "most": "most: xyz + k*tau*white; k=0.00001[0,0.00003]",
    "dark": "dark: xyz - k*tau*white; k=0.002[0,0.05]",
}


@cache
def readings(design: str, baseline: str = "colour-points") -> Measurements:
    campaign = Campaign(
        design=design,
        hours=HOURS,
        seed=3,
        baseline=baseline,
        display="OLED" if baseline == "first-hour" else "white LED LCD",
    )
    return read(csv_text(campaign), file="own.csv", sha256="")


@cache
def rehearsed(name: str, design: str = "colours") -> Rehearsal:
    return rehearse(parse(OWN[name]) if name in OWN else catalogue()[name], readings(design), BUILT_IN)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "design", "told"), [
    ("stairs", "colours", "three times the smallest detectable size, it is found again: 0.0"),
    ("leak", "colours", "these readings cannot tell it from black-level."),
    ("corner", "full", "it is found again"),
    ("most", "colours", "the largest size allowed and "),
    ("warm-up", "full", "it is found again"),
    ("temperature", "full", " 1/K, three times the smallest detectable size"),
    ("quantization", "colours", "Put into these readings at "),
])  # fmt: skip
def test_what_is_put_in_is_found_again_in_its_size(name: str, design: str, told: str) -> None:
    rehearsal = rehearsed(name, design)
    assert rehearsal.recovered, rehearsal.sentence
    assert told in rehearsal.sentence
    assert rehearsal.sentence.startswith("Put into these readings")
    assert rehearsal.sentence.endswith(".")
    assert rehearsal.absorbed is not None
    assert 0.0 <= rehearsal.absorbed < 1.0


@pytest.mark.parametrize(("name", "design", "told"), [
    ("fade", "colours", 'declare it with baseline="first-hour"'),
    ("crosstalk", "tips", "Measure more than white and primaries"),
    ("corner", "colours", "It changes none of these readings"),
    ("edge-falloff", "colours", "It needs the columns u, v."),
    ("small", "colours", "It would show from k = "),
    ("matrix-switching", "colours", "It shows too little in these readings"),
])  # fmt: skip
def test_what_cannot_be_seen_is_not_rehearsed_and_the_sentence_says_why(name: str, design: str, told: str) -> None:
    rehearsal = rehearsed(name, design)
    assert not rehearsal.recovered
    assert told in rehearsal.sentence
    assert "Put into these readings" not in rehearsal.sentence


def test_an_effect_that_changes_nothing_is_like_nothing() -> None:
    rehearsal = rehearsed("corner")
    assert (rehearsal.absorbed, rehearsal.smallest_detectable, rehearsal.likeness) == (None, None, [])
    assert json.loads(json.dumps(rehearsal.as_json()))["absorbed"] is None


def test_what_takes_everything_alike_is_absorbed_and_its_leftover_is_like_nothing() -> None:
    assert rehearsed("fade").absorbed == pytest.approx(1.0, abs=1e-6)
    assert rehearsed("fade").likeness == []


@pytest.mark.parametrize("name", mostly_slow(["leak", "dark"], "dark"))
def test_an_effect_is_most_like_its_twin_in_the_catalogue_whatever_its_sign(name: str) -> None:
    rehearsal = rehearsed(name)
    (first, cosine), *others = rehearsal.likeness
    assert first == "black-level"
    assert cosine == pytest.approx(1.0, abs=1e-6)
    assert [share for _, share in rehearsal.likeness] == sorted(
        (share for _, share in rehearsal.likeness), reverse=True
    )
    assert all(0.0 <= share < 0.99 for _, share in others)
    names = {each.name for each in BUILT_IN if each.baseline == "colour-points"}
    assert {each for each, _ in rehearsal.likeness} == names


@pytest.mark.slow
def test_only_effects_of_the_same_baseline_are_likened_and_all_from_hour_0() -> None:
    rehearsal = rehearse(catalogue()["channel-decay"], readings("colours", "first-hour"), BUILT_IN)
    assert {each for each, _ in rehearsal.likeness} == set(catalogue()) - {"channel-decay"}
    assert dict(rehearsal.likeness)["phosphor-wear"] > 0.8
    assert rehearsal.smallest_detectable is not None
    assert rehearsal.parameter in catalogue()["channel-decay"].forms[0]


def test_the_size_that_is_said_to_be_smallest_is_that_of_the_visibility_table() -> None:
    rehearsal = rehearsed("crosstalk")
    assert rehearsal.recovered, rehearsal.sentence
    assert "it is found again: 0.0" in rehearsal.sentence
    assert (rehearsal.parameter, rehearsal.unit) == ("new", "1")
    put = float(rehearsal.sentence.partition(" at ")[2].partition(",")[0])
    assert rehearsal.smallest_detectable is not None
    assert put == pytest.approx(3.0 * rehearsal.smallest_detectable, rel=0.01)


def test_a_size_that_only_a_later_form_frees_is_found_again() -> None:
    rehearsal = rehearse(catalogue()["black-level"], readings("colours"), ())
    assert rehearsal.parameter not in catalogue()["black-level"].forms[0]
    assert rehearsal.recovered, rehearsal.sentence
    assert "it is found again" in rehearsal.sentence


@pytest.mark.slow
@pytest.mark.parametrize(("design", "seconds"), [
    ("colours", 8.0),
    pytest.param("full", 15.0, marks=pytest.mark.rare(instead="test_the_rehearsal_is_the_same_twice_and_short")),
])  # fmt: skip
def test_the_rehearsal_is_the_same_twice_and_short(design: str, seconds: float) -> None:
    effect = parse(OWN["stairs"])
    start = time.process_time()
    first = rehearse(effect, readings(design), BUILT_IN)
    assert time.process_time() - start < seconds
    assert first == rehearse(effect, readings(design), BUILT_IN)


def test_json_has_every_field_in_plain_values() -> None:
    rehearsal = rehearsed("leak")
    content = json.loads(json.dumps(rehearsal.as_json()))
    assert set(content) == set(Rehearsal.__dataclass_fields__)
    assert content["likeness"][0] == ["black-level", pytest.approx(1.0)]
    assert content["recovered"] is True
