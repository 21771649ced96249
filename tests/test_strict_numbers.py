"""A number consists of the digits 0 to 9 and a decimal point, for every reader and option of the project."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from lutgen.display import default_display
from lutgen.display.conditions import parse_at
from lutgen.display.tips import Tips, luminance_law, parse_hours
from lutgen.effects.formula import read_formula
from lutgen.errors import LutgenError
from lutgen.history.history import parse_limit
from lutgen.readings import read_measurements, read_session
from lutgen.study.design import condition_of
from lutgen.study.protocol import ease_of
from lutgen.study.tables import read_rows
from tests.command import in_process

pytestmark = pytest.mark.numbers

#: Text that Python's float and int accept, and that no measuring program writes.
LOOSE = ("1_000", "１", "٣", "1\u00a0", "infinity")

READINGS = """\
hour,R,G,B,x,y,Y
0,1,1,1,0.3127,0.3290,{0}
0,1,0,0,0.6400,0.3300,54
0,0,1,0,0.3000,0.6000,180
0,0,0,1,0.1500,0.0600,18
"""
CGATS = """\
CGATS.17
NUMBER_OF_FIELDS 6
BEGIN_DATA_FORMAT
RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z
END_DATA_FORMAT
BEGIN_DATA
255 255 255 95 100 {0}
255 0 0 41 21 2
END_DATA
"""
PATCHES = "R,G,B,X,Y,Z\n1,1,1,95,100,{0}\n1,0,0,41,21,2\n"
UNIFORMITY = "position,row,col,level_index,X,Y,Z\n1,0,0,0,95,100,{0}\n"
STUDY = "session,image\n{0},a\n"
LAW = "hour,factor\n0,1\n{0},0.5\n18000,0.4\n"


def law(text: str, folder: Path) -> object:
    (folder / "law.csv").write_text(text, encoding="utf-8")
    return luminance_law(str(folder / "law.csv"))


def readings(text: str, folder: Path) -> object:
    (folder / "readings.csv").write_text(text, encoding="utf-8")
    return read_measurements(folder / "readings.csv")


def session(text: str, folder: Path) -> object:
    (folder / "session.txt").write_text(text, encoding="utf-8")
    return read_session(folder / "session.txt")


def study(text: str, folder: Path) -> object:
    (folder / "study.csv").write_text(text, encoding="utf-8")
    return [row.whole("session", low=1) for row in read_rows(folder / "study.csv", ("session", "image"))[1]]


FILES: dict[str, tuple[Callable[[str, Path], object], str, str]] = {
    "readings": (readings, READINGS, "250"),
    "CGATS": (session, CGATS, "108"),
    "patches": (session, PATCHES, "108"),
    "uniformity": (session, UNIFORMITY, "108"),
    "study table": (study, STUDY, "1"),
    "luminance table": (law, LAW, "900"),
}


@pytest.mark.parametrize("name", FILES)
def test_every_reader_takes_a_plain_number(name: str, tmp_path: Path) -> None:
    read, text, plain = FILES[name]
    read(text.format(plain), tmp_path)


# A Unicode blank separates the words of a CGATS file like any other blank.
@pytest.mark.parametrize("loose", [*LOOSE, "#N/A"])
@pytest.mark.parametrize("name", FILES)
def test_no_reader_takes_what_only_python_reads_as_a_number(name: str, loose: str, tmp_path: Path) -> None:
    read, text, _ = FILES[name]
    if (name, loose) == ("CGATS", "1\u00a0"):
        loose = "1\u00a02"
    with pytest.raises(LutgenError, match=r"number|fields"):
        read(text.format(loose), tmp_path)


ERRORS = ("#N/A", "#DIV/0!", "#WERT!")


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize(
    ("read", "text"),
    [
        (readings, READINGS.format(250) + "{0},1,1,1,0.3127,0.3290,250\n"),
        (session, CGATS.format(108).replace("END_DATA\n", "").replace("255 0 0 ", "{0} 0 0 ") + "END_DATA\n"),
        (session, PATCHES.format(108) + "{0},1,1,95,100,108\n"),
        (study, STUDY.format(1) + "{0},b\n"),
        (law, LAW.format(900) + "{0},0.5\n"),
    ],
)
def test_a_row_that_begins_with_a_spreadsheets_error_is_no_comment(
    read: Callable[[str, Path], object], text: str, error: str, tmp_path: Path
) -> None:
    with pytest.raises(LutgenError, match="#"):
        read(text.format(error), tmp_path)


def test_comments_stay_comments(tmp_path: Path) -> None:
    readings("# the first\n#####\n#0,1,1,1,1,1,1\n" + READINGS.format(250), tmp_path)
    law("# the first\n##\n" + LAW.format(900), tmp_path)


@pytest.mark.parametrize("loose", [*LOOSE[:3], "1_0000", "nan", "#N/A", ".5"])
def test_no_span_of_hours_takes_them(loose: str) -> None:
    tips = Tips.of(read_measurements(default_display()))
    for text in (loose, f"0..{loose}", f"{loose}..18000", f"0..18000:{loose}", f"0,{loose}"):
        with pytest.raises(LutgenError, match="number of hours"):
            parse_hours(text, tips)


@pytest.mark.parametrize("loose", [*LOOSE, "６０", "nan"])
def test_no_small_reader_takes_them(loose: str) -> None:
    for refuse in (
        lambda: parse_at((f"ambient_lx={loose}",)),
        lambda: parse_limit(f"white>={loose}"),
        lambda: condition_of(f"chroma@{loose}"),
        lambda: ease_of(f"1..{loose}"),
        lambda: ease_of("1.." + "9" * 5000),
    ):
        with pytest.raises(LutgenError):
            refuse()


@pytest.mark.parametrize("number", ["1_000", "0x10", "0b1"])
def test_no_formula_takes_them(number: str) -> None:
    with pytest.raises(LutgenError, match="is no number"):
        read_formula(f"xyz + {number}*k")


LOOSE_OPTIONS = (
    ("build", "--hours", "1_0000", "-o", "x"),
    ("build", "--hours", "0", "--at", "ambient_lx=６０", "-o", "x"),
    ("build", "--hours", "0", "--tolerance", "0_1", "-o", "x"),
    ("build", "--hours", "0", "--tolerance", "nan", "-o", "x"),
    ("build", "--hours", "0", "--cubesize", "３３", "-o", "x"),
    ("build", "--hours", "0", "--jobs", "１", "-o", "x"),
    ("apply", "x.png", "--mode", "chroma", "--hours", "1_0000", "-o", "y.png"),
    ("check", "x.cube", "--mode", "chroma", "--hours", "1_0000"),
    ("check", "x.cube", "--mode", "chroma", "--hours", "0", "--max-delta-e", "nan"),
    ("compare", str(default_display()), "--instrument", "0.002,0_003"),
    ("lifetime", "x.png", "--tolerance", "３"),
    ("map", "x.png", "--mode", "chroma", "--hours", "0", "--range", "0,1_2", "-o", "y.png"),
    ("study", "plan", "x", "--seed", "１", "-o", "y"),
    ("study", "power", "--readers", "1_0"),
    ("study", "run", "x", "--reader", "a", "--session", "１"),
)


@pytest.mark.parametrize("arguments", LOOSE_OPTIONS, ids=" ".join)
def test_no_option_takes_them(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    done = in_process(monkeypatch, capsys)(*arguments)
    assert done.code == 2
    assert "number" in done.err or "0,1_2: give the two ends" in done.err
    assert not done.out
    assert not list(tmp_path.iterdir())


def test_no_other_pattern_of_numbers_is_left() -> None:
    lines = subprocess.run(
        ["grep", "-rnE", r"\[eE\]\[[-+]{2}\]\?", "lutgen", "--include=*.py"],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=False,
    ).stdout.splitlines()
    assert [line.split(":")[0] for line in lines] == ["lutgen/cells.py"]
