"""The pictures of a study: the given images, and the renders that readers see.

Given images become 8-bit RGB. Two images must not have the same name, the same bytes or the same pixels. Each image is
rendered under each of its conditions, through a baked LUT. A render is an uncompressed PNG that holds only 8-bit
pixels, so that all renders of an image have the same file size and time. Only the pixels differ between conditions:
file names are keyed hashes, which reveal neither image nor condition, and files are written in the order of their
names.
"""

import hashlib
import hmac
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.bake.build import BuildPlan, build
from lutgen.display import DisplayModel
from lutgen.errors import LutgenError
from lutgen.files import file_sha256, files_below, scratch
from lutgen.pictures.apply import apply_to_images
from lutgen.pictures.frame import Pixels, plain_png
from lutgen.pictures.images import FORMATS, ImageSource, open_source
from lutgen.study.design import UNAGED
from lutgen.study.protocol import IMAGES, Render, StudyCondition, StudyImage

#: Formats of images that a study shows: formats that store code values.
KINDS = ("png", "jpeg", "tiff")

#: Suffixes of the files in a folder that count as images.
SUFFIXES = tuple(suffix for kind in FORMATS if kind.name in KINDS for suffix in kind.suffixes)


@dataclass(frozen=True)
class Picture:
    """One image given for a study."""

    #: Name in the study: the file's name, without its suffix if this is unique.
    name: str
    #: Path as given, or as found in a folder.
    path: Path
    #: Hash of the file, and hash of the shown picture: its size and 8-bit pixels.
    sha256: str
    pixels_sha256: str
    #: Size in pixels.
    width: int
    height: int
    #: Whether the image has 16 bits per channel, and is shown rounded to 8 bits.
    rounded: bool

    @property
    def frozen(self) -> StudyImage:
        """The entry of this image in the protocol."""
        return StudyImage(self.name, self.sha256, self.width, self.height)


def find_images(given: Iterable[str | Path]) -> list[Path]:
    """Return the images that files and folders name, in order. Raises LutgenError: none, unreadable, or given twice."""
    images: dict[Path, Path] = {}
    for path in (path for each in given for path in _images_of(Path(each))):
        absolute = path.resolve()
        if absolute in images:
            raise LutgenError(f"{path}: is given twice. Name each image once; a folder names all images in it.")
        images[absolute] = path
    return list(images.values())


def _images_of(given: Path) -> list[Path]:
    images = files_below(given, SUFFIXES)
    if images is None:
        return [given]
    if not images:
        raise LutgenError(f"{given}: no image in this folder or below. Looked for {', '.join(SUFFIXES)}.")
    return images


def look_at(paths: Sequence[Path], progress: Callable[[int], None]) -> tuple[Picture, ...]:
    """Read and check every image; ``progress`` gets the number done. Raises LutgenError: unfit, or two are equal."""
    pictures = []
    for name, path in zip(_names(paths), paths, strict=True):
        pictures.append(_picture(name, path))
        progress(len(pictures))
    for key, alike in {"sha256": "are the same file, byte for byte", "pixels_sha256": "show the same pixels"}.items():
        first: dict[str, Picture] = {}
        for picture in pictures:
            other = first.setdefault(getattr(picture, key), picture)
            if other is not picture:
                both = f"{other.path} and {picture.path}"
                raise LutgenError(f"{both}: {alike}, so a reader would read one picture twice. Leave one out.")
    return tuple(pictures)


def _names(paths: Sequence[Path]) -> list[str]:
    stems = Counter(path.stem for path in paths)
    names = [path.stem if stems[path.stem] == 1 else path.name for path in paths]
    first: dict[str, Path] = {}
    for name, path in zip(names, paths, strict=True):
        if not name.isprintable():
            raise LutgenError(f"{str(path)!a}: has letters in its name that cannot be seen. Rename the image.")
        if name in first:
            raise LutgenError(f"{first[name]} and {path}: both would be called {name} in the study. Rename one.")
        first[name] = path
    return names


def _picture(name: str, path: Path) -> Picture:
    pixels = shown_pixels(path)
    shown = hashlib.sha256(str(pixels.shape).encode())
    shown.update(pixels.tobytes())
    with open_source(path) as source:
        rounded = source.storage.dtype == np.uint16
    return Picture(name, path, file_sha256(path), shown.hexdigest(), pixels.shape[1], pixels.shape[0], rounded)


def shown_pixels(path: Path) -> Pixels:
    """Read an image as readers see it: uint8, (height, width, 3). Raises LutgenError: it cannot be shown."""
    with open_source(path) as source:
        _check_shown(source)
        pixels = source.read(0, source.height)
        deep = source.storage.dtype == np.uint16
        if source.storage.alpha and (pixels[..., 3] < source.storage.white).any():
            message = f"{path}: is transparent in places, where the page would shine through. Flatten it first."
            raise LutgenError(message)
    pixels = pixels[..., :3]
    # 65535 is 257 · 255, and 257 is odd: no number lies halfway between two 8-bit numbers.
    return ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8) if deep else pixels.astype(np.uint8)


def _check_shown(source: ImageSource) -> None:
    path = source.path
    if source.format.name not in KINDS or source.storage.dtype not in (np.uint8, np.uint16):
        message = f"{path}: readers are shown PNG, TIFF or JPEG of 8 or 16 bits per channel. Export the image as one."
        raise LutgenError(message)
    turned = int(source.spec.get_int_attribute("Orientation", 1))
    if turned > 1:
        message = f"{path}: asks viewers to turn it (Orientation {turned}), which not all do. Turn its pixels first."
        raise LutgenError(message)


#: Format of the LUTs for images: the most exact format.
LUT_FORMAT = "clf"

#: Time stamp of every picture, in seconds since 1970: the earliest time that a ZIP archive can store.
_WRITTEN = 315_532_800


@dataclass(frozen=True)
class BakedLut:
    """The baked LUT of a condition."""

    #: Path of the file.
    path: Path
    #: Hash of the file.
    sha256: str
    #: The certificate's largest ΔE2000 to the model: over all colours, and where no jump or gamut's edge is crossed.
    worst: float
    smooth: float

    def as_json(self) -> dict[str, Any]:
        """Return the entry of this LUT in the protocol."""
        worst = {"worst_delta_e_2000": self.worst, "worst_smooth_delta_e_2000": self.smooth}
        return {"format": LUT_FORMAT, "sha256": self.sha256, **worst}


def bake_conditions(conditions: Iterable[StudyCondition], model: DisplayModel, folder: Path) -> dict[str, BakedLut]:
    """Bake and certify the LUT of every aged condition, by name. Raises LutgenError: a LUT cannot be baked."""
    baked = {}
    for condition in conditions:
        if condition == UNAGED:
            continue
        output = folder / condition.name
        plan = BuildPlan(hours=(condition.hours,), modes=(condition.mode,), formats=(LUT_FORMAT,))
        (record,) = (each for each in build(model, plan, output, jobs=1).manifest.files if each.kind == "lut")
        certificate = record.certificate or {}
        worst = max(group["max"] for group in certificate.values() if isinstance(group, dict))
        smooth = certificate["smooth"]["max"]
        baked[condition.name] = BakedLut(output / record.path, record.sha256, worst, smooth)
    return baked


def blind_name(key: bytes, image: str, condition: str) -> str:
    """Return the name of a render: a keyed hash of its image and condition."""
    # A blind name has 20 letters.
    return hmac.new(key, f"{image}\0{condition}".encode(), hashlib.sha256).hexdigest()[:20]


def render_images(
    shown: Sequence[tuple[Picture, str]],
    luts: Mapping[str, BakedLut],
    study: Path,
    key: bytes,
    progress: Callable[[int], None],
) -> tuple[Render, ...]:
    """Write the render of each (image, condition) into a study's folder. Raises LutgenError: unreadable."""
    renders: dict[tuple[str, str], Render] = {}
    rendered = study / "rendered"
    for folder in (study / IMAGES, rendered):
        folder.mkdir()
    # In the order of blind names, which is random: another order would reveal the un-aged picture.
    by_name = sorted(shown, key=lambda each: blind_name(key, each[0].name, each[1]))
    with scratch() as beside:
        for picture, condition in by_name:
            source = picture.path
            if condition != UNAGED.name:
                source = beside / "aged.tif"
                apply_to_images([(picture.path, source)], luts[condition].path, source="signal", force=True)
            data = plain_png(shown_pixels(source))
            name = f"{blind_name(key, picture.name, condition)}.png"
            (rendered / name).write_bytes(data)
            sha256 = hashlib.sha256(data).hexdigest()
            renders[picture.name, condition] = Render(picture.name, condition, f"{IMAGES}/{name}", sha256)
            progress(len(renders))
    # Copied after all renders: aging takes time, and the file system's own times would reveal the aged pictures.
    for path in sorted(rendered.iterdir()):
        copy = study / IMAGES / path.name
        shutil.copyfile(path, copy)
        os.utime(copy, (_WRITTEN, _WRITTEN))
        path.unlink()
    rendered.rmdir()
    return tuple(renders[picture.name, condition] for picture, condition in shown)
