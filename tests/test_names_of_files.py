"""File names with arbitrary bytes, and paths that are no files: every command gives one sentence."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lutgen import DisplayModel, read_measurements
from lutgen.bake.build import build
from lutgen.bake.check import check
from lutgen.bake.manifest import MANIFEST
from lutgen.bake.plan import BuildPlan
from lutgen.display import default_display
from lutgen.errors import LutgenError
from lutgen.files import write_atomically
from tests.command import here
from tests.quick import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="names are Unicode elsewhere")

PLAN = BuildPlan(hours=(0.0,), modes=("chroma",), formats=("cube", "clf"), cubesize=17)

EXAMPLES = Path(__file__).parents[1] / "examples"

#: An invalid UTF-8 byte, as Python represents it in a name.
BYTE = os.fsdecode(b"\xff")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("names") / "built"
    build(DisplayModel(read_measurements(default_display())), PLAN, folder, jobs=1)
    return folder


@pytest.mark.parametrize(
    "command",
    [
        "lint a{}.clf",
        "lint a{}.ocio",
        "check folder{}",
        "check a{}.cube --mode chroma --hours 0",
        "apply picture.jpg --lut a{}.cube -o aged.png",
        "build --mode chroma --hours 0 --cubesize 17 -o new{}",
        "build --display a{}.csv --mode chroma --hours 0 --cubesize 17 -o new",
    ],
)
def test_a_name_that_is_no_utf_8_is_said(
    built: Path, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in (built / "chroma/0h/aged.cube", built / "chroma/0h/aged.clf", built / "config.ocio", default_display()):
        shutil.copy(file, f"a{BYTE}{file.suffix}")
    shutil.copytree(built, f"folder{BYTE}")
    shutil.copy(EXAMPLES / "tissue.jpg", "picture.jpg")
    before = set(tmp_path.iterdir())
    done = here(*command.format(BYTE).split())
    assert done.returncode == (1 if ".cube --mode" in command else 2)  # a fault of a file is a finding
    assert (done.stdout + done.stderr).count("UTF-8") == 1
    assert "Traceback" not in done.stderr
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", [MANIFEST, ".lutgen-build.json"])
def test_a_pipe_in_the_place_of_a_manifest_is_not_waited_for(built: Path, name: str, tmp_path: Path) -> None:
    folder = shutil.copytree(built, tmp_path / "copy")
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    if name == MANIFEST:
        (finding,) = check(folder, jobs=1).findings
        assert "is no file" in finding.problem
    with pytest.raises(LutgenError, match="is no file"):
        build(DisplayModel(read_measurements(default_display())), PLAN, folder, jobs=1)


def test_a_text_with_such_a_name_is_one_sentence_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def written(*_: object, **__: object) -> None:
        f"display = {BYTE}.csv\n".encode()

    monkeypatch.setattr("lutgen.cli.command.group.main", written)
    done = here("effects")
    assert done.returncode == 2
    assert "'display = \\udcff.csv': holds a name that is no UTF-8" in done.stderr


@pytest.mark.parametrize("encoding", mostly_slow(["ascii", "latin-1"], "ascii"))
def test_an_encoding_without_dashes_costs_letters_alone(encoding: str) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "lutgen", "effects"]
    plain, other = (
        subprocess.run(command, env=each, capture_output=True, check=False) for each in (os.environ, environment)
    )
    assert (plain.returncode, other.returncode, other.stderr) == (0, 0, b"")
    assert other.stdout.decode(encoding) == plain.stdout.decode().encode(encoding, errors="replace").decode(encoding)
    assert other.stdout != plain.stdout


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_device_or_a_pipe_is_not_replaced(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "there"
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to(os.devnull)
    before = place.lstat()
    with pytest.raises(LutgenError, match="device or a pipe"):
        write_atomically(place, b"new")
    assert (place.lstat().st_ino, list(tmp_path.iterdir())) == (before.st_ino, [place])
