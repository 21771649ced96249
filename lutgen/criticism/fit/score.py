"""What the first step of a fit promises: gains of χ² from one linearisation that all candidates share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.code_shifts import CodeShifts
from lutgen.criticism.fit.linear import BEHIND_PANEL, STEP, State, Term, whiten
from lutgen.criticism.fit.system import local_basis, prior_rows, readings_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.effects import Effect


#: Directions in which parameters do the same, to this share of variance, promise nothing of their own.
TOLD = 1e-12


class Score:
    """Gains in χ² that a first step promises, from one linearisation that all candidates share."""

    def __init__(self, base: Fit) -> None:
        """Linearise about a fit."""
        self.base, self.problem, self.state = base, base.problem, State(base.terms, base.tips, base.gains)
        self.before = self.problem.panel(base.terms)
        self.predicted = self.problem.predict(base.terms, self.before, base.tips)
        self.parts = [_Part.of(base, self.state, here) for here in self.problem.blocks]
        self.rows = sum(len(part.basis) for part in self.parts)
        free = self._outside(base.linear.free)
        self.free = np.linalg.qr(free.T)[0] if len(free) else None
        self.residual = self._without_free(self._outside(base.linear.residual, priors=True))
        self._proposed: dict[str, tuple[list[dict[str, float]], int]] = {}
        self._of_effect = ""
        self._seen: dict[tuple[object, ...], tuple[Array, Array]] = {}
        #: Starts of forms that a search has found already, and what they promise.
        self.starts: dict[tuple[object, ...], tuple[float, Term]] = {}

    def _outside(self, columns: Array, *, priors: bool = False) -> Array:
        """What blocks cannot absorb of columns (..., n, 3); of residuals also where blocks are off their ``priors``."""
        sizes, shared = np.zeros((*columns.shape[:-2], 0)), self.problem.first_errors
        if shared:
            columns, sizes = shared.taken_from(columns)
        rows, start = np.empty((*columns.shape[:-2], self.rows + sizes.shape[-1])), 0
        for part in self.parts:
            end = start + len(part.basis)
            place = rows[..., start:end]
            readings = end - part.off.size - start
            place[..., :readings] = columns[..., part.here, :].reshape(*columns.shape[:-2], readings)
            place[..., readings:] = part.off if priors else 0.0
            place -= (place @ part.basis) @ part.basis.T
            start = end
        rows[..., start:] = -sizes
        return rows

    def _without_free(self, rows: Array) -> Array:
        return rows if self.free is None else np.asarray(rows - (rows @ self.free) @ self.free.T)

    def project(self, columns: Array) -> Array:
        """What the base fit's unknowns cannot absorb of whitened signatures (..., n, 3), with priors: (..., 3n + k)."""
        return self._without_free(self._outside(columns))

    def signature(self, term: Term, name: str) -> Array:
        """Whitened change of the readings per unit of a parameter, tips held: (n, 3)."""
        low, high = term.effect.parameters[name].bounds
        value = term.values[name]
        step = STEP * (high - low) * (1 if value + STEP * (high - low) <= high else -1)
        moved = replace(term, values={**term.values, name: value + step})
        return whiten(self.problem, self._change_by(moved) / step)

    def seen(self, term: Term, name: str) -> tuple[Array, Array]:
        """Return a parameter's signature, and what of it the base fit's unknowns cannot absorb, (3n,) each.

        Forms of one effect share their parameters: what one has asked for is kept until another effect is asked for.
        """
        return self._seen_all(term, (name,))[0]

    def _seen_all(self, term: Term, names: Sequence[str]) -> list[tuple[Array, Array]]:
        if term.effect.name != self._of_effect:
            self._of_effect, self._seen = term.effect.name, {}
        keys = [(name, *term.values.values()) for name in names]
        new = [at for at, key in enumerate(keys) if key not in self._seen]
        if new:
            signatures = np.array([self.signature(term, names[at]) for at in new])
            for at, signature, left in zip(new, signatures, self.project(signatures), strict=True):
                self._seen[keys[at]] = signature.ravel(), left
        return [self._seen[key] for key in keys]

    def gain(self, term: Term, names: Sequence[str]) -> float:
        """χ² that a step of some parameters from where the effect does nothing would gain, bounds ignored."""
        if not names:
            return self._plain_gain(term)
        columns = np.array([left for _, left in self._seen_all(term, names)]).T
        size = np.linalg.norm(columns, axis=0)
        columns = columns[:, size > 1e-9] / size[size > 1e-9]
        if not columns.shape[1]:
            return 0.0
        variances, directions = np.linalg.eigh(columns.T @ columns)
        told = variances > TOLD * variances[-1]
        return float((((columns.T @ self.residual) @ directions[:, told]) ** 2 / variances[told]).sum())

    def gain_of_typical(self, term: Term) -> float:
        """χ² that the signature of an effect at given values, scaled at will, gains."""
        column = self.project(self.switched_on(term))
        size = float(np.linalg.norm(column))
        return float((column @ self.residual / size) ** 2) if size > 1e-9 else 0.0

    def _plain_gain(self, term: Term) -> float:
        """χ² that switching on an effect without amplitudes gains."""
        after = self.residual - self.project(self.switched_on(term))
        return float(self.residual @ self.residual - after @ after)

    def switched_on(self, term: Term) -> Array:
        """Whitened change of the readings by one more term, tips held: (n, 3)."""
        return whiten(self.problem, self._change_by(term))

    def _change_by(self, term: Term) -> Array:
        """Change of the readings by one more term, tips held: (n, 3), cd/m²."""
        terms = (*self.base.terms, term)
        before = self.before if term.effect.stage in BEHIND_PANEL else self.problem.panel(terms)
        return self.problem.predict(terms, before, self.base.tips) - self.predicted

    @cached_property
    def code_shifts(self) -> CodeShifts:
        """What the readings say of the shift of each code value."""
        return CodeShifts.of(self.problem, self.switched_on, self.project, self.residual)

    def proposed(self, effect: Effect) -> tuple[list[dict[str, float]], int]:
        """Settings that an effect proposes for jagged shifts of code values, best first, and how many it looked at."""
        if effect.name not in self._proposed:
            shifts = self.code_shifts
            settings, looked = (
                effect.propose(shifts.code, shifts.pull, shifts.information)
                if effect.propose and shifts.is_jagged
                else ([], 1)
            )
            self._proposed[effect.name] = settings, looked
        return self._proposed[effect.name]

    def switched(self, term: Term) -> tuple[float, float]:
        """Whitened norm of what an effect at given values changes, and of what cannot be absorbed of that."""
        changed = self.switched_on(term)
        return float(np.linalg.norm(changed)), float(np.linalg.norm(self.project(changed)))


@dataclass(frozen=True)
class _Part:
    """A block's readings ``here``, an orthonormal basis of what its local unknowns do, and the priors' right sides."""

    here: NDArray[np.intp] | slice
    basis: Array
    off: Array

    @classmethod
    def of(cls, base: Fit, state: State, here: NDArray[np.intp]) -> _Part:
        """Take a block of the problem at a fit."""
        problem, shared = base.problem, len(base.problem.shared[int(here[0])])
        off = prior_rows(problem, state, int(problem.hour_of[here[0]]), problem.gains_of[int(here[0])], shared)[1]
        return cls(readings_at(here), local_basis(problem, base.linear.local, state, here), off)
