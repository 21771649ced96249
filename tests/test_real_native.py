"""The X61 of 2017 and 2020 with its own model: aged and unaged properties, and the duration of a diagnosis.

Its sessions have dates but no hours. This file states 0 and 8000 h, which nobody counted.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import pytest
from colour import LUT3D, write_LUT

from lutgen.criticism.compare.comparison import Comparison, compare
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.refine import Course
from lutgen.readings.formats import campaign
from lutgen.readings.formats._source import FileText
from tests.real_data import real_data

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.readings import Measurements

pytestmark = [pytest.mark.numbers, pytest.mark.slow]

#: Stated hours, not counted hours.
STATED_H = (0.0, 8000.0)

AGED = ("ThinkPad_X61*2017-04-19_15-14", "ThinkPad_X61*2020-05-26_15-02")
NULL = ("ThinkPad_X61*2020-05-26_13-57", "ThinkPad_X61*2020-05-26_15-02")


def sessions(*patterns: str) -> Measurements:
    blocks = ["schema = 1"]
    for pattern, hours in zip(patterns, STATED_H, strict=False):
        (file,) = (real_data() / "real").glob(f"*/{pattern}*")
        blocks.append(f'[[sessions]]\nfile = "{file}"\nhours = {hours}')
    return campaign.read(FileText("\n".join(blocks), "x61.toml", "")).measurements()


@cache
def compared(patterns: tuple[str, ...], baseline: str) -> Comparison:
    return compare(sessions(*patterns), baseline=baseline)


def test_each_baseline_is_nearer_than_the_one_that_knows_less() -> None:
    paper, native = compared(AGED, "colour-points"), compared(AGED, "native")
    foretold = compared(AGED, "native-first-hour")
    assert paper.error.delta_e_mean > 1.3
    assert foretold.error.delta_e_mean == pytest.approx(1.65, rel=0.05)
    assert native.error.delta_e_mean == pytest.approx(0.357, rel=0.05)


def test_the_null_pair_is_foretold_by_its_first_session() -> None:
    assert compared(NULL, "native").error.delta_e_mean == pytest.approx(0.242, rel=0.05)
    assert compared(NULL, "native-first-hour").error.delta_e_mean == pytest.approx(0.334, rel=0.05)


@pytest.mark.parametrize("baseline", ["native", "native-first-hour"])
@pytest.mark.rare(instead="test_the_null_pair_is_foretold_by_its_first_session")
def test_nothing_ages_within_a_day_but_a_sessions_gain(baseline: str) -> None:
    diagnosis = diagnose(sessions(*NULL), baseline=baseline)
    assert (diagnosis.verdict.name, diagnosis.verdict.effects) == ("consistent", ())


def test_the_calibration_of_2020_is_known_and_no_aging() -> None:
    """With white and primaries of 2020 the residuals are only those of the own model of 2017."""
    (known,) = compared(AGED, "native").problem.known
    (sentence,) = known.sentences()
    assert "blue raised from 0.916 to 0.936" in sentence
    diagnosis = diagnose(sessions(*AGED), baseline="native")
    assert (diagnosis.verdict.name, diagnosis.verdict.effects) == ("consistent", ())
    assert diagnosis.after.error.delta_e_mean < 0.37
    assert diagnosis.after.error.delta_e_mean < 1.2 * diagnosis.after.floor.delta_e_mean


@pytest.mark.rare(instead="test_the_calibration_of_2020_is_known_and_no_aging")
def test_a_calibration_that_no_file_holds_is_a_changed_curve() -> None:
    readings = replace(sessions(*AGED), calibrations={})
    diagnosis = diagnose(readings, baseline="native")
    assert (diagnosis.verdict.name, diagnosis.verdict.effects) == ("one-of", ("recalibration", "eotf-drift"))
    assert diagnosis.after.error.delta_e_mean < 0.75 * diagnosis.comparison.error.delta_e_mean


@pytest.mark.rare(instead="test_the_calibration_of_2020_is_known_and_no_aging")
def test_black_blues_curve_and_the_recalibration_of_2020_bring_the_error_down() -> None:
    """The own model of 2017 has 413 readings, the null pair's model 825: with half of the 825 its error is 0.26."""
    course = Course.of(sessions(*AGED), baseline="native")
    refinement = course.refinement(["black-level", "channel-gamma", "recalibration"])
    assert refinement.improves
    assert refinement.after.error.delta_e_mean < 0.31
    assert refinement.after.error.delta_e_mean < 0.86 * refinement.before.error.delta_e_mean


@pytest.mark.rare(instead="test_the_calibration_of_2020_is_known_and_no_aging")
def test_what_the_cells_do_with_the_drive_brings_it_to_the_null_pairs() -> None:
    """Each session has its own curves, leaks between channels, and channels whose colour changes with the drive."""
    course = Course.of(sessions(*AGED), baseline="native")
    refinement = course.refinement(["black-level", "recalibration", "channel-gamma", "primary-shift", "crosstalk"])
    assert refinement.improves
    assert refinement.after.error.delta_e_mean < 1.2 * compared(NULL, "native").error.delta_e_mean


@pytest.mark.parametrize(
    ("later", "named"), [(AGED[1], ("phosphor-wear",)), (NULL[0], ("phosphor-wear", "drive-loss"))]
)
@pytest.mark.rare(instead="test_the_calibration_of_2020_is_known_and_no_aging")
def test_the_light_source_has_worn_by_2020_and_the_error_falls_to_the_null_pairs(
    later: str, named: tuple[str, ...]
) -> None:
    """In one of the sessions of 2020 the channels also get a little less drive than their calibration explains."""
    diagnosis = diagnose(sessions(AGED[0], later), baseline="native-first-hour")
    assert diagnosis.verdict.effects == named
    assert diagnosis.comparison.error.delta_e_mean > 1.4
    assert diagnosis.after.error.delta_e_mean < 1.2 * compared(NULL, "native-first-hour").error.delta_e_mean


@pytest.mark.parametrize("pattern", ["DELL_P2715Q_20220226", "LG_ULTRAWIDE_20220226"])
def test_the_last_level_below_a_clipped_end_is_not_misread(pattern: str) -> None:
    """The light of some ramps is constant from code 240 of 255 upwards."""
    assert diagnose(sessions(pattern), baseline="native").verdict.name == "consistent"


#: Largest permitted duration of a diagnosis in units, by the session's pattern: 825 readings and 175.
LONGEST = (("ThinkPad_X61*2020-05-26_15-02", 80), ("U2718Q__2_2017-12-05", 25))


@pytest.mark.parametrize(("pattern", "most"), LONGEST)
def test_a_diagnosis_takes_no_longer_than_so_many_tables_to_write(pattern: str, most: int, tmp_path: Path) -> None:
    """One run measures both: the processor time, and the processor time of ``colour.write_LUT`` of 33³ as unit."""
    readings, units = sessions(pattern), []
    for _ in range(5):
        start = time.process_time()
        write_LUT(LUT3D(size=33), str(tmp_path / "unit.cube"))
        units.append(time.process_time() - start)
    start = time.process_time()
    diagnose(readings, baseline="native")
    assert time.process_time() - start <= most * min(units)
