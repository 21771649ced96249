"""What readers are shown: every image under each of its conditions, through a baked LUT, under a blind name.

A render is a PNG of 8-bit pixels and nothing else, stored as they are: all renders of a picture have one size, and one
time. Pixels alone tell conditions apart; names are hashes under a key, from which neither image nor condition can be
read, and files are written in the order of their names.
"""

from __future__ import annotations

import hashlib
import hmac
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.bake.build import Plan, build
from lutgen.pictures.apply import apply_to_images
from lutgen.pictures.png import plain_png
from lutgen.scratch import scratch
from lutgen.study.design import UNAGED
from lutgen.study.pictures import shown_pixels
from lutgen.study.protocol import IMAGES, Condition, Render

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from lutgen.display import DisplayModel
    from lutgen.study.pictures import Picture

#: The LUTs that images go through: the most exact of the formats.
LUT_FORMAT = "clf"

#: Letters of a blind name.
BLIND = 20

#: When every picture says that it was written, in seconds since 1970: the first moment that a ZIP can name.
_WRITTEN = 315_532_800


@dataclass(frozen=True)
class BakedLut:
    """A condition's LUT.

    Attributes
    ----------
    path
        The file.
    sha256
        Of the file.
    worst, smooth
        The certificate's largest ΔE2000 to the model: over all colours, and over those that neither a jump of the model
        nor the gamut's edge is mixed into.

    """

    path: Path
    sha256: str
    worst: float
    smooth: float

    def as_json(self) -> dict[str, Any]:
        """Return what a protocol keeps of it."""
        return {
            "format": LUT_FORMAT,
            "sha256": self.sha256,
            "worst_delta_e_2000": self.worst,
            "worst_smooth_delta_e_2000": self.smooth,
        }


def bake_conditions(conditions: Iterable[Condition], model: DisplayModel, folder: Path) -> dict[str, BakedLut]:
    """Bake and certify the LUT of every condition but the un-aged one, by the condition's name.

    Raises
    ------
    LutgenError
        Hours outside the measured span, or a display that cannot be baked.

    """
    baked = {}
    for condition in conditions:
        if condition == UNAGED:
            continue
        output = folder / condition.name
        plan = Plan(hours=(condition.hours,), modes=(condition.mode,), formats=(LUT_FORMAT,))
        (record,) = (each for each in build(model, plan, output, jobs=1).manifest.files if each.kind == "lut")
        groups = [group for group in (record.certificate or {}).values() if isinstance(group, dict)]
        smooth = (record.certificate or {})["smooth"]["max"]
        baked[condition.name] = BakedLut(
            output / record.path, record.sha256, max(group["max"] for group in groups), smooth
        )
    return baked


def blind_name(key: bytes, image: str, condition: str) -> str:
    """Name a render: a keyed hash of what it shows."""
    return hmac.new(key, f"{image}\0{condition}".encode(), hashlib.sha256).hexdigest()[:BLIND]


def render_images(
    shown: Sequence[tuple[Picture, str]],
    luts: Mapping[str, BakedLut],
    study: Path,
    key: bytes,
    progress: Callable[[int], None],
) -> tuple[Render, ...]:
    """Write what is shown of each (image, condition) into a study's folder; ``progress`` is told how many are done.

    The un-aged picture is the image itself; of 16 bits a channel the nearest 8 are shown, after aging.

    Raises
    ------
    LutgenError
        An image that cannot be read or aged. What is written so far is the caller's to remove.

    """
    renders: dict[tuple[str, str], Render] = {}
    (study / IMAGES).mkdir()
    # In the order of blind names, which is random: the order of writing would tell the un-aged picture.
    by_name = sorted(shown, key=lambda each: blind_name(key, each[0].name, each[1]))
    with scratch() as beside:
        for picture, condition in by_name:
            source = picture.path
            if condition != UNAGED.name:
                source = beside / "aged.tif"
                apply_to_images([(picture.path, source)], luts[condition].path, source="signal", force=True)
            data = plain_png(shown_pixels(source))
            file = f"{IMAGES}/{blind_name(key, picture.name, condition)}.png"
            (study / file).write_bytes(data)
            os.utime(study / file, (_WRITTEN, _WRITTEN))
            sha256 = hashlib.sha256(data).hexdigest()
            renders[picture.name, condition] = Render(picture.name, condition, file, sha256)
            progress(len(renders))
    return tuple(renders[picture.name, condition] for picture, condition in shown)
