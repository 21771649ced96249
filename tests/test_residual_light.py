"""The residual light of a display's curves follows the channels when an effect changes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.colorimetry import code_to_linear
from lutgen.criticism.first_session.residual_light import ResidualLight
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.search.candidates import family
from lutgen.effects import catalogue
from tests.generators.meters import METERS
from tests.generators.real import campaign
from tests.generators.table import table
from tests.readings_text import read
from tests.real_data import needs_sessions
from tests.test_native import bright_mixtures

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers


def test_light_beside_the_curves_goes_where_effects_take_the_channels() -> None:
    level = np.array([[0.25, 0.0, 0.0], [0.5, 0.0, 0.0], [0.75, 0.0, 0.0], [0.6, 0.4, 0.0]])
    linear = code_to_linear(level)
    light = np.array([[0.0, 0.02, 0.01], [0.0, 0.05, 0.0], [0.0, 0.03, 0.02], [0.01, 0.04, 0.1]])
    beside = ResidualLight.of(linear, light, np.ones(4, dtype=bool), np.arange(4))
    assert beside.at(linear) == pytest.approx(light, abs=1e-12)
    # A single channel takes the colour of its changed level: here the colour of the reading below.
    lower = beside.at(linear[[0, 0, 1, 3]])
    assert lower[1:3] == pytest.approx(light[:2], abs=1e-12)
    # The common light of several channels is proportional to the product of their code values.
    halved = beside.at(code_to_linear(level / 2.0))[3]
    alone = ResidualLight.of(linear, light, np.ones(4, dtype=bool), np.zeros(4, dtype=int))

    def of_red(code: float) -> Array:
        return np.asarray(alone.at(code_to_linear(np.array([[code, 0.0, 0.0]] * 4)))[0])

    assert halved - of_red(0.3) == pytest.approx((light[3] - of_red(0.6)) / 4.0, abs=1e-12)


@needs_sessions
def test_a_loss_of_drive_is_seen_on_a_display_whose_blue_changes_colour_with_its_drive() -> None:
    truth = campaign(5, {"drive-loss": 1.0}, base="ThinkPad_X61__N121X5-L06__1_2017-04-19_15-14")
    readings = read(table(truth, METERS["gaussian"].read(truth, 5)), file="loss.csv", sha256="")
    base = fit(with_shared_errors(Problem.of(readings, baseline="native"), ()))
    best = family(base, catalogue()["drive-loss"]).best.fit
    # If the residual light follows the channels, little misfit remains. If it stays fixed, half of the misfit remains.
    assert best.chi2 - best.freedom < 0.2 * (base.chi2 - base.freedom)


def test_curves_may_miss_a_level_that_the_first_session_lacks_but_alike_at_all_hours() -> None:
    """The curves miss a level of blue by 6 % in X and −5 % in Z: at all later hours, or at the last hour only."""
    readings = bright_mixtures(without="0,0,0,0.45,")
    here = (readings.drive == (0.0, 0.0, 0.45)).all(axis=1)
    assert here.any()
    assert not here[readings.hours == 0].any()

    def misfit(missed: Array) -> float:
        xyz = np.where(missed[:, np.newaxis], readings.xyz_cd_m2 * np.array([1.06, 1.0, 0.95]), readings.xyz_cd_m2)
        return fit(Problem.of(readings.with_light(xyz), baseline="native")).chi2

    usual = misfit(np.zeros(here.size, dtype=bool))
    assert misfit(here) - usual < 50.0
    assert misfit(here & (readings.hours == 18_000.0)) - usual > 500.0
