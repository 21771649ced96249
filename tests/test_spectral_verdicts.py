"""Verdicts on displays of the spectral simulator, whose effects have other formulas than the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from lutgen.criticism.diagnose import diagnose
from tests.generators.meters import METERS
from tests.generators.spectral import campaign
from tests.generators.table import table
from tests.readings_text import read

if TYPE_CHECKING:
    from lutgen.criticism.verdict.verdict import Verdict

pytestmark = pytest.mark.numbers


def verdict_on(seed: int, habits: int, kind: str, size: float, baseline: str) -> Verdict:
    """Diagnose a full campaign with one hidden effect; ``size`` in typical sizes."""
    truth = campaign(seed, {kind: size}, design="full", habits=habits)
    text = table(truth, METERS["gaussian"].read(truth, seed))
    return diagnose(read(text, file="spectral.csv", sha256=""), baseline=baseline).verdict


@pytest.mark.slow
def test_what_formulas_miss_of_unknown_spectra_is_no_further_way_of_aging() -> None:
    """The optics of a CCFL display yellow. Lamps with other spectra than lutgen's leave a residual."""
    verdict = verdict_on(453521110, 1, "yellowing", 0.8344, "first-hour")
    assert (verdict.name, set(verdict.effects)) == ("one-of", {"yellowing", "phosphor-wear"})
    assert "an effect like these" in verdict.sentence


@pytest.mark.slow
def test_a_shift_of_three_primaries_with_another_power_of_the_level_is_explained() -> None:
    """The chromaticities shift with (1 - d)²: no shift of a single primary explains half of this."""
    verdict = verdict_on(2144834226, 3, "primary-shift", 0.04903, "colour-points")
    assert (verdict.name, verdict.effects) == ("one-of", ("primary-shift",))
