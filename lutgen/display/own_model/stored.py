"""``StoredModel``: the taken rungs as the bytes of an .npz file, for model files and manifests."""

import hashlib
import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.display.own_model.curves import COLUMNS, Curves, SrgbCurves
from lutgen.display.own_model.drive import WAYS, Drive
from lutgen.display.own_model.ladder import Model
from lutgen.display.own_model.residual import SmoothResidual
from lutgen.errors import LutgenError

#: Arrays of a stored model, with their shapes; −1: any number of rows. The first group is always present.
SHAPES: dict[str, tuple[int, ...]] = {"black": (3,), "tips": (4, 3), "way": (), "calibration": (-1, 4)}
RUNGS: dict[str, tuple[int, ...]] = {"srgb": (4, 3), "coefficients": (-1, 3)}
RESIDUAL: dict[str, tuple[int, ...]] = {
    "centres": (-1, 3), "weights": (-1, 3), "noise": (-1,), "length": (), "size": (3,)
}  # fmt: skip

#: Largest number of rows of an array (readings of the largest session), and largest total size of the arrays in bytes.
MOST_ROWS = 100_000
MAX_BYTES = 32_000_000


@dataclass(frozen=True)
class StoredModel:
    """An own model as the bytes of an .npz file. Two stored models are equal exactly when their bytes are equal.

    Raises LutgenError: the bytes are no stored model.
    """

    content: bytes

    def __post_init__(self) -> None:
        if self._arrays["way"] not in range(len(WAYS)):
            raise LutgenError("the display's own model: `way` is none of 0 to 3. Make the model again.")

    @classmethod
    def of(cls, model: Model, tips: Array, black: Array) -> "StoredModel":
        """Return the rungs of a model, with the measured shares of white of colour points (4, 3) and black (3,)."""
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
        """Measured shares of white's X, Y and Z for white, red, green and blue, (4, 3)."""
        return self._arrays["tips"]

    @property
    def black(self) -> Array:
        """Measured shares of white's X, Y and Z for black, (3,)."""
        return self._arrays["black"]

    def __call__(self, code: Array) -> Array:
        """Return shares of white's X, Y and Z, (m, 3), for code values (m, 3)."""
        return self.model(code)

    def near(self, code: Array) -> Array:
        """Return nearly the same shares; faster for many calls."""
        return self.model.near(code) if isinstance(self.model, SmoothResidual) else self.model(code)

    @cached_property
    def model(self) -> Model:
        """The model of the stored rungs."""
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
        """The arrays by name, with checked names, shapes and numbers."""
        try:
            with np.load(io.BytesIO(self.content), allow_pickle=False) as file:
                if sum(each.file_size for each in file.zip.infolist()) > MAX_BYTES:
                    raise LutgenError(_WRONG.format("far too large"))
                arrays = {name: np.array(file[name], dtype=np.float64) for name in file.files}
        except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
            raise LutgenError(_WRONG.format("no .npz of lutgen's")) from error
        rung = next((name for name in RUNGS if name in arrays), "coefficients")
        expected = {**SHAPES, rung: RUNGS[rung], **(RESIDUAL if "centres" in arrays else {})}
        if set(arrays) != set(expected) or not all(_fits(arrays[name], shape) for name, shape in expected.items()):
            raise LutgenError(_WRONG.format("not made of the arrays that lutgen writes"))
        rows = {len(arrays[name]) for name in ("centres", "weights", "noise") if name in arrays}
        if len(rows) > 1 or (rung == "coefficients" and len(arrays[rung]) not in {COLUMNS, COLUMNS + 3}):
            raise LutgenError(_WRONG.format("not made of arrays that fit each other"))
        return arrays


_WRONG = "the display's own model is {}. Make the model again: lutgen refine."


def _fits(array: Array, shape: tuple[int, ...]) -> bool:
    if array.ndim != len(shape) or not np.isfinite(array).all():
        return False
    return all(size == rows or (rows < 0 and size <= MOST_ROWS) for size, rows in zip(array.shape, shape, strict=True))
