"""A session whose light changes during the session: reported in words, even if its repeats alone look like noise."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.compare.drift import drifts
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.problem import Problem
from lutgen.effects import catalogue
from tests.command import Done, words
from tests.generators.meters import METERS
from tests.generators.ours import campaign
from tests.generators.table import table
from tests.native_displays import BLACK, GREYS, RAMPS, TIPS, Panel, session, write
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

pytestmark = [pytest.mark.numbers, pytest.mark.usefixtures("fitted_once")]

WHITE = (1.0, 1.0, 1.0)
MIXTURES = [tuple(code) for code in np.round(np.random.default_rng(7).uniform(0.05, 1.0, (60, 3)), 3).tolist()]
CODES = [*TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES]


def measured(
    course: Callable[[Array], Array], repeats: int = 3, noise: float = 0.001, hours: tuple[float, ...] = (0.0,)
) -> Measurements:
    """Sessions in random order, with ``repeats`` more whites at even steps. Their light follows a course over 0..1."""
    random = np.random.default_rng(11)
    codes = [CODES[place] for place in random.permutation(len(CODES))]
    for place in np.linspace(0, len(codes) + repeats - 1, repeats).round().astype(int):
        codes.insert(place, WHITE)
    read = session(Panel(), codes, hours=hours)
    light = np.tile(course(np.linspace(0.0, 1.0, len(codes))), len(hours))
    light *= 1.0 + noise * random.standard_normal(read.hours.size)
    return replace(read, xyz_cd_m2=read.xyz_cd_m2 * light[:, np.newaxis])


def warms_up(place: Array) -> Array:
    return 1.0 + 0.1 * place


def dims_at_once(place: Array) -> Array:
    return np.where(place > 0.5, 0.88, 1.0)


COURSES: dict[Callable[[Array], Array], float] = {warms_up: 0.1, dims_at_once: -0.12}


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("repeats", [3, 8])
def test_a_drift_is_told_by_repeated_patches(course: Callable[[Array], Array], repeats: int) -> None:
    (drift,) = drifts(Problem.of(measured(course, repeats)))
    assert drift.change == pytest.approx(COURSES[course], rel=0.3)
    assert (drift.hour, drift.code) == (0.0, WHITE)


def test_noise_is_no_drift() -> None:
    assert drifts(Problem.of(measured(np.ones_like, repeats=3, noise=0.003))) == ()
    assert drifts(Problem.of(measured(np.ones_like, repeats=8, noise=0.01))) == ()
    assert drifts(Problem.of(measured(np.ones_like, repeats=3, noise=0.01), instrument="0.01,0.01")) == ()


@pytest.mark.parametrize("course", [np.ones_like, warms_up])
def test_photon_noise_of_dim_patches_is_no_drift(course: Callable[[Array], Array]) -> None:
    """Greys at a fifteenth of white's light scatter by 1.5 %, whites by 0.4 %. A common drift is still reported."""
    random = np.random.default_rng(12)
    codes = [*CODES, *[(0.3, 0.3, 0.3), WHITE] * 12]
    codes = [codes[place] for place in random.permutation(len(codes))]
    trials = []
    for _ in range(8):
        exact = session(Panel(), codes, hours=(0.0,))
        light = exact.xyz_cd_m2 * course(np.linspace(0.0, 1.0, len(codes)))[:, np.newaxis]
        noise = np.sqrt(0.0025 * light) * random.standard_normal(light.shape)
        trials.append(drifts(Problem.of(replace(exact, xyz_cd_m2=light + noise))))
    assert [len(each) for each in trials] == [int(course is warms_up)] * 8


def test_one_reading_that_slipped_is_no_drift() -> None:
    steady = measured(np.ones_like, repeats=8)
    (whites,) = np.nonzero((steady.drive == 1.0).all(axis=1))
    light = steady.xyz_cd_m2.copy()
    light[whites[4]] *= 1.3
    assert drifts(Problem.of(replace(steady, xyz_cd_m2=light))) == ()


def test_the_column_order_counts_and_not_the_rows() -> None:
    """The largest change is the change of the last reading in time, wherever its row stands."""
    read = measured(warms_up)
    order = np.arange(float(read.hours.size))
    shuffled = np.random.default_rng(3).permutation(read.hours.size)
    moved = replace(
        read, drive=read.drive[shuffled], xyz_cd_m2=read.xyz_cd_m2[shuffled], lines=read.lines[shuffled],
        order=order[shuffled],
    )  # fmt: skip
    assert drifts(Problem.of(moved)) == drifts(Problem.of(replace(read, order=order)))


@pytest.mark.parametrize("baseline", mostly_slow(["native", "native-first-hour"], "native"))
def test_a_model_that_agrees_with_a_drift_is_not_praised(baseline: str) -> None:
    comparison = compare(measured(dims_at_once), baseline=baseline)
    assert comparison.agrees
    assert "as well as they repeat, but they drift" in comparison.sentence()
    steady = compare(measured(np.ones_like), baseline=baseline)
    assert steady.agrees
    assert "drift" not in steady.sentence()


def test_diagnose_doubts_the_measurement_before_the_display() -> None:
    diagnosis = diagnose(measured(warms_up), baseline="native")
    assert diagnosis.verdict.name == "measurement-problem"
    assert "luminance changed within the session at 0 h by +" in diagnosis.verdict.sentence
    assert any("Luminance changed within the session at 0 h" in each for each in diagnosis.verdict.remarks)


def test_an_effect_that_no_drift_hides_is_named() -> None:
    """A drift of 4 % cannot explain black's light, which has grown eightfold."""
    read = measured(lambda place: 1.0 + 0.04 * place, hours=(0.0, 5000.0))
    leaked = np.where(read.hours > 0, 0.02, 0.0)[:, np.newaxis] * read.xyz_cd_m2.max(axis=0)
    others = sorted({*catalogue()} - {"black-level", "meter-offset", "meter-drift", "backlight-decay", "eotf-drift"})
    diagnosis = diagnose(replace(read, xyz_cd_m2=read.xyz_cd_m2 + leaked), baseline="native", without=others)
    assert drifts(diagnosis.problem)
    assert "black-level" in diagnosis.verdict.effects


def test_compare_names_the_reading(tmp_path: Path, run: Callable[..., Done]) -> None:
    write(measured(dims_at_once), tmp_path / "drifts.csv")
    page = words(run("compare", "drifts.csv", "--baseline", "native").out)
    content = json.loads(run("compare", "drifts.csv", "--baseline", "native", "--json", "-").out)
    validator("compare").validate(content)
    (drift,) = content["drifts"]
    assert f"code 1, 1, 1, read again in {drift['line']}, changed by {100 * drift['change']:+.1f} %." in page


def test_slips_of_an_instrument_with_heavy_tails_are_no_drift() -> None:
    """The last white of a session is an outlier of 5 %: with such an instrument the display's light need not change."""
    truth = campaign(711052289, {}, design="full", habits=2)
    text = table(truth, METERS["heavy-tails"].read(truth, 711052289))
    assert diagnose(read(text, file="healthy.csv", sha256="")).verdict.name == "consistent"
