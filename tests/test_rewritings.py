"""Each rewriting of a campaign changes what its name states, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.generators.rewritings import NOTHING_LOST, OF_TRUTH, SOMETHING_LOST, CannotRewrite
from tests.generators.table import BLANK, CONDITIONS, Table, is_colour_point, parsed, table
from tests.generators.truth import Truth

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

pytestmark = pytest.mark.numbers

POINTS = [(1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
MIXTURES = [(0.2, 0.4, 0.9), (0.7, 0.1, 0.3), (0.3, 0.8, 0.5), (0.9, 0.6, 0.1)]


def _truth(*, hours: Iterable[float] = (0, 1000, 3000, 6000, 9000, 12000, 18000), positions: bool = True) -> Truth:
    """Colour points twice, a grey twice, four mixtures; white off centre, and white in a room of 80 lx."""
    patches = [*POINTS, *POINTS, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5), *MIXTURES]
    place = [(0.5, 0.0)] * len(patches)
    if positions:
        patches, place = [*patches, (1, 1, 1), (1, 1, 1)], [*place, (0.1, 0.0), (0.5, 80.0)]
    every = sorted(hours)
    drive, where = np.tile(np.array(patches, dtype=float), (len(every), 1)), np.tile(place, (len(every), 1))
    n = len(drive)
    random = np.random.default_rng(3)
    blank = np.where(random.random(n) < 0.5, np.nan, 0.5)
    return Truth(
        hours=np.repeat(every, len(patches)).astype(float),
        drive=drive,
        xyz_cd_m2=(drive**2.2) @ np.array([[80.0, 40.0, 4.0], [70.0, 150.0, 20.0], [35.0, 14.0, 190.0]]) + 0.3,
        conditions={"u": where[:, 0], "v": blank, "ambient_lx": where[:, 1], "warmup_min": np.full(n, 90.0)},
        session=tuple(f"s{i}" for i in range(len(every)) for _ in patches),
        order=np.arange(n, dtype=float),
        note=("",) * n,
        metadata={"display": "simulated", "session_gain": "0.003"},
        hidden={},
    )


def _text(*, order: bool = True, positions: bool = True) -> str:
    truth = _truth(positions=positions)
    noise = np.random.default_rng(5).normal(1.0, 0.002, truth.xyz_cd_m2.shape)
    return table(truth, truth.xyz_cd_m2 * noise, order=order)


def _readings(table: Table) -> list[tuple[float, ...]]:
    """The values that a reader must find in any form of the file: one tuple for each reading, sorted."""
    hours = table.numbers("hour") - float(table.metadata.get("start_hour", "0"))
    known = [table.numbers(name) for name in (*BLANK,)]
    values = np.column_stack([hours, table.drive, np.round(table.xyz, 7), *known])
    return sorted(map(tuple, values.tolist()))


def _apply(name: str) -> tuple[Table, Table]:
    """A file and its rewriting, for the first file that allows the rewriting."""
    rewrite = (NOTHING_LOST | SOMETHING_LOST)[name]
    for text in (_text(), _text(order=False), _text(positions=False)):
        try:
            return parsed(text), parsed(rewrite(text))
        except CannotRewrite:
            continue
    pytest.fail(f"no file here allows {name!r}")


#: Rewritings that give every row another constant condition, so that rest is a different condition.
CONSTANT = ("room light of 5 lx in every row", "a window of 90 % in every row")


@pytest.mark.parametrize("name", [name for name in NOTHING_LOST if name not in CONSTANT])
def test_nothing_is_lost_by(name: str) -> None:
    before, after = _apply(name)
    assert _readings(after) == _readings(before)
    assert after.text() != before.text()


@pytest.mark.parametrize("name", NOTHING_LOST)
def test_colour_points_stay_at_rest_after(name: str) -> None:
    before, after = _apply(name)
    assert after.at_rest().sum() == before.at_rest().sum()


@pytest.mark.parametrize("name", [*NOTHING_LOST, *SOMETHING_LOST])
def test_the_first_line_still_says_simulated_after(name: str) -> None:
    assert "SIMULATED" in _apply(name)[1].head[0]


@pytest.mark.parametrize("name", [*NOTHING_LOST, *SOMETHING_LOST])
def test_the_same_text_is_rewritten_alike_by(name: str) -> None:
    rewrite = (NOTHING_LOST | SOMETHING_LOST)[name]
    before, after = _apply(name)
    assert rewrite(before.text()) == after.text()


@pytest.mark.parametrize("name", SOMETHING_LOST)
def test_hours_and_colour_points_are_enough_after(name: str) -> None:
    _, after = _apply(name)
    drive, rest = after.drive, after.at_rest()
    for hour in set(after.numbers("hour")):
        here = rest & (after.numbers("hour") == hour)
        assert {tuple(row) for row in drive[here & is_colour_point(drive)]} == set(POINTS)
    assert min(after.numbers("hour")) == 0


@pytest.mark.parametrize(("column", "value"), [("ambient_lx", "5"), ("window", "0.9"), ("warmup_min", "60")])
def test_a_constant_condition_fills_every_row(column: str, value: str) -> None:
    name = {"ambient_lx": CONSTANT[0], "window": CONSTANT[1], "warmup_min": "an hour since power-on in every row"}
    _, after = _apply(name[column])
    assert set(after.columns[column]) == {value}


def test_a_condition_that_changes_is_not_made_constant() -> None:
    with pytest.raises(CannotRewrite, match="ambient_lx changes"):
        NOTHING_LOST[CONSTANT[0]](_text())


def test_filled_cells_leave_no_blank_and_keep_what_was_written() -> None:
    before, after = _apply("optional columns filled with their rest value in every row")
    for name in CONDITIONS:
        assert "" not in after.columns[name]
    assert after.columns["u"] == before.columns["u"]
    assert set(after.columns["temperature_c"]) == {"24.3"}


def test_renamed_sessions_hold_the_same_rows() -> None:
    before, after = _apply("sessions with other names")
    assert len(set(zip(before.session, after.session, strict=True))) == len(set(before.session))
    assert set(before.session).isdisjoint(after.session)


def test_minutes_that_change_are_neither_blanked_nor_filled() -> None:
    table = parsed(_text())
    minutes = ["5" if row % 3 == 0 else "60" if row % 3 == 1 else "" for row in range(len(table))]
    text = table.having(warmup_min=minutes).text()
    for name in ("cells that hold what a blank means blank, and columns that never change", "optional columns filled"):
        rewrite = next(function for each, function in NOTHING_LOST.items() if each.startswith(name))
        assert list(parsed(rewrite(text)).columns["warmup_min"]) == minutes


def test_columns_at_rest_go_and_others_stay() -> None:
    _, after = _apply("optional columns that never change absent")
    assert {"v", "warmup_min", "session", "note"}.isdisjoint(after.columns)
    assert {"u", "ambient_lx"} <= set(after.columns)


def test_a_dark_reading_below_zero_has_no_chromaticity() -> None:
    table = parsed(_text())
    dark = table.having(Z=["-0.001", *table.columns["Z"][1:]]).text()
    with pytest.raises(CannotRewrite, match="row 1 "):
        NOTHING_LOST["light as x,y,Y"](dark)


def test_shuffling_within_sessions_keeps_the_sessions_in_their_order() -> None:
    before, after = _apply("rows shuffled within each session")
    assert after.session == before.session
    assert after.columns["order"] != before.columns["order"]


def test_excel_writes_semicolons_line_ends_and_a_mark() -> None:
    text = NOTHING_LOST["semicolons, CR LF and a byte order mark, as Excel saves a table"](_text())
    assert text.startswith("\ufeff#")
    assert text.count("\r\n") == text.count("\n")
    assert "hour;R;G;B" in text


def test_a_split_session_has_colour_points_and_another_hour_in_both_halves() -> None:
    before, after = _apply("a session split in two names an hour apart")
    assert len(set(after.session)) == len(set(before.session)) + 1
    assert set(after.numbers("hour")) - set(before.numbers("hour")) == {6001.0}
    halves = [sum(name == each for name in after.session) for each in ("s3", "s3 continued")]
    assert abs(halves[0] - halves[1]) <= 1


def test_sessions_keep_half_of_the_mixtures_and_not_the_same() -> None:
    before, after = _apply("different mixtures in each session: half of them, drawn anew")
    kept = [
        frozenset(set(map(tuple, after.drive[after.numbers("hour") == hour])) & set(MIXTURES))
        for hour in set(after.numbers("hour"))
    ]
    assert {len(each) for each in kept} == {2}
    assert len(set(kept)) > 1
    assert len(before) - len(after) == 2 * len(kept)


def test_averaging_leaves_one_reading_of_each_patch_but_the_colour_points() -> None:
    before, after = _apply("every replicate averaged away but the colour points'")

    def greys(table: Table) -> tuple[int, NDArray[np.float64]]:
        grey = (table.drive == 0.5).all(axis=1)
        return int(grey.sum()), table.xyz[grey].mean(axis=0)

    assert greys(after)[0] == greys(before)[0] / 2
    np.testing.assert_allclose(greys(after)[1], greys(before)[1], rtol=1e-7)
    assert is_colour_point(after.drive).sum() == is_colour_point(before.drive).sum()


def test_four_digits_are_left() -> None:
    before, after = _apply("four significant digits of X, Y, Z")
    np.testing.assert_allclose(after.xyz, before.xyz, rtol=6e-4)
    assert all(len(cell.replace(".", "").lstrip("0")) <= 4 for cell in after.columns["Y"])


def test_irregular_hours_lack_two_sessions_and_half_of_another() -> None:
    before, after = _apply("irregular hours, and one session with half the patches")
    counts = sorted(sum(name == each for name in after.session) for each in set(after.session))
    whole = before.session.count("s0")
    assert len(counts) == len(set(before.session)) - 2
    assert counts[0] < counts[1] == whole


def test_metadata_and_order_go() -> None:
    assert _apply("metadata lines absent")[1].metadata.keys() == {"simulated"}
    assert "order" not in _apply("order of reading absent")[1].columns


@pytest.mark.parametrize("name", OF_TRUTH)
def test_extra_readings_are_in_place_and_show_the_same_light(name: str) -> None:
    before = _truth()
    after = OF_TRUTH[name](before, 7)
    added = len(set(after.session)) - len(set(before.session))
    assert added == (2 if "sessions" in name else 1)
    assert (np.diff(after.hours) >= 0).all()
    assert len(set(after.order)) == after.order.size == len(after.session) == len(after.note)
    old = [name in before.session for name in after.session]
    np.testing.assert_array_equal(after.xyz_cd_m2[old], before.xyz_cd_m2)
    if added == 1:
        new = ~np.array(old)
        assert is_colour_point(after.drive[new]).all()
        assert new.sum() == 8


def test_a_campaign_too_short_for_a_rewriting_says_so() -> None:
    short = replace(_truth(hours=(0, 9000)), metadata={})
    for name in ("irregular hours, and one session with half the patches", "a session split in two names"):
        with pytest.raises(CannotRewrite):
            SOMETHING_LOST[name](table(short, short.xyz_cd_m2))
    with pytest.raises(CannotRewrite):
        OF_TRUTH["two extra sessions in between"](short, 1)
