"""Predicted gains in χ² of a first step of each candidate effect, from one linearisation for all candidates."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.code_shifts import CodeShifts
from lutgen.criticism.fit.linear import BEHIND_PANEL, Term, whiten

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import State
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.fit.projection import Projection
    from lutgen.effects import Effect


#: Relative cutoff of eigenvalues: directions of collinear parameters with less variance have no gain.
COLLINEAR = 1e-12


class Score:
    """Predicted gains in χ² of first steps, from one linearisation about a fit, the base fit."""

    def __init__(self, problem: Problem, state: State, projection: Projection) -> None:
        """Linearise about the ``state`` of the base fit."""
        self.problem, self.state, self.projection = problem, state, projection
        self.before = problem.panel(state.terms)
        self.predicted = problem.predict(state.terms, self.before, state.tips)
        self.free = self.projection.factors[0] if len(self.projection.free) else None
        self.residual = self._without_free(self.projection.residual)
        self._proposed: dict[str, tuple[list[dict[str, float]], int]] = {}
        self._last_effect = ""
        self._last_signatures: dict[tuple[object, ...], tuple[Array, Array]] = {}
        #: Cache of a search: predicted gain and starting values of forms.
        self.starts: dict[tuple[object, ...], tuple[float, Term]] = {}

    def _without_free(self, rows: Array) -> Array:
        """Part of rows that the global unknowns of the base fit cannot absorb."""
        return rows if self.free is None else np.asarray(rows - (rows @ self.free) @ self.free.T)

    def project(self, columns: Array) -> Array:
        """Part of signatures (..., n, 3) that the base fit's unknowns cannot absorb, with k priors: (..., 3n + k)."""
        return self._without_free(self.projection.of(columns))

    def signature(self, term: Term, name: str) -> Array:
        """Whitened change of the readings per unit of a parameter, tips fixed: (n, 3)."""
        moved, step = term.nudged(name)
        return whiten(self.problem, self._change_by(moved) / step)

    def seen(self, term: Term, name: str) -> tuple[Array, Array]:
        """Return a parameter's signature, (3n,), and its part that the base fit's unknowns cannot absorb, (3n + k,).

        Forms of one effect share their parameters, so the results of the last effect are cached.
        """
        return self._seen_all(term, (name,))[0]

    def _seen_all(self, term: Term, names: Sequence[str]) -> list[tuple[Array, Array]]:
        if term.effect.name != self._last_effect:
            self._last_effect, self._last_signatures = term.effect.name, {}
        keys = [(name, *term.values.values()) for name in names]
        missing = [place for place, key in enumerate(keys) if key not in self._last_signatures]
        if missing:
            signatures = np.array([self.signature(term, names[place]) for place in missing])
            for place, signature, unabsorbed in zip(missing, signatures, self.project(signatures), strict=True):
                self._last_signatures[keys[place]] = signature.ravel(), unabsorbed
        return [self._last_signatures[key] for key in keys]

    def gain(self, term: Term, names: Sequence[str]) -> float:
        """Gain in χ² of the best step of some parameters, from values of no effect, bounds ignored."""
        if not names:
            return self._plain_gain(term)
        columns = np.array([unabsorbed for _, unabsorbed in self._seen_all(term, names)]).T
        size = np.linalg.norm(columns, axis=0)
        columns = columns[:, size > 1e-9] / size[size > 1e-9]
        if not columns.shape[1]:
            return 0.0
        variances, directions = np.linalg.eigh(columns.T @ columns)
        determined = variances > COLLINEAR * variances[-1]
        return float((((columns.T @ self.residual) @ directions[:, determined]) ** 2 / variances[determined]).sum())

    def gain_of_typical(self, term: Term) -> float:
        """Gain in χ² of the signature of an effect at given values, with its best scale."""
        column = self.project(self.switched_on(term))
        size = float(np.linalg.norm(column))
        return float((column @ self.residual / size) ** 2) if size > 1e-9 else 0.0

    def _plain_gain(self, term: Term) -> float:
        """Gain in χ² of an effect without free parameters."""
        residual = self.residual - self.project(self.switched_on(term))
        return float(self.residual @ self.residual - residual @ residual)

    def switched_on(self, term: Term) -> Array:
        """Whitened change of the readings by one more term, tips fixed: (n, 3)."""
        return whiten(self.problem, self._change_by(term))

    def _change_by(self, term: Term) -> Array:
        """Change of the readings by one more term, tips fixed: (n, 3), cd/m²."""
        terms = (*self.state.terms, term)
        before = self.before if term.effect.stage in BEHIND_PANEL else self.problem.panel(terms)
        return self.problem.predict(terms, before, self.state.tips) - self.predicted

    @cached_property
    def code_shifts(self) -> CodeShifts:
        """Information of the readings on the shift of each code value."""
        return CodeShifts.of(self.problem, self.switched_on, self.project, self.residual)

    def proposed(self, effect: Effect) -> tuple[list[dict[str, float]], int]:
        """Settings that an effect proposes for jagged shifts of code values, best first, and how many it examined."""
        if effect.name not in self._proposed:
            shifts = self.code_shifts
            self._proposed[effect.name] = (
                effect.propose(shifts.code, shifts.pull, shifts.information)
                if effect.propose and shifts.is_jagged
                else ([], 1)
            )
        return self._proposed[effect.name]

    def switched(self, term: Term) -> tuple[float, float]:
        """Whitened norm of the change by an effect at given values, and of the part that cannot be absorbed."""
        changed = self.switched_on(term)
        return float(np.linalg.norm(changed)), float(np.linalg.norm(self.project(changed)))
