"""Tables as people type them: what looks like another unit, other hours or a typing error is refused or remarked."""

from __future__ import annotations

import re
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.colorimetry import xyY_to_xyz
from lutgen.errors import LutgenError
from lutgen.readings import read_campaign, read_measurements, read_session
from lutgen.readings.formats._csv_doubts import lone_jump
from lutgen.readings.rest import TIP_DRIVES
from tests.command import here
from tests.real_data import real_data

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers

HOURS = ("0", "3000", "6500", "14000")
HEADER = "hour,R,G,B,x,y,Y"
#: White, red, green and blue of an additive display, xyY.
TIPS = np.array([[0.3127, 0.3290, 250.0], [0.64, 0.33, 53.16], [0.30, 0.60, 178.79], [0.15, 0.06, 18.05]])
DRIVES = ("1,1,1", "1,0,0", "0,1,0", "0,0,1")


def table(hours: tuple[str, ...] = HOURS, *, gain: float = 1.0, metadata: str = "", header: str = HEADER) -> str:
    """A display whose white falls by 5 % from session to session, as a table of x, y, Y."""
    rows = [
        f"{hour},{drive},{x:g},{y:g},{gain * 0.95**at * luminance:.4f}"
        for at, hour in enumerate(hours)
        for drive, (x, y, luminance) in zip(DRIVES, TIPS, strict=True)
    ]
    return "\n".join([*([metadata] if metadata else []), header, *rows]) + "\n"


@pytest.fixture
def typed(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        (tmp_path / "typed.csv").write_text(text)
        return tmp_path / "typed.csv"

    return write


def without_hours(text: str) -> str:
    return "".join(f"{line.partition(',')[2]}\n" for line in text.splitlines())


@pytest.mark.parametrize(
    "hours",
    [("0", "3.000", "6.500", "14.000"), ("0", "500", "1.000", "14.000"), ("0", "2.125", "3.250")],
)
@pytest.mark.parametrize("read", [read_measurements, read_campaign])
def test_points_that_look_like_separators_of_thousands_are_refused(
    read: Callable[[Path], object], hours: tuple[str, ...], typed: Callable[[str], Path]
) -> None:
    first = next(hour for hour in hours if "." in hour)
    says = rf"line \d+, column hour: {first} has three decimals.* Write {first.replace('.', '')}, or {first}0 if hours"
    with pytest.raises(LutgenError, match=says):
        read(typed(table(hours)))


@pytest.mark.parametrize(
    "hours",
    [("0.000", "3.000", "6.500"), ("0", "0.500", "1.000", "2.000"), ("0", "3.000"), ("0", "3.000", "6.5"),
     ("0", "3.0000", "6.500"), ("0", "3.000", "4.250", "1500"), ("0", "221.000", "892.000")],
)  # fmt: skip
def test_hours_with_three_decimals_that_are_no_thousands_are_read(
    hours: tuple[str, ...], typed: Callable[[str], Path]
) -> None:
    assert np.unique(read_measurements(typed(table(hours))).hours).tolist() == sorted(map(float, hours))


@pytest.mark.parametrize("key", ["unit", "units", "Unit"])
@pytest.mark.parametrize("unit", ["cd/m²", "cd/m2", "CD/M2", "nits", "nit", "cd/m^2"])
def test_a_line_may_state_candela_per_square_metre(unit: str, key: str, typed: Callable[[str], Path]) -> None:
    path = typed(table(gain=0.4, metadata=f"# {key}: {unit}"))
    assert read_measurements(path).remarks == ()
    path = typed(without_hours(table(("0",))).replace("R,G", f"# {key}: {unit}\nR,G"))
    assert read_measurements(path).remarks == ()


@pytest.mark.parametrize("unit", ["fL", "percent", "lux", ""])
@pytest.mark.parametrize("read", [read_measurements, read_campaign])
def test_another_unit_is_refused(read: Callable[[Path], object], unit: str, typed: Callable[[str], Path]) -> None:
    says = rf"typed\.csv: unit is '{unit}'; light must be in cd/m² .* 1 fL = 3\.426 cd/m²\."
    with pytest.raises(LutgenError, match=says):
        read(typed(table(metadata=f"# unit: {unit}")))


@pytest.mark.parametrize(
    ("key", "meant"),
    [("instument", "instrument"), ("start hour", "start_hour"), ("white_cdm2", "white_cd_m2"), ("dispaly", "display")],
)
def test_a_key_that_is_nearly_known_is_remarked(key: str, meant: str, typed: Callable[[str], Path]) -> None:
    remarks = read_measurements(typed(table(metadata=f"# {key}: 7"))).remarks
    assert remarks == (f"Line # {key}: not known to lutgen, and left alone; is {meant} meant?",)


@pytest.mark.parametrize("key", ["noise", "room", "lifetimes", "data", "firmware", "comment"])
def test_any_other_key_is_a_comment(key: str, typed: Callable[[str], Path]) -> None:
    assert read_measurements(typed(table(metadata=f"# {key}: 7"))).remarks == ()


def test_white_of_100_at_the_first_hour_is_said_to_be_taken_as_luminance(typed: Callable[[str], Path]) -> None:
    (remark,) = read_measurements(typed(table(gain=0.402))).remarks
    assert remark == (
        "Y is taken as cd/m², of which white has 100.5 at hour 0: the header names no unit (Y_cdm2). If it is "
        "relative, multiply it by white's luminance at hour 0 over 100."
    )
    assert read_measurements(typed(table(gain=0.41))).remarks == ()
    assert read_measurements(typed(table(gain=0.402, header=f"{HEADER}_cdm2"))).remarks == ()


@pytest.mark.parametrize("command", [("show", "--display"), ("inspect",), ("trend",), ("sessions", "explain")])
def test_commands_print_a_remark_on_a_table_with_hours_once(
    command: tuple[str, ...], typed: Callable[[str], Path]
) -> None:
    done = here(*command, typed(table(gain=0.4)))
    assert " ".join((done.stdout + done.stderr).split()).count("Y is taken as cd/m², of which white has 100") == 1


def test_sessions_without_a_column_of_hours_are_noticed(typed: Callable[[str], Path]) -> None:
    path = typed(without_hours(table()))
    says = "White was read 4 times at hour 0, from 214.3 to 250 cd/m²: is a column hour missing?"
    assert says in read_measurements(path).remarks
    assert says in read_campaign(path).entries[0].session.remarks
    assert says in here("show", "--display", path).stderr
    assert "is a column hour missing?" in " ".join(here("inspect", path).stdout.split())


def test_sessions_at_one_hour_are_noticed(typed: Callable[[str], Path]) -> None:
    readings = read_measurements(typed(table(("0", "0", "0", "0", "900"))))
    assert readings.remarks == (
        "White was read 4 times at hour 0, from 214.3 to 250 cd/m²: is an hour or a number mistyped?",
    )


@pytest.mark.parametrize(
    ("column", "other"), [("warmup_min", "1"), ("ambient_lx", "300"), ("window", "0.1"), ("note", "lens cap")]
)
@pytest.mark.parametrize("hours", [True, False])
def test_a_white_away_from_rest_is_no_white_of_another_session(
    column: str, other: str, hours: bool, typed: Callable[[str], Path]
) -> None:
    usual = {"warmup_min": "60", "ambient_lx": "0", "window": "1", "note": ""}[column]
    header, *rows = table(("0",), header=f"{HEADER}_cdm2").splitlines()
    rows = [*(f"{row},{usual}" for row in rows), f"0,1,1,1,0.3127,0.3290,200,{other}"]
    text = "\n".join([f"{header},{column}", *rows]) + "\n"
    assert read_measurements(typed(text if hours else without_hours(text))).remarks == ()


def with_reading(text: str, hour: str, drive: str, reading: str) -> str:
    """Replace x, y, Y of one row."""
    rows = [f"{hour},{drive},{reading}" if row.startswith(f"{hour},{drive},") else row for row in text.splitlines()]
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize("read", [read_measurements, read_campaign])
@pytest.mark.parametrize(
    ("name", "drive", "reading"),
    [
        ("blue", "0,0,1", "0.51,0.06,16.29"), ("blue", "0,0,1", "0.15,0.06,162.9"), ("blue", "0,0,1", "0.15,0.6,16.29"),
        ("red", "1,0,0", "0.64,0.33,4.558"), ("green", "0,1,0", "0.30,0.06,161.3"), ("red", "1,0,0", "0.46,0.33,47.98"),
    ],
)  # fmt: skip
def test_a_primary_that_jumps_in_one_session_alone_is_mistyped(
    read: Callable[[Path], object], name: str, drive: str, reading: str, typed: Callable[[str], Path]
) -> None:
    path = typed(with_reading(table(), "6500", drive, reading))
    line = next(at for at, row in enumerate(path.read_text().splitlines(), 1) if row.startswith(f"6500,{drive}"))
    says = rf"line {line}: at hour 6500 {name} has x = .* At hour 3000 it has x = .*, and white shows .* mistyped\?"
    with pytest.raises(LutgenError, match=says):
        read(path)


def xyz_rows(sessions: list[np.ndarray]) -> str:
    """A table of X, Y, Z from white and primaries of sessions, (4, 3) each."""
    rows = [
        f"{1000 * at},{drive},{','.join(map(repr, xyz.tolist()))}"
        for at, session in enumerate(sessions)
        for drive, xyz in zip(DRIVES, session, strict=True)
    ]
    return "\n".join(["hour,R,G,B,X,Y,Z", *rows]) + "\n"


def additive(*primaries: tuple[float, float, float]) -> np.ndarray:
    xyz = xyY_to_xyz(np.array(primaries))
    return np.vstack([xyz.sum(axis=0), xyz])


SRGB = additive((0.64, 0.33, 53.16), (0.30, 0.60, 178.79), (0.15, 0.06, 18.05))
ADOBE = additive((0.64, 0.33, 74.3), (0.21, 0.71, 156.9), (0.15, 0.06, 18.8))
BLUE_DIMMED = additive((0.64, 0.33, 53.16), (0.30, 0.60, 178.79), (0.15, 0.06, 6.0))
REC2020 = additive((0.708, 0.292, 65.7), (0.17, 0.797, 169.5), (0.131, 0.046, 14.8))
OLED = SRGB * np.array([[0.55], [1.0], [1.0], [1.0]])
OLED_LIMITED = SRGB * np.array([[0.25], [1.0], [1.0], [1.0]])
MISTYPED = SRGB * np.array([[1.0], [1.0], [1.0], [3.0]])

REAL = {
    "another gamut in one session": [SRGB, ADOBE, SRGB],
    "a wide gamut in one session": [SRGB, REC2020, SRGB],
    "blue dimmed in one session": [SRGB, BLUE_DIMMED, SRGB],
    "another limiter in one session": [OLED, OLED_LIMITED, OLED],
    "another gamut from one session on": [SRGB, SRGB, ADOBE, ADOBE],
    "a last session that differs": [SRGB, SRGB, MISTYPED],
    "a first session that differs": [MISTYPED, SRGB, SRGB],
    "two sessions": [SRGB, MISTYPED],
    "no two sessions alike": [SRGB, MISTYPED, SRGB * np.array([[1.0], [1.0], [1.0], [0.3]])],
}


@pytest.mark.parametrize("name", REAL)
def test_what_a_display_may_do_is_no_typing_error(name: str, typed: Callable[[str], Path]) -> None:
    assert read_measurements(typed(xyz_rows(REAL[name]))).tips()[0].size == len(REAL[name])


@pytest.mark.parametrize("display", [SRGB, OLED], ids=["LCD", "OLED"])
def test_a_typing_error_is_noticed_on_any_display_between_any_sessions(
    display: np.ndarray, typed: Callable[[str], Path]
) -> None:
    mistyped = display * np.array([[1.0], [1.0], [1.0], [3.0]])
    for at in (1, 2, 3):
        sessions = [0.95**each * (mistyped if each == at else display) for each in range(5)]
        with pytest.raises(LutgenError, match=rf"line {4 * at + 5}: at hour {at}000 blue has .* mistyped\?"):
            read_measurements(typed(xyz_rows(sessions)))


def test_no_primary_of_a_real_display_jumps() -> None:
    """Any three sessions of one display in any order: calibrated differently, by different instruments and cables."""
    displays: dict[str, list[np.ndarray]] = {}
    for path in sorted([*real_data().glob("real/*/*.ti3"), *real_data().glob("real/ickc/*.csv")]):
        session = read_session(path)
        tips = [np.isclose(session.drive, drive, atol=1e-4).all(axis=1) for drive in TIP_DRIVES]
        name = re.split(r"__|_[0-9]", path.name)[0]
        displays.setdefault(name, []).append(np.array([session.xyz[rows].mean(axis=0) for rows in tips]))
    triples = [three for sessions in displays.values() for three in permutations(sessions, 3)]
    assert len(triples) > 100
    assert all(lone_jump(np.array(three)) is None for three in triples)


def test_of_repeated_readings_the_mistyped_one_is_named(typed: Callable[[str], Path]) -> None:
    text = table().replace("6500,0,0,1", "6500,0,0,1,0.15,0.06,16.31\n6500,0,0,1,0.15,0.06,163.1\n6500,0,0,1")
    line = next(at for at, row in enumerate(text.splitlines(), 1) if row.endswith(",163.1"))
    with pytest.raises(LutgenError, match=rf"line {line}: at hour 6500 blue has .* Y = 163\.1\."):
        read_measurements(typed(text))
