"""A folder with the files of the examples in README and help texts, and every command that the examples may run."""

import os
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import chdir
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest
from click import Command, Context, Group
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen.bake import icc_profile
from lutgen.bake.spaces import linear_to_xyz_d50
from lutgen.cli.command import group
from lutgen.display import DisplayModel, default_display
from lutgen.errors import INTERRUPTED
from lutgen.readings import read_measurements
from lutgen.report.effect_sketch import sketched
from tests.command import here

ROOT = Path(__file__).resolve().parents[1]


def commands(here: Group = group, before: str = "") -> dict[str, Command]:
    """Return every command by its words, such as "study plan"; groups include their commands."""
    named: dict[str, Command] = {}
    for name in here.list_commands(Context(here)):
        command = here.get_command(Context(here), name)
        assert command is not None
        named |= commands(command, f"{before}{name} ") if isinstance(command, Group) else {f"{before}{name}": command}
    return named


COMMANDS = commands()


def make_folder(folder: Path) -> Path:
    """Put the files of the examples into an empty folder."""
    imsave(folder / "slide.png", immunohistochemistry()[:64, :64])
    for top, name in ((0, "a.tif"), (32, "b.tif")):
        imsave(folder / name, immunohistochemistry()[top : top + 32, :32])
    (folder / "compared").mkdir()
    (folder / "slides").mkdir()
    for name in ("a.tif", "b.tif"):
        shutil.copyfile(folder / name, folder / "slides" / name)
    shutil.copyfile(default_display(), folder / "my-display.csv")
    (folder / "examples").mkdir()
    for name in ("display-a.csv", "paper-study-counts.csv", "paper-study-summary.csv", "session.ti3"):
        shutil.copyfile(ROOT / "examples" / name, folder / "examples" / name)
    shutil.copytree(ROOT / "examples/campaign", folder / "examples/campaign")
    (folder / "my_effect.py").write_text(sketched("light added everywhere", misfit="of an example"))
    shutil.copyfile(ROOT / "configs/default/chroma/10000h/aged.clf", folder / "theirs.clf")
    model = DisplayModel(read_measurements(default_display()))
    axis = np.linspace(0, 1, 33)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    table = model.at("chroma", 10_000).code_to_code(np.stack([red, green, blue], axis=-1)).reshape(-1, 3)
    rows = "".join(f"{r:.7f} {g:.7f} {b:.7f}\n" for r, g, b in table)
    (folder / "theirs.cube").write_text(f"LUT_3D_SIZE 33\n{rows}")
    shutil.copytree(ROOT / "configs/default/stable/0h", folder / "my-config")
    tags = icc_profile.display_tags("Scanner", ("a scanner's profile",), linear_to_xyz_d50(np.eye(3)))
    (folder / "scanner.icc").write_bytes(icc_profile.profile(device_class=b"scnr", pcs=b"XYZ ", tags=tags))
    return folder


def run_lutgen(line: str, folder: Path) -> str:
    """Run a line of a shell in a folder, in this process, where the slow modules are already imported."""
    program, *arguments = shlex.split(line, comments=True)
    assert program == "lutgen"
    if arguments[:2] == ["study", "run"] or arguments[:1] == ["explore"]:
        return run_until_served([sys.executable, "-m", "lutgen", *arguments], folder)
    with chdir(folder), pytest.MonkeyPatch.context() as patch:
        # No workers: beside the threads of earlier tests (OpenGL, images) a forked process may hang.
        patch.setattr(os, "cpu_count", lambda: 1)
        done = here(*arguments)
    # A gate may report that the error of the example's model is too large.
    allowed = (0, 1) if "--fail-above" in arguments else (0,)
    assert done.returncode in allowed, (line, done.stderr)
    return done.stdout


def run_until_served(command: list[str], folder: Path) -> str:
    """Run a command that serves a page until the page is served; then stop the command like Ctrl-C."""
    process = subprocess.Popen([*command, "--no-browser"], cwd=folder, stdout=subprocess.PIPE, text=True)
    with process:
        assert process.stdout
        printed = list(takewhile(lambda line: "http://" not in line, process.stdout))
        process.send_signal(signal.SIGINT)
        printed += process.stdout
    assert process.returncode == INTERRUPTED, (command, printed)
    return "".join(printed)
