"""CIE conversions, the sRGB display and ΔE2000, vectorised in double precision.

Glossary of frames (variable names contain the frame; the last axis of an array is the triplet):

``code``     R'G'B' drive or code values, 0..1, non-linear (sRGB-encoded)
``linear``   linear light of the sRGB primaries, 0..1 inside the gamut
``xyz``      CIE 1931 XYZ relative to the un-aged display, whose white has Y = 1
``xyz_cd_m2``  CIE 1931 XYZ in cd/m², as a meter reports XYZ
``xyY``      CIE chromaticity x, y and luminance Y (relative or cd/m², like XYZ)
``xy``, ``uv``  CIE 1931 x, y and CIE 1976 u', v' chromaticity
``lab``      CIE 1976 L*a*b*, reference white D65 with Y = 1

Units: hours for time, cd/m² for luminance, ΔE2000 for colour difference.

Sources: IEC 61966-2-1:1999 (sRGB); CIE 15:2018 (Lab); CIE 142-2001 and Sharma, Wu & Dalal 2005,
doi:10.1002/col.20070 (CIEDE2000).
"""

from collections.abc import Callable
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

#: Chromaticities of the sRGB white and primaries (IEC 61966-2-1, table 1), in the order w, r, g, b.
SRGB_XY = np.array([[0.3127, 0.3290], [0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])

#: Number of pixels in one chunk. The temporaries of a chunk fit into the cache, and are smaller than the 128 kB from
#: which glibc requests memory from the kernel for each temporary.
CHUNK = 15_360


def in_chunks(function: Callable[..., Array], *signals: NDArray[Any]) -> Array:
    """Apply a function of independent rows to signals (n, ...) in chunks; the columns of the result are contiguous."""
    rows = len(signals[0])
    if rows <= CHUNK:
        return function(*signals)
    result = np.empty(0)
    for start in range(0, rows, CHUNK):
        part = slice(start, start + CHUNK)
        chunk = function(*(signal[part] for signal in signals))
        if not start:
            result = np.empty((rows, *chunk.shape[1:]), order="F")
        result[part] = chunk
    return result


def xyY_to_xyz(xyY: ArrayLike) -> Array:  # noqa: N802 - the CIE's own spelling
    """Convert xyY to XYZ, step 1 of the paper: X = xY/y, Z = (1−x−y)Y/y. Shape (..., 3) → (..., 3)."""
    x, y, luminance = np.moveaxis(np.asarray(xyY, dtype=np.float64), -1, 0)
    return np.stack([x * luminance / y, luminance, (1.0 - x - y) * luminance / y], axis=-1)


def xyz_to_xyY(xyz: ArrayLike) -> Array:  # noqa: N802 - the CIE's own spelling
    """Convert XYZ to xyY. Shape (..., 3) → (..., 3); black (X+Y+Z = 0) has no chromaticity: NaN."""
    xyz = np.asarray(xyz, dtype=np.float64)
    total = xyz.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.stack([xyz[..., 0] / total, xyz[..., 1] / total, xyz[..., 1]], axis=-1)


def xy_to_uv(xy: ArrayLike) -> Array:
    """Convert CIE 1931 x, y to CIE 1976 u', v' (CIE 15:2018, 8.1). Shape (..., 2) → (..., 2)."""
    x, y = np.moveaxis(np.asarray(xy, dtype=np.float64), -1, 0)
    return np.asarray(np.stack([4 * x, 9 * y], axis=-1) / (-2 * x + 12 * y + 3)[..., np.newaxis])


def xyz_to_uv(xyz: ArrayLike) -> Array:
    """Convert CIE XYZ to CIE 1976 u', v'. Shape (..., 3) → (..., 2); black has no chromaticity: NaN."""
    return xy_to_uv(xyz_to_xyY(xyz)[..., :2])


def transform(matrix: Array, signal: ArrayLike) -> Array:
    """Multiply every k-vector of ``signal`` by ``matrix``: shapes (m, k) and (..., k) → (..., m).

    The sum runs column by column in a fixed order. BLAS is not used, because the last bits of its results depend on
    processor and threads, and the same inputs must give the same files. Chunks avoid that a column is fetched from
    memory twice. The columns of the result are contiguous.
    """
    signal = np.asarray(signal, dtype=np.float64)
    columns = signal.T if signal.ndim == 2 else np.moveaxis(signal, -1, 0)
    flat = columns.reshape(len(columns), -1)
    result = np.empty((len(matrix), flat.shape[1]))
    for start in range(0, flat.shape[1], CHUNK):
        here = flat[:, start : start + CHUNK]
        product = np.empty(here.shape[1])
        for out, factors in zip(result[:, start : start + CHUNK], matrix, strict=True):
            np.multiply(here[0], factors[0], out=out)
            for column, factor in zip(here[1:], factors[1:], strict=True):
                np.add(out, np.multiply(column, factor, out=product), out=out)
    return result.T if signal.ndim == 2 else np.moveaxis(result.reshape(len(matrix), *columns.shape[1:]), 0, -1)


def inverse(matrix: Array) -> Array:
    """Return the inverse of a 3 × 3 matrix, by its cofactors.

    LAPACK is not used, because the last bit of its results depends on processor, build and memory, and the same inputs
    must give the same files.
    """
    a, b, c = matrix
    cofactors = np.array([cross(b, c), cross(c, a), cross(a, b)]).T
    return np.asarray(cofactors / (a[0] * cofactors[0, 0] + a[1] * cofactors[1, 0] + a[2] * cofactors[2, 0]))


def cross(a: Array, b: Array) -> list[Any]:
    """Return the three numbers of the cross product of two vectors, (3, ...) each."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rgb_to_xyz_matrix(xy: ArrayLike) -> Array:
    """Return the 3 × 3 matrix from linear RGB to XYZ of an additive display whose white has Y = 1.

    ``xy`` holds the chromaticities of w, r, g, b, shape (4, 2). Columns of the result are the primaries' XYZ.
    """
    xy = np.asarray(xy, dtype=np.float64)
    white, *primaries = xyY_to_xyz(np.column_stack([xy, np.ones(4)]))
    columns = np.column_stack(primaries)
    return columns * transform(inverse(columns), white)


#: Linear sRGB → XYZ, and its inverse. The matrix is computed from the chromaticities, so that the inverse is exact; it
#: agrees with the four decimals that IEC 61966-2-1 prints.
LINEAR_TO_XYZ = rgb_to_xyz_matrix(SRGB_XY)
XYZ_TO_LINEAR = inverse(LINEAR_TO_XYZ)
#: XYZ of the sRGB display's white.
D65 = LINEAR_TO_XYZ.sum(axis=1)


#: End of the straight segment of sRGB's curve, in code values and in linear light. With the constants of IEC 61966-2-1
#: the two segments differ by 2e-9 of linear light at this point; the middle of the gap makes the curves exact inverses.
CODE_BREAK = 0.04045
LINEAR_BREAK = (CODE_BREAK / 12.92 + ((CODE_BREAK + 0.055) / 1.055) ** 2.4) / 2


def code_to_linear(code: ArrayLike) -> Array:
    """Convert sRGB code values to linear light (IEC 61966-2-1, equation of step 4 of the paper). Any shape.

    Negative values extrapolate the straight segment, values above 1 the power, as in OpenColorIO.
    """
    code = np.asarray(code, dtype=np.float64)
    # In place, because allocating temporaries would take longer than the power itself.
    linear: Array = np.maximum(code, CODE_BREAK, out=np.empty_like(code))
    linear += 0.055
    linear /= 1.055
    np.power(linear, 2.4, out=linear)
    np.divide(code, 12.92, out=linear, where=code <= CODE_BREAK)
    return linear


def linear_to_code(linear: ArrayLike) -> Array:
    """Convert linear light to sRGB code values: the inverse of :func:`code_to_linear`. Any shape."""
    linear = np.asarray(linear, dtype=np.float64)
    code: Array = np.maximum(linear, LINEAR_BREAK, out=np.empty_like(linear))
    # `power` takes twice as long as logarithm and exponential; both are accurate to 5e-16.
    np.log(code, out=code)
    code *= 1.0 / 2.4
    np.exp(code, out=code)
    code *= 1.055
    code -= 0.055
    np.multiply(linear, 12.92, out=code, where=linear <= LINEAR_BREAK)
    return code


def linear_to_xyz(linear: ArrayLike) -> Array:
    """Convert linear sRGB to XYZ. Shape (..., 3) → (..., 3)."""
    return transform(LINEAR_TO_XYZ, linear)


def xyz_to_linear(xyz: ArrayLike) -> Array:
    """Convert XYZ to linear sRGB, without clipping and without chromatic adaptation. Shape (..., 3) → (..., 3)."""
    return transform(XYZ_TO_LINEAR, xyz)


def linear_to_lab(linear: ArrayLike) -> Array:
    """Convert linear sRGB to CIE L*a*b* under D65 (CIE 15:2018, 8.2.1). Shape (..., 3) → (..., 3)."""
    return _ratio_to_lab(transform(LINEAR_TO_XYZ / D65[:, np.newaxis], linear))


def xyz_to_lab(xyz: ArrayLike, white: ArrayLike) -> Array:
    """Convert XYZ to CIE L*a*b*, with ``white`` in the same unit (CIE 15:2018, 8.2.1). (..., 3), (3,) → (..., 3)."""
    return _ratio_to_lab(np.asarray(xyz, dtype=np.float64) / np.asarray(white, dtype=np.float64))


def _ratio_to_lab(ratio: Array) -> Array:
    f = np.cbrt(ratio)
    # `copyto` keeps the columns contiguous; `where` would return contiguous rows.
    np.copyto(f, ratio * ((29 / 6) ** 2 / 3) + 4 / 29, where=~(ratio > (6 / 29) ** 3))
    x, y, z = f.T if f.ndim == 2 else np.moveaxis(f, -1, 0)
    # Contiguous columns, as in `transform`, because the callers compute column by column.
    lab = np.empty((3, *y.shape))
    np.subtract(116.0 * y, 16.0, out=lab[0, ...])
    np.multiply(500.0, x - y, out=lab[1, ...])
    np.multiply(200.0, y - z, out=lab[2, ...])
    return lab.T if f.ndim == 2 else np.moveaxis(lab, 0, -1)


def delta_e_2000(lab_1: ArrayLike, lab_2: ArrayLike) -> Array:
    """CIEDE2000 colour difference (Sharma et al. 2005, doi:10.1002/col.20070), k_L = k_C = k_H = 1.

    Shapes (..., 3) and (..., 3) → (...). For speed the function works in chunks, with one exponential for each pixel
    and square roots as the only other library functions. The unit vector of the mean hue gives the multiples of the
    mean hue, the cross product gives ΔH', and short series give the rotation's angle and sine.
    """
    lab_1, lab_2 = np.broadcast_arrays(np.asarray(lab_1, dtype=np.float64), np.asarray(lab_2, dtype=np.float64))
    shape = lab_1.shape[:-1]
    flat_1, flat_2 = lab_1.reshape(-1, 3), lab_2.reshape(-1, 3)
    return in_chunks(_delta_e_2000_chunk, flat_1, flat_2).reshape(shape)


def _delta_e_2000_chunk(lab_1: Array, lab_2: Array) -> Array:
    l_1, a_1, b_1 = np.ascontiguousarray(lab_1.T)
    l_2, a_2, b_2 = np.ascontiguousarray(lab_2.T)
    # Equations (2)-(5): chroma with the stretched a axis.
    c_mean = 0.5 * (np.sqrt(a_1 * a_1 + b_1 * b_1) + np.sqrt(a_2 * a_2 + b_2 * b_2))
    stretch = 1.5 - 0.5 * _chroma_weight(c_mean)
    a_1, a_2 = a_1 * stretch, a_2 * stretch
    c_1 = np.sqrt(a_1 * a_1 + b_1 * b_1)
    c_2 = np.sqrt(a_2 * a_2 + b_2 * b_2)
    # Equation (11): ΔH' = 2√(C1C2) sin(Δh/2) = cross/√((C1C2 + dot)/2), without the hue angles.
    product = c_1 * c_2
    half = 0.5 * (product + a_1 * a_2 + b_1 * b_2)
    # For hues nearer to opposite, and for greys, the cancellation in `half` would cause errors above 1e-12.
    opposite = np.flatnonzero(half <= 1e-3 * product)
    root = np.sqrt(np.maximum(half, _TINY))
    d_hue = (a_1 * b_2 - a_2 * b_1) / root
    # Equation (14): the unit vector of the mean hue, which is the bisector of both hues.
    root *= np.sqrt(np.maximum(product, _TINY))
    np.divide(0.5, root, out=root)
    weight_1, weight_2 = c_2 * root, c_1 * root
    cos_h, sin_h = a_1 * weight_1 + a_2 * weight_2, b_1 * weight_1 + b_2 * weight_2
    if opposite.size:
        d_hue[opposite], cos_h[opposite], sin_h[opposite] = _opposite_hues(
            *(each[opposite] for each in (a_1, b_1, a_2, b_2, product))
        )
    d_l, d_c = l_2 - l_1, c_2 - c_1
    l_mean, c_mean = 0.5 * (l_1 + l_2), 0.5 * (c_1 + c_2)
    # Equations (15)-(22); T is a polynomial in the cosine of the mean hue, plus its sine times another polynomial.
    t = _series(_T_EVEN, cos_h) + sin_h * _series(_T_ODD, cos_h)
    squared = (l_mean - 50.0) ** 2
    s_l = 1.0 + 0.015 * squared / np.sqrt(20.0 + squared)
    s_c = 1.0 + 0.045 * c_mean
    s_h = 1.0 + 0.015 * c_mean * t
    r_t = -2.0 * _chroma_weight(c_mean) * _rotation(cos_h, sin_h)
    d_l, d_c, d_h = d_l / s_l, d_c / s_c, d_hue / s_h
    squared = d_l * d_l + d_c * d_c + d_h * d_h + r_t * d_c * d_h
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


#: Avoids a division by zero where the quotient is replaced later or multiplied by 0.
_TINY = 1e-200


def _hue_polynomials() -> tuple[list[float], list[float]]:
    """Return equation (15) as coefficients of powers of cos h: the terms without sin h, and the terms times sin h."""
    # T = 1 − 0.17 cos(h − 30°) + 0.24 cos 2h + 0.32 cos(3h + 6°) − 0.20 cos(4h − 63°).
    weights, turns = np.array([0.17, 0.32, 0.20]), np.radians([30.0, 6.0, 63.0])
    cos_1, cos_3, cos_4 = weights * np.cos(turns)
    sin_1, sin_3, sin_4 = weights * np.sin(turns)
    even = [1.0 - 0.24 - cos_4, -cos_1 - 3.0 * cos_3, 0.48 + 8.0 * cos_4, 4.0 * cos_3, -8.0 * cos_4]
    odd = [-sin_1 + sin_3, 4.0 * sin_4, -4.0 * sin_3, -8.0 * sin_4]
    return even, odd


_T_EVEN, _T_ODD = _hue_polynomials()
_275 = np.radians(275.0)

#: Coefficients of arctan(t)/t in powers of t², and of sin(x)/x in powers of x². The rotation is accurate to 1e-13:
#: where the series of arctan is less accurate, far from 275°, the rotation is almost 0.
_ARCTAN = [(-1.0) ** k / (2 * k + 1) for k in range(10)]
_SINE = [(-1.0) ** k / factorial(2 * k + 1) for k in range(8)]


def _rotation(cos_h: Array, sin_h: Array) -> Array:
    """Return sin 2Δθ, equations (16) and (22): sin(60° exp(−((h − 275°)/25°)²)), h from 0° to below 360°."""
    along = np.cos(_275) * cos_h + np.sin(_275) * sin_h
    # The squared tangent of half the angle from 275°, then of a quarter of the angle, whose series is short.
    squared = (1.0 - along) / np.maximum(1.0 + along, _TINY)
    longer = 1.0 + np.sqrt(1.0 + squared)
    squared /= longer * longer
    arctan = _series(_ARCTAN, squared)
    near = np.exp(squared * arctan * arctan * -((4.0 / np.radians(25.0)) ** 2))
    # Hues wrap at 0°, so hues from 0° to 90° are far from 275°. CIEDE2000 itself jumps at 0°, by 1e-5 of the rotation.
    near *= (sin_h < 0.0) | (cos_h < 0.0)
    near *= np.radians(60.0)
    return np.asarray(near * _series(_SINE, near * near))


def _series(coefficients: list[float], x: Array) -> Array:
    """Return Σ coefficients[k]·x^k."""
    result = coefficients[-1] * x
    for coefficient in coefficients[-2:0:-1]:
        result += coefficient
        result *= x
    result += coefficients[0]
    return result


def _chroma_weight(chroma: Array) -> Array:
    """Return √(C⁷ / (C⁷ + 25⁷)), a part of equations (4) and (21)."""
    squared = chroma * chroma
    seventh = squared * squared * squared * chroma
    return np.asarray(np.sqrt(seventh / (seventh + 25.0**7)))


def _opposite_hues(a_1: Array, b_1: Array, a_2: Array, b_2: Array, product: Array) -> tuple[Array, Array, Array]:
    """Return ΔH' and cosine and sine of the mean hue from the angles, for (nearly) opposite hues and for greys."""
    h_1, h_2 = np.arctan2(b_1, a_1) % (2 * np.pi), np.arctan2(b_2, a_2) % (2 * np.pi)
    d_h = h_2 - h_1
    mean = 0.5 * (h_1 + h_2)
    wide = np.abs(d_h) > np.pi
    mean = np.where(wide, np.where(h_1 + h_2 < 2 * np.pi, mean + np.pi, mean - np.pi), mean)
    d_h = np.where(wide, d_h - np.sign(d_h) * 2 * np.pi, d_h)
    grey = product == 0.0
    only = h_1 * ((a_1 != 0.0) | (b_1 != 0.0)) + h_2 * ((a_2 != 0.0) | (b_2 != 0.0))
    mean = np.where(grey, only, mean)
    return np.where(grey, 0.0, 2.0 * np.sqrt(product) * np.sin(0.5 * d_h)), np.cos(mean), np.sin(mean)
