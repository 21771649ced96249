"""Findings of lint on configs, CLF and older table formats, each compared with OpenColorIO's treatment of the file."""

import shutil
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.bake.readback import apply_lut
from lutgen.cells import number
from lutgen.errors import LutgenError
from lutgen.lint import lint, programs
from lutgen.lint.finding import CLF_IO, FFMPEG, OCIO_21, OCIO_26, OCIOCHECK, READS, REFUSES, WRONG, Linted, Trial
from lutgen.lint.programs import OPENCOLORIO, Refusal, opencolorio_reader, probe_colours, through_opencolorio
from tests.mesh_cases import BLUE, GREEN, MESHES, PLACES, mesh
from tests.quick import draws

ROOT = Path(__file__).parents[1]
OURS = ROOT / "configs/default/chroma/10000h"


def changed(folder: Path, old: str, new: str) -> Linted:
    """Lint the config of ``OURS`` with a change of its text."""
    shutil.copyfile(OURS / "aged.clf", folder / "aged.clf")
    text = (OURS / "config.ocio").read_text()
    assert old in text
    (folder / "config.ocio").write_text(text.replace(old, new))
    return lint(folder / "config.ocio")


def findings_of(report: Linted) -> dict[str, str]:
    return {each.rule: f"{each.level(report.readers)}: {each.line}: {each.what}" for each in report.findings}


@pytest.mark.parametrize("config", ["chroma/10000h", "stable/0h", "."])
def test_our_own_configs_are_clean(config: str) -> None:
    report = lint(ROOT / "configs/default" / config / "config.ocio")
    assert report.clean, report
    assert set(findings_of(report)) <= {"config-environment"}


@pytest.mark.parametrize(
    ("old", "new", "rule", "words"),
    [
        ("src: aged.clf", "src: gone.clf", "config-parts", "error: 53: view Aged of sRGB"),
        ("  data: Raw\n", "", "config-roles", "note: 11: has no role data"),
        ("default: Source signal", "default: Raw", "config-roles", "note: "),
        ("search_path: .", "search_path: ../luts:.", "config-files", "note: 5: searches ../luts, outside"),
        ("search_path: .", "search_path: /data/luts:.", "config-files", "absolute path"),
        ("src: aged.clf", 'src: "${SHOT}.clf"', "config-environment", "has no default"),
        ("{name: Raw, colorspace: Raw}", "{name: Raw, colorspace: Raw, looks: Aged display look}", "config-views",
         "has looks in the view Raw of sRGB"),
        ("profile_version: 2.1", "profile_version: 9.9", "config-version", "error: 1: asks for profile version 9.9"),
        ("ocio_profile_version: 2.1", "", "config-version", "error: 0: does not load"),
        ("strictparsing: true", "strictparsing: true\nnonsense: 1", "config-keys", "note: 7: OpenColorIO warns"),
        ("displays:\n", "displays: [\n", "config-version", "does not load"),
    ],
)  # fmt: skip
def test_a_fault_of_a_config_is_found(old: str, new: str, rule: str, words: str, tmp_path: Path) -> None:
    report = findings_of(changed(tmp_path, old, new))
    assert rule in report
    assert words in report[rule]


def test_many_views_are_told(tmp_path: Path) -> None:
    more = "".join(f"    - !<View> {{name: V{place}, colorspace: Raw}}\n" for place in range(4))
    report = changed(tmp_path, "active_views: [Aged, Un-aged, Raw]", "")
    assert "config-views" not in findings_of(report)
    text = (tmp_path / "config.ocio").read_text().replace("  sRGB:\n", f"  sRGB:\n{more}")
    (tmp_path / "config.ocio").write_text(text)
    assert "has 13 views" in findings_of(lint(tmp_path / "config.ocio"))["config-views"]


def test_a_table_without_an_interpolation_is_told(tmp_path: Path) -> None:
    shutil.copyfile(OURS / "aged.clf", tmp_path / "aged.clf")
    old, new = "src: aged.clf, interpolation: tetrahedral", "src: aged.cube"
    assert "states no interpolation for aged.cube" in findings_of(changed(tmp_path, old, new))["config-files"]


def test_rubbish_that_opencolorio_takes_for_an_empty_config_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "a.ocio").write_bytes(b"\0\xff\xfe\0" * 50)
    assert "error" in findings_of(lint(tmp_path / "a.ocio"))["config-version"]


# CLF and tables: OpenColorIO treats each file as lint says of the installed version

ROWS = "\n".join(f"{r:.6f} {g:.6f} {b * 0.8:.6f}" for r in (0, 1) for g in (0, 1) for b in (0, 1))
SMPTE = 'xmlns="http://www.smpte-ra.org/ns/2136-1/2024"'


def clf(root: str = 'id="a" compCLFversion="3"', node: str = 'outBitDepth="32f"', values: str = ROWS) -> str:
    how = "" if "interpolation" in node else 'interpolation="tetrahedral"'
    return (
        f'<ProcessList {root}><LUT3D inBitDepth="32f" {how} {node}><Array dim="2 2 2 3">\n{values}\n</Array></LUT3D>'
        "</ProcessList>"
    )


INDEX = range(2)
SPI3D = "SPILUT 1.0\n3 3\n2 2 2\n" + "".join(
    f"{r} {g} {b} {r * 0.9:.6f} {g * 0.8} {b * 0.7}\n" for r in INDEX for g in INDEX for b in INDEX
)
CSP = "CSPLUTV100\n3D\n\n" + "2\n0 1\n0 1\n" * 3 + "\n2 2 2\n" + "".join(
    f"{r * 0.9} {g * 0.8} {b * 0.7}\n" for b in INDEX for g in INDEX for r in INDEX
)  # fmt: skip

#: Suffix, content, the readers' outcome, and a rule that reports the fault.
TABLES: dict[str, tuple[str, str, str, str]] = {
    "clf": (".clf", clf(), READS, ""),
    "clf without id": (".clf", clf('compCLFversion="3"'), REFUSES, "clf-form"),
    "clf of version 4": (".clf", clf('id="a" compCLFversion="4"'), REFUSES, "loads"),
    "clf too short": (".clf", clf(values=ROWS[:-9]), REFUSES, "loads"),
    "clf with NaN": (".clf", clf(values=ROWS.replace("0.8", "nan", 1)), REFUSES, "loads"),
    "clf of an unknown encoding": (".clf", f'<?xml version="1.0" encoding="none"?>{clf()}', REFUSES, "clf-form"),
    "clf of an encoding of pairs": (".clf", f'<?xml version="1.0" encoding="gb2312"?>{clf()}', REFUSES, "clf-form"),
    "clf cut off": (".clf", clf()[:-20], REFUSES, "clf-form"),
    "clf of floats said to be integers": (".clf", clf(node='outBitDepth="10i"'), WRONG, "clf-form"),
    "clf of integers": (".clf", clf(node='outBitDepth="10i"', values=ROWS.replace("1.0", "1023.0")), READS, ""),
    "spi3d": (".spi3d", SPI3D, READS, ""),
    "spi3d too short": (".spi3d", SPI3D.rsplit("\n", 2)[0], REFUSES, "loads"),
    "spi3d too long": (".spi3d", f"{SPI3D}0 0 0 .5 .5 .5\n", WRONG, "table-numbers"),
    "spi3d with NaN": (".spi3d", SPI3D.replace("0.900000", "nan", 1), WRONG, "table-numbers"),
    "spi3d with decimal commas": (".spi3d", SPI3D.replace(".", ","), WRONG, "table-numbers"),
    "spi3d of any size": (".spi3d", SPI3D.replace("2 2 2", "100000 100000 100000"), REFUSES, "loads"),
    "csp": (".csp", CSP, READS, ""),
    "csp too short": (".csp", CSP.rsplit("\n", 2)[0], REFUSES, "loads"),
    "csp too long": (".csp", f"{CSP}0 0 0\n", WRONG, "table-numbers"),
    "csp of curves of three points": (".csp", CSP.replace("2\n0 1\n0 1\n", "3\n0 1 2\n0 1 2\n"), READS, ""),
    "csp without curves": (".csp", CSP.replace("2\n0 1\n0 1\n", "0\n"), READS, ""),
    "csp of one dimension": (
        ".csp",
        CSP.partition("\n\n2 2 2")[0].replace("3D", "1D") + "\n2\n0 0 0\n1 1 1\n",
        READS,
        "",
    ),
    "csp with NaN": (".csp", CSP.replace("0.9", "nan", 1), WRONG, "table-numbers"),
    "3dl": (".3dl", f"{PLACES}\n{mesh()}", READS, ""),
    "3dl too short": (".3dl", mesh(3).rsplit("\n", 2)[0], REFUSES, "loads"),
    "empty 3dl": (".3dl", "", REFUSES, "loads"),
}


@pytest.mark.parametrize("name", TABLES)
def test_what_is_said_of_clf_and_tables_is_what_opencolorio_does(name: str, tmp_path: Path) -> None:
    suffix, text, outcome, rule = TABLES[name]
    path = tmp_path / f"lut{suffix}"
    path.write_text(text)
    report = lint(path)
    assert report.fate(opencolorio_reader())[0].outcome == outcome
    assert report.clean == (outcome == READS)
    assert not rule or rule in findings_of(report)
    if name == "spi3d of any size":
        return  # OpenColorIO would ask for 12 PB
    try:
        through_opencolorio(path, probe_colours())
    except Refusal:
        assert outcome == REFUSES
    else:
        assert outcome != REFUSES


@pytest.mark.parametrize("name", MESHES)
def test_what_is_said_of_a_3dl_is_what_opencolorio_does(name: str, tmp_path: Path) -> None:
    """``make consumers`` asks ffmpeg."""
    text, *outcomes = MESHES[name]
    path = tmp_path / "lut.3dl"
    path.write_text(text(), newline="")
    report = lint(path)
    assert [report.fate(each)[0].outcome for each in (opencolorio_reader(), FFMPEG)] == outcomes
    assert report.clean == (outcomes == [READS, READS])
    code = probe_colours()
    try:
        shown = through_opencolorio(path, code)
    except Refusal:
        assert outcomes[0] == REFUSES
    else:
        assert (np.abs(shown - code / 255 * [1, GREEN, BLUE]).max() < 5e-4) == (outcomes[0] == READS)


#: Text in place of a number, and the number that OpenColorIO 2.1 and 2.6 read; None if they refuse the file.
WORDS = {
    "0;75": 0.0, "1'000": 1.0, "1/2": 1.0, "1e": 1.0, "1e+": 1.0, "1.2.3": 1.2, "1_0": 1.0, "0,75": 0.0, "1d0": 1.0,
    "0.75f": 0.75, "0.75%": 0.75, "0x10": 16.0, "nan": 0.0, "-inf": None, "infinity": None, "１": None, "٣": None,
    "--1": None, "abc": None,
}  # fmt: skip


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("suffix", [".spi3d", ".csp"])
def test_a_word_that_opencolorio_reads_as_another_number_is_told(word: str, suffix: str, tmp_path: Path) -> None:
    content, number = (SPI3D, "0.900000") if suffix == ".spi3d" else (CSP, "0.9")
    path = tmp_path / f"lut{suffix}"
    path.write_text(content.replace(number, word, 1))
    report = lint(path)
    assert not report.clean
    line = content[: content.index(number)].count("\n") + 1
    try:
        shown = through_opencolorio(path, np.array([[255, 0, 0]], np.uint8))[0, 0]
    except Refusal:
        assert WORDS[word] is None
        assert report.fate(opencolorio_reader())[0].outcome == REFUSES
        return
    assert report.fate(opencolorio_reader())[0].outcome == WRONG
    assert findings_of(report)["table-numbers"].startswith(f"error: {line}: ")
    if WORDS[word] is not None:
        assert shown == pytest.approx(WORDS[word], abs=1e-6)
    else:
        assert abs(shown) > 1e38


#: Suffix → a file without one number of its table.
GAPS = {
    ".spi3d": SPI3D.replace("0.900000", "{}", 1), ".csp": CSP.replace("0.9", "{}", 1),
    ".clf": clf(values=ROWS.replace("0.800000", "{}", 1)),
}  # fmt: skip


@given(st.text("0123456789.,;:'/_eE+-xX%$#abcdfin \t\0", min_size=1, max_size=7), st.sampled_from(list(GAPS)))
@draws(300)
def test_what_lint_calls_clean_opencolorio_reads_as_the_number_that_stands_there(word: str, suffix: str) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, f"lut{suffix}")
        path.write_text(GAPS[suffix].replace("{}", word))
        if lint(path).clean:
            shown = through_opencolorio(path, probe_colours())
            path.write_text(GAPS[suffix].replace("{}", repr(number(word))))
            np.testing.assert_allclose(shown, through_opencolorio(path, probe_colours()), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("2\n0 1\n0 1\n", "2\n0 1\n0 1/2\n"),
        ("2\n0 1\n0 1\n", "2\n0 0.9;5\n0 1\n"),
        ("0.9 0.8", "0.9\0 0.8"),
    ],
    ids=["an output of a curve", "an input of a curve", "NUL"],
)
def test_odd_words_of_a_csp_are_told_wherever_they_stand(old: str, new: str, tmp_path: Path) -> None:
    assert old in CSP
    (tmp_path / "lut.csp").write_text(CSP.replace(old, new, 1))
    assert "surplus or malformed numbers" in findings_of(lint(tmp_path / "lut.csp"))["table-numbers"]


def test_words_in_the_metadata_of_a_csp_are_no_numbers(tmp_path: Path) -> None:
    words = "BEGIN METADATA\nNaN 1,5 1/2 of a film, from 3\nEND METADATA\n"
    (tmp_path / "lut.csp").write_text(CSP.replace("3D\n", f"3D\n{words}"))
    assert lint(tmp_path / "lut.csp").clean


def test_a_number_too_many_in_a_row_of_a_spi3d_is_told(tmp_path: Path) -> None:
    (tmp_path / "lut.spi3d").write_text(SPI3D.replace("0.900000", "0.9 0.1", 1))
    assert "surplus or malformed numbers" in findings_of(lint(tmp_path / "lut.spi3d"))["table-numbers"]


def test_a_size_that_ends_in_a_letter_is_bounded_too(tmp_path: Path) -> None:
    """OpenColorIO would read 100000 from 100000x, and ask for 12 PB."""
    (tmp_path / "lut.spi3d").write_text(SPI3D.replace("2 2 2", "100000 100000 100000x"))
    assert "too large" in findings_of(lint(tmp_path / "lut.spi3d"))["loads"]


def test_a_mesh_line_with_a_word_in_it_is_told(tmp_path: Path) -> None:
    """OpenColorIO ignores such a line, and with the line the curve that it may hold."""
    curve = PLACES.replace("64 ", "90 ", 1)
    (tmp_path / "sound.3dl").write_text(f"{curve}\n{mesh()}")
    (tmp_path / "lut.3dl").write_text(f"{curve.replace('128', '128.5')}\n{mesh()}")
    code = np.array([[16, 16, 16]], np.uint8)
    assert (
        np.abs(
            through_opencolorio(tmp_path / "sound.3dl", code) - through_opencolorio(tmp_path / "lut.3dl", code)
        ).max()
        > 0.01
    )
    assert "surplus or malformed numbers" in findings_of(lint(tmp_path / "lut.3dl"))["table-numbers"]


def node(content: str) -> str:
    """A CLF with an operator before its table."""
    return clf().replace("<LUT3D", f"{content}<LUT3D")


DEPTHS = 'inBitDepth="32f" outBitDepth="32f"'

#: A CLF with a value that OpenColorIO accepts and no author intends.
ODD_CLF = {
    "nan": clf(values=ROWS.replace("0.800000", "nan", 1)),
    "-nan": clf(values=ROWS.replace("0.800000", "-NaN", 1)),
    "inf": clf(values=ROWS.replace("0.800000", "inf", 1)),
    "beyond float32": clf(values=ROWS.replace("0.800000", "1e39", 1)),
    "beyond float64": clf(values=ROWS.replace("0.800000", "1e999", 1)),
    "hexadecimal": clf(values=ROWS.replace("0.800000", "0x10", 1)),
    "matrix": node(f'<Matrix {DEPTHS}><Array dim="3 3">1 0 0 0 nan 0 0 0 1</Array></Matrix>'),
    "1D": node(f'<LUT1D {DEPTHS}><Array dim="2 1">0 nan</Array></LUT1D>'),
    "range": node(
        f"<Range {DEPTHS}><minInValue>0</minInValue><maxInValue>1</maxInValue><minOutValue>0</minOutValue>"
        "<maxOutValue>inf</maxOutValue></Range>"
    ),
    "CDL": node(
        f"<ASC_CDL {DEPTHS} style='Fwd'><SOPNode><Slope>1 1 inf</Slope><Offset>0 0 0</Offset><Power>1 1 1</Power>"
        "</SOPNode></ASC_CDL>"
    ),
    "attribute": node(
        f"<Log {DEPTHS} style='linToLog'><LogParams base='2' logSideSlope='0x1' logSideOffset='0.5' linSideSlope='1' "
        "linSideOffset='0.1'/></Log>"
    ),
}


@pytest.mark.parametrize("name", ODD_CLF)
def test_a_value_of_a_clf_that_opencolorio_takes_and_nobody_means_is_told(name: str, tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    path.write_text(ODD_CLF[name])
    through_opencolorio(path, probe_colours())  # OpenColorIO does not refuse it
    report = lint(path)
    assert report.fate(opencolorio_reader())[0].outcome == WRONG
    assert "no finite decimal number of float32" in findings_of(report)["clf-form"]


def test_nan_of_a_1d_table_of_all_half_floats_is_meant(tmp_path: Path) -> None:
    halves = np.arange(65536, dtype=np.uint16).view(np.float16).astype(float)
    rows = "\n".join(map(repr, halves.tolist()))
    table = node(f'<LUT1D {DEPTHS} halfDomain="true"><Array dim="65536 1">{rows}</Array></LUT1D>')
    path = tmp_path / "lut.clf"
    path.write_text(table)
    assert lint(path).clean
    path.write_text(table.replace("\n0.5\n", "\nnan\n", 1))
    assert "nan" in findings_of(lint(path))["clf-form"]


def test_infinity_as_the_bits_of_a_half_float_is_told(tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    for bits, clean in ((15360, True), (31744, False)):
        path.write_text(node(f'<LUT1D {DEPTHS} rawHalfs="true"><Array dim="2 1">0 {bits}</Array></LUT1D>'))
        assert lint(path).clean == clean


def test_words_and_names_of_a_clf_are_no_values(tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    path.write_text(node("<Description>nan inf 1e999 0x10</Description>").replace("<LUT3D", '<LUT3D name="nan"'))
    assert lint(path).clean


def test_a_comma_in_a_clf_is_refused_by_python_alone(tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    path.write_text(clf(values=ROWS.replace("0.800000", "0.800000,", 1)))
    report = lint(path)
    assert (report.fate(opencolorio_reader())[0].outcome, report.fate(CLF_IO)[0].outcome) == (READS, REFUSES)
    through_opencolorio(path, probe_colours())


# Configs that once broke lint


@pytest.mark.parametrize("role", ["default", "scene_linear", "data", "aces_interchange", "my_own"])
def test_a_role_that_names_a_missing_space_is_told(role: str, tmp_path: Path) -> None:
    text = (OURS / "config.ocio").read_text()
    line = next((line for line in text.splitlines() if line.startswith(f"  {role}: ")), "roles:")
    report = changed(
        tmp_path, f"{line}\n", f"{line.partition(': ')[0]}: Gone\n" if line != "roles:" else f"roles:\n  {role}: Gone\n"
    )
    assert not report.clean
    assert f"The role '{role}' refers to" in findings_of(report)["config-version"]
    with zipfile.ZipFile(tmp_path / "a.ocioz", "w") as archive:
        for name in ("config.ocio", "aged.clf"):
            archive.write(tmp_path / name, name)
    assert f"The role '{role}' refers to" in findings_of(lint(tmp_path / "a.ocioz"))["config-version"]


@pytest.mark.parametrize("word", ["Aged display look", "src: aged.clf", "search_path: .", "name: Raw", "family: "])
def test_a_config_whose_names_are_not_utf8_is_told(word: str, tmp_path: Path) -> None:
    changed(tmp_path, "", "")
    data = (tmp_path / "config.ocio").read_bytes()
    assert word.encode() in data
    (tmp_path / "config.ocio").write_bytes(data.replace(word.encode(), f"{word}é".encode("latin-1")))
    report = lint(tmp_path / "config.ocio")
    assert not report.clean
    assert "not UTF-8" in findings_of(report)["config-encoding"]


def test_a_comment_that_is_not_utf8_is_a_note(tmp_path: Path) -> None:
    changed(tmp_path, "", "")
    data = (tmp_path / "config.ocio").read_bytes()
    (tmp_path / "config.ocio").write_bytes(b"# \xe9\n" + data)
    report = lint(tmp_path / "config.ocio")
    assert report.clean
    assert findings_of(report)["config-encoding"] == "note: 1: has comments that are not UTF-8"


def test_a_config_in_utf16_is_read_as_opencolorio_reads_it(tmp_path: Path) -> None:
    changed(tmp_path, "", "")
    text = (tmp_path / "config.ocio").read_text()
    (tmp_path / "config.ocio").write_text(text, encoding="utf-16")
    assert lint(tmp_path / "config.ocio").clean


def test_an_integer_of_5000_digits_is_told_in_every_format(tmp_path: Path) -> None:
    digits = "9" * 5000
    for name, text in {
        "size.cube": f"LUT_3D_SIZE {digits}\n0 0 0\n",
        "curve.cube": f"LUT_1D_SIZE {digits}\n0 0 0\n",
        "row.cube": f"LUT_3D_SIZE 2\n{digits} 0 0\n",
        "a.3dl": f"0 1 2 {digits}\n{digits} 1 1\n",
        "a.spi3d": f"SPILUT 1.0\n3 3\n{digits} 2 2\n{digits} 0 0 0 0 {digits}\n",
        "a.csp": CSP.replace("2 2 2", f"{digits} 2 2"),
        "a.clf": clf(values=digits).replace("2 2 2 3", f"{digits} 2 2 3"),
        "a.ocio": (OURS / "config.ocio").read_text().replace("version: 2.1", f"version: 2.{digits}"),
    }.items():
        (tmp_path / name).write_text(text)
        report = lint(tmp_path / name)
        assert not report.clean
        assert all(len(each.what) < 500 for each in report.findings)


def test_a_clf_of_smpte_without_id_is_read_by_new_versions_alone(tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    path.write_text(clf(SMPTE))
    try:
        through_opencolorio(path, probe_colours())
    except Refusal:
        assert opencolorio_reader() == OCIO_21
    else:
        assert opencolorio_reader() == OCIO_26
    report = lint(path)
    assert report.fate(OCIO_21)[0].outcome == REFUSES
    assert report.fate(OCIO_26)[0].outcome == READS


def test_entities_are_not_expanded(tmp_path: Path) -> None:
    bomb = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10 if n else "x"}">' for n in range(12))
    (tmp_path / "a.clf").write_text(f"<!DOCTYPE a [{bomb}]>{clf(values='&a11;')}")
    assert "declares entities" in findings_of(lint(tmp_path / "a.clf"))["clf-form"]


def test_what_ociocheck_alone_refuses_is_told() -> None:
    refused = Trial(OCIOCHECK, "2.1.2", REFUSES, "")
    assert Linted(Path("a"), "config", (), (), (refused,)).disagreements() == (refused,)


def test_an_ociocheck_that_fails_without_a_message_does_not_validate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / OCIOCHECK
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    trial = programs.try_config(OURS / "config.ocio")
    assert trial == Trial(OCIOCHECK, "", REFUSES, "ends with an error, without a message")


def test_metadata_that_never_end_are_told_and_never_given_to_opencolorio(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenColorIO reads such a file for ever, with each suffix: the test would hang."""
    content = CSP.replace("3D\n\n", "3D\n\n  BEGIN METADATA\nfrom a shop\n")
    for name in ("lut.csp", "lut.spi3d", "lut.3dl"):
        (tmp_path / name).write_text(content)
        assert findings_of(lint(tmp_path / name))["table-metadata"].endswith(
            "4: opens its metadata and never closes them"
        )
    with pytest.raises(LutgenError, match=r"lut\.csp:4: opens its metadata and never closes them"):
        apply_lut(tmp_path / "lut.csp", np.zeros((1, 3)))
    (tmp_path / "lut.cube").write_text(content)
    monkeypatch.setattr(programs, "PROGRAMS", (OPENCOLORIO,))
    assert [each.outcome for each in lint(tmp_path / "lut.cube", ask_readers=True).trials] == [REFUSES]
    report = changed(tmp_path, "aged.clf", "lut.csp")
    assert "lut.csp opens its metadata and never closes them" in findings_of(report)["config-parts"]
    (tmp_path / "lut.csp").write_text(content.replace("shop\n", "shop\nEND METADATA\n"))
    assert lint(tmp_path / "lut.csp").clean
