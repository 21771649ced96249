"""CIE conversions, the sRGB display and ΔE2000, vectorised in double precision.

Glossary of frames (names in the code carry them; the last axis of an array is the triplet):

``code``     R'G'B' drive or code values, 0..1, non-linear (sRGB-encoded)
``linear``   linear light of the sRGB primaries, 0..1 inside the gamut
``xyz``      CIE 1931 XYZ relative to the un-aged display: its white has Y = 1
``xyz_cd_m2``  CIE 1931 XYZ in cd/m², as a meter reports it
``xyY``      CIE chromaticity x, y and luminance Y (relative or cd/m², as its XYZ)
``xy``, ``uv``  CIE 1931 x, y and CIE 1976 u', v' chromaticity
``lab``      CIE 1976 L*a*b*, reference white D65 with Y = 1

Units: hours for time, cd/m² for luminance, ΔE2000 for colour difference.

Sources: IEC 61966-2-1:1999 (sRGB); CIE 15:2018 (Lab); CIE 142-2001 and Sharma, Wu & Dalal 2005,
doi:10.1002/col.20070 (CIEDE2000).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

#: Chromaticities of the sRGB white and primaries (IEC 61966-2-1, table 1), in the order w, r, g, b.
SRGB_XY = np.array([[0.3127, 0.3290], [0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])

#: Pixels that one step of a chunked routine works on: its temporaries then stay in the cache.
CHUNK = 32_768


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
    """CIE 1931 x, y to CIE 1976 u', v' (CIE 15:2018, 8.1). Shape (..., 2) → (..., 2)."""
    x, y = np.moveaxis(np.asarray(xy, dtype=np.float64), -1, 0)
    return np.asarray(np.stack([4 * x, 9 * y], axis=-1) / (-2 * x + 12 * y + 3)[..., np.newaxis])


def transform(matrix: Array, signal: ArrayLike) -> Array:
    """Multiply every k-vector of ``signal`` by ``matrix``: shapes (m, k) and (..., k) → (..., m).

    Column by column in a fixed order rather than by BLAS, whose last bits depend on processor and threads: the
    same inputs are to give the same files. In chunks, so that each column is fetched from memory once. The result's
    columns are contiguous.
    """
    columns = np.moveaxis(np.asarray(signal, dtype=np.float64), -1, 0)
    flat = columns.reshape(len(columns), -1)
    result = np.empty((len(matrix), flat.shape[1]))
    for start in range(0, flat.shape[1], CHUNK // 4):
        part = slice(start, start + CHUNK // 4)
        np.multiply.outer(matrix[:, 0], flat[0, part], out=result[:, part])
        for column, factors in zip(flat[1:, part], matrix[:, 1:].T, strict=True):
            for out, factor in zip(result[:, part], factors, strict=True):
                np.add(out, column * factor, out=out)
    return np.moveaxis(result.reshape(len(matrix), *columns.shape[1:]), 0, -1)


def inverse(matrix: Array) -> Array:
    """Inverse of a 3 × 3 matrix by its cofactors.

    Not by LAPACK, whose last bit depends on processor, build and memory: the same inputs are to give the same files.
    """
    a, b, c = matrix
    cofactors = np.array([_cross(b, c), _cross(c, a), _cross(a, b)]).T
    return np.asarray(cofactors / (a[0] * cofactors[0, 0] + a[1] * cofactors[1, 0] + a[2] * cofactors[2, 0]))


def _cross(a: Array, b: Array) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rgb_to_xyz_matrix(xy: ArrayLike) -> Array:
    """Return the 3 × 3 matrix from linear RGB to XYZ of an additive display whose white has Y = 1.

    ``xy`` holds the chromaticities of w, r, g, b, shape (4, 2). Columns of the result are the primaries' XYZ.
    """
    xy = np.asarray(xy, dtype=np.float64)
    white, *primaries = xyY_to_xyz(np.column_stack([xy, np.ones(4)]))
    columns = np.column_stack(primaries)
    return columns * transform(inverse(columns), white)


#: Linear sRGB → XYZ, derived from the chromaticities so that T(0 h) is its exact inverse's partner;
#: it agrees with the four decimals that IEC 61966-2-1 prints.
LINEAR_TO_XYZ = rgb_to_xyz_matrix(SRGB_XY)
XYZ_TO_LINEAR = inverse(LINEAR_TO_XYZ)
#: XYZ of the sRGB display's white.
D65 = LINEAR_TO_XYZ.sum(axis=1)


#: Where sRGB's straight piece meets the power, in code values and in linear light. With the constants of IEC 61966-2-1
#: the two pieces miss each other by 2e-9 of linear light; the middle of that gap makes the curves exact inverses.
CODE_BREAK = 0.04045
LINEAR_BREAK = (CODE_BREAK / 12.92 + ((CODE_BREAK + 0.055) / 1.055) ** 2.4) / 2


def code_to_linear(code: ArrayLike) -> Array:
    """Code values of sRGB to linear light (IEC 61966-2-1, equation of step 4 of the paper). Any shape.

    Negative values continue the straight piece, values above 1 the power, as OpenColorIO does.
    """
    code = np.asarray(code, dtype=np.float64)
    # In place: memory for temporaries would cost more than the power itself.
    linear: Array = np.maximum(code, CODE_BREAK, out=np.empty_like(code))
    linear += 0.055
    linear /= 1.055
    np.power(linear, 2.4, out=linear)
    np.divide(code, 12.92, out=linear, where=code <= CODE_BREAK)
    return linear


def linear_to_code(linear: ArrayLike) -> Array:
    """Linear light to sRGB code values: the inverse of :func:`code_to_linear`. Any shape."""
    linear = np.asarray(linear, dtype=np.float64)
    code: Array = np.maximum(linear, LINEAR_BREAK, out=np.empty_like(linear))
    np.power(code, 1.0 / 2.4, out=code)
    code *= 1.055
    code -= 0.055
    np.multiply(linear, 12.92, out=code, where=linear <= LINEAR_BREAK)
    return code


def linear_to_xyz(linear: ArrayLike) -> Array:
    """Linear sRGB to XYZ. Shape (..., 3) → (..., 3)."""
    return transform(LINEAR_TO_XYZ, linear)


def xyz_to_linear(xyz: ArrayLike) -> Array:
    """XYZ to linear sRGB, unclipped, no adaptation. Shape (..., 3) → (..., 3)."""
    return transform(XYZ_TO_LINEAR, xyz)


def linear_to_lab(linear: ArrayLike) -> Array:
    """Linear sRGB to CIE L*a*b* under D65 (CIE 15:2018, 8.2.1). Shape (..., 3) → (..., 3)."""
    return _ratio_to_lab(transform(LINEAR_TO_XYZ / D65[:, np.newaxis], linear))


def xyz_to_lab(xyz: ArrayLike, white: ArrayLike) -> Array:
    """XYZ to CIE L*a*b* under a white of the same unit (CIE 15:2018, 8.2.1). Shapes (..., 3), (3,) → (..., 3)."""
    return _ratio_to_lab(np.asarray(xyz, dtype=np.float64) / np.asarray(white, dtype=np.float64))


def _ratio_to_lab(ratio: Array) -> Array:
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * ((29 / 6) ** 2 / 3) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def delta_e_2000(lab_1: ArrayLike, lab_2: ArrayLike) -> Array:
    """CIEDE2000 colour difference (Sharma et al. 2005, doi:10.1002/col.20070), k_L = k_C = k_H = 1.

    Shapes (..., 3) and (..., 3) → (...). Works in chunks with one arctangent, one exponential and one sine a
    pixel; multiples of the mean hue come from its unit vector, ΔH' from the cross product.
    """
    lab_1, lab_2 = np.broadcast_arrays(np.asarray(lab_1, dtype=np.float64), np.asarray(lab_2, dtype=np.float64))
    shape = lab_1.shape[:-1]
    flat_1, flat_2 = lab_1.reshape(-1, 3), lab_2.reshape(-1, 3)
    result = np.empty(flat_1.shape[0])
    for start in range(0, result.size, CHUNK):
        part = slice(start, start + CHUNK)
        result[part] = _delta_e_2000_chunk(flat_1[part], flat_2[part])
    return result.reshape(shape)


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
    # Nearer to opposite than this the cancellation in `half` would cost more than 1e-12.
    opposite = half <= 1e-4 * product
    d_hue = (a_1 * b_2 - a_2 * b_1) / np.sqrt(np.where(opposite, 1.0, half))
    cos_h, sin_h = _mean_hue(a_1, b_1, c_1, a_2, b_2, c_2)
    if opposite.any():
        d_hue[opposite], cos_h[opposite], sin_h[opposite] = _opposite_hues(
            a_1[opposite], b_1[opposite], a_2[opposite], b_2[opposite], product[opposite]
        )
    d_l, d_c = l_2 - l_1, c_2 - c_1
    l_mean, c_mean = 0.5 * (l_1 + l_2), 0.5 * (c_1 + c_2)
    # Equations (15)-(22).
    cos_2h, sin_2h = cos_h * cos_h - sin_h * sin_h, 2.0 * sin_h * cos_h
    cos_3h, sin_3h = cos_2h * cos_h - sin_2h * sin_h, sin_2h * cos_h + cos_2h * sin_h
    cos_4h, sin_4h = cos_2h * cos_2h - sin_2h * sin_2h, 2.0 * sin_2h * cos_2h
    t = (
        1.0
        - 0.17 * (_COS_30 * cos_h + _SIN_30 * sin_h)
        + 0.24 * cos_2h
        + 0.32 * (_COS_6 * cos_3h - _SIN_6 * sin_3h)
        - 0.20 * (_COS_63 * cos_4h + _SIN_63 * sin_4h)
    )
    squared = (l_mean - 50.0) ** 2
    s_l = 1.0 + 0.015 * squared / np.sqrt(20.0 + squared)
    s_c = 1.0 + 0.045 * c_mean
    s_h = 1.0 + 0.015 * c_mean * t
    degrees = np.degrees(np.arctan2(sin_h, cos_h))
    degrees += 360.0 * (degrees < 0.0)
    rotation = np.sin(np.radians(60.0) * np.exp(-(((degrees - 275.0) / 25.0) ** 2)))
    r_t = -2.0 * _chroma_weight(c_mean) * rotation
    d_l, d_c, d_h = d_l / s_l, d_c / s_c, d_hue / s_h
    squared = d_l * d_l + d_c * d_c + d_h * d_h + r_t * d_c * d_h
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


_COS_30, _SIN_30 = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
_COS_6, _SIN_6 = np.cos(np.radians(6.0)), np.sin(np.radians(6.0))
_COS_63, _SIN_63 = np.cos(np.radians(63.0)), np.sin(np.radians(63.0))


def _chroma_weight(chroma: Array) -> Array:
    """√(C⁷ / (C⁷ + 25⁷)), shared by equations (4) and (21)."""
    squared = chroma * chroma
    seventh = squared * squared * squared * chroma
    return np.asarray(np.sqrt(seventh / (seventh + 25.0**7)))


def _mean_hue(  # noqa: PLR0917 - two polar vectors
    a_1: Array, b_1: Array, c_1: Array, a_2: Array, b_2: Array, c_2: Array
) -> tuple[Array, Array]:
    """Cosine and sine of the mean hue: the bisector of both hue vectors; a grey lends no hue (equation 14)."""
    safe_1, safe_2 = np.where(c_1 == 0.0, 1.0, c_1), np.where(c_2 == 0.0, 1.0, c_2)
    along, across = a_1 / safe_1 + a_2 / safe_2, b_1 / safe_1 + b_2 / safe_2
    length = np.sqrt(along * along + across * across)
    grey = length == 0.0
    length = np.where(grey, 1.0, length)
    return np.where(grey, 1.0, along / length), across / length


def _opposite_hues(a_1: Array, b_1: Array, a_2: Array, b_2: Array, product: Array) -> tuple[Array, Array, Array]:
    """ΔH' and the mean hue by the angles themselves, where hues are (nearly) opposite or a colour is grey."""
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
