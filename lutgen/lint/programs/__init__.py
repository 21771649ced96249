"""Readers of ``.cube`` that may be installed: one module each in this folder, found by being there.

A module defines ``PROGRAM``: the reader's name and version, and how code values are sent through a file. Each reader is
asked for trilinear interpolation, which all of them have.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Seconds after which a program counts as hung; each takes less than 2 s for the largest table that is tried.
TIMEOUT = 60

#: Number of colours that are sent through a file, 8-bit ones so that each reader gets exactly the same, and their seed.
COLOURS, SEED = 400, 20250611

#: Larger files are not given to readers: those that trust the header would fill the memory or run for hours.
MAX_BYTES = 200 << 20


class Refusal(Exception):  # noqa: N818 - no error of ours: what a reader answers
    """The reader does not take the file; says its words."""


class Absent(Exception):  # noqa: N818 - no error: a state of this machine
    """The reader is not installed; says how to get it."""


@dataclass(frozen=True)
class Program:
    """A reader.

    Attributes
    ----------
    reader
        Gives its name among ``finding.READERS``.
    version
        Gives its version, or raises ``Absent``.
    apply
        Sends 8-bit code values (n, 3) through the file, or raises ``Refusal``.
    tolerance
        How far it may be from our own reading, in code values 0..1.
    clips
        Whether it writes integers, which clips values outside 0..1.

    """

    reader: Callable[[], str]
    version: Callable[[], str]
    apply: Callable[[Path, NDArray[np.uint8]], Array]
    tolerance: float
    clips: bool


def programs() -> list[Program]:
    """All programs, by file name."""
    return [import_module(f"{__name__}.{module.name}").PROGRAM for module in iter_modules(__path__)]


def probe_colours() -> NDArray[np.uint8]:
    """Return the colours, uint8 (n, 3): the cube's corners, greys and random ones."""
    corners = np.array(np.meshgrid([0, 255], [0, 255], [0, 255])).reshape(3, -1).T
    greys = np.repeat(np.arange(0, 256, 15)[:, np.newaxis], 3, axis=1)
    random = np.random.default_rng(SEED).integers(0, 256, (COLOURS - len(corners) - len(greys), 3))
    return np.concatenate([corners, greys, random]).astype(np.uint8)
