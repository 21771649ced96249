"""A linear mixed model with crossed groupings, by restricted maximum likelihood, and how well its estimates are known.

y = X·β + Σ Z_i·u_i + ε, u_i and ε normal with the variances λ_i·σ² and σ². The deviance, profiled over β and σ², is
minimised over λ_i ≥ 0 (Bates, Mächler, Bolker & Walker, J. Stat. Softw. 67 (2015), doi:10.18637/jss.v067.i01); the
inverse of the covariance needs matrices no larger than the number of levels (Woodbury). A variance of 0 is an estimate
as any other.

An estimate with variance C, a known function of the variances θ, is taken for Student's t with 2·C²/(gᵀ·I⁻¹·g) degrees
of freedom: g the derivatives of C, I the expected information on θ. Of three readers who react to a condition in three
ways it makes 2, however many images they read. Sources: Satterthwaite, Biometrics Bull. 2, 110 (1946),
doi:10.2307/3002019; for mixed models Giesbrecht & Burns, Biometrics 41, 477 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.colorimetry import Array

#: Where a search begins: ratios of a grouping's variance to that of the noise.
STARTS = (1.0, 0.05)

#: A grouping whose variance is a smaller share of the noise's shows no differences.
NOTHING = 1e-6


@dataclass(frozen=True)
class MixedFit:
    """What was fitted."""

    #: Of the fixed effects, their standard errors and degrees of freedom, (k,) each.
    coefficients: Array
    errors: Array
    freedom: Array
    #: Of each grouping, and of what is ``rest``.
    variances: dict[str, float]
    #: What went wrong, in clauses.
    complaints: tuple[str, ...] = ()


def fit_crossed(values: Array, fixed: Array, groups: Mapping[str, Sequence[str]]) -> MixedFit:
    """Fit values (n,) = fixed (n, k)·β + a random effect a grouping + noise. Raises LinAlgError or ValueError."""
    from scipy.optimize import minimize

    members = [_membership(labels) for labels in groups.values()]
    deviance = _Deviance(values, fixed, members)
    ratios, complaints = np.zeros(0), []
    if members:
        bounds = [(0.0, None)] * len(members)
        found = [
            minimize(deviance, np.full(len(members), start), jac="3-point", bounds=bounds,
                     options={"ftol": 1e-14, "gtol": 1e-8, "maxiter": 1000})
            for start in STARTS
        ]  # fmt: skip
        best = min(found, key=lambda each: float(each.fun))
        if not np.isfinite(best.fun):
            raise ValueError("the likelihood is not finite")
        ratios = np.asarray(best.x)
        if abs(found[0].fun - found[1].fun) > 1e-3:
            complaints.append("the fit did not converge: do not rely on it")
    rest = deviance.rest(ratios)
    variances = [float(ratio) * rest for ratio in ratios]
    errors, freedom = errors_and_freedom(fixed, members, variances, rest)
    if not (np.isfinite(errors) & (errors > 0)).all():
        raise ValueError("standard errors cannot be computed")
    named = dict(zip(groups, variances, strict=True)) | {"rest": rest}
    return MixedFit(deviance.coefficients(ratios), errors, freedom, named, tuple(complaints))


def _membership(labels: Sequence[str]) -> Array:
    """Columns of 0 and 1, (n, levels)."""
    levels, place = np.unique(np.array(labels), return_inverse=True)
    return np.eye(len(levels))[place]


class _Deviance:
    """−2 log of the restricted likelihood, but for a constant, over the ratios λ_i."""

    def __init__(self, values: Array, fixed: Array, members: Sequence[Array]) -> None:
        self._free = len(values) - fixed.shape[1]
        self._fixed = fixed.shape[1]
        self._sizes = [member.shape[1] for member in members]
        both = np.column_stack([fixed, values])
        levels = np.column_stack([*members, np.zeros((len(values), 0))])
        self._both, self._levels, self._across = both.T @ both, levels.T @ levels, levels.T @ both

    def __call__(self, ratios: Array) -> float:
        inner, volume = self._whitened(ratios)
        root = np.linalg.cholesky(inner)
        # Of [X y]ᵀV⁻¹[X y] the factor's last entry is what the fixed effects leave of y.
        logs = np.log(np.diag(root))
        return float(volume + 2.0 * logs[:-1].sum() + self._free * 2.0 * logs[-1])

    def rest(self, ratios: Array) -> float:
        """σ²."""
        return float(np.linalg.cholesky(self._whitened(ratios)[0])[-1, -1] ** 2 / self._free)

    def coefficients(self, ratios: Array) -> Array:
        """β, (k,)."""
        inner, _ = self._whitened(ratios)
        return np.asarray(np.linalg.solve(inner[: self._fixed, : self._fixed], inner[: self._fixed, self._fixed]))

    def _whitened(self, ratios: Array) -> tuple[Array, float]:
        """[X y]ᵀV⁻¹[X y] and log|V|, V = I + Σ λ_i·Z_i·Z_iᵀ."""
        scale = np.sqrt(np.repeat(ratios, self._sizes))
        middle = np.eye(len(scale)) + scale[:, np.newaxis] * self._levels * scale
        root = np.linalg.cholesky(middle)
        across = np.linalg.solve(root, scale[:, np.newaxis] * self._across)
        return self._both - across.T @ across, 2.0 * float(np.log(np.diag(root)).sum())


def errors_and_freedom(
    fixed: Array, members: Sequence[Array], variances: Sequence[float], rest: float
) -> tuple[Array, Array]:
    """Return standard errors, (k,), and degrees of freedom, at least 1, of the fixed effects."""
    total = rest * np.eye(len(fixed))
    for member, variance in zip(members, variances, strict=True):
        total += variance * member @ member.T
    inverse = np.linalg.inv(total)
    weighted = inverse @ fixed
    covariance = np.linalg.inv(fixed.T @ weighted)
    # Noise is a grouping with one value a level.
    parts = [*members, np.eye(len(fixed))]
    left = inverse - weighted @ covariance @ weighted.T
    sides = [left @ part for part in parts]
    information = 0.5 * np.array([[((one.T @ side) ** 2).sum() for side in sides] for one in parts])
    slopes = np.array([((part.T @ weighted @ covariance) ** 2).sum(axis=0) for part in parts])
    spread = (slopes * np.linalg.solve(information, slopes)).sum(axis=0)
    own = np.diag(covariance)
    return np.sqrt(own), np.maximum(2.0 * own**2 / spread, 1.0)
