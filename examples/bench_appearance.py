"""Rows of ``bench``: the speed of the colour differences of a large image, for all hours and both modes.

The image is real tissue (skimage's immunohistochemistry image), tiled to 100 megapixels in a temporary TIFF. The
goals: curves 500 times and differences 4 times as fast as the peer, and at most 500 MB of memory.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from examples.racing import LUTGEN, Peer, Row, against_limit, peak_memory, race
from lutgen import lifetime
from lutgen.bindings import oiio
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab
from lutgen.names import AGING_MODES
from lutgen.pictures.difference import curves_of
from lutgen.pictures.distinct import count_colours

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from lutgen import DisplayModel
    from lutgen.colorimetry import Array
    from lutgen.pictures.distinct import Colours

with warnings.catch_warnings():
    # colour-science warns about optional packages that nothing here needs.
    warnings.simplefilter("ignore")
    import colour

CURVE_GOAL, DIFFERENCE_GOAL, MEMORY_LIMIT_MB, TILED_LIMIT = 500.0, 4.0, 500.0, 1.1

#: Number of repeats of the image for the row about its size.
TIMES = 10


@dataclass(frozen=True)
class Work:
    """The amount of work: sides of the image and of the peer's crop, in pixels; hours of the curve; repetitions."""

    width: int = 10_000
    height: int = 10_000
    crop: int = 256
    hours: int = 31
    short: int = 9
    long: int = 3

    @classmethod
    def quick(cls) -> Work:
        """Return little work for every row."""
        return cls(width=300, height=200, crop=32, hours=3, short=3, long=1)


def appearance(work: Work, model: DisplayModel, tissue: Array, folder: Path) -> Iterator[Row]:
    """Yield all rows; ``tissue`` is 8-bit RGB of the size of ``work``."""
    file = folder / "slide.tif"
    save(tissue, file)
    hours = [float(hour) for hour in model.tips.hours[: work.hours]]
    crop = tissue[: work.crop, : work.crop].reshape(-1, 3) / 255.0
    yield from _difference(work, model, tissue)
    straight = Straightforward(model, hours)
    _agree(straight, model, hours, tissue[: work.crop, : work.crop], folder)
    pixels = tissue.shape[0] * tissue.shape[1]
    yield from race(
        f"{len(hours)} hours × {len(AGING_MODES)} modes, {pixels / 1e6:.3g} Mpx, from the file",
        partial(lifetime, [file], model, hours=hours),
        Peer(
            f"colour-science on every pixel ({work.crop} × {work.crop} timed, × {pixels / len(crop):.4g})",
            partial(straight.means, crop),
            CURVE_GOAL,
            pixels / len(crop),
        ),
        times=work.long,
    )
    command = [*LUTGEN, "lifetime", str(file), "--json", "-"]
    peaks = [peak_memory(command, folder) for _ in range(work.long)]
    yield against_limit("peak memory of lutgen lifetime on that image (PSS)", peaks, MEMORY_LIMIT_MB, "MB")
    noise, every = folder / "noise.tif", folder / "every.tif"
    save(noisy(tissue), noise)
    peaks = [peak_memory([*LUTGEN, "lifetime", str(noise), "--hours", "10000", "--json", "-"], folder)]
    yield against_limit("the same, 16 bits, every pixel another colour, 1 hour", peaks, MEMORY_LIMIT_MB, "MB")
    if work.width >= 4096:
        save(all_colours(), every)
        peaks = [peak_memory([*LUTGEN, "lifetime", str(every), "--hours", "10000", "--json", "-"], folder)]
        yield against_limit("the same, all 16.7 million 8-bit colours, 1 hour", peaks, MEMORY_LIMIT_MB, "MB")
    yield from _tiled(work, model, tissue, hours, folder)


def _difference(work: Work, model: DisplayModel, tissue: Array) -> Iterator[Row]:
    """Race ΔE2000 alone, on pairs that an aged display makes."""
    code = tissue[: 4 * work.crop, : 4 * work.crop].reshape(-1, 3) / 255.0
    before = linear_to_lab(code_to_linear(code))
    after = linear_to_lab(np.clip(model.at("chroma", 10_000.0).code_to_linear(code), 0.0, 1.0))
    theirs = partial(colour.delta_E, before, after, method="CIE 2000")
    if np.abs(delta_e_2000(before, after) - theirs()).max() > 1e-10:
        raise SystemExit("bench: colour-science's ΔE2000 and lutgen's differ by more than 1e-10")
    peer = Peer("colour.delta_E, CIE 2000", theirs, DIFFERENCE_GOAL)
    yield from race(f"ΔE2000 of {len(code):,} pairs", partial(delta_e_2000, before, after), peer, times=work.short)


@dataclass(frozen=True)
class Straightforward:
    """The curve as in colour-science's documentation: every pixel through every step at every hour."""

    model: DisplayModel
    hours: list[float]

    def means(self, code: Array) -> Array:
        """Return the mean ΔE2000 of code values (n, 3) in each mode at each hour: (modes, hours)."""
        linear = colour.cctf_decoding(code, function="sRGB")
        lab = self._lab(linear)
        points = np.array([[1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        nearest = np.linalg.norm(linear[:, np.newaxis] - points, axis=-1).argmin(axis=-1)
        return np.array([[self._mean(lab, linear, nearest, mode, hour) for hour in self.hours] for mode in AGING_MODES])

    def _mean(self, lab: Array, linear: Array, nearest: Any, mode: str, hour: float) -> float:
        xyz = colour.algebra.vecmul(self.model.matrices(mode, hour).array[nearest], linear)
        aged = np.clip(colour.XYZ_to_RGB(xyz, "sRGB", chromatic_adaptation_transform=None), 0, 1)
        return float(np.mean(colour.delta_E(lab, self._lab(aged), method="CIE 2000")))

    @staticmethod
    def _lab(linear: Array) -> Array:
        xyz = colour.RGB_to_XYZ(linear, "sRGB", chromatic_adaptation_transform=None)
        return np.asarray(colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]))


def _agree(straight: Straightforward, model: DisplayModel, hours: list[float], crop: Any, folder: Path) -> None:
    """Stop if the results of the race differ.

    Tolerances allow for colour's sRGB matrix, which has four decimals, and for ties, which it gives to one point.
    """
    save(crop, folder / "crop.tif")
    (mine,) = lifetime([folder / "crop.tif"], model, hours=hours).images
    means = straight.means(crop.reshape(-1, 3) / 255.0)
    if np.abs(np.array([mine.curves[mode].mean for mode in AGING_MODES]) - means).max() > 0.01:
        raise SystemExit("bench: colour-science's curve and lutgen's differ by more than 0.01 ΔE2000")


def _tiled(work: Work, model: DisplayModel, tissue: Array, hours: list[float], folder: Path) -> Iterator[Row]:
    """Compare all hours and modes of an image with those of the same image tiled ten times.

    The difference is the work after the read.
    """
    side = min(512, work.height)
    small, large = folder / "once.tif", folder / "tiled.tif"
    save(tissue[:side, :side], small)
    save(np.tile(tissue[:side, :side], (TIMES, 1, 1)), large)
    once, tiled = count_colours(small), count_colours(large)
    if tiled.pixels != TIMES * once.pixels:
        raise SystemExit("bench: the tiled image has not ten times the pixels")

    def curves(colours: Colours) -> object:
        return curves_of(colours, model, AGING_MODES, hours)

    # Here the ratio is the time of the image divided by that of the tiled image; it must be at least 1/1.1.
    peer = Peer("the same image once", partial(curves, once), 1.0 / TILED_LIMIT)
    yield from race(
        f"{len(hours)} hours × {len(AGING_MODES)} modes of an image tiled {TIMES} times, after the read",
        partial(curves, tiled),
        peer,
        times=work.short,
    )


def noisy(tissue: Array) -> Any:
    """Return tissue in 16 bits, with noise in the lower eight bits, so that nearly every pixel has a unique colour."""
    noise = np.random.default_rng(0).integers(0, 256, tissue.shape, dtype=np.uint16)
    return tissue.astype(np.uint16) * np.uint16(256) + noise


def all_colours() -> Any:
    """Return an image of 4096 × 4096 pixels that shows each 8-bit colour once."""
    number = np.arange(1 << 24, dtype=np.uint32).reshape(4096, 4096)
    return np.stack([number >> 16, number >> 8 & 255, number & 255], axis=-1).astype(np.uint8)


def save(pixels: Any, path: Path) -> None:
    """Write RGB of 8 or 16 bits as TIFF."""
    lib = oiio()
    spec = lib.ImageSpec(pixels.shape[1], pixels.shape[0], 3, pixels.dtype.name)
    spec.attribute("compression", "zip")
    spec.attribute("tiff:RowsPerStrip", 64)
    out = lib.ImageOutput.create(str(path))
    if not (out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels)) and out.close()):
        sys.exit(f"bench: {path}: {out.geterror()}")
