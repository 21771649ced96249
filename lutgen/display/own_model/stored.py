"""``StoredModel``: the chosen rungs as the bytes of an .npz, which model files and manifests keep."""

from __future__ import annotations

import hashlib
import io
import zipfile
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.display.own_model.curves import COLUMNS, Curves, SrgbCurves
from lutgen.display.own_model.drive import WAYS, Drive
from lutgen.display.own_model.residual import SmoothResidual
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.display.own_model.ladder import Model

#: Arrays of a stored model, with their shapes; −1: any number of rows. Black and colour points are always there.
SHAPES: dict[str, tuple[int, ...]] = {"black": (3,), "tips": (4, 3), "way": (), "calibration": (-1, 4)}
RUNGS: dict[str, tuple[int, ...]] = {"srgb": (4, 3), "coefficients": (-1, 3)}
RESIDUAL: dict[str, tuple[int, ...]] = {
    "centres": (-1, 3), "weights": (-1, 3), "noise": (-1,), "length": (), "size": (3,)
}  # fmt: skip

#: Readings of the largest session, and the most bytes of an array of them.
MOST_ROWS = 100_000
MAX_BYTES = 32_000_000


@dataclass(frozen=True)
class StoredModel:
    """An own model as the bytes of an .npz: equal to another exactly when their bytes are.

    Raises LutgenError: the bytes are no such model.
    """

    content: bytes

    def __post_init__(self) -> None:
        """Refuse what is no stored model."""
        if self._arrays["way"] not in range(len(WAYS)):
            raise LutgenError("the display's own model: `way` is none of 0 to 3. Make the model again.")

    @classmethod
    def of(cls, model: Model, tips: Array, black: Array) -> StoredModel:
        """Store the rungs of a model, and shares of white of colour points (4, 3) and black (3,) as measured."""
        arrays: dict[str, Any] = {"tips": tips, "black": black}
        below = model.below if isinstance(model, SmoothResidual) else model
        drive = model.drive if isinstance(model, SmoothResidual | Curves) else Drive()
        arrays |= {"srgb": below.tips} if isinstance(below, SrgbCurves) else {}
        arrays |= {"coefficients": below.coefficients} if isinstance(below, Curves) else {}
        arrays |= {"way": WAYS.index(drive.way)}
        arrays |= {"calibration": np.zeros((0, 4)) if drive.calibration is None else drive.calibration}
        if isinstance(model, SmoothResidual):
            arrays |= {name: getattr(model, name) for name in RESIDUAL}
        stream = io.BytesIO()
        doubles: dict[str, Any] = {name: np.asarray(each, dtype=np.float64) for name, each in arrays.items()}
        np.savez_compressed(stream, **doubles)
        return cls(stream.getvalue())

    @cached_property
    def sha256(self) -> str:
        """Hash of the bytes."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def tips(self) -> Array:
        """Shares of white of white, red, green and blue as measured, (4, 3)."""
        return self._arrays["tips"]

    @property
    def black(self) -> Array:
        """Share of white of black as measured, (3,)."""
        return self._arrays["black"]

    def __call__(self, code: Array) -> Array:
        """Code values (m, 3) → shares of white's X, Y and Z, (m, 3)."""
        return self.model(code)

    def near(self, code: Array) -> Array:
        """Return nearly the same shares, but faster for many calls."""
        return self.model.near(code) if isinstance(self.model, SmoothResidual) else self.model(code)

    @cached_property
    def model(self) -> Model:
        """The rungs."""
        arrays = self._arrays
        way = WAYS[int(arrays["way"])]
        drive = Drive(way, arrays["calibration"] if len(arrays["calibration"]) else None)
        below: Model = SrgbCurves(arrays["srgb"]) if "srgb" in arrays else Curves(drive, arrays["coefficients"])
        if "centres" not in arrays:
            return below
        centres, weights, noise, size = (arrays[name] for name in ("centres", "weights", "noise", "size"))
        return SmoothResidual(below, drive, centres, weights, noise, float(arrays["length"]), size)

    @cached_property
    def _arrays(self) -> Mapping[str, Array]:
        """The arrays by name; names, shapes and numbers are checked."""
        try:
            with np.load(io.BytesIO(self.content), allow_pickle=False) as file:
                if sum(each.file_size for each in file.zip.infolist()) > MAX_BYTES:
                    raise LutgenError(_WRONG.format("far too large"))
                arrays = {name: np.array(file[name], dtype=np.float64) for name in file.files}
        except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
            raise LutgenError(_WRONG.format("no .npz of lutgen's")) from error
        rung = next((name for name in RUNGS if name in arrays), "coefficients")
        wanted = {**SHAPES, rung: RUNGS[rung], **(RESIDUAL if "centres" in arrays else {})}
        if set(arrays) != set(wanted) or not all(_fits(arrays[name], shape) for name, shape in wanted.items()):
            raise LutgenError(_WRONG.format("not made of the arrays that lutgen writes"))
        rows = {len(arrays[name]) for name in ("centres", "weights", "noise") if name in arrays}
        if len(rows) > 1 or (rung == "coefficients" and len(arrays[rung]) not in {COLUMNS, COLUMNS + 3}):
            raise LutgenError(_WRONG.format("not made of arrays that fit each other"))
        return arrays


_WRONG = "the display's own model is {}. Make the model again: lutgen refine."


def _fits(array: Array, shape: tuple[int, ...]) -> bool:
    if array.ndim != len(shape) or not np.isfinite(array).all():
        return False
    return all(
        size == wanted or (wanted < 0 and size <= MOST_ROWS) for size, wanted in zip(array.shape, shape, strict=True)
    )
