"""Every reader reads files of unknown size only up to a bound: larger files are refused at once."""

import hashlib
import resource
from collections.abc import Callable
from pathlib import Path

import pytest

from lutgen import LutgenError, load_model
from lutgen.bake.manifest import read_manifest
from lutgen.display.fitted import found_by
from lutgen.display.tips import luminance_law
from lutgen.effects.own import load_file
from lutgen.files import bytes_at_most, file_sha256, read_at_most
from lutgen.pictures.cohort_slides import find_slides
from lutgen.study.design import read_design
from lutgen.study.protocol import read_protocol
from lutgen.study.tables import read_answer_table, read_counts, read_summary

pytestmark = pytest.mark.numbers

#: Bytes of a sparse file of zeros, which takes no space on the disk.
GIGABYTE = 10**9


@pytest.mark.parametrize(
    ("name", "read", "says"),
    [
        ("protocol.json", lambda path: read_protocol(path.parent), "256 MB, which no protocol is. Give the folder"),
        ("counts.csv", read_counts, "64 MB, which no such table is. Give a .csv with condition,agreed,disagreed."),
        ("summary.csv", read_summary, "64 MB, which no such table is. Give a .csv with condition,measure,n,mean,ci95."),
        ("answers.csv", read_answer_table, "64 MB, which no such table is. Give a .csv with reader,session,position,"),
        ("design.csv", lambda path: read_design(path, ["a"], readers=1, seed=1), "which no such table is"),
        ("slides.txt", lambda path: find_slides([path]), "64 MB, which no list of slides is. A list holds the path"),
        ("model.toml", load_model, "16 MB, which no model is."),
        ("law.csv", lambda path: luminance_law(str(path)), "4 MB, which no luminance table is."),
        ("mine.py", load_file, "4 MB, which no file of effects is."),
        ("mine.py", lambda path: found_by("glow", {"origin": path.name}, path.parent), "which no file of effects is."),
        ("manifest.json", read_manifest, "256 MB, which no manifest is. Was it edited? Build into another folder."),
    ],
)
def test_a_gigabyte_is_refused_before_it_is_read(
    name: str, read: Callable[[Path], object], says: str, tmp_path: Path
) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(GIGABYTE)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(LutgenError) as error:
        read(tmp_path / name)
    assert str(error.value).startswith(f"{tmp_path / name}: larger than ")
    assert says in str(error.value)
    # ru_maxrss is in kB, and includes the imports of a reader's first call.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < GIGABYTE / 1e4


def test_a_file_is_read_up_to_the_bound_and_not_a_byte_more(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x" * 1000)
    assert read_at_most(path, 1000, what="it", none="such") == b"x" * 1000
    with pytest.raises(LutgenError, match="larger than 0 MB, which no such is"):
        read_at_most(path, 999, what="it", none="such")


def test_what_has_no_size_and_never_ends_is_refused() -> None:
    with pytest.raises(LutgenError, match="/dev/zero: larger than 1 MB, which no table is"):
        read_at_most(Path("/dev/zero"), 1_000_000, what="the table", none="table")


@pytest.mark.parametrize(
    ("name", "says"),
    [("none", "cannot read the table: no such file or directory. Give a table."), ("folder", "is a directory"),
     ("nul\0", "cannot read the table: embedded null byte. Give a table.")],
)  # fmt: skip
def test_what_cannot_be_read_is_said_with_what_to_do(name: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(LutgenError) as error:
        read_at_most(tmp_path / name, 1000, what="the table", none="table", advice="Give a table.")
    assert says in str(error.value)


def test_who_asks_for_bytes_hears_of_a_missing_file_as_python_says_it(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        bytes_at_most(tmp_path / "none", 1000, none="table")


def test_the_hash_of_a_file_is_that_of_its_bytes(tmp_path: Path) -> None:
    data = bytes(range(256)) * 5000
    (tmp_path / "a").write_bytes(data)
    assert file_sha256(tmp_path / "a") == hashlib.sha256(data).hexdigest()
    with pytest.raises(LutgenError, match="none: cannot read: no such file"):
        file_sha256(tmp_path / "none")
