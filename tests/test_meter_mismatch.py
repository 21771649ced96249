"""A meter with shifting filters: distinguished from aging displays, if the first session predicts the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from lutgen.criticism.diagnose import diagnose
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from lutgen.criticism.diagnose import Diagnosis

pytestmark = [pytest.mark.numbers, pytest.mark.slow]

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)


def diagnosed(hidden: tuple[str, float, str], seed: int, baseline: str = "first-hour") -> Diagnosis:
    campaign = Campaign(design="colours", hours=HOURS, seed=seed, baseline="first-hour", hidden=(hidden,))
    return diagnose(read(csv_text(campaign), file="meter.csv", sha256=""), baseline=baseline)


@pytest.mark.parametrize(("form", "size", "seed"), [("same", 0.6, 3), ("other", 1.0, 4)])
def test_filters_that_move_are_named_with_their_way(form: str, size: float, seed: int) -> None:
    """The display is spectral, so its spectra differ slightly from the class's typical spectra."""
    diagnosis = diagnosed(("meter-mismatch", size, form), seed)
    assert diagnosis.verdict.effects == ("meter-mismatch",)
    term = next(each for each in diagnosis.explanation.final.terms if each.effect.name == "meter-mismatch")
    assert term.values["shift"] == pytest.approx(size, rel=0.15)


def test_white_and_primaries_hide_it() -> None:
    assert diagnosed(("meter-mismatch", 0.6, "same"), 3, "colour-points").verdict.name == "consistent"


@pytest.mark.parametrize(("name", "size"), [("yellowing", 0.2), ("phosphor-wear", 0.2), ("meter-drift", 0.01)])
@pytest.mark.parametrize("form", ["same", "other"])
def test_no_other_change_of_colour_is_taken_for_it(name: str, size: float, form: str) -> None:
    assert "meter-mismatch" not in diagnosed((name, size, form), 5).verdict.effects
