"""A literal and slow own model of a display: XYZ curves of each channel and a Gaussian process, held out by patch.

This is the reference for ``lutgen.display.own_model``. It shares no code and no basis with that module. A curve is
sRGB's light times a gain that is linear between knots; each channel has one curve for X, one for Y and one for Z. A
Gaussian process in code values, solved in full, describes the residual of the curves. Both are fitted again for every
fold. An inner cross-validation, which never uses the fold, chooses their constants.

``python -m tests.own_model_twin FILE...`` prints the mean ΔE2000 on mixtures of each session.
"""

from __future__ import annotations

import sys
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import code_to_linear, delta_e_2000, xyz_to_lab
from lutgen.readings import read_session

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

KNOTS = np.linspace(0.0, 1.0, 17)
FOLDS = 5
SEED = 20150319

#: Candidates of the inner cross-validation: stiffness of the gains, length and noise of the Gaussian process.
STIFFNESS = (0.01, 0.1, 1.0)
LENGTHS = (0.2, 0.3, 0.5)
NOISES = (0.1, 0.3, 1.0)


def folds_of(drive: Array) -> Array:
    """Return the fold of each reading; every reading of one code value is in the same fold."""
    patches = sorted({tuple(code) for code in drive.tolist()})
    order = np.random.default_rng(SEED).permutation(len(patches))
    fold = {patch: int(order[place]) % FOLDS for place, patch in enumerate(patches)}
    return np.array([fold[tuple(code)] for code in drive.tolist()])


def slope_of_lab(share: Array) -> Array:
    """Return the derivative of CIELAB's function by X, Y or Z, given as shares of white's."""
    return 116.0 / 3.0 * np.maximum(share, 0.00886) ** (-2.0 / 3.0)


def columns(drive: Array) -> Array:
    """Return the columns of the fit: black, and for each channel sRGB's light times each knot's hat function."""
    functions = [np.ones(len(drive))]
    for channel in range(3):
        code = drive[:, channel]
        for knot in range(KNOTS.size):
            hat = np.interp(code, KNOTS, np.eye(KNOTS.size)[knot])
            functions.append(code_to_linear(code) * hat)
    return np.array(functions).T


def curves(drive: Array, share: Array, stiffness: float) -> Array:
    """Return the coefficients of the columns for X, Y and Z, by least squares with a penalty on bending gains."""
    coefficients = []
    for k in range(3):
        slope = slope_of_lab(share[:, k])
        rows, wanted = list(columns(drive) * slope[:, np.newaxis]), list(share[:, k] * slope)
        for channel, knot in product(range(3), range(1, KNOTS.size - 1)):
            bend = np.zeros(1 + 3 * KNOTS.size)
            bend[1 + channel * KNOTS.size + knot - 1 : 1 + channel * KNOTS.size + knot + 2] = (1.0, -2.0, 1.0)
            rows.append(100.0 * np.sqrt(stiffness) * bend)
            wanted.append(0.0)
        coefficients.append(np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0])
    return np.array(coefficients).T


def likeness(one: Array, other: Array, length: float) -> Array:
    """Covariance of the Gaussian process between code values, (n, 3) and (m, 3) → (n, m)."""
    return np.array([np.exp(-((other - code) ** 2).sum(axis=1) / (2.0 * length**2)) for code in one])


def predicted(drive: Array, share: Array, asked: Array, constants: tuple[float, float, float]) -> Array:
    """Predict the shares of white's X, Y and Z at the code values ``asked``, from readings at ``drive``."""
    stiffness, length, noise = constants
    coefficients = curves(drive, share, stiffness)
    residual = (share - columns(drive) @ coefficients) * slope_of_lab(share)
    own = likeness(drive, drive, length) + noise * np.eye(len(drive))
    smooth = likeness(asked, drive, length) @ np.linalg.solve(own, residual)
    start = columns(asked) @ coefficients
    return np.asarray(start + smooth / slope_of_lab(start))


def delta_e(share: Array, other: Array, white: Array) -> Array:
    return np.asarray(delta_e_2000(xyz_to_lab(share * white, white), xyz_to_lab(other * white, white)))


def best_constants(drive: Array, share: Array, white: Array) -> tuple[float, float, float]:
    """Choose stiffness, length and noise, one after the other, by an inner cross-validation."""
    fold = folds_of(drive)

    def error(constants: tuple[float, float, float]) -> float:
        prediction = np.empty_like(share)
        for each in range(FOLDS):
            out = fold == each
            prediction[out] = predicted(drive[~out], share[~out], drive[out], constants)
        return float(delta_e(prediction, share, white).mean())

    stiffness = min(STIFFNESS, key=lambda each: error((each, 0.3, 0.3)))
    length = min(LENGTHS, key=lambda each: error((stiffness, each, 0.3)))
    noise = min(NOISES, key=lambda each: error((stiffness, length, each)))
    return stiffness, length, noise


def held_out(session: Session) -> Array:
    """Return ΔE2000 of each reading, predicted by a model without readings of the same code value."""
    kinds = np.array(session.kinds)
    white = session.xyz[kinds == "white"].mean(axis=0)
    drive, share = session.drive, session.xyz / white
    fold, prediction = folds_of(drive), np.empty_like(share)
    for each in range(FOLDS):
        out = fold == each
        constants = best_constants(drive[~out], share[~out], white)
        prediction[out] = predicted(drive[~out], share[~out], drive[out], constants)
    return delta_e(prediction, share, white)


def on_mixtures(session: Session) -> float:
    """Return the mean ΔE2000 on mixtures, held out by patch."""
    return float(held_out(session)[np.array(session.kinds) == "mixture"].mean())


if __name__ == "__main__":
    for file in sys.argv[1:]:
        print(f"{on_mixtures(read_session(file)):.3f}  {file}", flush=True)
