"""Size of the errors of all readings, of the readings that belong together, and of one reading."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Errors:
    """Size of residuals: ΔE2000 (reference white: white of hour 0), and root mean square in σ of the noise."""

    delta_e_mean: float
    delta_e_p95: float
    delta_e_max: float
    rms_sigma: float


@dataclass(frozen=True)
class Slice:
    """Errors of readings that belong together.

    ``mean_residual_xyz`` is measured less predicted in cd/m²; the floors are the errors that noise alone gives.
    """

    by: str
    slice: str
    n: int
    delta_e_mean: float
    rms_sigma: float
    mean_residual_xyz: tuple[float, float, float]
    floor_delta_e_mean: float
    floor_rms_sigma: float


@dataclass(frozen=True)
class Reading:
    """One reading and its error."""

    line: int
    hour: float
    code: tuple[float, float, float]
    delta_e: float
    sigma: float
