"""Proof of a merge: the user's parts give the same pixels as before, and aged views give the pixels of the build."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.config import AGED_VIEW, CONFIG, SOURCE
from lutgen.bindings import active_views, all_parts, first_space, ocio, ocio_errors
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, in_one_line

#: Maximum difference of a new view from the build's own, in code values 0..1: OpenColorIO approximates their powers.
TOLERANCE = 1e-3

#: Maximum difference due to the rounded numbers of a config that OpenColorIO writes; relative for values above 1.
ROUNDING = 1e-5

#: Number of colours of the comparison, and their seed.
COLOURS, SEED = 200, 11


class Proof(NamedTuple):
    """The number of compared parts, the names of the parts whose pixels have changed, and the largest difference."""

    compared: int
    changed: list[str]
    largest: float


def compare_parts(before: Any, after: Any) -> Proof:
    """Compare the pixels of each view, colour space and look of a config before and after the merge."""
    compared, changed, largest = 0, [], 0.0
    code = _code()
    for name, transform in all_parts(before):
        first, second = _pixels(before, transform, code), _pixels(after, transform, code)
        compared += 1
        if first is None or second is None:
            if first is not second:
                changed.append(name)
                largest = np.inf
        elif first.tobytes() != second.tobytes():
            changed.append(name)
            difference = np.abs(first.astype(np.float64) - second) / np.maximum(np.abs(first), 1.0)
            largest = max(largest, float(np.nan_to_num(difference, nan=np.inf).max()))
    return Proof(compared, changed, largest)


def missing_parts(planned: Any, merged: Any) -> list[str]:
    """Return the names of planned parts that the written config lacks. A comparison of pixels cannot find them."""
    present = set(_named_parts(merged))
    return [part for part in _named_parts(planned) if part not in present]


def _named_parts(config: Any) -> Iterator[str]:
    for display in config.getDisplaysAll():
        yield from (f"view {view} of {display}" for view in config.getViews(display))
    yield from (f"look {name}" for name in config.getLookNames())
    yield from (f"named transform {name}" for name in config.getNamedTransformNames())
    yield f"active views {', '.join(active_views(config))}"
    yield f"inactive colour spaces {config.getInactiveColorSpaces()}"


def _pixels(config: Any, transform: Any, code: Array) -> NDArray[np.float32] | None:
    """Return the pixels of a part, in float32; None when the part cannot be instantiated."""
    try:
        return _through(config, transform, code)
    except ocio_errors():
        return None


def aged_difference(built: Path, merged: Any, source: str, display: str, view: str) -> float:
    """Return a view's largest difference (code values) from the build's own. Raises LutgenError: too large, no view."""
    lib, start = ocio(), first_space(merged)
    own = lib.Config.CreateFromFile(str(built / CONFIG))
    try:
        code = _through(merged, lib.ColorSpaceTransform(src=start, dst=source), _code())
        expected = _through(own, lib.DisplayViewTransform(SOURCE, "sRGB", AGED_VIEW), code.astype(np.float64))
        shown = _through(merged, lib.DisplayViewTransform(start, display, view), _code())
    except ocio_errors() as error:
        why = f"cannot be shown: {in_one_line(error)}. Nothing was written."
        raise LutgenError(f"view {view} of {display} {why}") from None
    difference = float(np.abs(np.clip(shown, 0, 1) - np.clip(expected, 0, 1)).max())
    # `not <=` also finds NaN.
    if not difference <= TOLERANCE:
        raise LutgenError(
            f"view {view} of {display} would differ from the build's own by {difference:.3g} in code values, more than "
            f"{TOLERANCE:g}. Name another --source-space than {source}. Nothing was written."
        )
    return difference


def _through(config: Any, transform: Any, code: Array) -> NDArray[np.float32]:
    result = code.astype(np.float32)
    config.getProcessor(transform).getDefaultCPUProcessor().applyRGB(result)
    return np.asarray(result)


def _code() -> Array:
    return np.random.default_rng(SEED).random((COLOURS, 3))
