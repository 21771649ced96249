"""Findings of lint on .ocioz and on Hald images: no file leaves its folder, and no file fills the memory."""

import io
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.bindings import ocio, ocio_errors
from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.lint.finding import HALDCLUT, OCIO_26, READS, REFUSES, WRONG, Linted
from lutgen.lint.formats import archive
from tests.hald_cases import HALDS, PLAIN, file_of
from tests.quick import draws

ROOT = Path(__file__).parents[1]
OURS = ROOT / "configs/default/chroma/10000h"

CONFIG, CLF = (OURS / "config.ocio").read_text(), (OURS / "aged.clf").read_text()


def linted(folder: Path, data: bytes, name: str) -> Linted:
    path = folder / name
    path.write_bytes(data)
    return lint(path)


def zipped(*files: tuple[str | zipfile.ZipInfo, str | bytes], packed: int = zipfile.ZIP_DEFLATED) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", packed) as file:
        for name, content in files:
            file.writestr(name, content)
    return data.getvalue()


def a_link() -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo("luts")
    entry.create_system, entry.external_attr = 3, 0o120777 << 16
    return entry


def twice(data: bytes) -> bytes:
    return data.replace(b"config.OCIO", b"config.ocio")


def encrypted(data: bytes) -> bytes:
    for signature, place in ((b"PK\1\2", 8), (b"PK\3\4", 6)):
        start = data.index(signature) + place
        data = data[:start] + b"\1" + data[start + 1 :]
    return data


GOOD = (("config.ocio", CONFIG), ("aged.clf", CLF))


@pytest.mark.parametrize("name", ["ours", "another's"])
def test_a_whole_archive_is_read_by_opencolorio(name: str, tmp_path: Path) -> None:
    data = file_of("ocioz") if name == "ours" else zipped(*GOOD)
    report = linted(tmp_path, data, "a.ocioz")
    assert report.clean
    assert {each.level(report.readers) for each in report.findings} == {"note"}
    assert "OpenColorIO 2.1" in report.findings[0].what
    lib = ocio()
    if hasattr(lib, "ExtractOCIOZArchive"):
        config = lib.Config.CreateFromFile(str(tmp_path / "a.ocioz"))
        display = config.getDefaultDisplay()
        config.getProcessor(
            lib.DisplayViewTransform(config.getColorSpaceNames()[0], display, config.getDefaultView(display))
        )
    else:
        with pytest.raises(ocio_errors()):
            lib.Config.CreateFromFile(str(tmp_path / "a.ocioz"))


#: The fault, the archive, and the words of the finding.
BAD: dict[str, tuple[Callable[[], bytes], str]] = {
    "empty": (lambda: b"", "is not an archive"),
    "text": (lambda: b"ocio_profile_version: 2.1\n", "is not an archive"),
    "cut off": (lambda: file_of("ocioz")[:-40], "is not an archive"),
    "an end alone": (lambda: b"PK\x05\x06" + b"\xff" * 18, "has a directory of 4095 MiB"),
    "no config": (lambda: zipped(("aged.clf", CLF)), "has no config.ocio at its root"),
    "a config below": (lambda: zipped(("a/config.ocio", CONFIG)), "has no config.ocio at its root"),
    "a file outside": (
        lambda: zipped(*GOOD, ("../outside.txt", "x")),
        "'../outside.txt', which leads out of the folder",
    ),
    "a file far outside": (lambda: zipped(*GOOD, ("a/../../outside.txt", "x")), "leads out of the folder"),
    "an absolute path": (lambda: zipped(*GOOD, ("/tmp/outside.txt", "x")), "is an absolute path"),  # noqa: S108 - in the ZIP
    "a drive": (lambda: zipped(*GOOD, ("C:\\outside.txt", "x")), "is an absolute path"),
    "a path of Windows outside": (lambda: zipped(*GOOD, ("..\\outside.txt", "x")), "leads out of the folder"),
    "a link": (lambda: zipped(*GOOD, (a_link(), "/etc")), "'luts', which is a link"),
    "a link and a file behind it": (lambda: zipped((a_link(), "/etc"), ("luts/outside.txt", "x"), *GOOD), "is a link"),
    "a bomb": (lambda: zipped(*GOOD, ("zeros.clf", bytes(250 << 20))), "unpacks to 3 files of 250 MiB together"),
    "many files": (lambda: zipped(*GOOD, *((f"{n}.txt", "") for n in range(2001))), "unpacks to 2003 files"),
    "a file that is also a folder": (
        lambda: zipped(*GOOD, ("aged.clf/more", "x")),
        "cannot be unpacked",
    ),
    "a config without its LUT": (lambda: zipped(GOOD[0]), "config.ocio: view Aged of sRGB"),
    "a LUT without an id": (lambda: zipped(GOOD[0], ("aged.clf", CLF.replace(" id=", " ident="))), "aged.clf: "),
    "rubbish for a config": (lambda: zipped(("config.ocio", b"\0\xff" * 50)), "config.ocio: "),
    "two configs": (lambda: twice(zipped(*GOOD, ("config.OCIO", CONFIG))), "holds 'config.ocio' twice"),
    "an encrypted file": (lambda: encrypted(zipped(*GOOD)), "'config.ocio', which is encrypted"),
    "a LUT that would take all memory": (
        lambda: zipped(*GOOD, ("a.spi3d", "SPILUT 1.0\n3 3\n5000 5000 5000\n0 0 0 0 0 0\n")),
        "config.ocio was not loaded",
    ),
    "a name in two lines": (lambda: zipped(*GOOD, ("a\nb.cube", "x")), "a b.cube: "),
    "a wrong sum": (
        lambda: file_of("ocioz").replace(b"LUT3D", b"LUT4D"),
        "cannot be unpacked: Bad CRC-32",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_archive_is_refused_and_nothing_leaves_its_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, message = BAD[name]
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    report = linted(tmp_path, data(), "a.ocioz")
    assert any(message in each.what for each in report.findings), report.findings
    assert not report.clean
    assert report.fate(OCIO_26)[0].outcome in {REFUSES, WRONG}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.ocioz", "scratch"]
    assert not [*scratch.iterdir()]
    assert str(scratch) not in "".join(each.what for each in report.findings)


def test_a_file_that_unpacks_to_more_than_it_says_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "LARGEST", 1 << 20)
    data = bytearray(zipped(("config.ocio", bytes(3 << 20))))
    for signature, place in ((b"PK\1\2", 24), (b"PK\3\4", 22)):
        start = data.index(signature) + place
        data[start : start + 4] = struct.pack("<I", 1000)
    report = linted(tmp_path, bytes(data), "a.ocioz")
    assert "cannot be unpacked" in report.findings[0].what


#: Prints the peak of memory that lint adds, in MiB, after lint of a small file.
MEASURED = """
import resource, sys
from lutgen.lint import lint
lint(sys.argv[1])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
lint(sys.argv[2])
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) >> 10)
"""


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".ocioz", ".icc", ".png"])
def test_a_gigabyte_is_not_read_into_memory(suffix: str, tmp_path: Path) -> None:
    small, large = tmp_path / f"small{suffix}", tmp_path / f"large{suffix}"
    start = {".ocioz": file_of("ocioz"), ".icc": file_of("icc-matrix"), ".png": file_of("hald")}[suffix]
    small.write_bytes(start)
    large.write_bytes(start)
    with large.open("r+b") as file:
        file.truncate(1 << 30)  # sparse
    command = [sys.executable, "-c", MEASURED, str(small), str(large)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 30


# Hald images


@pytest.mark.parametrize("name", HALDS)
def test_the_rules_say_what_becomes_of_a_hald_image(name: str, tmp_path: Path) -> None:
    """``make consumers`` runs ffmpeg itself."""
    data, outcome, statement = HALDS[name]
    report = linted(tmp_path, data(), "table.png")
    assert report.fate(HALDCLUT)[0].outcome == outcome
    assert any(statement in each.what for each in report.findings) == bool(statement)
    assert report.clean == (outcome == READS)


def edits(size: int) -> st.SearchStrategy[list[tuple[int, bytes]]]:
    return st.lists(st.tuples(st.integers(0, size), st.binary(min_size=1, max_size=8)), min_size=1, max_size=4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("files")


SMALL = zipped(("config.ocio", b"x" * 40), ("luts/a.txt", b"y" * 40))


@given(st.sampled_from([("a.ocioz", SMALL), ("a.png", PLAIN)]), edits(300), st.integers(0, 400))
@draws(120)
def test_no_mutation_brings_lint_down(
    folder: Path, file: tuple[str, bytes], changes: list[tuple[int, bytes]], end: int
) -> None:
    name, data = file
    for place, value in changes:
        data = data[:place] + value + data[place + len(value) :]
    for content in (data, data[:end]):
        try:
            report = linted(folder, content, name)
        except LutgenError as error:
            assert "\n" not in str(error)  # noqa: PT017 - either is right
            continue
        assert all("\n" not in each.what for each in report.findings)
        assert sorted(path.suffix for path in folder.iterdir()) in ([".ocioz"], [".png"], [".ocioz", ".png"])
