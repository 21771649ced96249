"""A display's own model on simulated displays: the selected rungs, and the effect of a wrong reading."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.colorimetry import LINEAR_TO_XYZ, code_to_linear
from lutgen.display.own_model import Sample, curves, fit_own_model, residual
from lutgen.display.own_model.drive import WAYS, Drive
from lutgen.display.own_model.least_squares import solve
from lutgen.display.own_model.stored import StoredModel
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.display.own_model import OwnModel

pytestmark = pytest.mark.numbers

LEVELS = np.linspace(0.0, 1.0, 18)
WHITE = 150.0 * LINEAR_TO_XYZ.sum(axis=1)


def chart(mixtures: int = 120, seed: int = 3) -> Array:
    """Black, white, primaries, ramps of greys and channels, and mixtures in 8 bits."""
    channels = np.vstack([np.eye(3), np.ones((1, 3))])
    ramps = np.array([level * channel for channel, level in product(channels, LEVELS[1:])])
    rng = np.random.default_rng(seed)
    mixed = rng.uniform(0.0, 1.0, (mixtures, 3))
    return np.asarray(np.round(np.vstack([np.zeros((2, 3)), ramps, np.ones((3, 3)), mixed]) * 255) / 255)


def gamma(code: Array) -> Array:
    """A display with a power for each channel, a black with light, and primaries that add up to white."""
    light = code ** np.array([2.4, 2.2, 2.0])
    return np.asarray(0.3 + 150.0 * light @ LINEAR_TO_XYZ.T)


def turning(code: Array) -> Array:
    """The display of ``gamma``, with channels whose chromaticity depends on their drive."""
    return np.asarray(gamma(code) + (code**1.5 * (1.0 - code)) @ np.diag([3.0, 0.0, 6.0]))


def coupled(code: Array) -> Array:
    """The display of ``turning``, with mixtures brighter than the sum of their channels."""
    red, green, blue = code.T
    return np.asarray(turning(code) + 2.0 * (red * green * (1.0 - red * green) + green * blue)[:, np.newaxis])


def sample_of(display: Callable[[Array], Array], noise: float = 0.0005, calibration: Array | None = None) -> Sample:
    code = chart()
    xyz = display(code)
    rng = np.random.default_rng(7)
    return Sample.of(code, xyz * (1.0 + noise * rng.standard_normal(xyz.shape)), calibration=calibration)


@cache
def own_model_of(display: Callable[[Array], Array]) -> OwnModel:
    """Return the own model of readings of a display; several tests look at one."""
    return fit_own_model(sample_of(display))


def taken(sample: Sample) -> set[str]:
    return {rung.name for rung in fit_own_model(sample).rungs if rung.taken}


def test_an_srgb_display_stays_near_the_lowest_rung() -> None:
    model = fit_own_model(sample_of(lambda code: 150.0 * code_to_linear(code) @ LINEAR_TO_XYZ.T))
    assert model.rungs[0].name == curves.SRGB_NAME
    assert model.rungs[0].error < 0.05
    assert model.error <= model.rungs[0].error


@pytest.mark.parametrize(("display", "rung", "least"), [
    (gamma, curves.SCALAR_NAME, 0.05),
    (turning, curves.XYZ_NAME, 0.07),
    (coupled, curves.PRODUCTS_NAME, 0.12),
])  # fmt: skip
def test_the_rung_that_a_display_needs_is_taken(display: Callable[[Array], Array], rung: str, least: float) -> None:
    model = own_model_of(display)
    assert rung in {each.name for each in model.rungs if each.taken}
    assert model.error < least
    assert model.error < model.rungs[0].error / 5


def test_a_display_with_one_curve_a_channel_needs_no_products() -> None:
    errors = {rung.name: rung.error for rung in own_model_of(gamma).rungs}
    assert errors[curves.SCALAR_NAME] < errors[curves.SRGB_NAME] / 5
    assert errors[curves.PRODUCTS_NAME] > 0.8 * errors[curves.SCALAR_NAME]


def bumped(code: Array) -> Array:
    """The display of ``gamma``, with some brighter colours that no formula of a display describes."""
    bump = np.exp(-((code - np.array([0.7, 0.3, 0.6])) ** 2).sum(axis=1) / (2 * 0.25**2))
    return np.asarray(gamma(code) * (1.0 + 0.05 * bump)[:, np.newaxis])


def test_what_no_formula_names_is_in_the_residual() -> None:
    model = own_model_of(bumped)
    errors = {rung.name: rung.error for rung in model.rungs}
    assert model.rungs[-1].name == residual.NAME
    assert model.rungs[-1].taken
    assert errors[residual.NAME] < 0.6 * errors[curves.PRODUCTS_NAME]


def test_the_standard_error_is_small_at_readings_and_large_far_from_them() -> None:
    model = own_model_of(bumped)
    assert isinstance(model.model, residual.SmoothResidual)
    sparse = replace(model.model, centres=model.model.centres[:9], noise=model.model.noise[:9])
    near, far = sparse.standard_error(np.vstack([sparse.centres[:1], [[1.0, 0.0, 1.0]]]))
    slope = near / far
    assert (slope < 1.0).all()
    whole = model.standard_error(chart())
    assert whole is not None
    assert (whole > 0).all()
    assert own_model_of(gamma).standard_error(chart()) is None


def test_one_misread_level_is_named_and_hardly_counts() -> None:
    good = sample_of(coupled)
    row = int(np.flatnonzero((good.drive == np.array([0.0, 120 / 255, 0.0])).all(axis=1))[0])
    share = good.share.copy()
    share[row] *= 0.4
    bad = Sample(good.drive, share, good.white, good.lines, "panel.ti3")
    model, right = fit_own_model(bad), own_model_of(coupled)
    assert model.misread == (row,)
    (remark,) = model.remarks()
    assert re.search(rf"panel.ti3, line {row + 1}: the reading of code 0, 0.4706, 0 contradicts all others", remark)
    assert right.remarks() == ()
    assert model.error < 1.1 * right.error + 0.02
    at = np.array([[0.0, 120 / 255, 0.0]])
    np.testing.assert_allclose(model(at), right(at), rtol=0.02)


def test_the_luminance_of_a_channel_never_falls() -> None:
    good = sample_of(gamma, noise=0.03)
    fitted = curves.fit_xyz(good, 0.0001, Drive())
    code = np.linspace(0.0, 1.0, 65)[:, np.newaxis] * np.eye(3)[:, np.newaxis, :]
    assert (np.diff(np.array([fitted(each)[:, 1] for each in code]), axis=1) >= -1e-9).all()


def test_steps_of_a_loaded_calibration_are_part_of_the_model() -> None:
    """An 8-bit panel behind a strong calibration has steps that smooth curves do not fit."""
    steps = np.arange(256) / 255
    loaded = np.column_stack([steps, 0.8 * steps**1.3, 0.7 * steps**1.2, 0.9 * steps**0.9])
    through = Drive(WAYS[2], loaded)

    def stairs(code: Array) -> Array:
        return gamma(through(code))

    known, unknown = sample_of(stairs, 0.0001, calibration=loaded), sample_of(stairs, 0.0001)
    model = fit_own_model(known)
    drive = model.model.drive  # type: ignore[attr-defined]
    assert drive.way == WAYS[2]
    assert model.error < 0.5 * fit_own_model(unknown).error


def test_a_clipped_input_is_part_of_the_model() -> None:
    """Red and green are constant from code 0.8 upwards, as with a cable that assumes another signal range."""

    def clipped(code: Array) -> Array:
        return gamma(np.minimum(code / np.array([0.8, 0.8, 1.0]), 1.0))

    sample = sample_of(clipped)
    model = fit_own_model(sample)
    drive = model.model.drive  # type: ignore[attr-defined]
    assert drive.way == WAYS[3]
    at = np.array([[0.9, 0.2, 0.3], [1.0, 0.2, 0.3], [0.7, 0.2, 0.3]])
    known, full, below = drive(at)
    np.testing.assert_array_equal(known, full)
    assert below[0] < 1.0
    assert known[2] == 0.3
    assert 0.8 <= drive.calibration[1, 0] < 0.87
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Sample, "clipped", None)
        assert model.error < 0.75 * fit_own_model(sample_of(clipped)).error
    stored = StoredModel.of(model.model, sample.tips, sample.black)
    np.testing.assert_array_equal(StoredModel(stored.content)(at), model(at))


def test_light_that_rises_to_full_drive_is_not_clipped() -> None:
    assert sample_of(gamma).clipped is None


def test_all_readings_of_one_code_lie_in_one_fold_and_colour_points_in_none() -> None:
    sample = sample_of(gamma)
    twice = Sample.of(np.vstack([sample.drive] * 2), np.vstack([sample.share] * 2))
    for patch in np.unique(twice.patch):
        assert np.unique(twice.fold[twice.patch == patch]).size == 1
    assert (twice.fold[twice.drive.min(axis=1) == 1.0] == -1).all()
    assert set(twice.fold[twice.is_mixture]) == {0, 1, 2, 3, 4}


def test_a_model_never_depends_on_the_order_of_the_readings() -> None:
    sample = sample_of(coupled)
    turned = np.random.default_rng(1).permutation(len(sample.drive))
    other = Sample(sample.drive[turned], sample.share[turned], sample.white, sample.lines[turned])
    np.testing.assert_allclose(fit_own_model(other)(chart()), own_model_of(coupled)(chart()), atol=1e-9)


def test_few_mixtures_and_a_missing_black_are_refused() -> None:
    sample = sample_of(gamma)
    few = sample.part(~sample.is_mixture)
    with pytest.raises(LutgenError, match=r"0 different mixtures; .* judged on 20"):
        fit_own_model(few)
    lit = sample.drive.any(axis=1)
    with pytest.raises(LutgenError, match="needs black"):
        Sample.of(sample.drive[lit], sample.share[lit])


def test_least_squares_keep_inequalities() -> None:
    """Compare with the slow way: the best of all combinations of inequalities that hold as equalities."""
    rng = np.random.default_rng(4)
    at, wanted = rng.standard_normal((30, 4)), rng.standard_normal(30)
    rises = np.diff(np.eye(4), axis=0)
    solution = solve(at, wanted, np.zeros((1, 4)), rises)
    assert (rises @ solution >= -1e-9).all()
    best = np.inf
    for active in product((False, True), repeat=3):
        equal = rises[np.array(active)]
        free = np.linalg.svd(equal)[2][len(equal) :].T if len(equal) else np.eye(4)
        tried = free @ np.linalg.lstsq(at @ free, wanted, rcond=None)[0]
        if (rises @ tried >= -1e-9).all():
            best = min(best, float(((at @ tried - wanted) ** 2).sum()))
    assert ((at @ solution - wanted) ** 2).sum() == pytest.approx(best, rel=1e-6)
