"""ΔE2000 between un-aged and aged displays, against colour-science step by step, and pitfalls of CIEDE2000."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen import AppliedEffect, DisplayModel
from lutgen.colorimetry import CHUNK, LINEAR_TO_XYZ, SRGB_XY, delta_e_2000
from lutgen.display.conditions import conditions_of
from lutgen.effects import catalogue
from lutgen.pictures.difference import differences

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

pytestmark = pytest.mark.numbers

#: Hues, in degrees, where a formula of CIEDE2000 changes: the wrap, sign changes of sine or cosine, the rotation.
EDGES = (0.0, 90.0, 95.0, 180.0, 270.0, 275.0, 360.0)


@pytest.fixture(scope="module")
def code() -> Array:
    """Colours of all kinds: a lattice with its greys, primaries and ties, and random colours."""
    lattice = np.array(list(product(np.linspace(0.0, 1.0, 9), repeat=3)))
    return np.concatenate([lattice, np.random.default_rng(1).random((3000, 3))])


def by_colour_science(code: Array, before: AgedDisplay, after: AgedDisplay) -> Array:
    """The same by colour-science's own steps. XYZ of the displays is lutgen's: other tests compare XYZ with oracles."""
    import colour

    def lab(display: AgedDisplay) -> Array:
        linear = np.clip(colour.algebra.vecmul(np.linalg.inv(LINEAR_TO_XYZ), display.code_to_xyz(code)), 0.0, 1.0)
        return np.asarray(colour.XYZ_to_Lab(colour.algebra.vecmul(LINEAR_TO_XYZ, linear), SRGB_XY[0]))

    return np.asarray(colour.delta_E(lab(before), lab(after), method="CIE 2000"))


def around(hue: float, apart: float, chroma_1: Array, chroma_2: Array) -> tuple[Array, Array]:
    """Pairs of hues on both sides of ``hue``, at this distance in degrees."""
    low, high = np.radians([hue - apart, hue + 0.7 * apart])
    light = np.linspace(5.0, 95.0, len(chroma_1))
    first = np.column_stack([light, chroma_1 * np.cos(low), chroma_1 * np.sin(low)])
    second = np.column_stack([light[::-1], chroma_2 * np.cos(high), chroma_2 * np.sin(high)])
    return first, second


@pytest.mark.parametrize("hue", EDGES)
@pytest.mark.parametrize("apart", [1e-12, 1e-6, 1e-3, 1.0, 30.0, 80.0])
def test_ciede2000_agrees_with_colour_science_around_its_edges(hue: float, apart: float) -> None:
    import colour

    random = np.random.default_rng(3)
    chroma_1, chroma_2 = 10.0 ** random.uniform(-8, 2.1, (2, 2000))
    first, second = around(hue, apart, chroma_1, chroma_2)
    # The mean hue is never exactly at the wrap: CIEDE2000 jumps there, and rounding would decide the side.
    expected = colour.delta_E(first, second, method="CIE 2000")
    np.testing.assert_allclose(delta_e_2000(first, second), expected, rtol=0, atol=1e-10)


def test_ciede2000_of_colours_hardly_apart_stays_a_small_number() -> None:
    # Cosine and sine of equal hues, computed twice, may differ in the last bit: avoid the root of a negative number.
    random = np.random.default_rng(4)
    lab = np.array([100.0, 120.0, 120.0]) * random.random((20_000, 3)) - np.array([0.0, 60.0, 60.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        difference = delta_e_2000(lab, lab * (1.0 + 1e-15))
    assert (difference >= 0).all()
    assert difference.max() < 1e-12


def test_ciede2000_does_not_see_how_its_arrays_lie_in_memory() -> None:
    lab = np.random.default_rng(5).uniform(-50.0, 50.0, (1000, 3))
    other = lab[::-1] * 0.5
    rows = delta_e_2000(lab, other)
    np.testing.assert_array_equal(delta_e_2000(np.asfortranarray(lab), np.asfortranarray(other)), rows)


@pytest.mark.parametrize("selection", ["nearest", "continuous"])
@pytest.mark.parametrize(("mode", "hours"), [("chroma", 500.0), ("chroma", 18_000.0), ("chroma-luma", 7300.0)])
def test_differences_are_colour_sciences(
    mode: str, hours: float, selection: str, model: DisplayModel, code: Array
) -> None:
    display = replace(model, selection=selection)
    before, after = display.at("stable", 0.0), display.at(mode, hours)
    (difference,) = differences(code.__getitem__, len(code), before, [after])
    np.testing.assert_allclose(difference, by_colour_science(code, before, after), rtol=0, atol=1e-10)
    assert difference.max() > 0.3


def test_the_unaged_picture_is_the_picture_itself(model: DisplayModel, code: Array) -> None:
    import colour

    aged = model.at("chroma", 18_000.0)
    (difference,) = differences(code.__getitem__, len(code), model.at("stable", 0.0), [aged])
    plain = colour.XYZ_to_Lab(colour.algebra.vecmul(LINEAR_TO_XYZ, colour.models.eotf_sRGB(code)), SRGB_XY[0])
    shown = colour.models.eotf_sRGB(aged.code_to_code(code))
    seen = colour.XYZ_to_Lab(colour.algebra.vecmul(LINEAR_TO_XYZ, shown), SRGB_XY[0])
    # The picture goes through the sRGB curve and back, as in `apply`: an error of 1e-7 by the curve's gap of 2e-9.
    np.testing.assert_allclose(difference, colour.delta_E(plain, seen, method="CIE 2000"), rtol=0, atol=2e-5)


def test_at_hour_0_nothing_differs_and_stable_never_does(model: DisplayModel, code: Array) -> None:
    still = [model.at("chroma", 0.0), model.at("chroma-luma", 0.0), model.at("stable", 18_000.0)]
    assert not differences(code.__getitem__, len(code), model.at("stable", 0.0), still).any()


def test_room_light_that_was_always_there_is_no_aging_and_hides_some(model: DisplayModel, code: Array) -> None:
    room = AppliedEffect.of(catalogue()["ambient-reflection"], {"reflectance": 0.02})
    lit = replace(model, effects=(room,), conditions=conditions_of({"ambient_lx": 500.0}))
    before, after = lit.at("stable", 0.0), lit.at("chroma", 18_000.0)
    assert not differences(code.__getitem__, len(code), before, [lit.at("chroma", 0.0)]).any()
    (difference,) = differences(code.__getitem__, len(code), before, [after])
    np.testing.assert_allclose(difference, by_colour_science(code, before, after), rtol=0, atol=1e-10)
    (dark,) = differences(code.__getitem__, len(code), model.at("stable", 0.0), [model.at("chroma", 18_000.0)])
    assert 0 < difference.mean() < dark.mean()


def test_chunks_and_groups_of_displays_do_not_show(model: DisplayModel) -> None:
    many = np.random.default_rng(6).random((2 * CHUNK + 11, 3))
    before, after = model.at("stable", 0.0), [model.at("chroma", hours) for hours in (4000.0, 9000.0)]
    calls: list[tuple[int, int]] = []
    both = differences(many.__getitem__, len(many), before, after, lambda done, size: calls.append((done, size)))
    assert both.shape == (2, len(many))
    assert calls == [(CHUNK, len(many)), (2 * CHUNK, len(many)), (len(many), len(many))]
    around = slice(CHUNK - 5, CHUNK + 5)
    few = differences(many[around].__getitem__, 10, before, after[1:])
    np.testing.assert_allclose(both[1:, around], few, rtol=0, atol=1e-13)
