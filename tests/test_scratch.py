"""The next run removes the remains of a killed run. SIGTERM leaves no remains."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from lutgen import files
from lutgen.files import GRACE

pytest.importorskip("fcntl", reason="locks of folders are Unix's")

HOLD = "from lutgen.files import scratch\nwith scratch() as it:\n    print(it, flush=True)\n    input()\n"


def holder(place: Path) -> tuple[subprocess.Popen[str], Path]:
    """Start a process that holds a folder until it receives a line."""
    started = subprocess.Popen(
        [sys.executable, "-c", HOLD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(place)},
    )
    assert started.stdout
    return started, Path(started.stdout.readline().strip())


def old(folder: Path) -> None:
    then = time.time() - GRACE - 5
    os.utime(folder, (then, then))


def test_the_next_run_clears_what_a_killed_one_left_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed, left = holder(tmp_path)
    running, held = holder(tmp_path)
    killed.kill()
    killed.communicate(timeout=60)
    (left / "table.cube").write_text("half")
    others = tmp_path / "others-folder"
    others.mkdir()
    fresh = tmp_path / "lutgen-fresh"
    fresh.mkdir()
    for folder in (left, held, others):
        old(folder)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    files._clear.cache_clear()
    with files.scratch() as own:
        assert set(tmp_path.iterdir()) == {held, others, fresh, own}
    running.communicate("\n", timeout=60)
    assert set(tmp_path.iterdir()) == {others, fresh}
    files._clear.cache_clear()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_sigterm_leaves_nothing_half_written(tmp_path: Path, jobs: str) -> None:
    options = ["--hours", "0..18000", "--cubesize", "17", "--jobs", jobs, "-o", str(tmp_path / "built")]
    started = subprocess.Popen(
        [sys.executable, "-m", "lutgen", "build", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 60
    while not list(tmp_path.rglob("*.cube")) and time.monotonic() < end:
        time.sleep(0.05)
    started.send_signal(signal.SIGTERM)
    out, err = started.communicate(timeout=60)
    assert (started.returncode, out, err) == (143, "", "")
    assert not [path for path in tmp_path.rglob("*") if path.name.endswith(".lutgen-partial")]
