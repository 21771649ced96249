"""A smooth model of one real display at hour 0, and a spectral estimate of its primaries.

The model gives only the *change* of the light when the code value changes. The light itself is the measured reading.
Values between the measured patches are simulated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import colour
import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import nnls

from tests.generators.real.sessions import Array, session

WAVELENGTHS = np.arange(400.0, 701.0, 10.0)  # nm
_FULL, _NONE = 0.999, 0.001  # code values have five digits
_PAIRS = ((0, 1), (1, 2), (0, 2))


@dataclass(frozen=True)
class Display:
    """A real display at hour 0.

    Attributes
    ----------
    name
        Name of the session.
    drive, xyz_cd_m2
        Code values and light in cd/m² of the distinct measured patches, (n, 3); repeated readings are averaged.
    black, white, primaries
        XYZ in cd/m² of black (3,) and white (3,); light that each channel adds to black, one a column, (3, 3).
    calibration
        The session's calibration curves, (m, 4).
    ramps
        For each channel, the light that it adds to black as a function of its code value.
    mixing
        Coefficients of the mixing terms, (8, 3).

    """

    name: str
    drive: Array
    xyz_cd_m2: Array
    black: Array
    white: Array
    primaries: Array
    calibration: Array
    ramps: tuple[PchipInterpolator, ...]
    mixing: Array

    def light(self, drive: Array) -> Array:
        """Return the simulated light (n, 3) in cd/m² of code values (n, 3).

        The result is the sum of the measured ramps and of mixing terms, which are fitted to mixtures by least squares.
        The terms are products of code values and products of light: some real displays need the first, others the
        second (no source).
        """
        added = np.sum([ramp(drive[:, channel]) for channel, ramp in enumerate(self.ramps)], axis=0)
        return np.asarray(self.black + added + _mixing_terms(drive) @ self.mixing)

    def channels(self, drive: Array) -> Array:
        """Return each channel's light (n, 3) relative to its primary's luminance, from the measured ramps."""
        return np.column_stack(
            [ramp(drive[:, channel])[:, 1] / self.primaries[1, channel] for channel, ramp in enumerate(self.ramps)]
        )

    def patch(self, drive: tuple[float, float, float]) -> int:
        """Return the index of the measured patch that is nearest to a code value."""
        return int(np.argmin(np.sum((self.drive - np.array(drive)) ** 2, axis=1)))


@cache
def display(name: str) -> Display:
    """Return the real display of a session. Its light between the measured patches is simulated."""
    measured = session(name)
    drive, which = np.unique(np.round(measured.drive, 5), axis=0, return_inverse=True)
    count = np.bincount(which.ravel())
    xyz = np.column_stack([np.bincount(which.ravel(), measured.xyz_cd_m2[:, axis]) / count for axis in range(3)])
    black = xyz[(drive <= _NONE).all(axis=1)].mean(axis=0)
    ramps, primaries = [], np.zeros((3, 3))
    for channel in range(3):
        alone = (np.delete(drive, channel, axis=1) <= _NONE).all(axis=1) & (drive[:, channel] > _NONE)
        levels, light = drive[alone, channel], xyz[alone] - black
        primaries[:, channel] = light[np.argmax(levels)]
        ramps.append(PchipInterpolator(np.concatenate([[0.0], levels]), np.vstack([np.zeros(3), light])))
    bare = Display(
        name=name,
        drive=drive,
        xyz_cd_m2=xyz,
        black=black,
        white=xyz[(drive >= _FULL).all(axis=1)].mean(axis=0),
        primaries=primaries,
        calibration=measured.calibration,
        ramps=tuple(ramps),
        mixing=np.zeros((8, 3)),
    )
    missing = xyz - bare.light(drive)
    weight = 1.0 / (xyz + 0.02 * bare.white)  # relative errors, with a floor for dark patches
    terms = _mixing_terms(drive)
    mixing = np.column_stack(
        [
            np.linalg.lstsq(terms * weight[:, [axis]], missing[:, axis] * weight[:, axis], rcond=None)[0]
            for axis in range(3)
        ]
    )
    return Display(**{**bare.__dict__, "mixing": mixing})


def _mixing_terms(drive: Array) -> Array:
    light = drive**2.2
    products = [values[:, i] * values[:, j] for values in (drive, light) for i, j in _PAIRS]
    return np.column_stack([*products, drive.prod(axis=1), light.prod(axis=1)])


@cache
def observer() -> Array:
    """Return the CIE 1931 2° observer at WAVELENGTHS, (31, 3)."""
    table = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    return np.asarray(table[WAVELENGTHS], dtype=np.float64)


@cache
def spectra(name: str) -> Array:
    """Return smooth, non-negative spectra (31, 3) with the XYZ of a session's primaries. They are estimates.

    The method is non-negative least squares on the second differences and the tristimulus values.
    """
    curvature = np.diff(np.eye(len(WAVELENGTHS)), 2, axis=0)
    curves = []
    for channel in range(3):
        xyz = display(name).primaries[:, channel]
        strict = 1e3 / xyz.sum() * observer().T  # 1000 times the weight of smoothness: XYZ is measured
        system = np.vstack([strict, curvature / xyz.sum() * observer().sum()])
        curves.append(nnls(system, np.concatenate([1e3 * xyz / xyz.sum(), np.zeros(len(curvature))]))[0])
    return np.column_stack(curves)
