"""ICC profile of the aged display as a matrix and curves: correct in pure white, where the table of ``icc`` is wrong.

For integer pictures LittleCMS resamples a profile's table and then maps white to white ("scum dot"), except with the
absolute intent: code 255 stays white. For 8-bit pictures LittleCMS computes curves and a matrix exactly. For 16-bit
pictures it resamples them too. Chromium and Argyll compute them exactly at any depth.

A matrix cannot follow a display whose white is not the sum of its primaries. This matrix shows the display's white
exactly and has the least error elsewhere. Its certificate states the error. Black becomes pure black: leaking light is
lost.
"""

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, Sampler, as_matrix
from lutgen.bake.spaces import lattice, linear_to_xyz_d50, xyz_d50_to_linear
from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, linear_to_lab, transform
from lutgen.display import AgedDisplay

#: Points along an edge of the lattice, in code values, for the fit of the matrix. With 9 no figure changes by 0.01.
FITTED_POINTS = 7

#: The fit ends when a step lowers the sum of squares by less than this share.
ENOUGH = 1e-4

#: Resolution of s15Fixed16 numbers.
_STEP = 1 / 65_536


def candidates(sampler: Sampler, aged: AgedDisplay, _size: int) -> list[Lut | MatrixLut]:
    """Return the display's own matrix if it has one, else the nearest matrix with its white, quantised as in a file."""
    own = as_matrix(aged)
    return [MatrixLut(_in_steps(own.matrix if own else nearest_matrix(sampler, aged)))]


def nearest_matrix(sampler: Sampler, aged: AgedDisplay) -> Array:
    """Fit a matrix from linear light to aged linear light, (3, 3), with an exact white, by ΔE2000 within sRGB."""
    from scipy.optimize import least_squares

    red, green, _, white = aged.code_to_linear(np.vstack([np.eye(3), np.ones(3)]))
    source = code_to_linear(lattice(FITTED_POINTS, "code"))
    aim = linear_to_lab(np.clip(sampler.linear(aged, FITTED_POINTS, "code"), 0.0, 1.0))

    def matrix(values: Array) -> Array:
        columns = values.reshape(2, 3)
        return np.column_stack([*columns, white - columns.sum(axis=0)])

    def error(values: Array) -> Array:
        return delta_e_2000(aim, linear_to_lab(np.clip(transform(matrix(values), source), 0.0, 1.0)))

    return matrix(least_squares(error, np.concatenate([red, green]), ftol=ENOUGH).x)


def _colorants(matrix: Array) -> Array:
    return linear_to_xyz_d50(matrix.T)


def _in_steps(matrix: Array) -> Array:
    """Quantise a matrix so that a file can hold its colorants exactly."""
    colorants = np.rint(_colorants(matrix) / _STEP) * _STEP
    return xyz_d50_to_linear(colorants).T


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    if not isinstance(lut, MatrixLut):
        raise TypeError("this format holds a matrix, not a table")
    tags = icc.display_tags(provenance.title, provenance.lines, _colorants(lut.matrix))
    return icc.profile(device_class=b"mntr", pcs=b"XYZ ", tags=tags)


FORMAT = Format(
    name="icc-matrix",
    suffix=".icc",
    unclipped=True,
    write=_write,
    candidates=candidates,
    reader=Reader(through_profile, table_of_profile),
    stem="aged-matrix",
    corrects=False,
    follows=False,
)
