"""What lint says of configs, CLF and the older table formats, each held to what OpenColorIO does with the file."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake.lint import lint, trial
from lutgen.bake.lint.finding import FFMPEG, OCIO_21, OCIO_26, OCIOCHECK, READS, REFUSES, WRONG, Linted, Trial
from lutgen.bake.lint.programs import Refusal, opencolorio
from lutgen.bake.lint.programs.opencolorio import apply, reader
from lutgen.bake.lint.trial import probe_colours
from lutgen.bake.readback import apply_lut
from lutgen.errors import LutgenError
from tests.mesh_cases import BLUE, GREEN, MESHES, PLACES, mesh

ROOT = Path(__file__).parents[1]
OURS = ROOT / "configs/default/chroma/10000h"


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
    found = lint(ROOT / "configs/default" / config / "config.ocio")
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


@pytest.mark.parametrize("name", MESHES)
def test_what_is_said_of_a_3dl_is_what_opencolorio_does(name: str, tmp_path: Path) -> None:
    """``make consumers`` asks ffmpeg."""
    text, *outcomes = MESHES[name]
    path = tmp_path / "lut.3dl"
    path.write_text(text(), newline="")
    found = lint(path)
    assert [found.fate(each)[0].outcome for each in (reader(), FFMPEG)] == outcomes
    assert found.clean == (outcomes == [READS, READS])
    code = probe_colours()
    try:
        shown = apply(path, code)
    except Refusal:
        assert outcomes[0] == REFUSES
    else:
        assert (np.abs(shown - code / 255 * [1, GREEN, BLUE]).max() < 5e-4) == (outcomes[0] == READS)


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


def test_what_ociocheck_alone_refuses_is_told() -> None:
    refused = Trial(OCIOCHECK, "2.1.2", REFUSES, "")
    assert Linted(Path("a"), "config", (), (), (refused,)).disagreements() == (refused,)


def test_metadata_that_never_end_are_told_and_never_given_to_opencolorio(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It reads on for ever, with each suffix: this test would hang."""
    content = CSP.replace("3D\n\n", "3D\n\n  BEGIN METADATA\nfrom a shop\n")
    for name in ("lut.csp", "lut.spi3d", "lut.3dl"):
        (tmp_path / name).write_text(content)
        assert said(lint(tmp_path / name))["table-metadata"].endswith("4: opens its metadata and never closes them")
    with pytest.raises(LutgenError, match=r"lut\.csp:4: opens its metadata and never closes them"):
        apply_lut(tmp_path / "lut.csp", np.zeros((1, 3)))
    (tmp_path / "lut.cube").write_text(content)
    monkeypatch.setattr(trial, "programs", lambda: [opencolorio.PROGRAM])
    assert [each.outcome for each in lint(tmp_path / "lut.cube", ask_readers=True).trials] == [REFUSES]
    found = changed(tmp_path, "aged.clf", "lut.csp")
    assert "lut.csp opens its metadata and never closes them" in said(found)["config-parts"]
    (tmp_path / "lut.csp").write_text(content.replace("shop\n", "shop\nEND METADATA\n"))
    assert lint(tmp_path / "lut.csp").clean
