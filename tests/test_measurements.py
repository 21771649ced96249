"""Tables of readings: good tables are read correctly, bad tables are refused with a helpful sentence."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements
from tests.command import here
from tests.quick import draws
from tests.real_data import real_data

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parents[1]
DEFAULT = default_display().read_bytes()
LINES = DEFAULT.decode().splitlines()
HEADER = next(i for i, line in enumerate(LINES) if line.startswith("hour,"))
#: Line numbers, from 1, of the first rows: white, red, green, blue at hour 0, then white at the next hour.
WHITE, RED, GREEN, BLUE, NEXT_WHITE = range(HEADER + 2, HEADER + 7)

#: Two hours of a display whose white is not the sum of its primaries.
SMALL = """\
hour,R,G,B,x,y,Y
0,1,1,1,0.3127,0.3290,250
0,1,0,0,0.6400,0.3300,54
0,0,1,0,0.3000,0.6000,180
0,0,0,1,0.1500,0.0600,18
1000,1,1,1,0.3200,0.3400,240
1000,1,0,0,0.6380,0.3310,52
1000,0,1,0,0.3010,0.5990,175
1000,0,0,1,0.1510,0.0610,15
"""


def xyz_text(text: str) -> str:
    """Rewrite SMALL's x,y,Y as X,Y,Z, by the paper's formulas in plain Python."""
    header, *rows = text.splitlines()
    assert header == "hour,R,G,B,x,y,Y"
    out = ["hour,R,G,B,X,Y,Z"]
    for row in rows:
        *drive, x, y, luminance = row.split(",")
        xyz = (
            float(x) * float(luminance) / float(y),
            luminance,
            (1 - float(x) - float(y)) * float(luminance) / float(y),
        )
        out.append(",".join([*drive, *map(str, xyz)]))
    return "\n".join(out) + "\n"


def with_line(number: int, old: str, new: str, text: str | None = None) -> bytes:
    """Return the default display's file, or ``text``, with ``old`` replaced once in line ``number`` (from 1)."""
    lines = text.splitlines() if text else list(LINES)
    assert old in lines[number - 1], lines[number - 1]
    lines[number - 1] = lines[number - 1].replace(old, new, 1)
    return ("\n".join(lines) + "\n").encode()


def without_lines(*numbers: int, text: str | None = None) -> bytes:
    lines = text.splitlines() if text else LINES
    return ("\n".join(line for i, line in enumerate(lines, start=1) if i not in numbers) + "\n").encode()


def with_columns(change: Callable[[list[str]], list[str]]) -> bytes:
    """Apply ``change`` to the cells of every row of SMALL except the header."""
    header, *rows = SMALL.splitlines()
    return ("\n".join([header, *(",".join(change(row.split(","))) for row in rows)]) + "\n").encode()


def plus(column: str, values: str | list[str], text: str = SMALL) -> str:
    """Return ``text`` with one more column, which has one value or a list of values."""
    header, *rows = text.splitlines()
    cells = [values] * len(rows) if isinstance(values, str) else values
    return "\n".join([f"{header},{column}", *(f"{row},{cell}" for row, cell in zip(rows, cells, strict=True))]) + "\n"


def file_with(folder: Path, content: str | bytes) -> Path:
    path = folder / "display.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# Good files


def test_the_default_display_is_read_as_31_times_4_tips() -> None:
    hours, tips = read_measurements(default_display()).tips()
    assert hours.shape == (31,)
    assert tips.shape == (31, 4, 3)
    assert (hours[0], hours[-1]) == (0, 18_000)
    cells = [line.split(",") for line in LINES[HEADER + 1 :]]
    np.testing.assert_allclose(tips.reshape(-1, 3), [[float(v) for v in row[4:]] for row in cells], rtol=1e-14)


GOOD = {
    "as written": SMALL.encode(),
    "XYZ": xyz_text(SMALL).encode(),
    "UTF-16": SMALL.encode("utf-16"),
    "tabs": SMALL.replace(",", "\t").encode(),
    "units in the header": SMALL.replace("y,Y", "y,Y_cdm2").encode(),
    "byte order mark": b"\xef\xbb\xbf" + SMALL.encode(),
    "CRLF": SMALL.replace("\n", "\r\n").encode(),
    "CR": SMALL.replace("\n", "\r").encode(),
    "no line end at the end": SMALL.rstrip("\n").encode(),
    "spaces around cells": SMALL.replace(",", " , ").encode(),
    "quoted cells": re.sub(r"[^,\n]+", lambda m: f'"{m[0]}"', SMALL).encode(),
    "blank lines": SMALL.replace("\n", "\n\n").encode(),
    "comments between rows": SMALL.replace("1000,1,1,1", "# later\n1000,1,1,1").encode(),
    "exponents": SMALL.replace(",250\n", ",2.5e2\n").encode(),
    "columns in another order": "\n".join(
        ",".join(line.split(",")[::-1]) for line in SMALL.splitlines()
    ).encode(),
    "rows of an hour in another order": "\n".join(
        [SMALL.splitlines()[i] for i in (0, 4, 3, 2, 1, 8, 5, 7, 6)]
    ).encode(),
    "optional columns at rest": plus("note", "hm", plus("window", "1", plus("ambient_lx", "0"))).encode(),
    "optional columns empty": plus("temperature_c", "", plus("window", "", plus("u", ""))).encode(),
    "readings off centre beside": (SMALL.replace("hour,R,G,B,x,y,Y", "hour,R,G,B,x,y,Y,u").replace("\n", ",0.5\n", 9)
        .replace(",Y,u,0.5", ",Y,u") + "1000,1,1,1,0.3300,0.3500,200,0.9\n").encode(),
    "greys between": SMALL.replace("1000,1,1,1", "0,0.5,0.5,0.5,0.3127,0.3290,53\n1000,1,1,1").encode(),
    "a later hour of greys only": (SMALL + "2000,0.5,0.5,0.5,0.3127,0.3290,53\n").encode(),
    "replicates at every hour": "".join(
        line + "\n" + (line + "\n" if line[0].isdigit() else "") for line in SMALL.splitlines()
    ).encode(),
}  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_a_good_file_is_read_as_it_is_meant(name: str, tmp_path: Path) -> None:
    hours, tips = read_measurements(file_with(tmp_path, GOOD[name])).tips()
    rows = [[float(cell) for cell in line.split(",")] for line in SMALL.splitlines()[1:]]
    assert hours.tolist() == [0, 1000]
    np.testing.assert_allclose(tips.reshape(-1, 3), [row[4:] for row in rows], rtol=1e-13, atol=0)


def test_replicates_are_averaged_as_light(tmp_path: Path) -> None:
    """Two whites of different chromaticity at every hour: the mean is the mean of their XYZ, not of x and y."""
    text = xyz_text(SMALL)
    doubled = [text.splitlines()[0]]
    for line in text.splitlines()[1:]:
        *drive, x, y, z = line.split(",")
        for x_gain, y_gain in ((0.98, 0.9), (1.02, 1.1)):
            doubled.append(",".join([*drive, str(float(x) * x_gain), str(float(y) * y_gain), z]))
    _, tips = read_measurements(file_with(tmp_path, "\n".join(doubled) + "\n")).tips()
    (tmp_path / "one").mkdir()
    _, expected = read_measurements(file_with(tmp_path / "one", text)).tips()
    np.testing.assert_allclose(tips, expected, rtol=1e-13)


def test_metadata_optional_columns_lines_and_hash_are_kept(tmp_path: Path) -> None:
    text = "# instrument: i1 Pro: rev. E\n#luminance:held\n# only a comment\n" + plus(
        "session",
        [f"s{i}" for i in range(8)],
        plus("temperature_c", ["", *map(str, range(7))], plus("ambient_lx", "0")),
    )
    path = file_with(tmp_path, text)
    readings = read_measurements(path)
    assert readings.metadata == {"instrument": "i1 Pro: rev. E", "luminance": "held"}
    assert readings.session == tuple(f"s{i}" for i in range(8))
    assert readings.note == ("",) * 8
    assert readings.lines.tolist() == list(range(5, 13))
    assert readings.constants == {"ambient_lx": 0.0}
    np.testing.assert_array_equal(readings.conditions["temperature_c"], [np.nan, *range(7)])
    assert set(readings.conditions) == {"temperature_c"}
    import hashlib

    assert readings.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert readings.file == str(path)


def test_a_dark_reading_may_be_slightly_negative(tmp_path: Path) -> None:
    text = xyz_text(SMALL).replace("1000,1,1,1", "0,0,0,0,-0.002,-0.001,0.003\n1000,1,1,1")
    readings = read_measurements(file_with(tmp_path, text))
    assert readings.xyz_cd_m2[readings.lines == 6].tolist() == [[-0.002, -0.001, 0.003]]
    assert readings.tips()[0].tolist() == [0, 1000]


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("u", ["0.5"] * 8 + ["0.1"]),
        ("v", ["0.5"] * 8 + ["0.9"]),
        ("ambient_lx", ["0"] * 8 + ["200"]),
        ("window", ["1"] * 8 + ["0.1"]),
        ("warmup_min", ["60"] * 8 + ["2"]),
    ],
)
def test_tips_are_taken_at_rest_only(column: str, values: list[str], tmp_path: Path) -> None:
    """A second white of hour 1000 under another condition does not enter the mean."""
    text = plus(column, values, SMALL + "1000,1,1,1,0.3200,0.3400,24\n")
    _, tips = read_measurements(file_with(tmp_path, text)).tips()
    assert tips[1, 0, 2] == pytest.approx(240, rel=1e-13)


def test_the_suffix_may_be_in_capitals(tmp_path: Path) -> None:
    path = tmp_path / "DISPLAY.CSV"
    path.write_text(SMALL)
    assert read_measurements(path).tips()[0].tolist() == [0, 1000]


def test_real_readings_are_read() -> None:
    readings = read_measurements(real_data() / "sample_readings.csv")
    hours, tips = readings.tips()
    assert hours.size == 4
    assert hours[0] == 0
    # The display is healthy and near sRGB, as its description says: white within 0.01 of D65, small drift.
    np.testing.assert_allclose(tips[:, 0, :2], np.tile([0.3127, 0.3290], (4, 1)), atol=0.03)
    DisplayModel(readings).at("chroma", float(hours[-1]))


# Bad files: section 7 of the issue and the list of criticism.md


class Bad(NamedTuple):
    content: bytes
    says: tuple[str, ...]


def bad(content: str | bytes, *says: str) -> Bad:
    return Bad(content if isinstance(content, bytes) else content.encode(), says)


def swap(i: int, j: int) -> Callable[[list[str]], list[str]]:
    def change(cells: list[str]) -> list[str]:
        cells[i], cells[j] = cells[j], cells[i]
        return cells

    return change


BAD = {
    "empty": bad("", "empty"),
    "only white space": bad(" \n\n\t\n", "empty"),
    "only comments": bad("# source: none\n", "no readings", "header"),
    "only a header": bad("hour,R,G,B,x,y,Y\n", "no readings"),
    "no header": bad(SMALL.split("\n", 1)[1], "line 1", "header"),
    "binary": bad(b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "binary"),
    "NUL bytes": bad(SMALL.replace("0.3127", "0.31\x0027"), "binary"),
    "UTF-16 without a mark": bad(SMALL.encode("utf-16-le"), "binary"),
    "truncated in a row": bad(DEFAULT[:1500].rsplit(b",", 2)[0], "line", "cut off"),
    "truncated in its last number": bad(DEFAULT.rstrip()[:-2], f"line {len(LINES)}", "Y = '9.9'", "cut off"),
    "truncated between the tips of an hour": bad("\n".join(LINES[:-2]) + "\n", "green and blue", "18000"),
    "NaN": bad(with_line(GREEN, "0.59882", "nan"), f"line {GREEN}", "column y", "not a finite number"),
    "infinite": bad(with_line(GREEN, "185.628", "inf"), f"line {GREEN}", "column Y", "not a finite number"),
    "overflow": bad(with_line(GREEN, "185.628", "1e999"), f"line {GREEN}", "column Y", "not a finite number"),
    "an empty cell": bad(with_line(GREEN, "0.59882", ""), f"line {GREEN}", "column y", "is empty: give a value"),
    "a word": bad(with_line(GREEN, "0.59882", "n/a"), f"line {GREEN}", "column y", "'n/a'"),
    "an underscore in a number": bad(with_line(GREEN, "185.628", "185_628"), f"line {GREEN}", "column Y"),
    "a hexadecimal number": bad(with_line(GREEN, "185.628", "0x1F"), f"line {GREEN}", "column Y", "0x1F"),
    "a decimal comma": bad(with_line(GREEN, "0.59882", "0,59882"), f"line {GREEN}", "decimal comma", "0.3127"),
    "a decimal comma in quotes": bad(
        with_line(GREEN, "0.59882", '"0,59882"'), f"line {GREEN}", "column y", "decimal comma"
    ),
    "decimal commas and semicolons": bad(
        SMALL.replace(",", ";").replace(".", ","), "decimal comma", "point"
    ),
    "x + y > 1": bad(with_line(RED, "0.63648", "0.73648"), f"line {RED}", "column x", "x + y"),
    "y = 0": bad(with_line(BLUE, "0.03965", "0"), f"line {BLUE}", "column y", "above 0"),
    "y < 0": bad(with_line(BLUE, "0.03965", "-0.03965"), f"line {BLUE}", "column y", "above 0"),
    "x < 0": bad(with_line(BLUE, "0.14955", "-0.14955"), f"line {BLUE}", "column x", "negative"),
    "Y = 0": bad(with_line(BLUE, "11.843", "0"), f"line {BLUE}", "column Y", "above 0"),
    "Y < 0": bad(with_line(BLUE, "11.843", "-11.843"), f"line {BLUE}", "column Y", "above 0"),
    "Y < 0 of a tip in XYZ": bad(
        with_line(2, ",250,", ",-250,", xyz_text(SMALL)), "line 2", "above 0"
    ),
    "X < 0 of a tip in XYZ": bad(
        re.sub(r"(0,1,0,0,)", r"\1-", xyz_text(SMALL), count=1), "line 3", "negative"
    ),
    "a missing primary": bad(without_lines(NEXT_WHITE + 2), "green", "hour 500", "full drive"),
    "a missing white": bad(without_lines(NEXT_WHITE), "white", "hour 500", "full drive"),
    "a missing primary at hour 0": bad(without_lines(BLUE), "blue", "hour 0", "full drive"),
    "no tips at all": bad(
        "hour,R,G,B,x,y,Y\n0,0.5,0.5,0.5,0.31,0.33,50\n100,0.5,0.5,0.5,0.31,0.33,50\n", "white", "hour 0"
    ),
    "duplicate hours": bad(
        "\n".join([*LINES[: HEADER + 9], *(f"500{line[3:]}" for line in LINES[HEADER + 5 : HEADER + 9]),
                   *LINES[HEADER + 9 :]]) + "\n",
        "hour 500 appears twice",
    ),
    "duplicate hours with other values": bad(
        SMALL.replace("1000,", "2000,") + "2000,1,1,1,0.3300,0.3500,230\n2000,1,0,0,0.6360,0.3320,50\n"
        "2000,0,1,0,0.3020,0.5980,170\n2000,0,0,1,0.1520,0.0620,14\n", "hour 2000 appears twice"
    ),
    "an hour that lacks a digit": bad(
        with_line(len(LINES), "18000,", "1800,"), "no reading of white, red and green at full drive at hour 1800"
    ),
    "a negative hour": bad(SMALL.replace("\n0,", "\n-10,"), "line 2", "negative"),
    "no hour 0": bad(SMALL.replace("\n0,", "\n10,"), "line 2", "hour 0", "subtract 10"),
    "8-bit drive": bad(
        with_columns(lambda c: [c[0], *(str(255 * int(v)) for v in c[1:4]), *c[4:]]), "line 2", "8-bit", "255"
    ),
    "percent drive": bad(
        with_columns(lambda c: [c[0], *(str(100 * int(v)) for v in c[1:4]), *c[4:]]), "line 2", "percent", "100"
    ),
    "10-bit drive": bad(
        with_columns(lambda c: [c[0], *(str(1023 * int(v)) for v in c[1:4]), *c[4:]]), "line 2", "1023"
    ),
    "negative drive": bad(SMALL.replace("0,1,0,0,", "0,1,-0.1,0,", 1), "line 3", "negative"),
    "collinear primaries": bad(
        SMALL.replace("0.3000,0.6000", "0.3950,0.1950").replace("0.3010,0.5990", "0.3960,0.1955"), "on one line"
    ),
    "two primaries alike": bad(SMALL.replace("0.1500,0.0600", "0.3000,0.6000"), "on one line"),
    "white on the line of two primaries": bad(
        SMALL.replace("0.3127,0.3290", "0.4700,0.4650").replace("0.3200,0.3400", "0.4700,0.4650"), "line", "singular"
    ),
    "relative luminance": bad(
        with_columns(lambda c: [*c[:6], str(float(c[6]) / 250)]), "hour 0", "cd/m²", "relative"
    ),
    "swapped channels in the header": bad(SMALL.replace("R,G,B", "B,G,R"), "swapped"),
    "swapped channels R and G": bad(with_columns(swap(1, 2)), "swapped"),
    "X and Z swapped in the header": bad(xyz_text(SMALL).replace("X,Y,Z", "Z,Y,X"), "hour 0", "are X and Z swapped"),
    "one code beyond 8 bits": bad(SMALL.replace("0,0,1,0,", "0,0,1.0039,0,", 1), "line 4", "1.0039 is just above 1"),
    "x and y swapped in the header": bad(
        SMALL.replace("x,y,Y", "y,x,Y"), "hour 0", "are the R, G, B columns swapped, or x and y (X and Y)?"
    ),
    "commas below a header with semicolons": bad(
        SMALL.replace(",", ";", 6), "line 2: commas separate its fields, and semicolons those of the header"
    ),
    "commas below a header with tabs": bad(SMALL.replace(",", "\t", 6), "line 2: commas", "tabs those of the header"),
    "a row of one field": bad(SMALL + "7\n", "line 10: 1 field for 7 columns"),
    "an hour of millennia": bad(
        SMALL.replace("1000,", "3000000000,"), "line 6: hour must be", "3000000000, is out of range: 0 to 10000000 are"
    ),
    "a row of sums": bad(SMALL + "Summe,,,,,,1400.5\n", "line 10, column hour: 'Summe'", "Remove rows that hold no"),
    "a row of one word": bad(SMALL + "Summe\n", "line 10, column hour: 'Summe'", "Remove rows that hold no"),
    "a row of a word below names": bad(
        "".join(f"{'a' if at else 'name'},{row}\n" for at, row in enumerate(SMALL.splitlines())) + "Mittel,,,,,,,\n",
        "line 10, column name: 'Mittel'", "Remove rows that hold no",
    ),
    "a column of luminance": bad(SMALL.replace("x,y,Y", "x,y,Luminance"), "line 1", "Is 'Luminance' Y in cd/m²?"),
    "an unknown column": bad(SMALL.replace("hour,", "hours,"), "line 1", "'hours'", "Pick one of"),
    "a column twice": bad(SMALL.replace("R,G,B", "R,R,B"), "line 1", "'R' appears twice"),
    "no column of drive": bad("hour,G,B,x,y,Y\n0,1,1,0.3,0.3,100\n", "line 1", "lacks R"),
    "no column of colour": bad("hour,R,G,B,x,y\n0,1,1,1,0.3,0.3\n", "line 1", "X,Y,Z or x,y,Y"),
    "both kinds of colour": bad("hour,R,G,B,X,Y,Z,x,y\n0,1,1,1,95,100,108,0.31,0.33\n", "line 1", "both"),
    "a row too long": bad(with_line(RED, "54.611", "54.611,1"), f"line {RED}", "8 fields for 7 columns"),
    "a row too short": bad(with_line(RED, ",54.611", ""), f"line {RED}", "6 fields for 7 columns"),
    "a cell of 200 kB": bad(SMALL.rstrip("\n") + ',"' + 200_000 * "9" + '"\n', "line 9", "no row of a CSV", "shorter"),
    "u off the screen": bad(plus("u", ["0.5"] * 7 + ["1.5"]), "line 9", "u "),
    "v in percent": bad(plus("v", "50"), "line 2", "v "),
    "window above the whole screen": bad(plus("window", "100"), "line 2", "window "),
    "window of nothing": bad(plus("window", "0"), "line 2", "window "),
    "surround in 8 bits": bad(plus("surround", "128"), "line 2", "surround "),
    "negative ambient light": bad(plus("ambient_lx", "-5"), "line 2", "ambient_lx "),
    "negative minutes": bad(plus("warmup_min", "-5"), "line 2", "warmup_min "),
    "absolute zero": bad(plus("temperature_c", "-300"), "line 2", "temperature_c "),
    "NaN in an optional column": bad(plus("u", ["0.5"] * 7 + ["nan"]), "line 9", "column u"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_in_one_sentence_that_names_it_and_helps(name: str, tmp_path: Path) -> None:
    path = file_with(tmp_path, BAD[name].content)
    with pytest.raises(LutgenError) as error:
        DisplayModel(read_measurements(path))
    message = str(error.value)
    assert str(path) in message
    assert "\n" not in message
    for fragment in BAD[name].says:
        assert fragment in message, message
    # The message states the fault, and then what is allowed or what to do.
    assert len(message.replace(str(path), "").split()) >= 6, message


@pytest.mark.parametrize(
    "name",
    ["empty", "binary", "NaN", "a decimal comma", "a missing primary", "8-bit drive",
     "white on the line of two primaries"],
)  # fmt: skip
def test_the_command_line_prints_that_sentence_exits_with_2_and_writes_nothing(name: str, tmp_path: Path) -> None:
    path = file_with(tmp_path, BAD[name].content)
    before = set(tmp_path.rglob("*"))
    done = here("build", "--display", path, "-o", tmp_path / "out")
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("lutgen: error: ")
    assert done.stderr.count("\n") == 1
    for fragment in BAD[name].says:
        assert fragment in done.stderr
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda folder: folder / "none.csv", "no such file"),
        (lambda folder: folder, "holds no readings"),
        (lambda folder: file_with(folder, "prose, and more").rename(folder / "display.xlsx"), "Pick one of"),
        (lambda folder: (folder / "folder.csv").mkdir() or folder / "folder.csv", "holds no readings"),
    ],
)
def test_what_is_no_table_is_refused(make: Callable[[Path], Path], says: str, tmp_path: Path) -> None:
    path = make(tmp_path)
    with pytest.raises(LutgenError, match=re.escape(str(path))) as error:
        read_measurements(path)
    assert says in str(error.value)


def test_a_file_that_is_larger_than_any_table_is_refused_without_reading_it(tmp_path: Path) -> None:
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.truncate(10**12)  # sparse
    with pytest.raises(LutgenError, match="larger than"):
        read_measurements(path)


def test_a_table_is_known_by_its_content_whatever_its_name(tmp_path: Path) -> None:
    path = file_with(tmp_path, SMALL).rename(tmp_path / "display")
    assert read_measurements(path).hours[-1] == 1000


@pytest.mark.parametrize("name", ["ambient_lux", "hours", "temperature", "temp_c", "warmup", "Window", "window_share"])
def test_a_column_whose_name_is_nearly_known_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=rf"unknown column '{name}' in the header; is \w+ meant\?"):
        read_measurements(file_with(tmp_path, plus(name, "1")))


@pytest.mark.parametrize(("white", "message"), [("2500", "white has Y = 2500"), ("12", "white has Y = 12")])
def test_a_white_that_its_primaries_cannot_add_up_to_is_refused(white: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=rf"hour 0: {message} and red, green and blue together 252.* mistyped\?"):
        read_measurements(file_with(tmp_path, SMALL.replace("0.3290,250", f"0.3290,{white}", 1)))


@pytest.mark.parametrize("name", ["time", "operating_hours", "h", "Age (months)", "date", "Year"])
def test_a_table_without_hours_is_not_one_session_where_another_column_holds_times(name: str, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=rf"column '{re.escape(name)}' looks like times, .* Call it hour"):
        read_measurements(file_with(tmp_path, SMALL.replace("hour,", f"{name},", 1)))


def test_the_time_of_each_reading_divides_no_session(tmp_path: Path) -> None:
    head, *rows = [line for line in SMALL.splitlines() if not line.startswith("#")]
    stamped = [f"12:{minute:02d}{row[row.index(',') :]}" for minute, row in enumerate(rows)]
    text = "\n".join([head.replace("hour", "time"), *stamped]) + "\n"
    assert np.unique(read_measurements(file_with(tmp_path, text)).hours).tolist() == [0.0]


def test_another_column_is_left_alone_with_a_remark(tmp_path: Path) -> None:
    readings = read_measurements(file_with(tmp_path, plus("operator", "hm", plus("CCT", "6500"))))
    assert readings.remarks == ("Columns CCT, operator: not known to lutgen, and left alone.",)
    assert set(readings.constants) == set(readings.conditions) == set()


# Fuzz: a table with any changed bytes is read or refused

MUTATION = st.tuples(
    st.sampled_from(["delete", "insert", "replace", "truncate", "repeat"]),
    st.integers(0, len(DEFAULT)),
    st.one_of(
        st.binary(min_size=1, max_size=8),
        st.sampled_from(
            [b",", b"\n", b"\r", b'"', b"-", b".", b"e", b"#", b"\x00", b"nan", b"inf", b"1e308", b"-1e308", b"1e-320",
             b"99999999999", b"\xff\xfe", b"\xef\xbb\xbf", b"\x0c", b"\xe2\x80\xa8", b"_", b"0x", b"\xd9\xa3"],
        ),
    ),
    st.integers(0, 400),
)  # fmt: skip


def mutate(data: bytes, kind: str, place: int, piece: bytes, length: int) -> bytes:
    before, after = data[:place], data[place:]
    return {
        "delete": before + after[length:],
        "insert": before + piece + after,
        "replace": before + piece + after[len(piece) :],
        "truncate": before,
        "repeat": before + after[:length] + after,
    }[kind]


def read_or_refused(folder: Path, content: bytes) -> None:
    path = file_with(folder, content)
    try:
        model = DisplayModel(read_measurements(path))
        last = float(model.tips.hours[-1])
        shown = model.at("chroma", last).code_to_code(np.full((1, 3), 0.5))
    except LutgenError as error:
        assert "\n" not in str(error)  # noqa: PT017
        assert "display.csv" in str(error)  # noqa: PT017
    else:
        assert np.isfinite(shown).all()


FUZZ = draws(150, suppress_health_check=[HealthCheck.function_scoped_fixture])


@FUZZ
@given(st.lists(MUTATION, min_size=1, max_size=4))
def test_a_mutated_display_is_read_or_refused(tmp_path: Path, mutations: list[tuple[str, int, bytes, int]]) -> None:
    content = DEFAULT
    for mutation in mutations:
        content = mutate(content, *mutation)
    read_or_refused(tmp_path, content)


CELL = st.one_of(
    st.floats().map(repr),
    st.sampled_from(
        ["0", "1", "", "nan", "inf", "-0", "1e-320", "1e308", "0.3", "255", '"', "#", "٣", "1_0", "1e", "\x85"]
    ),
)


@FUZZ
@given(st.lists(st.tuples(st.integers(0, 8), st.integers(0, 6), CELL), min_size=1, max_size=4))
def test_a_table_with_other_numbers_in_some_cells_is_read_or_refused(
    tmp_path: Path, changes: list[tuple[int, int, str]]
) -> None:
    for text in (SMALL, xyz_text(SMALL)):
        cells = [line.split(",") for line in text.splitlines()]
        for row, column, value in changes:
            cells[row][column] = value
        read_or_refused(tmp_path, "\n".join(",".join(row) for row in cells).encode())


@FUZZ
@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_refused(tmp_path: Path, content: bytes) -> None:
    read_or_refused(tmp_path, content)
