"""The covariance of a fit's estimates: against a slow twin, through a model file, and in random draws from it."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

import lutgen
from lutgen.criticism.fit.joint_covariance import joint_covariance
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term, predict, whiten
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.refine import Refinement, refine
from lutgen.display import load_model, save_model
from lutgen.display.fitted import FitCovariance
from lutgen.effects import catalogue
from lutgen.errors import LutgenError
from lutgen.pictures.difference import drawn
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

HOURS = (0.0, 6000.0, 18_000.0)


def text(gain: float = 0.0) -> str:
    hidden = (("black-level", 0.0016, "same"),)
    table = csv_text(Campaign(design="colours", hours=HOURS, seed=3, hidden=hidden))
    stated = next(line for line in table.splitlines() if "session_gain" in line)
    return table.replace(stated, f"# session_gain: {gain}")


@cache
def solution_of(baseline: str, gain: float = 0.0) -> Fit:
    problem = Problem.of(read(text(gain), file="hidden.csv", sha256="1" * 64), baseline=baseline)
    return fit(problem, [Term.at_rest(catalogue()["black-level"], ("grown", "new"))])


def twin(of: Fit, scale: float = 1e-4) -> Array:
    """Inverse of the normal equations of all unknowns together, by differences: parameters, tips, and gains."""
    problem, (term,) = of.problem, of.terms
    tips = of.tips if not problem.from_first_hour else of.tips[:1]

    def at(unknowns: Array) -> Array:
        there = term.moved(unknowns[:2].tolist())
        here = unknowns[2 : 2 + tips.size].reshape(tips.shape)
        gains = unknowns[2 + tips.size :]
        state = State((there,), np.broadcast_to(here, of.tips.shape), gains if gains.size else of.gains)
        readings = whiten(problem, predict(problem, state)).ravel()
        return np.concatenate([readings, gains / max(problem.noise.session, 1e-6)])

    gains = of.gains if (problem.gains >= 0).any() else of.gains[:0]
    middle = np.concatenate([[term.values[name] for name in term.free], tips.ravel(), gains])
    step = scale * np.concatenate([[1e-2, 1e-2], tips.ravel(), np.full(gains.size, 1.0)])
    jacobian = np.array([(at(middle + step * one) - at(middle - step * one)) / 2.0 for one in np.eye(middle.size)])
    jacobian /= step[:, np.newaxis]
    return np.asarray(np.linalg.inv(jacobian @ jacobian.T))[: 2 + tips.size, : 2 + tips.size]


@pytest.mark.parametrize("baseline", ["colour-points", "first-hour"])
def test_it_is_the_inverse_of_the_normal_equations(baseline: str) -> None:
    known, expected = joint_covariance(solution_of(baseline)), twin(solution_of(baseline))
    assert known.of == (("black-level", "grown"), ("black-level", "new"))
    assert known.hours == (1 if baseline == "first-hour" else len(HOURS))
    size = np.sqrt(np.diagonal(expected))
    np.testing.assert_allclose(known.matrix / np.outer(size, size), expected / np.outer(size, size), atol=2e-3)
    # A leak from the first hour and a growing leak are anticorrelated. X, Y and Z of a reading share noise.
    correlation = known.matrix / np.outer(size, size)
    assert correlation[0, 1] < -0.3
    assert correlation[2, 3] > 0.3


def test_a_gain_that_the_file_states_moves_all_tips_of_an_hour_together() -> None:
    plain, gained = (joint_covariance(solution_of("colour-points", gain)) for gain in (0.0, 0.01))
    tips = solution_of("colour-points", 0.01).tips
    more = (gained.matrix - plain.matrix)[2:, 2:]
    own = np.outer(tips[1], tips[1]) * 0.01**2
    np.testing.assert_allclose(more[12:24, 12:24], own, rtol=0.05, atol=1e-3 * own.max())
    np.testing.assert_allclose(more[:12, 12:24], 0.0, atol=1e-3 * own.max())


@cache
def refined(folder: Path) -> Refinement:
    (folder / "hidden.csv").write_text(text())
    return refine(lutgen.read_measurements(folder / "hidden.csv"), ["black-level"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("covariance")


def test_a_model_file_keeps_it(folder: Path) -> None:
    model = refined(folder).model
    save_model(model, folder / "mine.toml")
    loaded = load_model(folder / "mine.toml")
    assert model.covariance is not None
    assert loaded.covariance == model.covariance
    content = tomllib.loads((folder / "mine.toml").read_text(encoding="utf-8"))["covariance"]
    assert content["of"] == [f"black-level.{name}" for _, name in model.covariance.of]
    assert [len(row) for row in content["rows"]] == list(range(1, len(model.covariance.matrix) + 1))
    estimates = model.effects[0].estimates
    for place, (_, name) in enumerate(model.covariance.of):
        assert content["rows"][place][place] ** 0.5 == pytest.approx(estimates[name].stderr, rel=1e-5)
    save_model(loaded, folder / "again.toml")
    assert (folder / "again.toml").read_bytes() == (folder / "mine.toml").read_bytes()


def test_what_is_drawn_scatters_by_it(folder: Path) -> None:
    model = refined(folder).model
    assert model.covariance is not None
    assert model.latent is not None
    middle = np.concatenate(
        [[model.effects[0].values[name] for _, name in model.covariance.of], model.latent.xyz_cd_m2.ravel()]
    )
    models = drawn(model, 600)
    draws = np.array(
        [
            [
                *(each.effects[0].values[name] for _, name in model.covariance.of),
                *(each.latent.xyz_cd_m2.ravel() if each.latent else ()),
            ]
            for each in models
        ]
    )
    size = np.sqrt(np.diagonal(model.covariance.matrix))
    np.testing.assert_allclose((draws - middle).T @ (draws - middle) / 600 / np.outer(size, size),
                               model.covariance.matrix / np.outer(size, size), atol=0.2)  # fmt: skip


def test_a_bound_stops_a_parameter_and_what_follows_it() -> None:
    known = FitCovariance((("leak", "new"),), np.eye(13) + 0.9 * (np.ones((13, 13)) - np.eye(13)))
    random = np.random.default_rng(1)
    drawn_ones = [known.drawn(random, np.array([0.0]), np.array([np.inf])) for _ in range(2000)]
    off = np.array([held[0] for held, _ in drawn_ones])
    tips = np.array([tips for _, tips in drawn_ones])
    assert (off >= 0.0).all()
    assert (off == 0.0).mean() == pytest.approx(0.5, abs=0.05)
    # With the parameter at its bound, the tips scatter only by their part that is independent of the parameter.
    np.testing.assert_allclose(tips[off == 0.0].mean(axis=0), 0.0, atol=0.06)
    np.testing.assert_allclose(tips[off == 0.0].std(axis=0), (1 - 0.81) ** 0.5, rtol=0.1)


@pytest.mark.parametrize(
    ("of", "matrix", "says"),
    [
        ((), np.eye(5), "of 5 rows, 5 are not of parameters. White and primaries need 12 rows for each hour"),
        ((("a", "b"),), np.zeros((0, 0)), "1 parameters need 1 rows and columns"),
        ((("a", "b"),), np.array([[np.nan]]), "all numbers must be finite"),
        ((("a", "b"), ("a", "c")), np.array([[1.0, 2.0], [2.0, 1.0]]), "larger than the errors"),
        ((("a", "b"),), np.array([[-1.0]]), "larger than the errors"),
    ],
)
def test_what_is_no_covariance_is_refused(of: tuple[tuple[str, str], ...], matrix: Array, says: str) -> None:
    with pytest.raises(LutgenError, match=says):
        FitCovariance(of, matrix)


def test_a_covariance_of_another_model_is_refused() -> None:
    free = {("black-level", "new"), ("black-level", "grown")}
    with pytest.raises(LutgenError, match=r"\[covariance\]: leak\.new is not a fitted parameter"):
        FitCovariance((("leak", "new"),), np.eye(1)).check(free, 3)
    with pytest.raises(LutgenError, match="it holds white and primaries of 1 hours, but 3 are fitted"):
        FitCovariance((), np.eye(12)).check(free, 3)
    with pytest.raises(LutgenError, match=r"black-level\.new is there twice"):
        FitCovariance((("black-level", "new"),) * 2, np.eye(2)).check(free, 3)


def test_without_an_effect_its_parameters_are_drawn_no_more(folder: Path) -> None:
    model = refined(folder).model
    bare = replace(model, effects=())
    assert model.covariance is not None
    few = model.covariance.among(bare.fitted)
    assert few.of == ()
    np.testing.assert_array_equal(few.matrix, model.covariance.matrix[-36:, -36:])
    assert all(each.effects == () for each in drawn(bare, 3))
