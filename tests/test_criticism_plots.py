"""The pictures of compare, diagnose and refine: the same bytes each time, no text cut off, no overlapping texts."""

from __future__ import annotations

import sys
from functools import cache
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from matplotlib.backends.backend_agg import RendererAgg
from PIL import Image

from lutgen import LutgenError
from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.compare.fit_view import View, patch_name
from lutgen.criticism.compare.panels import ResidualPanel, panels
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import Term
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.refine import refine
from lutgen.criticism.search.candidates import family
from lutgen.effects import catalogue
from lutgen.report.comparison import title_of
from lutgen.report.criticism_plots import (
    OF_COMPARE,
    OF_DIAGNOSE,
    OF_REFINE,
    plot_comparison,
    plot_diagnosis,
    plot_fit,
    plot_refinement,
)
from lutgen.report.drawing import _wrapped
from tests.campaigns import CAMPAIGNS, text_of
from tests.effect_scenes import lively
from tests.quick import mostly_slow
from tests.readings_text import read

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers


class Drawn(NamedTuple):
    """A piece of horizontal text on a canvas: its box in pixels, y downward."""

    text: str
    left: float
    top: float
    right: float
    bottom: float


class Canvas(NamedTuple):
    width: float
    height: float
    texts: list[Drawn]


@pytest.fixture
def canvases(monkeypatch: pytest.MonkeyPatch) -> list[Canvas]:
    """Every canvas that is drawn during a test, with its horizontal texts."""
    drawn: dict[RendererAgg, Canvas] = {}
    drawings: list[Canvas] = []
    draw: Any = RendererAgg.draw_text

    def note(self: Any, gc: Any, x: float, y: float, s: str, *more: Any, **named: Any) -> None:
        prop, angle = more[0], more[1]
        if angle == 0:
            if self not in drawn:
                drawn[self] = Canvas(self.width, self.height, [])
                drawings.append(drawn[self])
            width, height, descent = self.get_text_width_height_descent(s, prop, more[2] if len(more) > 2 else False)
            drawn[self].texts.append(Drawn(s, x, y - height, x + width, y + descent - 1))
        draw(self, gc, x, y, s, *more, **named)

    monkeypatch.setattr(RendererAgg, "draw_text", note)
    return drawings


def overlap(one: Drawn, other: Drawn) -> bool:
    """Whether two texts overlap by more than two pixels in both directions."""
    across = min(one.right, other.right) - max(one.left, other.left)
    down = min(one.bottom, other.bottom) - max(one.top, other.top)
    return across > 2 and down > 2


def check_legible(canvases: list[Canvas]) -> None:
    assert canvases
    for canvas in canvases:
        for drawn in canvas.texts:
            inside = (
                drawn.left >= 0 and drawn.top >= -1 and drawn.right <= canvas.width and drawn.bottom <= canvas.height
            )
            assert inside, f"cut off: {drawn}"
        covered = [(one.text, other.text) for one, other in combinations(set(canvas.texts), 2) if overlap(one, other)]
        assert not covered, covered


def readings(name: str) -> Measurements:
    table: Measurements = read(text_of(name), file=f"{name}.csv", sha256="0" * 64)
    return table


@cache
def diagnosis_of(name: str) -> Diagnosis:
    return diagnose(readings(name), baseline=CAMPAIGNS[name].baseline)


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("name", mostly_slow(CAMPAIGNS, "leak", "tips only", "one hour"))
def test_a_comparison_is_legible(name: str, tmp_path: Path, canvases: list[Canvas]) -> None:
    (path,) = plot_comparison(compare(readings(name), baseline=CAMPAIGNS[name].baseline), tmp_path)
    check_legible(canvases)
    assert written(tmp_path) == {path.name} == set(OF_COMPARE)
    with Image.open(path) as picture:
        assert picture.size[0] == 1500


@pytest.mark.parametrize(
    ("name", "title"),
    mostly_slow(
        [
            ("leak", "black-level is missing"),
            ("curve", "eotf-drift is missing"),
            ("edge", "edge-falloff is missing"),
            ("healthy", "no effect is added"),
            ("tips only", "they cannot see"),
            ("outside", "No known effect explains the error: "),
        ],
        "tips only",
    ),
)
def test_a_diagnosis_is_legible_and_its_titles_are_findings(
    name: str, title: str, tmp_path: Path, canvases: list[Canvas]
) -> None:
    pictures = plot_diagnosis(diagnosis_of(name), catalogue(), tmp_path)
    check_legible(canvases)
    assert written(tmp_path) == {path.name for path in pictures} <= set(OF_DIAGNOSE)
    assert ("fit.png" in written(tmp_path)) == (name not in {"healthy", "tips only"})
    titles = [" ".join(drawn.text for drawn in canvas.texts) for canvas in canvases]
    assert any(title in each for each in titles), titles


@pytest.mark.slow
@pytest.mark.parametrize("add", [("black-level",), ("edge-falloff", "black-level"), ()])
def test_a_refinement_is_legible(add: tuple[str, ...], tmp_path: Path, canvases: list[Canvas]) -> None:
    pictures = plot_refinement(refine(readings("edge"), add), catalogue(), tmp_path)
    check_legible(canvases)
    assert written(tmp_path) == {path.name for path in pictures}
    assert written(tmp_path) == (set(OF_REFINE) if add else {"residuals.png", "steps.png"})


@pytest.mark.slow
def test_pictures_are_the_same_bytes_again(tmp_path: Path) -> None:
    one = plot_diagnosis(diagnosis_of("leak"), catalogue(), tmp_path / "one")
    two = plot_diagnosis(diagnosis_of("leak"), catalogue(), tmp_path / "two")
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]


def test_pictures_are_replaced_only_by_force(tmp_path: Path) -> None:
    comparison = compare(readings("tips only"))
    (path,) = plot_comparison(comparison, tmp_path)
    path.write_bytes(b"here first")
    with pytest.raises(LutgenError, match=r"exists already\. Add --force"):
        plot_comparison(comparison, tmp_path)
    assert path.read_bytes() == b"here first"
    plot_comparison(comparison, tmp_path, force=True)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_panels_show_what_the_comparison_says() -> None:
    comparison = compare(readings("edge"))
    by = {panel.by: panel for panel in panels(comparison)}
    assert set(by) == {"hour", "level", "family", "position", "ambient_lx", "warmup_min", "temperature_c", "window"}
    for name in ("hour", "level", "family"):
        table = {each.slice: each for each in comparison.where if each.by == name}
        assert set(by[name].labels) == set(table)
        for label, ratio in zip(by[name].labels, by[name].ratio, strict=True):
            assert ratio == pytest.approx(table[label].rms_sigma / table[label].floor_rms_sigma, rel=1e-6)
    assert by["position"].worst == max(panel.worst for panel in by.values())
    assert by["window"].worst < 1.5
    assert list(by["hour"].places) == sorted(by["hour"].places)
    assert by["warmup_min"].labels == ("2 min", "5 min", "10 min", "20 min", "40 min", "warm")
    centre = by["position"].labels.index("u 0.5, v 0.5")
    np.testing.assert_allclose(by["position"].places[centre], 0.5)
    # The picture has only patches that were also read at the edges. The model predicts their centre correctly.
    assert abs(by["position"].lab[centre, 0]) < 0.1
    assert by["position"].lab[:, 0].min() < -2.0


@pytest.mark.parametrize(
    ("by", "ratio", "title"),
    [
        ("ambient_lx", (30.0, 33.0, 31.0), "room light: makes no difference"),
        ("ambient_lx", (30.0, 47.0, 31.0), "room light: 47 × the noise at b"),
        ("ambient_lx", (1.0, 1.3, 0.9), "room light: at most 1.3 × the noise"),
        ("level", (30.0, 33.0, 31.0), "code value: 33 × the noise at b"),
    ],
)
def test_a_panel_says_whether_its_condition_makes_a_difference(by: str, ratio: tuple[float, ...], title: str) -> None:
    none = np.zeros((3, 3))
    panel = ResidualPanel(by, 1, ("a", "b", "c"), np.arange(3.0), np.array(ratio), none[:, :2], none, none)
    assert title_of(panel) == title


@pytest.mark.parametrize(
    ("data", "effect", "way", "unit"),
    [
        ("leak", "black-level", "operating hours", "cd/m²"),
        ("curve", "eotf-drift", "code value", "%"),
        ("edge", "edge-falloff", "distance from the centre (1: a corner)", "%"),
        ("edge", "warm-up", "minutes since power-on", "%"),
        ("edge", "temperature", "temperature, °C", "%"),
        ("edge", "ambient-reflection", "room light, lux", "cd/m²"),
        ("edge", "crosstalk", "code value", "%"),
        ("fading", "backlight-decay", "operating hours", "%"),
    ],
)
def test_an_effect_is_drawn_over_what_it_depends_on(data: str, effect: str, way: str, unit: str) -> None:
    problem = Problem.of(readings(data), baseline=CAMPAIGNS[data].baseline)
    solution = family(fit(problem), catalogue()[effect]).best.fit
    view = View.of(problem, solution.terms, catalogue()[effect])
    assert view.way.name == way
    if data != "edge" or effect == "edge-falloff":
        assert view.unit == unit
        for curve in view.curves:
            assert len(set(curve.places)) == len(curve.places) >= 3
            assert np.abs(curve.measured - curve.with_it).max() < 0.35 * np.abs(curve.with_it).max()
        assert view.sentence().startswith(f"Without {effect}, ")


@pytest.mark.slow
def test_every_effect_has_a_view_and_the_longest_over_each_axis_is_legible(
    tmp_path: Path, canvases: list[Canvas]
) -> None:
    """The next test without fits: effects that share their axes differ only in names and sentences."""
    problem = Problem.of(readings("edge"))
    longest: dict[tuple[str, str], View] = {}
    for effect in catalogue().values():
        if effect.baseline == "colour-points":
            view = View.of(problem, (Term(effect, lively(effect), effect.forms[0]),), effect)
            key = (view.way.name, view.unit)
            longest[key] = max(longest.get(key, view), view, key=lambda each: len(each.sentence()))
    assert len(longest) >= 5
    for number, view in enumerate(longest.values()):
        plot_fit([view], tmp_path / f"{number}.png", title=view.effect.name, foot="", force=False)
    check_legible(canvases)


@pytest.mark.slow
@pytest.mark.rare(instead="test_every_effect_has_a_view_and_the_longest_over_each_axis_is_legible")
def test_every_effect_of_the_catalogue_can_be_drawn(tmp_path: Path, canvases: list[Canvas]) -> None:
    problem = Problem.of(readings("edge"))
    base = fit(problem)
    for effect in catalogue().values():
        if effect.baseline == "colour-points":
            view = View.of(problem, family(base, effect).best.fit.terms, effect)
            path = tmp_path / f"{effect.name}.png"
            plot_fit([view], path, title=effect.name, foot="", force=False)
    check_legible(canvases)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ((0, 0, 0), "black"),
        ((1, 1, 1), "white"),
        ((0.5, 0.5, 0.5), "grey 0.5"),
        ((0, 1, 0), "green"),
        ((0, 0.45, 0), "green 0.45"),
        ((0.6, 0.6, 0), "yellow 0.6"),
        ((1, 0, 1), "magenta"),
        ((0.594, 0.312, 0.36), "0.59 0.31 0.36"),
        ((0.5, 0.2, 0), "0.5 0.2 0"),
    ],
)
def test_patches_have_names(code: tuple[float, float, float], name: str) -> None:
    assert patch_name(np.array(code, dtype=float)) == name


@pytest.fixture(autouse=True)
def no_pyplot() -> Iterator[None]:
    """Check that no drawing imports pyplot's global state."""
    before = "matplotlib.pyplot" in sys.modules
    yield
    assert ("matplotlib.pyplot" in sys.modules) == before


def test_a_title_is_never_broken_within_a_number() -> None:
    for letters in range(12, 40):
        lines = _wrapped("the exponent changes by 15 % by 18 000 h at 120 000 lx", letters, 6)
        assert all(not line.startswith("000") for line in lines)
