"""A campaign in another form gives the same verdict."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import pytest

from lutgen.criticism.diagnose import diagnose
from tests.campaigns import text_of
from tests.generators.rewritings import NOTHING_LOST, SOMETHING_LOST, CannotRewrite
from tests.quick import mostly_slow
from tests.readings_text import read

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.diagnose import Diagnosis

pytestmark = pytest.mark.numbers

#: Campaigns of this test by their baseline. "filled" has no blank cell, and has the order of reading.
BASELINES = {
    "healthy": "colour-points",
    "leak": "colour-points",
    "curve": "colour-points",
    "fading": "first-hour",
    "filled": "colour-points",
}

#: Campaigns with a clear verdict, which a loss of information may not change.
CLEAR = ("healthy", "leak", "curve", "filled", "edge")


#: The fastest rewritings: the order of rows, and the form of the file.
QUICK_NOTHING = ("rows shuffled within each session", "semicolons between fields, with decimal points")
QUICK_SOMETHING = (
    "a session split in two names an hour apart",
    "metadata lines absent",
)


@cache
def text(campaign: str) -> str:
    if campaign != "filled":
        return text_of(campaign)
    lines = NOTHING_LOST["optional columns filled with their rest value in every row"](text_of("leak"))
    head = [line for line in lines.splitlines() if line.startswith("#")]
    header, *rows = [line for line in lines.splitlines() if not line.startswith("#")]
    return "\n".join([*head, f"{header},order", *(f"{row},{place}" for place, row in enumerate(rows))]) + "\n"


def first_that_can(name: str, campaigns: Sequence[str]) -> tuple[str, str]:
    """Campaign and its rewritten text: the drawn campaign, or the next campaign that allows the rewriting."""
    registry = {**NOTHING_LOST, **SOMETHING_LOST}
    start = list(registry).index(name)
    for campaign in (campaigns[(start + k) % len(campaigns)] for k in range(len(campaigns))):
        try:
            return campaign, registry[name](text(campaign))
        except CannotRewrite:
            continue
    pytest.fail(f"no campaign of this test can be rewritten so: {name}")


@cache
def diagnosis(campaign: str, baseline: str) -> Diagnosis:
    return diagnose(read(campaign.removeprefix("\ufeff"), file="campaign.csv", sha256=""), baseline=baseline)


@pytest.mark.parametrize("name", mostly_slow(NOTHING_LOST, *QUICK_NOTHING))
def test_a_rewriting_that_loses_nothing_changes_nothing(name: str) -> None:
    campaign, rewritten = first_that_can(name, list(BASELINES))
    before, after = (diagnosis(each, BASELINES[campaign]) for each in (text(campaign), rewritten))
    assert after.verdict.name == before.verdict.name
    assert after.verdict.effects == before.verdict.effects
    assert after.verdict.rivals == before.verdict.rivals
    assert after.verdict.shares == pytest.approx(before.verdict.shares, abs=1e-4)
    assert after.after.error.rms_sigma == pytest.approx(before.after.error.rms_sigma, rel=1e-4)
    assert after.after.error.delta_e_mean == pytest.approx(before.after.error.delta_e_mean, rel=1e-4)


@pytest.mark.parametrize("name", mostly_slow(SOMETHING_LOST, *QUICK_SOMETHING))
def test_a_rewriting_that_loses_something_keeps_a_clear_verdict(name: str) -> None:
    campaign, rewritten = first_that_can(name, CLEAR)
    before, after = (diagnosis(each, "colour-points").verdict for each in (text(campaign), rewritten))
    assert after.effects == before.effects
    assert (after.name == "consistent") == (before.name == "consistent")
