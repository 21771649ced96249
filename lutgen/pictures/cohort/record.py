"""An image's lifetimes read back from JSON, to the last bit what was written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.pictures.curve import Curve
from lutgen.pictures.lifetime import ImageLifetime
from lutgen.pictures.tissue import Tissue

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.pictures.uncertainty import Intervals

#: Attributes of a curve, as JSON calls them.
_COLUMNS = {"hours": "hours", "mean": "mean", "sd": "sd", "p95": "p95", "p99": "p99", "largest": "max"}


def image_from_json(content: Mapping[str, Any], file: str, tolerances: Sequence[float]) -> ImageLifetime:
    """Return the image that ``lifetime --json`` wrote, under the name ``file``.

    Raises
    ------
    KeyError, TypeError, ValueError
        It is none.

    """
    tissue, modes = content["tissue"], content["modes"]
    return ImageLifetime(
        file=file,
        pixels=int(content["pixels"]),
        colours=int(content["colours"]),
        bits=int(content["bits"]),
        binning_error=float(content["binning_error"]),
        tissue=tissue and Tissue(tissue["threshold_L"], tissue["left_out_share"]),
        curves={mode: _curve(each["curve"]) for mode, each in modes.items()},
        intervals=_intervals(modes, tolerances),
    )


def _curve(points: Sequence[Mapping[str, float]]) -> Curve:
    return Curve(**{name: np.array([float(point[key]) for point in points]) for name, key in _COLUMNS.items()})


def _intervals(modes: Mapping[str, Any], tolerances: Sequence[float]) -> Intervals | None:
    found: Intervals = {}
    for mode, each in modes.items():
        found[mode] = {}
        for tolerance in tolerances:
            interval = each["lifetimes"][f"{tolerance:g}"]["interval"]
            if interval is None:
                return None
            found[mode][tolerance] = {name: (ends[0], ends[1]) for name, ends in interval.items()}
    return found
