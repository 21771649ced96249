"""OpenImageIO's command line: the program in Debian's package and the program in the wheel."""

import sys
from collections.abc import Callable
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path

from lutgen.bake.config import AGED, AGED_VIEW, LOOK, NAMED_TRANSFORM, SOURCE
from lutgen.bake.formats import format_named
from tests.consumers import Consumer, Job, Picture, Unavailable, first_line, program, read_image, run

#: Formats of LUT files.
LUTS = ("cube", "resolve", "csp", "spi3d", "3dl")

DISPLAY = (f"--ociodisplay:from={SOURCE}", "sRGB", AGED_VIEW)


def debian() -> str:
    return program("oiiotool", "openimageio-tools")


def wheel() -> str:
    path = Path(sys.prefix, "bin", "oiiotool")
    if not path.is_file():
        raise Unavailable("this openimageio wheel brings no oiiotool")
    return str(path)


def has_wheel() -> bool:
    binding = find_spec("OpenImageIO")
    return binding is not None and Path(str(binding.origin)).is_relative_to(sys.prefix)


@cache
def version(tool: Callable[[], str]) -> str:
    return first_line(run(tool(), "--version"))


def call(job: Job, tool: Callable[[], str], config: Path, *steps: str | Path) -> Picture:
    result = job.scratch / "oiiotool.tif"
    result.unlink(missing_ok=True)
    plain = ("-d", "uint16", "--compression", "none", "-o", result)
    run(tool(), "--colorconfig", config, job.png8, *steps, *plain)
    return read_image(result)


def display(job: Job, tool: Callable[[], str]) -> Picture:
    return call(job, tool, job.config, *DISPLAY)


def look(job: Job, tool: Callable[[], str]) -> Picture:
    return call(job, tool, job.config, f"--ociolook:from={SOURCE}:to={SOURCE}", LOOK)


def convert(job: Job, tool: Callable[[], str]) -> Picture:
    return call(job, tool, job.config, "--colorconvert", AGED, SOURCE)


def variables(job: Job, tool: Callable[[], str]) -> Picture:
    keys, values = ",".join(job.variables), ",".join(job.variables.values())
    option, *rest = DISPLAY
    return call(job, tool, job.common_config, f"{option}:key={keys}:value={values}", *rest)


def lut(job: Job, tool: Callable[[], str], name: str) -> Picture:
    return call(job, tool, job.config, "--ociofiletransform", job.lut(name))


def named(job: Job, tool: Callable[[], str]) -> Picture:
    return call(job, tool, job.config, "--ocionamedtransform", NAMED_TRANSFORM)


def ways(name: str, tool: Callable[[], str]) -> list[Consumer]:
    # OpenImageIO requests OpenColorIO's best interpolation of a LUT file, which is tetrahedral.
    files: list[tuple[str, str, Callable[..., Picture]]] = [
        ("--ociofiletransform", format_named(each).file, partial(lut, name=each)) for each in LUTS
    ]
    return [
        Consumer(f"{name} {option}", partial(version, tool), file, "tetrahedral", partial(render, tool=tool))
        for option, file, render in (
            ("--ociodisplay", "config.ocio", display),
            ("--ociodisplay:key", "common config.ocio", variables),
            ("--ociolook", "config.ocio", look),
            ("--colorconvert", "config.ocio", convert),
            *files,
        )
    ]


CONSUMERS = ways("oiiotool", debian)
if has_wheel():
    CONSUMERS += ways("wheel's oiiotool", wheel)
    CONSUMERS.append(
        Consumer(
            "wheel's oiiotool --ocionamedtransform",
            partial(version, wheel),
            "config.ocio",
            "tetrahedral",
            partial(named, tool=wheel),
        )
    )
