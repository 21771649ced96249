"""Simulated campaigns with effects that depend on conditions, by separate formulas: a diagnosis names the effects."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lutgen.criticism.diagnose import diagnose
from lutgen.effects import catalogue
from lutgen.readings import read_measurements
from tests.virtual_display.campaign import Campaign, header, table
from tests.virtual_display.display import xyz_at_eye
from tests.virtual_display.instrument import NOISE
from tests.virtual_display.physics.effect import code_to_linear, linear_to_code

if TYPE_CHECKING:
    from pathlib import Path

    from tests.virtual_display.readings import Readings

pytestmark = pytest.mark.numbers

REFERENCE_C = 25.0


def warm_curve(campaign: Campaign) -> Any:
    """The light of each channel to a power that grows by 0.005 per kelvin. Blank temperatures mean rest."""
    readings = campaign.readings
    warmer = np.nan_to_num(readings.temperature_c - REFERENCE_C)[:, np.newaxis]
    drive = linear_to_code(code_to_linear(readings.drive) ** (1.0 + 0.005 * warmer))
    return xyz_at_eye(campaign.panel, replace(readings, drive=drive), (), seed=campaign.seed)


def dimmed(campaign: Campaign) -> Any:
    """A backlight that falls as 1/(1 + 0.3·darkness²), where darkness is 1 − the screen's mean code value."""
    readings = campaign.readings
    own = readings.drive.mean(axis=1)
    mean = readings.window * own + (1.0 - readings.window) * readings.surround
    factor = (1.0 + 0.3 * (1.0 - own) ** 2) / (1.0 + 0.3 * (1.0 - mean) ** 2)
    return xyz_at_eye(campaign.panel, readings, (), seed=campaign.seed) * factor[:, np.newaxis]


def text(campaign: Campaign, xyz: Any, readings: Readings) -> str:
    """The campaign as a table, with the noise of its instrument."""
    session = np.unique(readings.hours, return_inverse=True)[1]
    read = NOISE[campaign.noise].read(xyz, session, np.random.default_rng([campaign.seed, 0x501]))
    return table(readings, read, header(campaign), conditions=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "plant", "verdicts"),
    [("temperature-gamma", warm_curve, {"named"}), ("dynamic-contrast", dimmed, {"named", "form"})],
)
def test_it_is_named(name: str, plant: Any, verdicts: set[str], tmp_path: Path) -> None:
    campaign = Campaign(seed=970)
    file = tmp_path / "readings.csv"
    file.write_text(text(campaign, plant(campaign), campaign.readings), encoding="utf-8")
    verdict = diagnose(read_measurements(file)).verdict
    assert (verdict.effects, verdict.name in verdicts) == ((name,), True)


@pytest.mark.parametrize("name", ["temperature-gamma", "dynamic-contrast"])
def test_without_its_column_no_campaign_has_it_for_a_candidate(name: str, tmp_path: Path) -> None:
    """The design ``colours`` logs no conditions: the effect is listed as an effect that these readings cannot show."""
    campaign = Campaign(seed=971, design="colours", hours=(0.0, 9000.0, 18_000.0))
    file = tmp_path / "readings.csv"
    readings = campaign.readings
    xyz = xyz_at_eye(campaign.panel, readings, (), seed=campaign.seed)
    file.write_text(table(readings, xyz, header(campaign), conditions=False), encoding="utf-8")
    known = catalogue()
    some = {each: known[each] for each in (name, "black-level")}
    rows = {row.effect: row.visible for row in diagnose(read_measurements(file), effects=some).visibility}
    assert rows == {name: False, "black-level": True}


@pytest.mark.slow
def test_two_effects_that_readings_of_their_own_prove_are_named_although_a_formula_leaves_more_than_one_explains(
    tmp_path: Path,
) -> None:
    """The light at the places follows no formula: what a dim edge leaves is nearly as large as a cold start."""
    campaign = Campaign(seed=5, hidden=(("edge-falloff", 0.12, "other"), ("warm-up", 0.03, "same")))
    readings = campaign.readings
    light = xyz_at_eye(campaign.panel, readings, campaign.hidden, seed=campaign.seed)
    wave = 0.02 * np.sin(9.0 * readings.u) * np.sin(7.0 * readings.v) * ((readings.u != 0.5) | (readings.v != 0.5))
    file = tmp_path / "places.csv"
    file.write_text(text(campaign, light * (1.0 + wave)[:, np.newaxis], readings), encoding="utf-8")
    verdict = diagnose(read_measurements(file)).verdict
    assert (verdict.name, {*verdict.effects}) == ("several", {"edge-falloff", "warm-up"}), verdict.sentence
