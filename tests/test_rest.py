"""Each campaign defines its own rest: the conditions under which its sessions' colour points were read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen import LutgenError
from lutgen.readings.conditions import COLUMNS, CONDITIONS
from tests.readings_text import read

if TYPE_CHECKING:
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers

#: White, red, green, blue, a grey: code value, and XYZ in cd/m² of an invented display.
PATCHES = (
    ("1,1,1", "190,200,218"),
    ("1,0,0", "82,43,4"),
    ("0,1,0", "72,143,24"),
    ("0,0,1", "36,14,190"),
    ("0.5,0.5,0.5", "41,43,47"),
)
#: Hours that a test leaves out of a long campaign.
MIDDLE = ("1000", "1700", "2500", "4500", "5200", "6000")

EXTRA = PATCHES[:1] + PATCHES[4:]


def table(columns: str, *parts: tuple[str, tuple[tuple[str, str], ...], str]) -> Measurements:
    """Rows ``hour,code,cells,light`` for each part: its hour, its patches, and the cells of its columns."""
    rows = [f"{hour},{code},{cells},{light}" for hour, patches, cells in parts for code, light in patches]
    text = "\n".join(["# simulated, not measured", f"hour,R,G,B,{columns},X,Y,Z", *rows]) + "\n"
    return read(text, file="rest.csv", sha256="")


def away(readings: Measurements, cell: str) -> list[int]:
    """Lines of the readings that deviate from rest in a condition."""
    return sorted(readings.lines[readings.rest.away[cell]].astype(int).tolist())


@pytest.mark.parametrize(("column", "value"), [
    ("ambient_lx", "5"), ("warmup_min", "60"), ("temperature_c", "24"), ("window", "0.9"), ("u", "0.4"),
])  # fmt: skip
def test_a_column_with_one_value_in_every_row_is_no_condition(column: str, value: str) -> None:
    readings = table(column, ("0", PATCHES, value), ("900", PATCHES, value))
    assert readings.conditions == {}
    assert readings.constants == {column: float(value)} == readings.usual()
    assert readings.at_rest().all()
    assert readings.tips()[0].tolist() == [0, 900]


@pytest.mark.parametrize(("column", "rest", "other", "cell"), [
    ("ambient_lx", "5", "60", "ambient"),
    ("ambient_lx", "5", "0", "ambient"),
    ("warmup_min", "60", "3", "cold"),
    ("warmup_min", "", "60", "cold"),
    ("temperature_c", "24.3", "32", "heat"),
    ("window", "0.9", "0.1", "window"),
    ("u", "0.4", "0.9", "position"),
])  # fmt: skip
def test_what_differs_from_the_colour_points_is_away_from_rest(column: str, rest: str, other: str, cell: str) -> None:
    readings = table(column, ("0", PATCHES, rest), ("0", EXTRA, other), ("900", PATCHES, rest))
    assert away(readings, cell) == [8, 9]
    assert readings.tips()[1][:, 0, 2].tolist() == [200, 200]


def test_more_minutes_than_the_colour_points_had_is_warm_too() -> None:
    readings = table("warmup_min", ("0", PATCHES, "60"), ("0", EXTRA, "240"), ("900", PATCHES, "60"))
    assert away(readings, "cold") == []


def test_a_log_of_every_readings_minutes_is_one_warm_span() -> None:
    drifting = [("0", (patch,), f"{60 + 9 * k}") for k, patch in enumerate((*PATCHES, *PATCHES))]
    readings = table("warmup_min", ("0", EXTRA, "40"), *drifting, ("900", PATCHES, ""))
    assert away(readings, "cold") == [3, 4]


def test_room_light_that_a_lux_meter_reads_a_little_differently_is_the_same() -> None:
    jitter = [("0", (patch,), f"{5 + 0.1 * k}") for k, patch in enumerate(PATCHES)]
    readings = table("ambient_lx", *jitter, ("0", EXTRA, "60"), ("900", PATCHES, "5"))
    assert away(readings, "ambient") == [8, 9]


def test_the_hotter_of_two_hours_is_at_rest_in_its_own_session() -> None:
    readings = table("temperature_c", ("0", PATCHES, "22"), ("900", PATCHES, "31"), ("900", EXTRA, "23"))
    assert away(readings, "heat") == [13, 14]


def test_where_most_colour_points_were_read_alike_is_rest() -> None:
    readings = table("window", ("0", PATCHES * 3, "0.9"), ("0", PATCHES, "0.1"), ("900", PATCHES, "0.9"))
    assert away(readings, "window") == list(range(18, 23))
    assert readings.usual() == {"window": 0.9}


def test_temperatures_of_the_heated_readings_alone_are_not_at_rest() -> None:
    """Most people log a temperature only where it is unusual, here in readings of three colour points out of four."""
    heated = table("temperature_c", ("0", PATCHES, ""), ("0", (*PATCHES[:2], PATCHES[3]), "33"))
    assert away(heated, "heat") == [8, 9, 10]
    assert heated.above_rest("temperature_c")[heated.rest.away["heat"]].tolist() == [8.0, 8.0, 8.0]
    mostly_logged = table("temperature_c", ("0", PATCHES, "33"), ("0", PATCHES[:1], ""))
    assert away(mostly_logged, "heat") == []


def test_of_as_many_the_full_screen_is_rest() -> None:
    readings = table("window", ("0", PATCHES, "0.1"), ("0", PATCHES, "1"), ("900", PATCHES, "1"))
    assert away(readings, "window") == list(range(3, 8))


def test_a_session_without_all_colour_points_takes_the_rest_of_its_hour() -> None:
    readings = table(
        "session,ambient_lx",
        ("0", PATCHES, "a,5"),
        ("0", EXTRA, "b,60"),
        ("0", EXTRA, "b,5"),
        ("900", PATCHES, "c,5"),
    )
    assert away(readings, "ambient") == [8, 9]


def test_colour_points_that_two_sessions_of_an_hour_share_are_a_set() -> None:
    readings = table(
        "session,ambient_lx", ("0", PATCHES[:2], "a,5"), ("0", PATCHES[2:], "b,5"), ("900", EXTRA, "c,60"),
        ("900", PATCHES, "c,5"),
    )  # fmt: skip
    assert away(readings, "ambient") == [8, 9]


def test_what_surrounds_a_patch_that_fills_the_screen_is_no_condition() -> None:
    readings = table("window,surround", ("0", PATCHES, "1,0"), ("0", EXTRA, "1,0.5"), ("0", EXTRA, "0.1,0.5"))
    assert away(readings, "surround") == [10, 11] == away(readings, "window")


def test_a_window_of_every_row_has_a_surround_that_may_vary() -> None:
    readings = table("window,surround", ("0", PATCHES, "0.1,0"), ("0", EXTRA, "0.1,1"), ("900", PATCHES, "0.1,0"))
    assert away(readings, "surround") == [8, 9]
    assert readings.usual() == {"window": 0.1, "surround": 0.0}


def test_colour_points_that_were_all_read_under_other_conditions_are_refused_by_name() -> None:
    parts = [("0", (patch,), f"{40 * k}") for k, patch in enumerate(PATCHES[:4])]
    with pytest.raises(LutgenError, match=r"no reading of .* at hour 0 \(all four under the same room light\)"):
        table("ambient_lx", *parts)


def test_every_condition_says_what_a_table_a_sentence_and_a_plan_need() -> None:
    assert [condition.place for condition in CONDITIONS] == sorted({condition.place for condition in CONDITIONS})
    assert len({condition.cell for condition in CONDITIONS}) == len(CONDITIONS)
    usual = {name: column.usual for name, column in COLUMNS.items()}
    for condition in CONDITIONS:
        values = [column.shown for column in condition.columns]
        label = condition.label(*values)
        assert label in condition.sentence.format(label)
        assert isinstance(condition.in_words(usual), str)
        assert all(condition.varied)
        for column in condition.columns:
            assert column.tried[0] == column.usual
            assert all(column.low <= value <= column.high for value in column.tried[1:])
            at = np.array([value for value in column.tried if np.isfinite(value)])
            low, high = condition.span(at, float(at[0]))
            assert low <= at[0] <= high


def test_a_refined_model_is_baked_at_the_rest_of_its_campaign() -> None:
    from lutgen.criticism.refine import refine
    from lutgen.display import what_luts_carry
    from tests.campaigns import text_of

    rows = text_of("edge").splitlines()
    place = next(row for row in rows if row.startswith("hour")).split(",").index("ambient_lx")
    moved = [
        ",".join([*cells[:place], "5" if cells[place] == "0" else cells[place], *cells[place + 1 :]])
        if (cells := row.split(","))[0].replace(".", "").isdigit()
        else row
        for row in rows
        if row.split(",")[0] not in MIDDLE
    ]
    readings = read("\n".join(moved) + "\n", file="lit.csv", sha256="")
    assert readings.usual()["ambient_lx"] == 5.0
    model = refine(readings, ["ambient-reflection"]).model
    assert model.conditions.stated() == {"ambient_lx": 5.0}
    assert what_luts_carry(model)[0] == "Baked at: room light 5 lx."
    plain = refine(readings, ["edge-falloff"]).model
    assert plain.conditions.stated() == {}
