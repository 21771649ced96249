"""ΔE2000 at nuclei between what a study shows of an image aged and un-aged.

Both are pictures on the same un-aged display, so that no display model is needed: nuclei are found in the un-aged
render by their stain (:mod:`lutgen.pictures.nuclei`), and the colours of the same pixels are compared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab
from lutgen.errors import LutgenError
from lutgen.pictures.field import code_of, read_field
from lutgen.pictures.nuclei import segment
from lutgen.study.analysis.agreement import UNAGED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from lutgen.study.protocol import Protocol


def nuclear_difference(unaged: Path, aged: Mapping[str, Path]) -> dict[str, float]:
    """Mean ΔE2000 over the pixels of nuclei, for each aged picture of an image.

    Parameters
    ----------
    unaged
        Picture in which nuclei are looked for.
    aged
        Condition → picture of the same size.

    Raises
    ------
    LutgenError
        A picture cannot be read, has no nuclei or another size; scikit-image is missing.

    """
    field = read_field(unaged)
    nuclei = segment(field).labels > 0
    before = linear_to_lab(code_to_linear(code_of(field.keys[nuclei])))
    made = {}
    for condition, path in aged.items():
        other = read_field(path)
        if other.shape != field.shape:
            raise LutgenError(f"{path}: has another size than {unaged}. Restore the study's images.")
        after = linear_to_lab(code_to_linear(code_of(other.keys[nuclei])))
        made[condition] = float(delta_e_2000(before, after).mean())
    return made


def measured_differences(
    study: Path, protocol: Protocol, progress: Callable[[int, int], None] = lambda _done, _total: None
) -> dict[tuple[str, str], float]:
    """Measure every image of a study under every aged condition that it is read under: (image, condition) → ΔE2000.

    Raises
    ------
    LutgenError
        As :func:`nuclear_difference`, or an image is never read un-aged.

    """
    files: dict[str, dict[str, Path]] = {}
    for render in protocol.renders:
        files.setdefault(render.image, {})[render.condition] = study / render.file
    found = {}
    images = [image.name for image in protocol.images]
    for done, image in enumerate(images):
        aged = {condition: path for condition, path in files.get(image, {}).items() if condition != UNAGED}
        if aged:
            if UNAGED not in files[image]:
                message = f"{image}: is not shown un-aged in this study, so that its ΔE at nuclei cannot be measured."
                raise LutgenError(f"{message} Give --difference for each aged condition.")
            for condition, value in nuclear_difference(files[image][UNAGED], aged).items():
                found[image, condition] = value
        progress(done + 1, len(images))
    return found
