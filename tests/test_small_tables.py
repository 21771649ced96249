"""Verdicts on small tables written by literal formulas: two causes at once, and causes that begin or differ by session.

No generator of campaigns is used: every table comes from one expression of this file.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

import colour
import numpy as np
import pytest

from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.refine import refine
from lutgen.effects import catalogue
from lutgen.report.comparison import compare_page
from lutgen.report.diagnosis import diagnose_page, refine_page
from tests.quick import mostly_slow
from tests.readings_text import read

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.criticism.diagnose import Diagnosis

    Array = NDArray[np.float64]

pytestmark = pytest.mark.numbers

#: Light of white, 250 cd/m², and shares of red, green and blue in it.
WHITE = np.array([237.6, 250.0, 272.2])
SHARES = np.array([[0.434, 0.213, 0.018], [0.376, 0.715, 0.109], [0.190, 0.072, 0.873]])

#: Code values: white three times, greys, ramps, secondaries and mixtures.
CODES = np.array(
    [[1.0, 1.0, 1.0]] * 3
    + [[level] * 3 for level in (0.0, 0.0, 0.0, 0.2, 0.4, 0.5, 0.5, 0.5, 0.6, 0.8)]
    + [[level * (channel == at) for at in range(3)] for channel in range(3) for level in (0.25, 0.5, 0.75, 1.0)]
    + [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.8, 0.3, 0.6], [0.2, 0.7, 0.4]]
)

#: Chromaticity of white.
WHITE_XY = (WHITE / WHITE.sum())[:2]

HOURS = (0.0, 2600.0, 6400.0, 11_000.0, 17_500.0)


def light(codes: Array, power: Array | float = 1.0) -> Array:
    """XYZ of code values (n, 3) by sRGB's curve, raised to a power, and additive channels, (n, 3)."""
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4) ** power
    return np.asarray(linear @ (SHARES * WHITE))


def table(rows: Sequence[tuple[float, Array, Array, str]], columns: str, seed: int = 1) -> str:
    """Rows of hour, code value, true XYZ and further cells as CSV; the noise is 0.1 % of the light and 0.002 cd/m²."""
    rng = np.random.default_rng(seed)
    lines = [f"hour,R,G,B,X,Y,Z{columns}"]
    for hour, code, xyz, cells in rows:
        noisy = xyz * (1.0 + 0.001 * rng.standard_normal(3)) + 0.002 * rng.standard_normal(3)
        lines.append(",".join([f"{hour:g}", *(f"{value:g}" for value in code), *(f"{value:.5f}" for value in noisy)]))
        lines[-1] += cells
    return "\n".join(lines) + "\n"


@cache
def diagnosed(text: str, baseline: str = "colour-points") -> Diagnosis:
    """Return the diagnosis of a table."""
    return diagnose(read(text, file="table.csv", sha256=""), baseline=baseline)


#: Offsets of the sessions in cd/m².
ZEROS = (
    (0.006, -0.003, 0.004),
    (-0.005, 0.006, 0.001),
    (0.0, 0.01, -0.008, 0.004),
    (0.02, -0.015, 0.01, -0.02, 0.005),
    (0.004, 0.001, 0.03, 0.012, -0.02),
    (-0.008, 0.012, 0.003, 0.005, 0.0),
)


@pytest.mark.parametrize("capped", [False, True])
@pytest.mark.parametrize("zeros", ZEROS)
def test_a_zero_that_differs_between_sessions_is_no_leak(zeros: tuple[float, ...], capped: bool) -> None:
    """The offset has the colour of white, as a leak has; only its course in time is different."""
    rows = []
    for hour, zero in zip(HOURS, zeros, strict=False):
        offset = zero * WHITE / WHITE[1]
        rows += [(hour, code, xyz + offset, ",") for code, xyz in zip(CODES, light(CODES), strict=True)]
        rows += [(hour, np.zeros(3), offset, ",lens cap")] * (3 if capped else 0)
    diagnosis = diagnosed(table(rows, ",note"))
    assert diagnosis.verdict.effects == ()
    assert diagnosis.verdict.name == "consistent", diagnosis.verdict.sentence
    is_told = any("Black differs between sessions by" in remark for remark in diagnosis.verdict.remarks)
    assert is_told is not capped


def leaking(hour: float) -> Array:
    """A leak of 0.04 % of white that grows by 0.08 % along a saturating course."""
    return np.asarray(WHITE * (0.0004 + 0.0008 * (1.0 - np.exp(-hour / 12_000.0)) / (1.0 - np.exp(-1.5))))


@pytest.mark.parametrize(
    ("every", "effects"), [(4, {"black-level", "meter-offset"}), (2, {"black-level"}), (1, {"black-level"})]
)
def test_a_leak_that_grows_smoothly_is_a_leak(every: int, effects: set[str]) -> None:
    """Two, three or five sessions; the leak differs between them as the zero of a very poor meter does."""
    hours = HOURS[::every]
    rows = [
        (hour, code, xyz + leaking(hour), "") for hour in hours for code, xyz in zip(CODES, light(CODES), strict=True)
    ]
    assert diagnosed(table(rows, "")).verdict.effects == tuple(sorted(effects))


def test_the_capped_lens_shows_an_offset_beside_a_leak() -> None:
    """The offset is a fiftieth of the leak's χ², and the leak alone explains 98 % of the misfit."""
    offset = np.array([0.02, 0.025, 0.03])
    rows = []
    for hour in HOURS:
        leak = leaking(hour)
        rows += [(hour, code, xyz + leak + offset, ",") for code, xyz in zip(CODES, light(CODES), strict=True)]
        rows += [(hour, np.zeros(3), offset, ",lens cap")] * 3
    verdict = diagnosed(table(rows, ",note")).verdict
    assert (verdict.name, set(verdict.effects)) == ("several", {"black-level", "meter-offset"}), verdict.sentence


def in_a_lit_room(lux_of_shrouded: float) -> str:
    """Readings of a display that reflects 0.005 cd/m² per lux and leaks, at 0 and 600 lx, with shrouded readings."""
    greys = np.array([[level] * 3 for level in (0.0, 0.25, 0.5, 1.0)])
    rows = []
    for hour in HOURS[::2]:
        leak = leaking(hour)
        rows += [(hour, code, xyz + leak, ",0,") for code, xyz in zip(CODES, light(CODES), strict=True)]
        for lux in (60.0, 600.0):
            room = 0.005 * lux * WHITE / WHITE[1]
            rows += [(hour, c, xyz + leak + room, f",{lux:g},") for c, xyz in zip(greys, light(greys), strict=True)]
        rows += [(hour, np.zeros(3), leak, f",{lux_of_shrouded:g},shroud")] * 2
    return table(rows, ",ambient_lx,note")


def test_a_leak_shows_beside_a_reflection_that_is_a_hundred_times_stronger() -> None:
    verdict = diagnosed(in_a_lit_room(0.0)).verdict
    assert (verdict.name, set(verdict.effects)) == ("several", {"ambient-reflection", "black-level"}), verdict.sentence


def test_a_shroud_blocks_the_light_that_the_column_of_the_room_states() -> None:
    diagnosis, dark = (diagnosed(in_a_lit_room(lux)) for lux in (600.0, 0.0))
    assert diagnosis.verdict.sentence == dark.verdict.sentence
    remarks = diagnosis.problem.readings.remarks
    assert any("A shroud blocked the room's light at lines" in remark for remark in remarks)
    assert not dark.problem.readings.remarks


@cache
def at_temperatures(rest: float, others: tuple[float, ...], gamma: float) -> Diagnosis:
    """Return the diagnosis of a display whose light falls by 0.3 % per kelvin, and whose exponent changes too."""
    warm = np.array([[1.0, 1.0, 1.0], [0.5, 0.5, 0.5], [0.75, 0.75, 0.75], [1.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
    rows = []
    for hour in HOURS[::2]:
        for kelvin, codes in ((rest, CODES), *((other, warm) for other in others)):
            xyz = light(codes, 1.0 + gamma * (kelvin - 25.0)) * (1.0 - 0.003 * (kelvin - 25.0))
            rows += [(hour, code, each, f",{kelvin:g}") for code, each in zip(codes, xyz, strict=True)]
    return diagnosed(table(rows, ",temperature_c"))


def test_a_changed_curve_says_how_much_it_changes_a_colour() -> None:
    powers = {hour: np.array([1.0, 1.0, 1.0 + 0.08 * hour / 18_000.0]) for hour in HOURS}
    rows = [(hour, code, light(code, powers[hour]), "") for hour in HOURS for code in CODES]
    verdict = diagnosed(table(rows, "")).verdict
    assert verdict.effects == ("channel-gamma",)
    (said,) = re.findall(r"changes a colour by up to ([0-9.]+) ΔE2000 by 17\s500 h", verdict.sentence)
    first, last = (colour.XYZ_to_Lab(light(CODES, power) / 250.0, WHITE_XY) for power in (1.0, powers[17_500.0]))
    assert float(said) == pytest.approx(colour.delta_E(first, last, method="CIE 2000").max(), rel=0.05)


def test_exchanged_readings_are_named_and_left_out() -> None:
    """Each of the two wrong readings spoils the fit, so that neither contradicts it enough alone."""
    lights = {hour: light(CODES) for hour in HOURS}
    red, mixture = (CODES.tolist().index(code) for code in ([0.75, 0.0, 0.0], [0.8, 0.3, 0.6]))
    lights[6400.0][[red, mixture]] = lights[6400.0][[mixture, red]]
    rows = [(hour, code, xyz, "") for hour in HOURS for code, xyz in zip(CODES, lights[hour], strict=True)]
    readings = table(rows, "")
    verdict = diagnosed(readings).verdict
    first = 2 + 2 * len(CODES)
    comparison = compare(read(readings, file="table.csv", sha256=""))
    said = f"lines {first + red}, {first + mixture} (each holds what the other should hold)"
    assert verdict.name == "measurement-problem"
    assert said in verdict.sentence
    assert f"Readings were exchanged: {said}. The error" in str([*compare_page(comparison)])
    refinement = refine(read(readings, file="table.csv", sha256=""), ["eotf-drift"])
    left_out = f"Left out of the fit, because other readings contradict them: lines {first + red}, {first + mixture}."
    assert left_out in [*refine_page(refinement, catalogue(), "table.csv", None)]
    assert refinement.as_json()["left_out"] == [first + red, first + mixture]
    assert refinement.before.ratio < 1.5 < comparison.ratio


def test_all_colours_that_lose_the_same_light_at_once_are_no_wear_of_single_parts() -> None:
    """Another meter or a new setting. A formula with several parts and a free course in time fits a step best."""
    rows = [(hour, code, light(code) * (0.96 if hour > 10_000.0 else 1.0), "") for hour in HOURS for code in CODES]
    diagnosis = diagnosed(table(rows, ""), "first-hour")
    assert not {"phosphor-wear", "channel-decay", "yellowing"} & {*diagnosis.verdict.effects}, (
        diagnosis.verdict.sentence
    )
    assert diagnosis.verdict.name in {"one-of", "unexplained"}
    assert "mostly between 6400 and 11000 h" in " ".join(diagnosis.verdict.remarks)
    assert "lutgen sessions explain finds such changes" in " ".join(diagnosis.verdict.remarks)


def test_blacks_that_jump_by_more_than_a_meters_zero_does_are_not_consistent(tmp_path: Path) -> None:
    """Offsets of sessions would absorb the jump: without the capped lens nobody knows whether the display leaks."""
    rows = [(hour, code, light(code) + (hour > 10_000.0) * 0.3 * WHITE / 250.0, "") for hour in HOURS for code in CODES]
    text = table(rows, "")
    diagnosis = diagnosed(text)
    verdict = diagnosis.verdict
    assert (verdict.name, verdict.effects) == ("one-of", ("black-level", "ambient-reflection", "meter-offset"))
    assert re.search(r"(0|0\.00\d+) cd/m² at 6400 h, 0\.30?\d* cd/m² at 11000 h", verdict.sentence), verdict.sentence
    page = "\n".join(str(part) for part in diagnose_page(diagnosis, catalogue(), "table.csv --baseline native"))
    assert not re.search(r"could not have seen: .*ambient-reflection", page)
    assert "read black with the lens capped in every session" in page
    assert "lutgen sessions explain table.csv\n" in page
    lines = [str(part) for part in compare_page(diagnosis.comparison)]
    assert lines[1].startswith("Black differs between sessions by 0.")
    # A small zero that the instrument states leaves only the display.
    stated = tmp_path / "meter.toml"
    stated.write_text(
        'name = "meter"\nsource = "a test"\nrelative = [0.001, 0.001, 0.001]\nfloor_cd_m2 = 0.002\n'
        "dark_offset_cd_m2 = 0.002\n",
        encoding="utf-8",
    )
    verdict = diagnose(read(text, file="table.csv", sha256=""), instrument=str(stated)).verdict
    assert verdict.effects[0] == "black-level", verdict.sentence


@pytest.mark.parametrize(
    ("rest", "others"), mostly_slow([(each, (15.0, 20.0, 32.0, 38.0)) for each in (25.0, 22.0)], 22.0)
)
def test_light_and_curve_may_both_depend_on_the_temperature(rest: float, others: tuple[float, ...]) -> None:
    """White shows the light's change alone, since the curve leaves white; 20 °C and 22 °C are two temperatures."""
    diagnosis = at_temperatures(rest, others, 0.004)
    verdict = diagnosis.verdict
    assert (verdict.name, set(verdict.effects)) == ("several", {"temperature", "temperature-gamma"}), verdict.sentence


@pytest.mark.parametrize(("rest", "others"), [(25.0, (29.0, 30.0, 31.0, 32.0)), (23.0, (20.0, 26.0, 32.0))])
def test_set_temperatures_a_few_kelvins_apart_are_no_replicates(rest: float, others: tuple[float, ...]) -> None:
    diagnosis = at_temperatures(rest, others, 0.0)
    assert (diagnosis.verdict.name, diagnosis.verdict.effects) == ("named", ("temperature",)), (
        diagnosis.verdict.sentence
    )
    assert diagnosis.problem.noise.relative < 0.0015


@pytest.mark.parametrize("baseline", mostly_slow(["colour-points", "native"], "colour-points"))
def test_a_cable_with_fewer_bits_may_be_installed_in_the_middle_of_a_campaign(baseline: str) -> None:
    """From 6400 h on, codes are rounded to 6 bits; the display's own model of the first session has no steps."""
    levels = np.arange(0.0, 1.0001, 1.0 / 16.0)
    ramps = [[level * (channel == at) for at in range(3)] for channel in range(3) for level in levels[1:-1]]
    codes = np.concatenate([CODES, [[level] * 3 for level in levels[1:-1]], ramps])
    rounded = np.round(codes * 63.0) / 63.0
    rows = [
        (hour, code, xyz, "")
        for hour in HOURS
        for code, xyz in zip(codes, light(rounded if hour >= 6400.0 else codes), strict=True)
    ]
    verdict = diagnosed(table(rows, ""), baseline).verdict
    assert (verdict.name, verdict.effects) == ("named", ("quantization",)), verdict.sentence
    assert "rounded to 6 bits, since a time between 2600 and 6400 h" in verdict.sentence


@pytest.mark.slow
def test_a_refutation_asks_for_nothing_that_the_readings_hold() -> None:
    """Readings of the capped lens in several sessions have ruled out the meter's offset already."""
    rows = []
    for hour in HOURS:
        leak = leaking(hour)
        rows += [(hour, code, xyz + leak, ",") for code, xyz in zip(CODES, light(CODES), strict=True)]
        rows += [(hour, np.zeros(3), np.zeros(3), ",lens cap")] * 3
    with_cap, without = (
        "\n".join(map(str, diagnose_page(diagnosed(text), catalogue(), "")))
        for text in (table(rows, ",note"), table([row for row in rows if row[3] == ","], ",note"))
    )
    assert "to rule out ambient-reflection" in with_cap
    assert "to rule out meter-offset" not in with_cap
    assert "to rule out meter-offset: read with the lens capped" in without


#: Shares of X, Y and Z that a filter in front of red, green and blue leaves at 18 000 h: a yellow one, of no spectrum.
FILTER = np.array([[0.985, 0.985, 0.93], [0.975, 0.98, 0.94], [0.925, 0.955, 0.915]])


def faded(codes: Array, hour: float, loss: float, depth: float) -> Array:
    """Light of a display that fades evenly, by ``loss`` nepers at 18 000 h, behind a filter of ``depth``, (n, 3)."""
    tau = hour / 18_000.0
    primaries = SHARES * WHITE * FILTER ** (depth * tau)
    return np.asarray(np.exp(-loss * tau**1.3) * (light(codes) @ np.linalg.inv(SHARES * WHITE) @ primaries))


@pytest.mark.slow
@pytest.mark.parametrize(("loss", "depth"), [(0.8, 1.0), (0.5, 0.4)])
def test_an_even_fading_behind_a_yellow_filter_is_two_effects(loss: float, depth: float) -> None:
    """Effects of several sizes, as rates of three channels, fit as well: they fit what formulas miss."""
    rows = [(hour, code, faded(code, hour, loss, depth), "") for hour in HOURS for code in CODES]
    verdict = diagnosed(table(rows, ""), "first-hour").verdict
    assert (verdict.name, set(verdict.effects)) == ("several", {"backlight-decay", "yellowing"})


@pytest.mark.parametrize("loss", mostly_slow([0.6, 0.9], 0.6))
def test_an_even_fading_is_no_wear_of_phosphors(loss: float) -> None:
    """Where all chromaticities are constant, phosphors or channels would have to wear alike: this is a fading."""
    rows = [(hour, code, faded(code, hour, loss, 0.0), "") for hour in HOURS for code in CODES]
    verdict = diagnosed(table(rows, ""), "first-hour").verdict
    assert verdict.effects[0] == "backlight-decay"
    assert not {"phosphor-wear", "channel-decay", "yellowing"} & set(verdict.effects)


@pytest.mark.slow
@pytest.mark.parametrize(("bump", "leak"), [(0.006, 0.004), (0.004, 0.003), (0.008, 0.006)])
def test_a_small_leak_beside_a_changed_curve_is_a_second_effect(bump: float, leak: float) -> None:
    """A changed curve leaves black as it is, so that black shows the leak, however little the leak explains."""
    rows = [
        (hour, code, light(code + bump * hour / 18_000.0 * code * np.sin(np.pi * code) ** 2) + leak * WHITE / 250.0, "")
        for hour in HOURS
        for code in CODES
    ]
    verdict = diagnosed(table(rows, "", seed=2)).verdict
    assert (verdict.name, set(verdict.effects)) == ("several", {"eotf-drift", "black-level"})
