"""Slides for the tests of cohorts, and effects that make worker processes die or wait."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import AppliedEffect, DisplayModel, read_measurements
from lutgen.display import default_display
from lutgen.effects.own import load_file

if TYPE_CHECKING:
    from pathlib import Path

HOURS = (0.0, 6000.0, 18_000.0)

#: An effect that adds light. If there is a file `order` beside it, the first process other than the tests' own that
#: uses the effect dies. Every process that shows an image of seven colours dies too.
DEADLY = '''\
"""Glue glows."""

import os
import signal
from contextlib import suppress
from pathlib import Path

from lutgen.effects import Parameter, effect


@effect(
    stage="optics",
    neutral={"glow": 0.0},
    glow=Parameter(0.002, (0.0, 0.05), "1", "light that is added, as a share of white's, at 18 000 h"),
)
def deadly_glow(xyz, scene, *, glow):
    order, parent = (Path(__file__).with_name(name) for name in ("order", "parent"))
    if parent.exists() and parent.read_text() != str(os.getpid()):
        with suppress(FileNotFoundError):
            order.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        if len(xyz) == 7:
            os.kill(os.getpid(), signal.SIGKILL)
    return xyz + glow * scene.tau * scene.white
'''

#: An effect that adds light. With an image of seven colours the effect waits while there is a file `gate` beside it.
WAITING = '''\
"""Glue glows."""

import time
from pathlib import Path

from lutgen.effects import Parameter, effect


@effect(
    stage="optics",
    neutral={"glow": 0.0},
    glow=Parameter(0.002, (0.0, 0.05), "1", "light that is added, as a share of white's, at 18 000 h"),
)
def waiting_glow(xyz, scene, *, glow):
    while len(xyz) == 7 and Path(__file__).with_name("gate").exists():
        time.sleep(0.01)
    return xyz + glow * scene.tau * scene.white
'''


def model() -> DisplayModel:
    return DisplayModel(read_measurements(default_display()))


def deadly_model(folder: Path, *, order: bool) -> DisplayModel:
    """Return a model with the effect that kills processes. With `order`, one process dies of the effect, once."""
    (folder / "parent").write_text(str(os.getpid()))
    if order:
        (folder / "order").touch()
    return _glowing(folder / "deadly.py", DEADLY)


def waiting_model(folder: Path) -> DisplayModel:
    """Return a model with the effect that waits at an image of seven colours until the file `gate` is removed."""
    (folder / "gate").touch()
    return _glowing(folder / "waiting.py", WAITING)


def _glowing(file: Path, source: str) -> DisplayModel:
    file.write_text(source)
    (effect,) = load_file(file)
    return replace(model(), effects=(AppliedEffect.of(effect, {"glow": 0.002}),))


def make_slides(folder: Path, count: int, side: int = 40) -> list[Path]:
    """Write parts of a real image; no two parts are equal."""
    folder.mkdir(exist_ok=True)
    tissue: Any = np.asarray(immunohistochemistry())
    files = []
    for place in range(count):
        row, column = divmod(place * 40, 440)
        files.append(folder / f"s{place:02}.png")
        part = tissue[40 * row : 40 * row + side, column : column + side]
        imsave(files[-1], part, check_contrast=False)
    return files


def seven_colours(file: Path) -> Path:
    """Write an image of seven colours, at which the effects die or wait."""
    imsave(file, np.repeat(np.arange(20, 27, dtype=np.uint8), 3).reshape(1, 7, 3), check_contrast=False)
    return file


def break_slide(file: Path) -> Path:
    """Truncate a file, like an interrupted copy."""
    file.write_bytes(file.read_bytes()[:300])
    return file
