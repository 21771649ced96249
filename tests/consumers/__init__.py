"""Programs with which people view pictures through lutgen's files; each program is run as its users run it.

There is one file per program. A file is found because it is in this folder. A file defines ``CONSUMERS``, one for each
way
to use the program (a display's view, a look, a LUT file), or ``CLAIMS``, the behaviour of the program according to
lutgen's rules and texts, or both. ``python -m tests.consumers`` prints the result of each consumer on a real image, and
whether each claim is true, with the versions of the programs. pytest asserts nothing of this, because another version
of
a program is not a fault of lutgen.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.formats import format_named
from lutgen.bindings import oiio
from lutgen.display import hour_name

#: Shape (height, width, 3): integers over their whole range, or floats where 1 is the largest code value.
Picture: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32] | NDArray[np.float64]


#: Timeout in seconds. All programs take less than 2 s, so a slower one hangs.
TIMEOUT = 60

#: Environment variables that would select another config than the config under test.
CHOOSERS = ("OCIO", "OCIO_ACTIVE_DISPLAYS", "OCIO_ACTIVE_VIEWS", "AGING_MODE", "AGING_HOURS")


class Unavailable(Exception):  # noqa: N818 - no error: a state of this machine
    """The program is not available on this machine; the message says why and how to install it."""


@dataclass(frozen=True)
class Job:
    """One picture to make: ``image`` on the display of ``mode`` at ``hours``, through the files in ``build``.

    ``scratch`` is a folder that all consumers share for one mode, hour and build.
    """

    build: Path
    mode: str
    hours: float
    image: NDArray[np.uint8]
    scratch: Path

    @property
    def config(self) -> Path:
        """The config of this display alone."""
        return self.build / self.mode / hour_name(self.hours) / "config.ocio"

    @property
    def common_config(self) -> Path:
        """The common config of all displays, which selects by context variables."""
        return self.build / "config.ocio"

    @property
    def variables(self) -> dict[str, str]:
        """The context variables of the common config."""
        return {"AGING_MODE": self.mode, "AGING_HOURS": hour_name(self.hours).removesuffix("h")}

    @property
    def cube(self) -> Path:
        return self.config.with_name("aged.cube")

    @property
    def clf(self) -> Path:
        return self.config.with_name("aged.clf")

    def lut(self, name: str) -> Path:
        """The file of this display in a format."""
        return self.config.with_name(format_named(name).file)

    @cached_property
    def png8(self) -> Path:
        """The image as an 8-bit PNG, the usual form."""
        return self._source("source-8.png", self.image)

    @cached_property
    def tif16(self) -> Path:
        """The same image as TIFF, without compression."""
        return self._source("source-16.tif", self.image.astype(np.uint16) * 257)

    @cached_property
    def png16(self) -> Path:
        """The same code values in 16 bit, for programs that compute in the depth of their input."""
        return self._source("source-16.png", self.image.astype(np.uint16) * 257)

    def _source(self, name: str, pixels: Picture) -> Path:
        path = self.scratch / name
        if not path.exists():
            write_image(path, pixels)
        return path


@dataclass(frozen=True)
class Consumer:
    """One way to use a program.

    Attributes
    ----------
    name
        The program and the part of it that is used.
    version
        Returns the version, or raises ``Unavailable``.
    file, interpolation
        The file for the program, and the program's interpolation: ``tetrahedral``, ``trilinear``, ``matrix`` for no
        table, or ``resampled`` if the program first makes its own table.
    render
        Returns the picture, or raises ``Unavailable``.

    """

    name: str
    version: Callable[[], str]
    file: str
    interpolation: str
    render: Callable[[Job], Picture]


@dataclass(frozen=True)
class Claim:
    """The behaviour of a program according to lutgen's rules or texts.

    Attributes
    ----------
    program
        The program and the part that is used.
    version
        Returns the version, or raises ``Unavailable``.
    says
        The claim: ``reads …``, ``shows …``.
    differences
        Takes an empty folder and yields a line for each case where the program behaves differently.

    """

    program: str
    version: Callable[[], str]
    says: str
    differences: Callable[[Path], Iterable[str]]


def consumers() -> list[Consumer]:
    """Return all consumers, sorted by file name."""
    return [consumer for each in _files() for consumer in getattr(each, "CONSUMERS", ())]


def claims() -> list[Claim]:
    """Return all claims, sorted by file name."""
    return [claim for each in _files() for claim in getattr(each, "CLAIMS", ())]


def _files() -> list[ModuleType]:
    names = sorted(module.name for module in iter_modules(__path__) if not module.name.startswith("_"))
    return [import_module(f"{__name__}.{name}") for name in names]


@cache
def program(name: str, package: str) -> str:
    """Return the path of a program of the system; the ``bin`` folder of the Python environment is excluded."""
    own = Path(sys.prefix, "bin").resolve()
    folders = [folder for folder in os.get_exec_path() if Path(folder).resolve() != own]
    path = shutil.which(name, path=os.pathsep.join(folders))
    if path is None:
        raise Unavailable(f"{name} is not on PATH; Debian has it in the package {package}")
    return path


def module(name: str, distribution: str) -> Any:
    """Import the Python module of a consumer."""
    if find_spec(name) is None:
        raise Unavailable(f"there is no module {name}; pip install {distribution}")
    return import_module(name)


def run(*command: str | Path, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    """Run a program and return its output; if the program fails, raise RuntimeError with its output."""
    inherited = {key: value for key, value in os.environ.items() if key not in CHOOSERS}
    words = [str(word) for word in command]
    done = subprocess.run(
        words,
        cwd=cwd,
        env=inherited | (env or {}),
        timeout=TIMEOUT,
        check=False,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def first_line(text: str) -> str:
    return text.strip().partition("\n")[0]


def write_image(path: Path, pixels: Picture) -> None:
    lib = oiio()
    height, width, channels = pixels.shape
    output = lib.ImageOutput.create(str(path))
    written = output.open(str(path), lib.ImageSpec(width, height, channels, str(pixels.dtype)))
    if not (written and output.write_image(pixels) and output.close()):
        raise RuntimeError(f"{path}: {output.geterror()}")


def read_image(path: Path) -> Picture:
    """Read a program's output picture in the file's depth; 16 bit is expected."""
    image = oiio().ImageInput.open(str(path))
    if image is None:
        raise RuntimeError(f"{path}: {oiio().geterror()}")
    pixels = image.read_image(image.spec().format)
    image.close()
    return np.asarray(pixels)[..., :3]
