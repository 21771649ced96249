"""Readers of ``.cube`` that may be installed: one module each in this folder, found by being there.

A module has ``PROGRAM``. Every one is asked for trilinear interpolation, which all of them have.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: A program that answers no sooner has hung: all take less than 2 s for the largest table that is tried.
TIMEOUT = 60


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
        Whether it writes integers, so that what leaves 0..1 is clipped.

    """

    reader: Callable[[], str]
    version: Callable[[], str]
    apply: Callable[[Path, NDArray[np.uint8]], Array]
    tolerance: float
    clips: bool


def programs() -> list[Program]:
    """All programs, by file name."""
    return [import_module(f"{__name__}.{module.name}").PROGRAM for module in iter_modules(__path__)]
