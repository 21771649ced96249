"""Every built-in effect keeps the contract."""

from __future__ import annotations

import re
import zlib
from dataclasses import fields, replace

import numpy as np
import pytest

from lutgen.display.trace import in_chain_order, panel, reported
from lutgen.effects import Effect, catalogue
from lutgen.effects.clause import in_words
from tests.effect_scenes import TIPS, N, Term, lively, scene_of, signal_of

pytestmark = pytest.mark.numbers

EFFECTS = tuple(catalogue().values())
NAMES = tuple(catalogue())


def random_values(effect: Effect, rng: np.random.Generator) -> dict[str, float]:
    """A point within the bounds."""
    return {name: float(rng.uniform(*parameter.bounds)) for name, parameter in effect.parameters.items()}


def seed_of(effect: Effect) -> int:
    return zlib.crc32(effect.name.encode())


@pytest.mark.parametrize("effect", EFFECTS, ids=NAMES)
class TestContract:
    def test_it_is_documented(self, effect: Effect) -> None:
        assert 20 < len(effect.summary) < 120
        assert effect.text.count("\n") >= 3
        assert effect.function.__doc__
        assert effect.source
        assert effect.origin == "built-in"
        for parameter in effect.parameters.values():
            assert len(parameter.meaning) > 10

    def test_what_it_is_confused_with_exists(self, effect: Effect) -> None:
        assert set(effect.confused_with or {}) <= set(NAMES) - {effect.name}
        assert all(len(text) > 10 for text in (effect.confused_with or {}).values())

    def test_its_forms_are_few_and_free_everything(self, effect: Effect) -> None:
        assert len(set(map(frozenset, effect.forms))) == len(effect.forms) <= 10
        assert max(map(len, effect.forms)) <= 12
        assert 1 <= effect.refined <= len(effect.forms)
        # A start that the baseline determines is no unknown.
        names = {name for name, each in effect.parameters.items() if each.beside_first and each.grid != "gaps"}
        assert {name for form in effect.forms for name in form} == set(effect.parameters) - names
        for form in effect.forms:
            # A search starts where the effect is zero: without an amplitude the search would stay there.
            assert effect.stage == "selection" or set(form) & set(effect.neutral)

    def test_its_simple_forms_free_sizes_and_times_alone(self, effect: Effect) -> None:
        """Parameters of the formula's shape, such as a power, belong to the refined forms."""
        times = {"hour", "since", "early_h", "minutes", "headroom"}
        for form in effect.forms[: effect.refined]:
            assert set(form) <= {*effect.neutral, *times}

    def test_neutral_is_identity_whatever_the_shape(self, effect: Effect) -> None:
        if effect.stage == "selection":
            assert not effect.neutral
            return  # a selection has no neutral value; test_effects_formulas.py tests its output
        rng = np.random.default_rng(seed_of(effect))
        scene = scene_of()
        signal = signal_of(effect, scene)
        points = [effect.rest(), *(random_values(effect, rng) | dict(effect.neutral) for _ in range(20))]
        for values in points:
            np.testing.assert_allclose(effect.function(signal, scene, **values), signal, rtol=1e-12, atol=1e-12)

    @pytest.mark.parametrize("variants", [(), (12,), (2, 3)])
    @pytest.mark.parametrize("columns", [True, False])
    def test_shapes_broadcast(self, effect: Effect, variants: tuple[int, ...], *, columns: bool) -> None:
        scene = scene_of(columns=columns)
        signal = signal_of(effect, scene, variants)
        scene = replace(scene, white=np.broadcast_to(scene.white, (*variants, *scene.white.shape)))
        light = effect.function(signal, scene, **lively(effect))
        assert light.shape == signal.shape
        assert light.dtype == np.float64

    def test_variants_are_treated_alike(self, effect: Effect) -> None:
        scene = scene_of()
        signal = signal_of(effect, scene, (4,))
        if signal.ndim == signal_of(effect, scene).ndim:
            return  # codes and linear light have no variants
        light = effect.function(signal, scene, **lively(effect))
        for one, given in zip(light, signal, strict=True):
            np.testing.assert_array_equal(one, effect.function(given, scene, **lively(effect)))

    def test_one_hour_and_one_reading_will_do(self, effect: Effect) -> None:
        scene = scene_of(columns=False, hours=np.array([[9000.0]]), white=TIPS[:1])
        signal = signal_of(effect, scene)
        many = replace(scene, hours=np.full((N, 1), 9000.0), white=np.tile(TIPS[:1], (N, 1)))
        values = lively(effect)
        np.testing.assert_allclose(
            effect.function(signal, scene, **values), effect.function(signal, many, **values), rtol=1e-13
        )
        if effect.stage == "emission":  # a model has one set of tips an hour, for all colours
            light = effect.function(TIPS[np.newaxis], scene, **values)
            assert np.broadcast_shapes(light.shape, (N, 4, 3)) == (N, 4, 3)

    def test_it_is_finite_within_and_at_the_corners_of_its_bounds(self, effect: Effect) -> None:
        rng = np.random.default_rng(seed_of(effect))
        scene = scene_of()
        signal = signal_of(effect, scene)
        corners = [
            {name: float(rng.choice(parameter.bounds)) for name, parameter in effect.parameters.items()}
            for _ in range(150)
        ]
        low = {name: parameter.bounds[0] for name, parameter in effect.parameters.items()}
        high = {name: parameter.bounds[1] for name, parameter in effect.parameters.items()}
        one_by_one = [effect.typical() | {name: end} for name in low for end in (low[name], high[name])]
        inside = [random_values(effect, rng) for _ in range(50)]
        with np.errstate(all="raise", under="ignore"):
            for values in (low, high, *corners, *one_by_one, *inside):
                light = effect.function(signal, scene, **values)
                assert np.isfinite(light).all(), values
                if effect.stage in {"drive", "transfer", "mixing"}:
                    assert (light >= 0).all(), values

    def test_what_it_is_given_stays_untouched(self, effect: Effect) -> None:
        scene = scene_of()
        for each in fields(scene):
            value = getattr(scene, each.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        effect.function(signal_of(effect, scene), scene, **lively(effect))  # read-only arrays raise an error on a write

    def test_every_parameter_matters(self, effect: Effect) -> None:
        scene = scene_of(200)
        signal = signal_of(effect, scene)
        values = lively(effect)
        before = effect.function(signal, scene, **values)
        for name, parameter in effect.parameters.items():
            low, high = parameter.bounds
            moved = values[name] + (0.2 if values[name] < (low + high) / 2 else -0.2) * (high - low)
            after = effect.function(signal, scene, **values | {name: moved})
            assert np.abs(after - before).max() > 1e-5 * np.abs(before).max(), name

    def test_a_small_step_makes_a_small_difference(self, effect: Effect) -> None:
        rng = np.random.default_rng(seed_of(effect))
        scene = scene_of()
        signal = signal_of(effect, scene)
        for _ in range(5):
            values = random_values(effect, rng)
            for name, parameter in effect.parameters.items():
                if parameter.grid:
                    continue
                step = 1e-7 * (parameter.bounds[1] - parameter.bounds[0])
                there = effect.function(signal, scene, **values | {name: values[name] + step})
                here = effect.function(signal, scene, **values)
                np.testing.assert_allclose(there, here, rtol=1e-4, atol=1e-4 * np.abs(here).max())

    def test_without_its_columns_it_hides_behind_the_tips(self, effect: Effect) -> None:
        """With its columns at rest, the effect is only a factor per hour."""
        if not effect.needs:
            return
        seen = scene_of(hours=np.full((N, 1), 9000.0))
        rest = scene_of(columns=False, hours=np.full((N, 1), 9000.0))
        still = {name: getattr(rest, name) for name in effect.needs}
        signal = signal_of(effect, seen) + 1.0
        factor = effect.function(signal, replace(seen, **still), **lively(effect)) / signal
        np.testing.assert_allclose(factor, np.broadcast_to(factor[:1], factor.shape), rtol=1e-12)
        factor = effect.function(signal, seen, **lively(effect)) / signal
        assert np.ptp(factor, axis=0).max() > 1e-3

    def test_the_chain_runs_with_it(self, effect: Effect) -> None:
        scene = scene_of()
        tips = TIPS * np.random.default_rng(1).uniform(0.5, 1.0, size=(12, N, 1, 1))
        applied = [Term(effect, **lively(effect))]
        for selection in ("nearest", "continuous"):
            light = reported(applied, panel(applied, scene, selection), tips, scene)
            assert light.shape == (12, N, 3)
            assert np.isfinite(light).all()


def test_the_chain_runs_with_all_of_them_in_any_order() -> None:
    scene = scene_of()
    applied = [Term(each, **lively(each)) for each in EFFECTS]
    tips = np.broadcast_to(TIPS, (3, N, 4, 3))
    light = reported(applied, panel(applied, scene, "continuous"), tips, scene)
    again = reported(applied[::-1], panel(applied[::-1], scene, "continuous"), tips, scene)
    np.testing.assert_array_equal(light, again)
    assert [each.effect.name for each in in_chain_order(applied[::-1])] == list(NAMES)


def test_every_module_docstring_gives_its_equation() -> None:
    for effect in EFFECTS:
        if effect.name != "matrix-switching":
            assert re.search(r"[×→=]|exp", effect.text), effect.name


@pytest.mark.parametrize(
    ("name", "values", "says"),
    [
        ("black-level", {"new": 0.0022}, "black leaks 0.22 % of white"),
        ("black-level", {"grown": 0.003}, "black leaks 0.3 % of white by 18 000 h"),
        ("black-level", {"new": 6e-7, "grown": 0.003}, "black leaks 0.3 % of white by 18 000 h"),
        ("black-level", {"new": 0.0022, "grown": 0.0055}, "black leaks 0.22 % of white, growing to 0.77 % by 18 000 h"),
        ("black-level", {"new": 0.002, "grown": -0.001}, "black leaks 0.2 % of white, falling to 0.1 % by 18 000 h"),
        ("eotf-drift", {"level_25": 0.1}, "the transfer curve drifts"),
        ("quantization", {"bits": 8.0}, "code values are rounded to 8 bits"),
        ("quantization", {"bits": 6.0, "since": 4500.0}, "code values are rounded to 6 bits, since a time near 4500 h"),
        ("recalibration", {"hour": 4500.0, "red": 0.1}, "somebody recalibrated the display near 4500 h"),
        ("channel-gamma", {"red_new": 0.1, "blue_25": 0.1}, "the transfer curve of red and blue drifts"),
        ("temperature", {"slope": -0.003}, "light changes by -0.3 % per kelvin"),
        ("warm-up", {"amount": -0.047}, "a cold display gives 4.7 % more light"),
        ("drive-loss", {"new": -0.01, "grown": 0.03}, "pixels lose -1 % of their drive, growing to 2 % by 18 000 h"),
        ("yellowing", {"depth": 0.2}, "optics yellow"),
    ],
)
def test_an_effect_says_in_a_clause_what_it_does(name: str, values: dict[str, float], says: str) -> None:
    effect = catalogue()[name]
    assert in_words(effect, effect.rest() | values) == says


def test_a_size_is_told_at_the_last_session() -> None:
    leak = catalogue()["black-level"]
    values = leak.rest() | {"new": 0.001, "grown": 0.004, "power": 2.0}
    assert in_words(leak, values, (0.0, 4500.0, 9000.0)) == "black leaks 0.1 % of white, growing to 0.2 % by 9 000 h"
    assert in_words(leak, values, (0.0,)) == "black leaks 0.1 % of white, growing to 0.5 % by 18 000 h"


def test_a_date_is_told_as_the_gap_between_two_sessions() -> None:
    recalibration = catalogue()["recalibration"]
    values = recalibration.rest() | {"hour": 11_000.0, "gamma": 0.1}
    assert in_words(recalibration, values, (0.0, 8500.0, 13_500.0)) == (
        "somebody recalibrated the display between 8500 and 13500 h"
    )


def test_every_clause_can_be_said() -> None:
    for effect in catalogue().values():
        assert in_words(effect, effect.typical())
        assert "{" not in in_words(effect, effect.rest())
