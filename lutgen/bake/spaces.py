"""Spaces of tables: the coordinate that indexes a table, and the meaning of its numbers.

``code``     indexed by code values; holds code values
``linear``   indexed by linear light; holds linear light
``shaped``   indexed by code values after a curve with more points near black (the shaper of .cube and .csp); holds code
             values
``lab``      indexed by code values; holds L*a*b* under D50 in the 16-bit encoding of an ICC profile's table
``lab-v2``   as ``lab``, in the encoding of ICC version 2
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import (
    D65,
    LINEAR_TO_XYZ,
    XYZ_TO_LINEAR,
    Array,
    code_to_linear,
    inverse,
    linear_to_code,
    transform,
    xyz_to_lab,
)

#: Strength of the shaper: its slope falls from 1.44 at black to 0.72 at white. For a display with a leaking black this
#: nearly halves the largest error. With a steeper shaper, light colours lose more than dark colours gain.
_STRETCH = 1.0

#: The profile connection space's white (ICC.1:2001-04, 6.1.3), and the Bradford matrix (same, annex E).
D50 = np.array([0.9642, 1.0, 0.8249])
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def _adaptation() -> Array:
    gain = transform(_BRADFORD, D50) / transform(_BRADFORD, D65)
    scaled = gain[:, np.newaxis] * _BRADFORD
    return transform(inverse(_BRADFORD), scaled.T).T


#: XYZ under D65 → XYZ under D50, as in every sRGB profile.
D65_TO_D50 = _adaptation()
_D50_TO_D65 = inverse(D65_TO_D50)

#: Meaning of a profile's numbers 0 to 65535: L* from 0 to 100, a* and b* from -128 to 127 (ICC.1:2010, 6.3.4.2).
_LAB_SPAN = np.array([100.0, 255.0, 255.0])
_LAB_START = np.array([0.0, -128.0, -128.0])

#: 65280 in version 2 has the meaning of 65535 in version 4: L* to 100.39, a* and b* to 127.996 (ICC.1:2010, 6.3.4.2).
_LAB_SPAN_V2 = _LAB_SPAN * 65_535 / 65_280


@dataclass(frozen=True)
class Space:
    """The conversions of a space: of its index, of its numbers to code values, and of linear light to its numbers."""

    #: Code value → place along the edge, 0..1, and its inverse. Any shape.
    index: Callable[[Array], Array]
    code: Callable[[Array], Array]
    #: Numbers of the table → code values, and linear light → numbers of the table. Shape (..., 3).
    shown: Callable[[Array], Array]
    held: Callable[[Array], Array]


def _same(values: Array) -> Array:
    return values


def shaped(code: Array) -> Array:
    """Apply the shaper: code values 0..1 → 0..1. Its slope is steeper near black and finite everywhere."""
    return np.asarray(np.log1p(_STRETCH * np.asarray(code)) / np.log1p(_STRETCH))


def unshaped(place: Array) -> Array:
    """Invert :func:`shaped`."""
    return np.asarray(np.expm1(np.asarray(place) * np.log1p(_STRETCH)) / _STRETCH)


def linear_to_xyz_d50(linear: Array) -> Array:
    """Convert linear light to XYZ under D50, relative to the un-aged white. Shape (..., 3) → (..., 3)."""
    return transform(D65_TO_D50, transform(LINEAR_TO_XYZ, linear))


def xyz_d50_to_linear(xyz: Array) -> Array:
    """Invert :func:`linear_to_xyz_d50`."""
    return transform(XYZ_TO_LINEAR, transform(_D50_TO_D65, xyz))


def linear_to_lab_held(linear: Array, version: int = 4) -> Array:
    """Convert linear light to a profile's encoding of L*a*b*, clipped to 0..1. Shape (..., 3) → (..., 3)."""
    lab = xyz_to_lab(linear_to_xyz_d50(linear), D50)
    return np.asarray(np.clip((lab - _LAB_START) / _lab_span(version), 0.0, 1.0))


def lab_held_to_xyz_d50(held: Array, version: int = 4) -> Array:
    """Convert a profile's encoding of L*a*b*, 0..1, to XYZ under D50 (CIE 15:2018, 8.2.1.2). (..., 3) → (..., 3)."""
    lightness, a, b = np.moveaxis(held * _lab_span(version) + _LAB_START, -1, 0)
    middle = (lightness + 16.0) / 116.0
    f = np.stack([middle + a / 500.0, middle, middle - b / 200.0], axis=-1)
    return np.asarray(np.where(f > 6 / 29, f**3, (f - 4 / 29) * (108 / 841)) * D50)


def _lab_span(version: int) -> Array:
    return _LAB_SPAN_V2 if version == 2 else _LAB_SPAN


def _lab_held_to_code(held: Array, version: int = 4) -> Array:
    return linear_to_code(xyz_d50_to_linear(lab_held_to_xyz_d50(held, version)))


SPACES = {
    "code": Space(_same, _same, _same, linear_to_code),
    "linear": Space(code_to_linear, linear_to_code, linear_to_code, _same),
    "shaped": Space(shaped, unshaped, _same, linear_to_code),
    "lab": Space(_same, _same, _lab_held_to_code, linear_to_lab_held),
    "lab-v2": Space(_same, _same, partial(_lab_held_to_code, version=2), partial(linear_to_lab_held, version=2)),
}


def lattice(size: int, space: str) -> Array:
    """Return the code values of a lattice uniform in ``space``: shape (size³, 3), red fastest."""
    axis = SPACES[space].code(np.linspace(0.0, 1.0, size))
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([red, green, blue], axis=-1).reshape(-1, 3)


def tetrahedra(code: Array, space: str, size: int) -> tuple[NDArray[np.intp], Array]:
    """Return the four lattice points that tetrahedral interpolation mixes for each code value, and their weights.

    Code values (n, 3) → flat indices of a lattice in ``space``, red fastest, (n, 4), and weights that sum to 1, (n, 4).
    The points lead from the cell's lower corner to its upper corner, first along the axis with the largest fraction.
    """
    place = SPACES[space].index(code) * (size - 1)
    corner = np.clip(np.floor(place), 0, size - 2).astype(np.intp)
    share = place - corner
    order = np.argsort(-share, axis=1)
    ordered = np.take_along_axis(share, order, axis=1)
    ends = np.ones((len(place), 1)), np.zeros((len(place), 1))
    weights = -np.diff(np.hstack([ends[0], ordered, ends[1]]), axis=1)
    stride = np.array([1, size, size * size])
    nodes = np.cumsum(np.column_stack([corner @ stride, stride[order]]), axis=1)
    return np.asfortranarray(nodes), np.asfortranarray(weights)
