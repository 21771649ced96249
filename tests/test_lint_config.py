"""What lint says of configs, CLF and the older table formats, each held to what OpenColorIO does with the file."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake.readback import apply_lut
from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.lint.finding import FFMPEG, OCIO_21, OCIO_26, OCIOCHECK, READS, REFUSES, WRONG, Linted, Trial
from lutgen.lint.programs import Absent, Refusal, ffmpeg, opencolorio, probe_colours
from lutgen.lint.programs.opencolorio import apply, reader

ROOT = Path(__file__).parents[1]
OURS = ROOT / "configs/default/chroma/10000h"
BLENDERS = Path("/usr/share/blender/datafiles/colormanagement/config.ocio")


def changed(folder: Path, old: str, new: str) -> Linted:
    """Our own config with a change."""
    shutil.copyfile(OURS / "aged.clf", folder / "aged.clf")
    text = (OURS / "config.ocio").read_text()
    assert old in text
    (folder / "config.ocio").write_text(text.replace(old, new))
    return lint(folder / "config.ocio")


def said(found: Linted) -> dict[str, str]:
    return {each.rule: f"{each.level(found.readers)}: {each.line}: {each.what}" for each in found.findings}


@pytest.mark.parametrize("config", ["chroma/10000h", "stable/0h", "."])
def test_our_own_configs_are_clean(config: str) -> None:
    found = lint(ROOT / "configs/default" / config / "config.ocio", ask_readers=True)
    assert found.clean, found
    assert set(said(found)) <= {"config-environment"}


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
    found = said(changed(tmp_path, old, new))
    assert rule in found
    assert words in found[rule]


def test_many_views_are_told(tmp_path: Path) -> None:
    more = "".join(f"    - !<View> {{name: V{place}, colorspace: Raw}}\n" for place in range(4))
    found = changed(tmp_path, "active_views: [Aged, Un-aged, Raw]", "")
    assert "config-views" not in said(found)
    text = (tmp_path / "config.ocio").read_text().replace("  sRGB:\n", f"  sRGB:\n{more}")
    (tmp_path / "config.ocio").write_text(text)
    assert "has 13 views" in said(lint(tmp_path / "config.ocio"))["config-views"]


def test_a_table_without_an_interpolation_is_told(tmp_path: Path) -> None:
    shutil.copyfile(OURS / "aged.clf", tmp_path / "aged.clf")
    old, new = "src: aged.clf, interpolation: tetrahedral", "src: aged.cube"
    assert "does not say how aged.cube" in said(changed(tmp_path, old, new))["config-files"]


def test_rubbish_that_opencolorio_takes_for_an_empty_config_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "a.ocio").write_bytes(b"\0\xff\xfe\0" * 50)
    assert "error" in said(lint(tmp_path / "a.ocio"))["config-version"]


@pytest.mark.skipif(not BLENDERS.is_file(), reason="Blender's config is not installed (Debian: blender-data)")
def test_blenders_own_config_is_clean() -> None:
    found = lint(BLENDERS, ask_readers=True)
    assert found.clean
    assert set(said(found)) == {"config-roles"}


# CLF and tables: whatever lint says of the installed OpenColorIO is what that does

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
PLACES = " ".join(str(min(64 * place, 1023)) for place in range(17))


def mesh(points: int = 17, largest: int = 4095) -> str:
    """The rows of a .3dl, in which no channel is as it was sent."""
    axis = np.linspace(0, largest, points)
    return "".join(f"{r:.0f} {g * 0.9:.0f} {b * 0.8:.0f}\n" for r in axis for g in axis for b in axis)


#: Suffix, content, whether readers do what is meant, and a rule that speaks of it.
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
    found = lint(path)
    assert found.fate(reader())[0].outcome == outcome
    assert found.clean == (outcome == READS)
    assert not rule or rule in said(found)
    if name == "spi3d of any size":
        return  # given to OpenColorIO, it would ask for 12 PB
    try:
        apply(path, probe_colours())
    except Refusal:
        assert outcome == REFUSES
    else:
        assert outcome != REFUSES


#: A .3dl, and what becomes of it in OpenColorIO and in ffmpeg.
MESHES = {
    "17 points": (f"{PLACES}\n{mesh()}", READS, READS),
    "comments": (f"# a\n\n{PLACES}\n{mesh()}", READS, READS),
    "CRLF": (f"{PLACES}\n{mesh()}".replace("\n", "\r\n"), READS, READS),
    "CR": (f"{PLACES}\n{mesh()}".replace("\n", "\r"), WRONG, REFUSES),
    "ours, of 33 points": (f"{PLACES}\n{mesh(33)}", READS, WRONG),
    "9 points": (f"{PLACES}\n{mesh(9)}", READS, REFUSES),
    "10 bits": (f"{PLACES}\n{mesh(largest=1023)}", READS, WRONG),
    "16 bits": (f"{PLACES}\n{mesh(largest=65535)}", READS, WRONG),
    "no places": (mesh(), READS, REFUSES),
    "no places, 33 points": (mesh(33), READS, WRONG),
    "Lustre's": (f"3DMESH\nMesh 4 12\n{PLACES}\n{mesh()}\nLUT8\ngamma 1.0\n", READS, REFUSES),
}


@pytest.mark.parametrize("name", MESHES)
def test_what_is_said_of_a_3dl_is_what_opencolorio_and_ffmpeg_do(name: str, tmp_path: Path) -> None:
    text, *outcomes = MESHES[name]
    path = tmp_path / "lut.3dl"
    path.write_text(text, newline="")
    found = lint(path)
    assert [found.fate(each)[0].outcome for each in (reader(), FFMPEG)] == outcomes
    assert found.clean == (outcomes == [READS, READS])
    code = probe_colours()
    for program, outcome in ((opencolorio, outcomes[0]), (ffmpeg, outcomes[1])):
        try:
            program.PROGRAM.version()
            shown = program.apply(path, code)
        except Absent:
            continue
        except Refusal:
            assert outcome == REFUSES
        else:
            # ffmpeg divides by 4096.
            assert (np.abs(shown - code / 255 * [1, 0.9, 0.8]).max() < 5e-4) == (outcome == READS)


def test_a_clf_of_smpte_without_id_is_read_by_new_versions_alone(tmp_path: Path) -> None:
    path = tmp_path / "lut.clf"
    path.write_text(clf(SMPTE))
    try:
        apply(path, probe_colours())
    except Refusal:
        assert reader() == OCIO_21
    else:
        assert reader() == OCIO_26
    found = lint(path)
    assert found.fate(OCIO_21)[0].outcome == REFUSES
    assert found.fate(OCIO_26)[0].outcome == READS


def test_entities_are_not_expanded(tmp_path: Path) -> None:
    bomb = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10 if n else "x"}">' for n in range(12))
    (tmp_path / "a.clf").write_text(f"<!DOCTYPE a [{bomb}]>{clf(values='&a11;')}")
    assert "declares entities" in said(lint(tmp_path / "a.clf"))["clf-form"]


@pytest.mark.skipif(shutil.which(OCIOCHECK) is None, reason="ociocheck is not installed (Debian: opencolorio-tools)")
@pytest.mark.parametrize(
    ("old", "new", "outcome"),
    [
        ("", "", READS),
        ("ocio_profile_version: 2.1", "ocio_profile_version: 2.9", REFUSES),
        ("roles:", "roles: {", REFUSES),
    ],
    ids=["as it is", "of a version to come", "broken"],
)
def test_ociocheck_refuses_what_the_rules_say_that_its_opencolorio_does(
    old: str, new: str, outcome: str, tmp_path: Path
) -> None:
    changed(tmp_path, old, new)
    found = lint(tmp_path / "config.ocio", ask_readers=True)
    assert [(trial.reader, trial.outcome) for trial in found.trials] == [(OCIOCHECK, outcome)]
    assert found.disagreements() == ()


def test_what_ociocheck_alone_refuses_is_told() -> None:
    trial = Trial(OCIOCHECK, "2.1.2", REFUSES, "")
    assert Linted(Path("a"), "config", (), (), (trial,)).disagreements() == (trial,)


def test_metadata_that_never_end_are_told_and_never_given_to_opencolorio(tmp_path: Path) -> None:
    """It reads on for ever, with each suffix: this test would hang."""
    content = CSP.replace("3D\n\n", "3D\n\n  BEGIN METADATA\nfrom a shop\n")
    for name in ("lut.csp", "lut.spi3d", "lut.3dl"):
        (tmp_path / name).write_text(content)
        assert said(lint(tmp_path / name))["table-metadata"].endswith("4: opens its metadata and never closes them")
    with pytest.raises(LutgenError, match=r"lut\.csp:4: opens its metadata and never closes them"):
        apply_lut(tmp_path / "lut.csp", np.zeros((1, 3)))
    (tmp_path / "lut.cube").write_text(content)
    assert {trial.outcome for trial in lint(tmp_path / "lut.cube", ask_readers=True).trials} <= {REFUSES, ""}
    found = changed(tmp_path, "aged.clf", "lut.csp")
    assert "lut.csp opens its metadata and never closes them" in said(found)["config-parts"]
    (tmp_path / "lut.csp").write_text(content.replace("shop\n", "shop\nEND METADATA\n"))
    assert lint(tmp_path / "lut.csp").clean
