"""LittleCMS: its ``tificc`` at 16 bit and ``transicc``, and Pillow's ``ImageCms`` at 8 bit, as many viewers call it."""

from collections.abc import Iterator
from functools import cache, partial
from importlib.metadata import version as version_of
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.lint.finding import LCMS_8, READS, REFUSES, WRONG
from tests.consumers import Claim, Consumer, Job, Picture, first_line, module, program, read_image, run, write_image
from tests.consumers._claims import INTENTS, aged, beyond, colours, converted, profile_in, unlike
from tests.consumers._gallery import RESAMPLED
from tests.profile_cases import CASES, PIXELS, profile_of

#: Rendering intents by their numbers.
PERCEPTUAL, RELATIVE, ABSOLUTE = 0, 1, 3


def tool(name: str = "tificc") -> str:
    return program(name, "liblcms2-utils")


@cache
def version() -> str:
    # The program has no version option. It prints the version with its help text and exits with an error.
    line = first_line(run("sh", "-c", '"$0" -h 2>&1 || true', tool()))
    return line.rpartition("LittleCMS ")[2].rstrip("]")


def tificc(job: Job, *options: str) -> Picture:
    result = job.scratch / "tificc.tif"
    result.unlink(missing_ok=True)
    run(tool(), "-w16", *options, job.tif16, result)
    return read_image(result)


def profile(job: Job, intent: int) -> Picture:
    return tificc(job, f"-t{intent}", f"-i{job.lut('icc')}", "-o*sRGB")


def link(job: Job) -> Picture:
    return tificc(job, f"-l{job.lut('devicelink')}")


def pillow_version() -> str:
    module("PIL.ImageCms", "pillow")
    return version_of("pillow")


def pillow(job: Job, form: str = "icc") -> Picture:
    cms = module("PIL.ImageCms", "pillow")
    image = module("PIL.Image", "pillow").fromarray(job.image)
    return np.asarray(cms.profileToProfile(image, str(job.lut(form)), cms.createProfile("sRGB")))


def by_pillow(data: bytes) -> Picture | None:
    cms = module("PIL.ImageCms", "pillow")
    try:
        source = cms.ImageCmsProfile(BytesIO(data))
        shown = cms.profileToProfile(module("PIL.Image", "pillow").fromarray(PIXELS), source, cms.createProfile("sRGB"))
    except (cms.PyCMSError, OSError):
        return None
    return np.asarray(shown)


def faulty_profiles(_folder: Path) -> Iterator[str]:
    for name, case in CASES.items():
        shown, meant = by_pillow(case.data), by_pillow(case.whole)
        assert meant is not None
        outcome = REFUSES
        if shown is not None:
            outcome = READS if np.abs(shown.astype(int) - meant).max() <= 1 else WRONG
        # At hour 0 the matrix and the table in a profile are equal; only the bytes show that the table is missing.
        if outcome == REFUSES or not ("cut off" in name or "beyond" in name):
            yield from unlike(name, outcome, case.outcomes[LCMS_8])


def whites_by_pillow(folder: Path) -> Iterator[str]:
    """Check white by Pillow.

    With integers, LittleCMS maps a table's white to white, unless told otherwise; a matrix keeps its white.
    """
    cms = module("PIL.ImageCms", "pillow")
    white, srgb = module("PIL.Image", "pillow").new("RGB", (1, 1), "white"), cms.createProfile("sRGB")
    model = aged().code_to_code(np.ones((1, 3))) * 255
    for name, kept in (("icc", False), ("icc-matrix", True)):
        path = profile_in(folder, name)

        def shown(intent: int, flags: Any, path: Path = path) -> Array:
            way = cms.buildTransform(str(path), srgb, "RGB", "RGB", cms.Intent(intent), flags)
            pixels = np.asarray(cms.applyTransform(white, way), dtype=np.float64)
            return np.asarray(pixels[0])

        plain = cms.Flags.NONE
        for intent in (PERCEPTUAL, RELATIVE):
            meant = model if kept else np.full((1, 3), 255.0)
            yield from beyond(f"white of {name}, intent {intent}", shown(intent, plain), meant, 0.6)
        unoptimised = shown(RELATIVE, cms.Flags.NOOPTIMIZE)
        yield from beyond(f"white of {name}, not optimised", unoptimised, model, 1.01)
        yield from beyond(f"white of {name}, absolute", shown(ABSOLUTE, plain), model, 1.01)


def white(folder: Path, depth: int, *options: str | Path) -> Array:
    """Return white of a picture of 8 or 16 bit after ``tificc`` converts it at this depth, in 0..1; shape (1, 3)."""
    source, result = folder / "white.tif", folder / "shown.tif"
    largest = 2**depth - 1
    pixels = np.full((8, 8, 3), largest)
    write_image(source, pixels.astype(np.uint8) if depth == 8 else pixels.astype(np.uint16))
    result.unlink(missing_ok=True)
    run(tool(), f"-w{depth}", *options, source, result)
    return np.asarray(read_image(result)[0, :1] / largest)


def whites(folder: Path) -> Iterator[str]:
    """Check white by ``tificc``.

    At 8 bit a matrix shows the aged white with every intent. At 16 bit pictures are resampled and lose it.
    """
    model, unaged = aged().code_to_code(np.ones((1, 3))), np.ones((1, 3))
    matrix = profile_in(folder, "icc-matrix")
    for intent in INTENTS:
        shown = white(folder, 8, f"-t{intent}", f"-i{matrix}", "-o*sRGB")
        yield from beyond(f"white of icc-matrix, 8 bit, intent {intent}", shown, model, 0.6 / 255)
    for name in ("icc", "icc-matrix"):
        path = profile_in(folder, name)
        shown = white(folder, 16, f"-t{RELATIVE}", f"-i{path}", "-o*sRGB")
        yield from beyond(f"white of {name}, 16 bit, relative", shown, unaged, 1e-6)
        shown = white(folder, 16, f"-t{ABSOLUTE}", f"-i{path}", "-o*sRGB")
        yield from beyond(f"white of {name}, 16 bit, absolute", shown, model, 1e-3)


def whites_that_are_lost(folder: Path) -> Iterator[str]:
    """Check that, at 8 bit and by default, a table's white becomes white, and a matrix's white does not."""
    for name, lost in (("icc", True), ("devicelink", True), ("icc-matrix", False)):
        (folder / "display.icc").write_bytes(profile_of(name, 18_000))
        path = folder / "display.icc"
        options = (f"-l{path}",) if name == "devicelink" else (f"-i{path}", "-o*sRGB")
        shown = white(folder, 8, f"-t{RELATIVE}", *options)
        if bool((shown == 1).all()) != lost:
            yield f"{name}: white becomes {np.rint(shown[0] * 255)}"


def numbers(folder: Path) -> Iterator[str]:
    code, path = colours(), profile_in(folder, "icc")
    for intent in INTENTS:
        options = (f"-t{intent}", "-c0", "-n", "-i", path, "-o", "*sRGB")
        answers = np.clip(converted(tool("transicc"), *options, code=code * 255), 0, 255)
        yield from beyond(f"intent {intent}", answers, aged().code_to_code(code) * 255, 0.7)


CLAIMS = [
    Claim("tificc", version, "shows the aged white where README says that it does, and only there", whites),
    Claim("tificc", version, "loses the aged white where lint says so", whites_that_are_lost),
    Claim("transicc", version, "shows the model with every intent", numbers),
    Claim("Pillow ImageCms", pillow_version, "keeps the aged white without a table alone", whites_by_pillow),
    Claim("Pillow ImageCms", pillow_version, f"reads {len(CASES)} profiles with faults as lint says", faulty_profiles),
]

CONSUMERS = [
    *(
        Consumer(f"tificc, {name}", version, "aged.icc", RESAMPLED, partial(profile, intent=intent))
        for name, intent in (("perceptual", PERCEPTUAL), ("relative", RELATIVE))
    ),
    Consumer("tificc, link", version, "aged-link.icc", "tetrahedral", link),
    Consumer("Pillow ImageCms", pillow_version, "aged.icc", "tetrahedral", pillow),
    Consumer(
        "Pillow ImageCms, matrix", pillow_version, "aged-matrix.icc", "matrix", partial(pillow, form="icc-matrix")
    ),
]
