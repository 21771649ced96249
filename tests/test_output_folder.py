"""The output folder of a build: files behind links stay, one build at a time, no remains after a failure."""

import fcntl
import os
import threading
from pathlib import Path

import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.display import DisplayModel
from lutgen.errors import LutgenError
from tests.command import in_process

PLAN = BuildPlan((0.0,), modes=("chroma",), formats=("cube",), cubesize=17, certify=False)
CUBE = "chroma/0h/aged.cube"


def contents(folder: Path) -> dict[str, bytes | None]:
    """Every file (its bytes) and folder (None) below a folder, by its relative path. Links are not followed."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("link", ["chroma", "chroma/0h"])
def test_files_behind_a_link_in_the_folder_are_never_overwritten(
    link: str, force: bool, model: DisplayModel, tmp_path: Path
) -> None:
    theirs = tmp_path / "theirs"
    (theirs / "0h").mkdir(parents=True)
    for place in (theirs, theirs / "0h"):
        (place / "aged.cube").write_text("precious")
    linked = tmp_path / "aged" / link
    linked.parent.mkdir(parents=True)
    linked.symlink_to(theirs)
    before = contents(tmp_path)
    with pytest.raises(LutgenError, match="holds files that lutgen did not write"):
        build(model, PLAN, tmp_path / "aged", jobs=1, force=force)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("place", [CUBE, "config.ocio", "manifest.json"])
def test_a_folder_in_the_place_of_a_file_is_seen_before_anything_is_written(
    place: str, model: DisplayModel, tmp_path: Path
) -> None:
    (tmp_path / "aged" / place).mkdir(parents=True)
    before = contents(tmp_path)
    with pytest.raises(LutgenError, match=r"lutgen did not write|is a directory"):
        build(model, PLAN, tmp_path / "aged", jobs=1)
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a" * 300, "cannot write: file name too long"),
        ("new/newer/" + "a" * 300, "cannot write: file name too long"),
        ("dangling", "dangling: is a link that leads to no folder"),
        ("dangling/below", "dangling: is a link that leads to no folder"),
        ("loop", "loop: is a link that leads to no folder"),
        ("link-to-file", "link-to-file: is a file"),
    ],
)
def test_a_folder_that_cannot_be_made_is_refused_and_nothing_left(
    name: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link-to-file").symlink_to("file")
    before = sorted(path.name for path in tmp_path.iterdir())
    done = in_process(monkeypatch, capsys, "build")("--hours", "0", "--mode", "chroma", "-o", str(tmp_path / name))
    assert done.code == 2
    (line,) = done.err.splitlines()
    assert says in line
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_a_link_to_a_folder_may_be_built_into(model: DisplayModel, tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "aged").symlink_to("disk")
    build(model, PLAN, tmp_path / "aged", jobs=1)
    assert check(tmp_path / "aged").passed


def test_a_failed_first_build_leaves_nothing_and_a_failed_second_one_the_first(
    model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise LutgenError("the disk is full")

    folder = tmp_path / "aged"
    build(model, PLAN, folder, jobs=1)
    before = contents(tmp_path)
    monkeypatch.setattr("lutgen.bake.build._write_common_config", fail)
    with pytest.raises(LutgenError, match="the disk is full"):
        build(model, PLAN, tmp_path / "new/newer", jobs=1)
    assert contents(tmp_path) == before
    with pytest.raises(LutgenError, match="the disk is full"):
        build(model, PLAN, folder, jobs=1)
    # The journal informs the next build, and `lutgen check`, that this build was interrupted.
    assert contents(tmp_path).keys() - before.keys() == {"aged/.lutgen-build.json"}
    assert {path: contents(tmp_path)[path] for path in before} == before


def test_a_second_build_waits_for_the_first_and_is_refused_when_that_lasts(
    model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "aged"
    folder.mkdir()
    held = os.open(folder, os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    monkeypatch.setattr("lutgen.bake.folder.PATIENCE", 0.2)
    with pytest.raises(LutgenError, match="another build writes into it"):
        build(model, PLAN, folder, jobs=1)
    assert list(folder.iterdir()) == []
    monkeypatch.setattr("lutgen.bake.folder.PATIENCE", 30.0)
    end = threading.Timer(0.2, os.close, [held])
    end.start()
    build(model, PLAN, folder, jobs=1)
    end.join()
    assert check(folder).passed
