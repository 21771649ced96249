"""The inverse display: the drive with which an aged display shows the colours of its new state."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from lutgen.colorimetry import (
    LINEAR_TO_XYZ,
    Array,
    code_to_linear,
    delta_e_2000,
    inverse,
    linear_to_code,
    linear_to_lab,
    xyz_to_linear,
    xyz_to_xyY,
)
from lutgen.display import (
    MODES,
    REFERENCES,
    SELECTIONS,
    AgedDisplay,
    AppliedEffect,
    Compensation,
    DisplayModel,
    compensated,
    compensation_of,
    default_display,
)
from lutgen.display.chain import SrgbTransfer, outside_gamut
from lutgen.display.effect_chain import without_steps
from lutgen.display.inverse import ON_BORDER, drive_of
from lutgen.display.paper import Selection, matrices_of
from lutgen.display.search import _DriveSearch, searched
from lutgen.effects import catalogue
from lutgen.errors import LutgenError
from lutgen.readings import Measurements
from tests.quick import mostly_slow
from tests.twin import PAPER_LAW, Twin, rows_of_csv

pytestmark = pytest.mark.numbers

#: Effects beside the paper's model that a display can have. The search has to invert these effects.
BAKED = [name for name, each in catalogue().items() if each.stage not in ("instrument", "selection")]


@pytest.fixture(scope="module")
def colours() -> Array:
    random = np.random.default_rng(5)
    greys = np.repeat(np.linspace(0, 1, 20)[:, np.newaxis], 3, axis=1)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(float)
    return np.concatenate([random.random((120, 3)), greys, corners])


def correction(model: DisplayModel, mode: str, hours: float, unreachable: str = "clip") -> AgedDisplay:
    return compensated(model.at(mode, hours), model.at("stable", hours), unreachable=unreachable)


def link_of(display: AgedDisplay) -> Compensation:
    link = compensation_of(display)
    assert link is not None
    return link


def with_effects(readings: Measurements, *names: str, selection: str = "continuous") -> DisplayModel:
    effects = tuple(AppliedEffect.of(catalogue()[name], catalogue()[name].typical()) for name in names)
    return DisplayModel(readings, effects=effects, selection=selection)


def a_display(selection: str, bonus: tuple[float, float, float]) -> AgedDisplay:
    """A display whose white is the sum of its primaries, each multiplied by one plus its value in ``bonus``."""
    white = LINEAR_TO_XYZ @ (1.0 + np.array(bonus))
    xyY = xyz_to_xyY(np.vstack([white, LINEAR_TO_XYZ.T]))
    return AgedDisplay("made up", 0.0, (SrgbTransfer(), Selection(selection)), (matrices_of(xyY, selection),))


def look(xyz: Array) -> Array:
    return linear_to_lab(xyz_to_linear(xyz))


# By the closed form


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("mode", MODES)
def test_the_aged_display_of_the_literal_twin_shows_the_new_one_through_the_correction(
    mode: str, selection: str, reference: str, readings: Measurements, colours: Array
) -> None:
    rows = rows_of_csv(default_display().read_text(encoding="utf-8"))
    sent = correction(DisplayModel(readings, selection=selection, reference=reference), mode, 10_000.0)
    drive = sent.code_to_linear(colours)
    reached = ~outside_gamut(drive)
    assert reached.mean() > 0.3
    code = linear_to_code(np.clip(drive, 0.0, 1.0))
    law = PAPER_LAW if mode == "chroma-luma" else None
    twin = {"selection": selection, "reference": reference, "hours": 10_000.0, "law": law}
    aged, fresh = Twin(rows, mode=mode, **twin), Twin(rows, mode="stable", **twin)  # type: ignore[arg-type]
    light = [aged.xyz((r, g, b)) for r, g, b in code[reached]]
    expected = [fresh.xyz((r, g, b)) for r, g, b in colours[reached]]
    # The twin's sRGB curve has the standard's own gap of 2e-9 between its pieces. The tips contain a larger gap.
    np.testing.assert_allclose(light, expected, rtol=0, atol=3e-6)


@pytest.mark.parametrize("selection", SELECTIONS)
def test_at_hour_0_nothing_is_corrected(selection: str, readings: Measurements, colours: Array) -> None:
    sent = correction(DisplayModel(readings, selection=selection), "chroma-luma", 0.0)
    np.testing.assert_allclose(sent.code_to_code(colours), colours, rtol=0, atol=1e-9)


def test_what_one_channel_lacks_costs_the_others_nothing(readings: Measurements) -> None:
    """Each channel clips by itself: white, which lacks blue, keeps its red."""
    sent = correction(DisplayModel(readings, selection="continuous"), "chroma", 18_000.0)
    drive = sent.code_to_linear(np.ones((1, 3)))[0]
    assert drive[0] < 1.0 < drive[2]
    np.testing.assert_array_equal(sent.code_to_code(np.ones((1, 3)))[0], linear_to_code(np.minimum(drive, 1.0)))


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize(("hours", "left"), [(10_000.0, 0.67), (18_000.0, 0.40)])
def test_scaled_light_fits_into_what_the_luminance_law_leaves(
    hours: float, left: float, selection: str, readings: Measurements, colours: Array
) -> None:
    """The paper's law leaves 67 % and 40 % of white's light. White in its old colour gets less, and nothing clips."""
    sent = correction(DisplayModel(readings, selection=selection), "chroma-luma", hours, "scale")
    assert 0.7 * left < link_of(sent).scale < left
    assert 1.0 - 1e-5 < sent.code_to_linear(colours).max() <= 1.0 + 1e-6
    clipped = correction(DisplayModel(readings, selection=selection), "chroma-luma", hours, "clip")
    assert clipped.clipped_share(colours) > 3 * sent.clipped_share(colours)


def test_white_beyond_what_is_left_is_out_of_reach(readings: Measurements) -> None:
    model = DisplayModel(readings, selection="continuous")
    greys = linear_to_code(np.repeat(np.array([[0.30], [0.41], [1.0]]), 3, axis=1))
    drive = correction(model, "chroma-luma", 18_000.0).code_to_linear(greys)
    np.testing.assert_array_equal(outside_gamut(drive), [False, True, True])


# At the jump of ``nearest``

#: A display whose jump leaves a gap: no drive shows the colours in the gap.
GAP = (-0.05, -0.08, -0.02)


@pytest.mark.parametrize("bonus", mostly_slow([((0.06, 0.02, 0.1),), (GAP,), ((0.05, 0.0, -0.08),)], GAP))
def test_no_drive_of_the_twin_looks_more_alike_than_the_one_found(bonus: tuple[float, float, float]) -> None:
    """Many starts of scipy's bounded least squares find nothing better, even at folds and gaps."""
    display = a_display("nearest", bonus)
    asked = np.random.default_rng(11).uniform(0.25, 0.75, (12, 3))
    drive = drive_of(display, asked @ LINEAR_TO_XYZ.T, asked)
    wanted = look(asked @ LINEAR_TO_XYZ.T)
    difference = delta_e_2000(look(display.code_to_xyz(linear_to_code(np.clip(drive, 0, 1)))), wanted)
    ways = np.random.default_rng(12).normal(0.0, 0.03, (4, 3))
    for colour, lab, error in zip(asked, wanted, difference, strict=True):

        def away(linear: Array, lab: Array = lab) -> Array:
            return np.asarray(look(display.code_to_xyz(linear_to_code(linear[np.newaxis])))[0] - lab)

        best = min(
            delta_e_2000(away(least_squares(away, np.clip(colour + way, 0, 1), bounds=(0, 1)).x) + lab, lab)
            for way in ways
        )
        # In a gap the search raises two channels equally to reach the border, not all three: an error of at most
        # 0.1 ΔE2000.
        assert error <= best + 0.1
        assert error <= 1e-9 or bonus != GAP


def test_where_two_drives_show_the_same_the_nearer_to_the_colour_is_sent() -> None:
    display = a_display("nearest", (-0.06, -0.06, -0.06))
    asked = np.array([[0.8, 0.505, 0.505], [0.8, 0.501, 0.501]])
    shown = display.code_to_xyz(linear_to_code(asked))
    np.testing.assert_allclose(drive_of(display, shown, asked), asked, rtol=0, atol=1e-9)
    # A start on the other side of the border gives the primary's drive, which shows the same colour.
    other = drive_of(display, shown, np.full((2, 3), 0.3))
    np.testing.assert_array_less(np.sort(other, axis=1)[:, :2].sum(axis=1), 1.0)
    np.testing.assert_allclose(display.code_to_xyz(linear_to_code(other)), shown, rtol=0, atol=1e-12)


def test_in_a_gap_the_drive_stays_on_one_side_of_the_border() -> None:
    display = a_display("nearest", (0.09, 0.09, 0.09))
    below, above = np.array([[0.7, 0.4999, 0.4999]]), np.array([[0.7, 0.5001, 0.5001]])
    shown = [display.code_to_xyz(linear_to_code(side)) for side in (below, above)]
    middle = 0.5 * (shown[0] + shown[1])
    drive = drive_of(display, middle, below)
    assert abs(np.sort(drive[0])[:2].sum() - 1.0) == pytest.approx(ON_BORDER / 2, rel=1e-6)
    # The distance from the middle to the better side is half the gap, except for the nonlinearity of ΔE2000.
    gap = delta_e_2000(look(shown[0]), look(shown[1]))[0]
    assert delta_e_2000(look(display.code_to_xyz(linear_to_code(drive))), look(middle))[0] < 0.75 * gap


# By search


@pytest.mark.parametrize("name", BAKED)
def test_the_search_undoes_every_effect_of_the_catalogue(name: str, readings: Measurements, colours: Array) -> None:
    model = with_effects(readings, name)
    sent = link_of(correction(model, "chroma", 18_000.0))
    drive = sent.drive(colours)
    reached = ~outside_gamut(drive)
    assert reached.mean() > 0.4
    # No drive can follow steps finer than its own: the search inverts the smooth curve.
    aged = without_steps(sent.aged) or sent.aged
    fresh = without_steps(sent.fresh) or sent.fresh
    shown = aged.code_to_xyz(linear_to_code(np.clip(drive[reached], 0.0, 1.0)))
    # A drive that exceeds its range by at most 1e-6 counts as reached: near black the error is 3e-3 ΔE2000 at most.
    assert delta_e_2000(look(shown), look(fresh.code_to_xyz(colours[reached]))).max() < 5e-3


def test_the_search_is_not_beaten_by_scipy(readings: Measurements) -> None:
    """Scipy's bounded trust region solves the same least squares for single colours, reachable or not."""
    model = with_effects(readings, "eotf-drift", "black-level", "crosstalk")
    sent = link_of(correction(model, "chroma-luma", 10_000.0))
    asked = np.concatenate([np.random.default_rng(2).random((20, 3)), np.eye(3), np.ones((1, 3)), np.zeros((1, 3))])
    target = sent.target(asked)
    tips = sent.aged.code_to_xyz(np.concatenate([np.eye(3), np.zeros((1, 3))]))
    to_light = inverse((tips[:3] - tips[3]).T)
    drive = np.clip(sent.drive(asked), 0.0, 1.0)
    ours = (sent.aged.code_to_xyz(linear_to_code(drive)) - target) @ to_light.T
    out = outside_gamut(sent.drive(asked))
    assert 5 < out.sum() < 20
    for wanted, mine, residual, outside in zip(target, drive, ours, out, strict=True):

        def away(linear: Array, wanted: Array = wanted) -> Array:
            return np.asarray(to_light @ (sent.aged.code_to_xyz(linear_to_code(linear[np.newaxis]))[0] - wanted))

        theirs = least_squares(away, np.full(3, 0.4), bounds=(0, 1), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert np.square(residual).sum() <= 2 * theirs.cost + 1e-12
        assert (np.abs(residual).max() > 1e-9) == outside
        np.testing.assert_allclose(mine, theirs.x, rtol=0, atol=2e-3)


@pytest.mark.parametrize("selection", SELECTIONS)
def test_search_and_closed_form_agree_on_the_papers_display(selection: str, readings: Measurements) -> None:
    model = DisplayModel(readings, selection=selection)
    aged = model.at("chroma", 18_000.0)
    colours = np.random.default_rng(8).random((300, 3))
    target = model.at("stable", 0.0).code_to_xyz(colours)
    closed, search_drive = drive_of(aged, target, code_to_linear(colours)), searched(aged, target)[0]
    reached = ~outside_gamut(closed)
    shown = aged.code_to_xyz(linear_to_code(np.clip(search_drive[reached], 0.0, 1.0)))
    np.testing.assert_allclose(shown, target[reached], rtol=0, atol=1e-9)
    if selection == "continuous":
        np.testing.assert_allclose(search_drive[reached], closed[reached], rtol=0, atol=1e-8)


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("unreachable", mostly_slow(["clip", "scale"], "clip"))
def test_starting_from_neighbours_finds_what_each_colour_finds_alone(
    unreachable: str, selection: str, readings: Measurements
) -> None:
    """Many colours start from the drives of a lattice, a few from the drives of an additive display."""
    model = with_effects(readings, "eotf-drift", "black-level", "crosstalk", selection=selection)
    sent = link_of(correction(model, "chroma-luma", 18_000.0, unreachable))
    colours = np.random.default_rng(4).random((4_000, 3))
    together = sent.drive(colours)
    apart = np.concatenate([sent.drive(part) for part in np.split(colours, 8)])
    problem = _DriveSearch.of(sent.aged)
    wanted = problem.light(sent.target(colours))
    missed, alone = (
        np.square(wanted - problem.shown(np.clip(drive, 0.0, 1.0))).sum(axis=1) for drive in (together, apart)
    )
    assert missed.mean() <= alone.mean() + 1e-7
    # If light is missing and ``nearest`` jumps, descents from two starts may end on different sides of the jump.
    assert (missed - alone).max() < (1e-6 if selection == "continuous" else 2e-4)


def test_neighbours_make_a_search_short(readings: Measurements, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slopes take three evaluations, each step one. A single colour takes 12 to 70, most if light is missing."""
    model = with_effects(readings, "eotf-drift", "black-level", selection="nearest")
    sent = link_of(correction(model, "chroma-luma", 18_000.0))
    colours = np.random.default_rng(6).random((20_000, 3))
    sent.drive(colours)
    evaluated = []
    shown = _DriveSearch.shown

    def counted(self: _DriveSearch, drive: Array) -> Array:
        evaluated.append(len(drive))
        return shown(self, drive)

    monkeypatch.setattr(_DriveSearch, "shown", counted)
    sent.drive(colours)
    assert sum(evaluated) < 16 * len(colours)


def test_a_leak_that_the_new_display_lacked_puts_black_out_of_reach(readings: Measurements) -> None:
    sent = correction(with_effects(readings, "black-level"), "chroma", 18_000.0)
    assert (sent.code_to_linear(np.zeros((1, 3))) < -1e-6).any()
    np.testing.assert_array_equal(sent.code_to_code(np.zeros((1, 3))), 0.0)


# Refused effects, and lists that the code holds in two places


def test_what_cannot_be_inverted_is_refused(readings: Measurements) -> None:
    aged = DisplayModel(readings).at("chroma", 10_000.0)
    with pytest.raises(LutgenError, match=r"'stretch'\. Pick one of: clip, scale\."):
        compensated(aged, aged, unreachable="stretch")
    with pytest.raises(LutgenError, match="white lies outside its own primaries"):
        drive_of(a_display("continuous", (-1.2, 0.0, 0.0)), np.ones((1, 3)), np.ones((1, 3)))


def test_displays_of_equal_light_share_a_correction(readings: Measurements) -> None:
    model = DisplayModel(readings)
    early, late = correction(model, "stable", 1_000.0), correction(model, "stable", 9_000.0)
    assert early.tail == late.tail
    assert compensation_of(model.at("stable", 1_000.0)) is None
