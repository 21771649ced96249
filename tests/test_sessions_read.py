"""Sessions in the files of programs: read correctly, or refused with a helpful sentence; never wrong values."""

from __future__ import annotations

import csv
import re
import time
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from examples.make_session import FILE, alike, session_text
from lutgen import LutgenError
from lutgen.readings import read_session
from lutgen.readings.formats import readers
from lutgen.readings.formats._source import FileText
from tests.quick import draws
from tests.real_data import real_data
from tests.session_files import DRIVE, LEAK, WHITE_CD_M2, curves, light, ti3

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

pytestmark = pytest.mark.numbers

LAB = ("LAB_L", "LAB_A", "LAB_B")
XYZ, XYY = ("XYZ_X", "XYZ_Y", "XYZ_Z"), ("XYY_X", "XYY_Y", "XYY_CAPY")
D50 = np.array([0.9642, 1.0, 0.8249])


def read(folder: Path, content: str | bytes, name: str = "session.ti3") -> Session:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_session(path)


def test_an_argyll_session_is_read_as_it_is_meant(tmp_path: Path) -> None:
    session = read(tmp_path, ti3(calibration=curves(1.0, 0.95, 0.9)))
    np.testing.assert_allclose(session.drive, DRIVE, atol=1e-6)
    np.testing.assert_allclose(session.xyz_cd_m2, WHITE_CD_M2 * light(), atol=1e-4)
    assert session.created == datetime(2020, 5, 26, 13, 21, 48)  # noqa: DTZ001 - local time
    assert session.display == "invented"
    assert session.metadata["DESCRIPTOR"] == 'an "invented" display'
    assert session.calibration is not None
    assert session.calibration[-1].tolist() == [1.0, 1.0, 0.95, 0.9]
    assert session.kinds[:3] == ("white", "black", "grey")
    assert {*session.kinds} == {"white", "black", "grey", "red", "green", "blue", "mixture"}
    assert session.lines[0] == ti3().splitlines().index("BEGIN_DATA") + 2


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace(" ", "\t"),
        lambda text: text.replace("invented", "erfunden von Müller").encode("latin-1"),
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\nDESCRIPTOR", '\nKEYWORD "ROOM"\nROOM "dark # not a comment"\nDESCRIPTOR', 1),
        lambda text: text.replace("\n0 ", "\nA1 ", 1),
        lambda text: text.replace("XYZ_X XYZ_Y XYZ_Z\n", "XYZ_X\nXYZ_Y XYZ_Z\n"),
    ],
    ids=[
        "CRLF",
        "CR",
        "tabs",
        "latin-1",
        "utf-8 with mark",
        "utf-16",
        "own keyword",
        "text as id",
        "format on two lines",
    ],
)
def test_how_the_text_is_written_does_not_matter(tmp_path: Path, change: object) -> None:
    assert callable(change)
    session = read(tmp_path, change(ti3()))
    np.testing.assert_allclose(session.xyz_cd_m2, WHITE_CD_M2 * light(), atol=1e-4)


def test_columns_may_stand_in_any_order_and_rows_go_on_in_the_next_line(tmp_path: Path) -> None:
    text = ti3(DRIVE[:, ::-1]).replace("RGB_R RGB_G RGB_B", "RGB_B RGB_G RGB_R")
    np.testing.assert_allclose(read(tmp_path, text).drive, DRIVE, atol=1e-6)
    lines = ti3().splitlines()
    first = lines.index("BEGIN_DATA") + 1
    lines[first] = lines[first].replace(" ", "\n", 3)
    np.testing.assert_allclose(read(tmp_path, "\n".join(lines)).drive, DRIVE, atol=1e-6)


def lab_under(
    white: Array,
) -> Array:
    """CIE 15:2018, 8.2.1, as a second implementation."""
    f = np.array([[t ** (1 / 3) if t > 0.008856 else 7.787 * t + 16 / 116 for t in row] for row in light() / white])
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


#: Text, and Y of white in cd/m², or None if Y is relative.
SCALES = {
    "absolute": (ti3(xyz=150.0 * light(), keywords=('NORMALIZED_TO_Y_100 "NO"',)), 150.0),
    "without luminance": (ti3(keywords=('NORMALIZED_TO_Y_100 "YES"',)), None),
    "old Argyll": (ti3(keywords=('LUMINANCE_XYZ_CDM2 "190 200 210"',)), 200.0),
    "nothing said": (ti3(keywords=()), None),
    "another program, 8 bit": (ti3(kind="CGATS.17", scale=255.0, keywords=()), None),
    "another program, 0..1": (ti3(kind="CGATS.17", scale=1.0, xyz=light(), keywords=()), None),
    "Lab of Argyll": (ti3(xyz=lab_under(D50), names=LAB, keywords=()), None),
    "Lab under D50": (
        ti3(kind="CGATS.17", xyz=lab_under(D50), names=LAB, keywords=('ILLUMINANT "D50"',)),
        None,
    ),
    "xyY": (
        ti3(
            xyz=np.column_stack([light()[:, :2] / light().sum(axis=1, keepdims=True), 100 * light()[:, 1]]),
            names=XYY,
        ),
        200.0,
    ),
    "CSV, 8 bit": (
        "R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n"
        + "\n".join(",".join(f"{v:.6f}" for v in (*(255 * d), *(90 * c))) for d, c in zip(DRIVE, light(), strict=True)),
        90.0,
    ),
    "CSV, percent": (
        "# drive: percent\nname;R;G;B;X;Y;Z\n"
        + "\n".join(
            ";".join(("p", *(f"{v:.6f}" for v in (*(100 * d), *(90 * c))))) for d, c in zip(DRIVE, light(), strict=True)
        ),
        90.0,
    ),
    "CSV, relative": (
        "R,G,B,X,Y,Z\n"
        + "\n".join(",".join(f"{v:.6f}" for v in (*d, *c)) for d, c in zip(DRIVE, light(), strict=True)),
        None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCALES)
def test_drive_is_0_to_1_and_light_is_absolute_only_where_the_file_says_so(tmp_path: Path, name: str) -> None:
    text, white = SCALES[name]
    session = read(tmp_path, text)
    np.testing.assert_allclose(session.drive, DRIVE, atol=1e-5)
    np.testing.assert_allclose(session.xyz, (white or 1.0) * light(), atol=2e-5 * (white or 1.0))
    assert session.absolute is (white is not None)
    if white is None:
        assert any("relative" in remark for remark in session.remarks)
        with pytest.raises(LutgenError, match="relative to white"):
            _ = session.xyz_cd_m2


def table(scale: float, *head: str, columns: str = "R,G,B,X,Y,Z", tail: str = "") -> str:
    """The display's session as a CSV with ``scale`` for white, between head lines and a tail."""
    rows = [",".join(f"{v:.8g}" for v in (*d, *(scale * c))) for d, c in zip(DRIVE, light(), strict=True)]
    return "\n".join([*head, columns, *rows]) + "\n" + tail


WRITTEN_OTHERWISE = {
    "a spreadsheet's line of the separator": table(90.0, "sep=,"),
    "a spreadsheet's empty rows": table(90.0, tail=",,,,,\n,,,,,\n"),
    "Argyll's names of columns": table(90.0, columns="RGB_R,RGB_G,RGB_B,XYZ_X,XYZ_Y,XYZ_Z"),
    "names that say whose they are": table(90.0, columns="Device R,Device G,Device B,CIE X,CIE Y,CIE Z"),
    "with units": table(90.0, columns="CodeR,CodeG,CodeB,Measured X (cd/m2),Measured Y (cd/m2),Measured Z (cd/m2)"),
    "Windows": table(90.0).replace("\n", "\r\n"),
    "tabs": table(90.0).replace(",", "\t"),
    "white stated, XYZ to 100": table(100.0, "# white_cd_m2: 90"),
    "white stated, XYZ to 77": table(77.0, "# white_cd_m2: 90"),
}


@pytest.mark.parametrize("name", WRITTEN_OTHERWISE)
def test_a_table_as_programs_write_it_is_the_same_session(tmp_path: Path, name: str) -> None:
    session = read(tmp_path, WRITTEN_OTHERWISE[name])
    np.testing.assert_allclose(session.xyz_cd_m2, 90.0 * light(), atol=1e-4)
    np.testing.assert_allclose(session.drive, DRIVE, atol=1e-6)


def test_a_title_above_the_header_is_no_header(tmp_path: Path) -> None:
    (tmp_path / "titled.csv").write_text("Room 3\n\n" + table(90.0))
    with pytest.raises(LutgenError, match=r"line 1: the header lacks R, G, B.* A title above the header begins with #"):
        read_session(tmp_path / "titled.csv")


def test_a_header_without_a_unit_is_said_with_the_luminance_of_white(tmp_path: Path) -> None:
    (remark,) = read(tmp_path, table(77.0, columns="RGB_R,RGB_G,RGB_B,XYZ_X,XYZ_Y,XYZ_Z")).remarks
    assert "taken as cd/m², of which white has 77:" in remark
    assert "# white_cd_m2:" in remark
    with pytest.raises(LutgenError, match=r"# white_cd_m2: 120\.0"):
        _ = read(tmp_path, table(100.0)).xyz_cd_m2


def test_spectra_come_with_their_wavelengths(tmp_path: Path) -> None:
    spectra = np.arange(3 * len(DRIVE), dtype=np.float64).reshape(-1, 3)
    text = ti3(
        xyz=np.hstack([100 * light(), spectra]), names=("XYZ_X", "XYZ_Y", "XYZ_Z", "SPEC_380", "SPEC_390", "SPEC_400")
    )
    session = read(tmp_path, text)
    assert session.wavelengths is not None
    assert session.spectra is not None
    assert session.wavelengths.tolist() == [380.0, 390.0, 400.0]
    np.testing.assert_allclose(session.spectra, spectra)


@pytest.mark.parametrize(
    ("text", "year", "remark"),
    [
        ("Tue May 26 13:21:48 2020", 2020, ""),
        ("Tue Dec  5 17:23:39 2017", 2017, ""),
        ("2020-05-26T13:21:48", 2020, ""),
        ("May 26, 2020", 2020, ""),
        ("26.05.2020", 2020, ""),
        ("05/06/2020", None, "is unknown or ambiguous"),
        ("2020-13-01", None, "is no date"),
        ("Fri Jan  1 00:00:00 1904", None, "not plausible"),
        ("2106-02-07", None, "not plausible"),
        ("last Tuesday", None, "is unknown or ambiguous"),
    ],
)
def test_a_date_is_read_or_doubted_in_a_sentence(tmp_path: Path, text: str, year: int | None, remark: str) -> None:
    session = read(tmp_path, ti3().replace("Tue May 26 13:21:48 2020", text))
    assert (session.created.year if session.created else None) == year
    assert remark in " ".join(session.remarks)
    assert bool(remark) == bool(session.remarks)


def test_a_uniformity_table_has_places_on_the_screen(tmp_path: Path) -> None:
    rows = [
        f"{3 * r + c},{r},{c},{n},{b * 1},{b * 1.05},{b * 1.1}"
        for r in range(3)
        for c in range(3)
        for n, b in enumerate((200, 110, 45, 10))
    ]
    text = "position,row,col,level_index,X,Y,Z\n" + "\n".join(rows) + "\n"
    session = read(tmp_path, text, "u.csv")
    assert session.lines[0] == 2
    assert read(tmp_path, f"\n\n{text}", "u.csv").lines[0] == 4
    assert session.positions is not None
    assert session.positions[4 * 5].tolist() == pytest.approx([5 / 6, 1 / 2])
    assert session.drive[:4, 0].tolist() == [1.0, 0.75, 0.5, 0.25]
    assert session.rows("white").tolist() == [16]


LINES = ti3(calibration=curves(1, 1, 1)).splitlines()
ROW = LINES.index("BEGIN_DATA") + 1


def edited(row: int, old: str, new: str) -> str:
    """The small file with one change in one row of its data."""
    lines = list(LINES)
    assert old in lines[ROW + row]
    lines[ROW + row] = lines[ROW + row].replace(old, new, 1)
    return "\n".join(lines) + "\n"


#: Content, and the words of the error.
BAD: dict[str, tuple[str | bytes, str]] = {
    "a field deleted": (edited(0, " 100.0000000", ""), rf"line {ROW + 1}: .* fields where the data format names 7"),
    "a field too many": (edited(2, "2 ", "2 2 "), "fields where the data format names 7"),
    "a decimal comma": (edited(0, "100.0000000", "100,00000"), "a decimal comma"),
    "a word": (edited(3, "25.0000000", "dark"), "'dark' is not a finite number"),
    "not a number": (edited(3, "25.0000000", "nan"), "is not a finite number"),
    "too large": (edited(3, "25.0000000", "1e999"), "is not a finite number"),
    "percent as 8 bit": (ti3(scale=255.0), "RGB reaches 255"),
    "percent as fraction": (ti3(scale=1.0), "RGB reaches only 1"),
    "negative drive": (edited(3, "25.0000000", "-25.0000000"), "drive is outside"),
    "no light": (edited(3, LINES[ROW + 3].split()[5], "-900.0"), "XYZ is outside"),
    "white without light": (edited(0, " ".join(LINES[ROW].split()[5:]), "0.0 110.0"), "white has no light"),
    "not normalised": (ti3(xyz=light()), "Y should be normalised to 100"),
    "cut off in the data": ("\n".join(LINES[: ROW + 5]), "without END_DATA"),
    "cut off in a row": ("\n".join(LINES)[: len("\n".join(LINES[: ROW + 5])) + 9], "without END_DATA|fields where"),
    "cut off in the calibration": ("\n".join(LINES[:-3]), "without END_DATA"),
    "cut off before the data": ("\n".join(LINES[:5]), "before its data"),
    "cut off in a string": ('CTI3\nDESCRIPTOR "an inv', "a string begins with a quote"),
    "a row deleted": ("\n".join(LINES[:ROW] + LINES[ROW + 1 :]), "NUMBER_OF_SETS .* rows follow"),
    "wrong fields": (ti3().replace("NUMBER_OF_FIELDS 7", "NUMBER_OF_FIELDS 8"), "NUMBER_OF_FIELDS"),
    "a count in words": (ti3().replace("NUMBER_OF_FIELDS 7", "NUMBER_OF_FIELDS seven"), "no count"),
    "a column twice": (ti3().replace("XYZ_X XYZ_Y", "XYZ_Y XYZ_Y"), "appears twice"),
    "two sets": (ti3() + ti3(), "several sets of readings"),
    "a chart": (re.sub("XYZ_([XYZ])", r"OTHER_\1", ti3()), "no table has drive"),
    "a printer": (ti3().replace("RGB_R RGB_G RGB_B", "CMYK_C CMYK_M CMYK_Y"), "a printer's file"),
    "curves alone": ("\n".join(LINES[LINES.index("CAL    ") :]), "calibration curves without readings"),
    "curves that fall back": (ti3(calibration=curves(1, 1, 1)[[0, 2, 1, 3, 4]]), "must rise from 0 to 1"),
    "curves in percent": (ti3(calibration=100 * curves(1, 1, 1)), "between 0 and 1"),
    "luminance in words": (ti3(keywords=('LUMINANCE_XYZ_CDM2 "bright"',)), "three numbers"),
    "luminance of nothing": (ti3(keywords=('LUMINANCE_XYZ_CDM2 "0 0 0"',)), "no display's white"),
    "perhaps normalised": (ti3(keywords=('NORMALIZED_TO_Y_100 "MAYBE"',)), "Pick one of: YES, NO"),
    "Lab under nothing": (ti3(kind="CGATS.17", xyz=lab_under(D50), names=LAB, keywords=()), "reference white"),
    "drive of unknown range": (ti3(DRIVE[1:9], kind="CGATS.17", scale=255.0), "the largest drive is 229.5"),
    "one drive beyond percent": (ti3(np.vstack([DRIVE[:-1], [1.7, 0.5, 0.5]])), "RGB reaches 170 there"),
    "one drive beyond 1": (
        "R,G,B,X,Y,Z\n1,1,1,95,100,108\n0,0,0,.1,.1,.1\n1,0,0,41,21,2\n1.7,1,0,77,92,14\n",
        "line 5: a drive of 1.7, but full drive is 1 in all other lines",
    ),
    "no rows": (ti3(DRIVE[:0], kind="CGATS.17"), "the largest drive is 0"),
    "no white to tell by": (ti3(DRIVE[1:9], keywords=()), "has no white that shows it"),
    "wavelengths that fall": (
        ti3(xyz=np.hstack([100 * light(), light()[:, :2]]), names=(*XYZ, "SPEC_390", "SPEC_380")), "must rise"
    ),
    "a CSV with commas for points": ("R;G;B;X;Y;Z\n0;0;0;0,1;0,1;0,1\n1;1;1;95,1;100,0;108,1\n", "decimal commas"),
    "white stated of cd/m²": (
        "# white_cd_m2: 80\nR,G,B,X_cdm2,Y_cdm2,Z_cdm2\n1,1,1,76,80,87\n", "is in cd/m².* Delete white_cd_m2"
    ),
    "white stated and not read": ("# white_cd_m2: 80\nR,G,B,X,Y,Z\n1,0,0,76,80,87\n", "no reading of white"),
    "white stated in words": ("# white_cd_m2: bright\nR,G,B,X,Y,Z\n1,1,1,76,80,87\n", "white_cd_m2 is 'bright'"),
    "a CSV row cut off": ("R,G,B,X,Y,Z\n1,1,1,190,200,218\n0,0,0,0.1,0.1", "5 fields for 6 columns"),
    "a CSV without light": ("R,G,B,a,b,c\n1,1,1,190,200,218\n", "the header lacks X,Y,Z or x,y,Y"),
    "a CSV of hours": (
        "hour,R,G,B,X,Y,Z\n"
        + "".join(f"{h},1,1,1,95,100,108\n{h},1,0,0,41,21,2\n{h},0,1,0,36,71,12\n{h},0,0,1,18,7,95\n" for h in (0, 9)),
        "holds 2 sessions",
    ),
    "a CSV of fractions called percent": (
        "# drive: percent\nR,G,B,X_cdm2,Y_cdm2,Z_cdm2\n1,1,1,190,200,218\n0,0,0,0.1,0.1,0.1\n", "reaches only 1"
    ),
    "a CSV of an unknown scale of drive": (
        "# drive: 8bit\nR,G,B,X_cdm2,Y_cdm2,Z_cdm2\n255,255,255,190,200,218\n",
        r"unknown scale of drive in .* '8bit'\. Pick one of: 0\.\.1, percent, 8-bit, 10-bit",
    ),
    "a CSV with a dark white": (
        "R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n255,255,255,0,0,0\n255,0,0,41,21,2\n", "white has Y = 0: no light"
    ),
    "XYZ called Lab": (ti3(names=LAB), "no light has this Lab"),
    "a CSV of places in percent": (
        "R,G,B,X,Y,Z,u,v\n1,1,1,190,200,218,50,0.5\n", r"column u: must be the position from the left, 0\.\.1\.$"
    ),
    "a CSV without rows": ("R,G,B,X,Y,Z\n", "no readings"),
    "a level that is none": ("position,row,col,level_index,X,Y,Z\n0,0,0,7,1,1,1\n", "level_index is 0"),
    "empty": ("  \n", "the file is empty"),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "NUL bytes"),
    "a spreadsheet": (b"PK\x03\x04" + bytes(40), "a spreadsheet"),
    "prose": ("Dear colleague, the display is fine.\n", "is no CGATS"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_with_a_sentence(tmp_path: Path, name: str) -> None:
    content, message = BAD[name]
    with pytest.raises(LutgenError, match=message) as refused:
        read(tmp_path, content)
    assert str(tmp_path) in str(refused.value)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    for path, message in (
        (tmp_path, "is a folder"),
        (tmp_path / "none.ti3", "cannot read"),
        (tmp_path / "a\0b", "cannot read"),
    ):
        with pytest.raises(LutgenError, match=message):
            read_session(path)
    with (tmp_path / "huge.ti3").open("wb") as file:
        file.truncate(10**12)  # sparse
    with pytest.raises(LutgenError, match="larger than"):
        read_session(tmp_path / "huge.ti3")
    (tmp_path / "a.chc").write_bytes(b"HCFR\1\2")
    with pytest.raises(LutgenError, match="HCFR's own binary"):
        read_session(tmp_path / "a.chc")


def test_ten_thousand_patches_are_read(tmp_path: Path) -> None:
    drive = np.vstack([np.ones((1, 3)), np.random.default_rng(1).random((10_000, 3))])
    session = read(tmp_path, ti3(drive))
    np.testing.assert_allclose(session.xyz_cd_m2, WHITE_CD_M2 * light(drive), atol=1e-3)


@pytest.mark.parametrize(
    "content",
    [
        lambda: b"CTI3\nBEGIN_DATA_FORMAT\n" + b" ".join(b"F%d" % n for n in range(300_000)),
        lambda: b'CTI3\nDESCRIPTOR "' + 4_000_000 * b'""',
        lambda: b"CTI3\n" + 4_000_000 * b"\n",
        pytest.param(lambda: ti3().replace(LINES[ROW].split()[5], 3_000_000 * "9").encode(), marks=pytest.mark.slow),
        lambda: ti3().replace("Tue May 26", 1_000_000 * "1-").encode(),
        pytest.param(
            lambda: b"R,G,B,X,Y,Z," + b",".join(b"c%d" % n for n in range(60_000)) + b"\n1,1,1,1,1,1\n",
            marks=pytest.mark.slow,
        ),
        lambda: b"#" + 1_000_000 * b"a " + b"\nR,G,B,X,Y,Z\n0,0,0,0,0,0\n",
        lambda: b"R,G,B,X,Y,Z\n" + 200_000 * b"1,1,1,90,100,110\n",
        lambda: b'R,G,B,X,Y,Z\n1,1,1,1,1,"' + 200_000 * b"9",
        lambda: b"position,row,col,level_index,X,Y,Z\n0,0,0,0,1,1," + 200_000 * b"9",
    ],
    ids=[
        "columns",
        "quotes",
        "blank lines",
        "digits",
        "date",
        "CSV columns",
        "comment",
        "rows",
        "cell",
        "digits of a grid",
    ],
)
def test_files_made_to_be_slow_or_large_end_soon(tmp_path: Path, content: Callable[[], bytes]) -> None:
    data = content()
    started = time.process_time()
    check_read_or_refused(tmp_path / "slow", data)
    assert time.process_time() - started < 8.0  # a quadratic step would take minutes


def test_no_two_formats_claim_the_same_file() -> None:
    texts = [text for text, _ in SCALES.values()] + ["position,row,col,level_index,X,Y,Z\n"]
    for text in texts:
        assert sum(module.claims(FileText(text, "any", "")) for module in readers().values()) == 1


def test_the_example_is_what_its_script_writes_and_says_that_it_is_simulated() -> None:
    text = FILE.read_text(encoding="utf-8")
    assert alike(text, session_text())
    assert text.splitlines()[1].startswith("# SIMULATED, not measured")


# Fuzz: a session with any changed bytes is read or refused, and a session that is read is plausible

MUTATION = st.tuples(
    st.sampled_from(["delete", "insert", "replace", "truncate", "repeat", "swap lines"]),
    st.floats(0.0, 1.0),
    st.integers(1, 60),
    st.sampled_from(
        [b"\0", b'"', b"#", b" ", b"\n", b",", b"-", b"1e99", b"\xff", b"END_DATA", b"BEGIN_DATA", b"CAL\n", b"9"]
    ),
)


def mutated(data: bytes, changes: list[tuple[str, float, int, bytes]]) -> bytes:
    for kind, share, length, token in changes:
        at = int(share * len(data))
        if kind == "delete":
            data = data[:at] + data[at + length :]
        elif kind == "insert":
            data = data[:at] + token + data[at:]
        elif kind == "replace":
            data = data[:at] + token + data[at + len(token) :]
        elif kind == "truncate":
            data = data[:at]
        elif kind == "repeat":
            data = data[:at] + data[at : at + 50 * length] + data[at:]
        else:
            lines = data.split(b"\n")
            one, other = int(share * (len(lines) - 1)), min(length, len(lines) - 1)
            lines[one], lines[other] = lines[other], lines[one]
            data = b"\n".join(lines)
    return data


def check_read_or_refused(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    try:
        session = read_session(path)
    except LutgenError as error:
        if str(path) not in str(error):
            pytest.fail(f"does not name the file: {error}")
        return
    assert np.isfinite(session.xyz).all()
    assert session.drive.min() >= 0.0
    assert session.drive.max() <= 1.0
    assert session.xyz.shape == session.drive.shape == (len(session.lines), 3)
    assert len(session.names) == len(session.lines) == len(session.kinds)


SEEDS = {
    "ti3": ti3(calibration=curves(1, 0.9, 0.8)).encode(),
    "csv": SCALES["CSV, 8 bit"][0].encode(),
    "uniformity": b"position,row,col,level_index,X,Y,Z\n0,0,0,0,1.5,2.5,3.5\n1,0,1,3,1.5,2.5,3.5\n",
}


@pytest.mark.parametrize("name", SEEDS)
@given(changes=st.lists(MUTATION, min_size=1, max_size=4))
@draws(150)
def test_mutated_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, name: str, changes: list[tuple[str, float, int, bytes]]
) -> None:
    check_read_or_refused(tmp_path_factory.getbasetemp() / f"fuzz-{name}", mutated(SEEDS[name], changes))


@given(text=st.text(max_size=300))
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    check_read_or_refused(tmp_path_factory.getbasetemp() / "text", text.encode("utf-8", "surrogatepass"))
    check_read_or_refused(tmp_path_factory.getbasetemp() / "cgats", f"CTI3\n{text}".encode("utf-8", "surrogatepass"))


@given(place=st.floats(0.0, 0.999), field=st.integers(0, 6))
def test_a_field_that_is_lost_never_goes_unseen(
    tmp_path_factory: pytest.TempPathFactory, place: float, field: int
) -> None:
    lines = list(LINES)
    row = ROW + int(place * len(DRIVE))
    cells = lines[row].split()
    del cells[field]
    lines[row] = " ".join(cells)
    path = tmp_path_factory.getbasetemp() / "lost.ti3"
    path.write_text("\n".join(lines))
    with pytest.raises(LutgenError, match="fields where the data format names 7"):
        read_session(path)


def real_files() -> list[Path]:
    return sorted(path for path in (real_data() / "real").rglob("*") if path.suffix in {".ti3", ".csv"})


def stated_white_cd_m2(file: Path) -> float:
    """Y of white in the file's own text: Argyll's keyword, or a table's row of white (in the middle of the screen)."""
    text = file.read_text(encoding="utf-8", errors="replace")
    if match := re.search(r'LUMINANCE_XYZ_CDM2 "\S+ (\S+)', text):
        return float(match[1])
    rows = [*csv.DictReader(text.splitlines())]
    if "level_index" in rows[0]:
        return next(float(row["Y"]) for row in rows if (row["row"], row["col"], row["level_index"]) == ("1", "1", "0"))
    return next(float(row["Y_cdm2"]) for row in rows if {row[each] for each in "RGB"} == {"255.0"})


def test_every_real_session_is_read_in_cd_m2() -> None:
    files = real_files()
    assert len(files) >= 20
    for file in files:
        session = read_session(file)
        assert session.absolute
        white = session.xyz_cd_m2[session.rows("white"), 1]
        # The whites of one session differ. The file states one of them.
        stated = stated_white_cd_m2(file)
        assert white.min() - 1e-5 <= stated <= white.max() + 1e-5, file.name
        assert (session.calibration is not None) == (file.suffix == ".ti3")


@pytest.mark.slow
@given(data=st.data())
@draws(60)
def test_mutated_real_sessions_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    files = real_files()
    file = data.draw(st.sampled_from([min(files, key=lambda each: each.stat().st_size), files[0], files[-2]]))
    changes = data.draw(st.lists(MUTATION, min_size=1, max_size=3))
    check_read_or_refused(tmp_path_factory.getbasetemp() / "real", mutated(file.read_bytes(), changes))


def test_black_is_what_was_put_in(tmp_path: Path) -> None:
    session = read(tmp_path, ti3())
    np.testing.assert_allclose(session.xyz_cd_m2[session.rows("black"), 1], LEAK * WHITE_CD_M2, atol=1e-4)


def as_xyy(xyz: Array) -> Array:
    """Return x, y, Y with as many digits as ``ti3`` writes; light of 0 has no chromaticity."""
    return np.column_stack([xyz[:, 0] / xyz.sum(axis=1), xyz[:, 1] / xyz.sum(axis=1), xyz[:, 1]])


def xyy_csv(colours: Array) -> str:
    rows = [",".join(f"{value:.7f}" for value in (*d, *c)) for d, c in zip(DRIVE, colours, strict=True)]
    return "\n".join(["# unit: cd/m2", "R,G,B,x,y,Y", *rows]) + "\n"


@pytest.mark.parametrize("dark", [(-0.0015, 0.001, -0.0023), (0.002, -0.003, 0.0005), (0.01, 0.004, -0.001)])
@pytest.mark.parametrize("form", ["CGATS", "CSV"])
def test_noise_around_zero_is_read_from_xyy(form: str, dark: tuple[float, float, float], tmp_path: Path) -> None:
    """A black without light has an x or y below 0 or above 1; X, Y and Z are those of the meter all the same."""
    xyz = WHITE_CD_M2 * light()
    xyz[1] = dark
    assert (as_xyy(xyz)[1, :2].min() < 0) or (as_xyy(xyz)[1, :2].sum() > 1)
    text, name = xyy_csv(as_xyy(xyz)), "session.csv"
    if form == "CGATS":
        text, name = ti3(xyz=as_xyy(xyz), names=XYY, keywords=('NORMALIZED_TO_Y_100 "NO"',)), "session.ti3"
    session = read(tmp_path, text, name)
    assert session.absolute
    np.testing.assert_allclose(session.xyz, xyz, rtol=1e-5, atol=2e-6)


@pytest.mark.parametrize("form", ["CGATS", "CSV"])
@pytest.mark.parametrize("colour", [(0.31, -0.33, 50.0), (0.31, -0.33, 0.2), (0.3, 0.0, 0.001)])
def test_a_negative_y_of_light_is_refused_with_what_to_do(
    form: str, colour: tuple[float, float, float], tmp_path: Path
) -> None:
    xyy = as_xyy(WHITE_CD_M2 * light())
    xyy[5] = colour
    text, name, told = xyy_csv(xyy), "session.csv", "give a dark reading as X,Y,Z, or remove its row"
    if form == "CGATS":
        text, name = ti3(xyz=xyy, names=XYY, keywords=('NORMALIZED_TO_Y_100 "NO"',)), "session.ti3"
        told = "Delete the row, or export XYZ"
    with pytest.raises(LutgenError, match=told):
        read(tmp_path, text, name)
