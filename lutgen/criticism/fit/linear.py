"""The problem linearised about a state: Jacobian of the whitened prediction by effects, tips and gains."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lutgen.effects import Scene
from lutgen.effects.scene import LIFE_H
from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.display.trace import Panel
    from lutgen.effects import Effect, Parameter

#: Conditions of two readings under which every effect changes the prediction.
UNUSUAL: dict[str, Any] = {name: np.full((2, 1), column.shown) for name, column in COLUMNS.items()}

#: Step of a parameter for a numerical derivative, as a share of its range.
STEP = 1e-4

#: Stages whose effects do not change the light of the panel, the result of drive, transfer and mixing.
BEHIND_PANEL = frozenset({"emission", "optics", "viewing", "instrument"})

#: Step of a tip for a numerical derivative, as a share of its unit.
NUDGE = 1e-2


@dataclass(frozen=True)
class Term:
    """An effect in a fit: values of all parameters, names of free parameters, and of parameters searched on a grid."""

    effect: Effect
    values: Mapping[str, float]
    free: tuple[str, ...] = ()
    gridded: tuple[str, ...] = ()

    @classmethod
    def at_rest(cls, effect: Effect, form: tuple[str, ...], **values: float) -> Term:
        """Return the term with ``values``, else values of no effect; parameters of the form with a grid are fixed."""
        free = tuple(name for name in form if not effect.parameters[name].grid)
        gridded = tuple(name for name in form if effect.parameters[name].grid)
        return cls(effect, effect.rest() | values, free, gridded)

    def nudged(self, name: str) -> tuple[Term, float]:
        """Return the term after a small step of one parameter inside its bounds, and this step."""
        low, high = self.effect.parameters[name].bounds
        value, step = self.values[name], STEP * (high - low)
        step = step if value + step <= high else -step
        return replace(self, values={**self.values, name: value + step}), step

    def moved(self, values: Sequence[float]) -> Term:
        """Return the term with other values of its free parameters."""
        return replace(self, values={**self.values, **dict(zip(self.free, values, strict=True))})

    @property
    def bounds(self) -> Array:
        """Lower and upper bounds of the free parameters, (p, 2)."""
        return np.array([self.effect.parameters[name].bounds for name in self.free]).reshape(-1, 2)


def grid_values(parameter: Parameter, hours: Array) -> list[float]:
    """Return the values of a parameter's grid; of a date: the midpoints between neighbouring ``hours`` of sessions."""
    grid = (hours[1:] + hours[:-1]) / 2 if isinstance(parameter.grid, str) else parameter.grid
    return [float(value) for value in grid]


class State(NamedTuple):
    """Values of all unknowns: terms, tips (H, 4, 3) in cd/m², session gains (G,) as relative deviations."""

    terms: tuple[Term, ...]
    tips: Array
    gains: Array


class Linear(NamedTuple):
    """The problem linearised at a state, whitened.

    ``residual`` (n, 3); ``local`` (L, n, 3) derivatives by local unknowns; ``free`` (p, n, 3) by global unknowns.
    """

    residual: Array
    local: Array
    free: Array


def predict(problem: Problem, state: State) -> Array:
    """XYZ (n, 3) that a state predicts, cd/m²."""
    xyz = problem.predict(state.terms, problem.panel(state.terms), state.tips)
    return xyz * (1.0 + _gain_of(problem, state.gains))[:, np.newaxis]


def _gain_of(problem: Problem, gains: Array) -> Array:
    return np.where(problem.gains >= 0, gains[np.maximum(problem.gains, 0)], 0.0)


def whiten(problem: Problem, xyz: Array) -> Array:
    """Whiten residuals (..., n, 3). The whiteners are lower triangles; the product is written out for speed."""
    diagonal, y_by_x, z_by_x, z_by_y = problem.whitener_parts
    white = np.asarray(xyz * diagonal)
    white[..., 1] += y_by_x * xyz[..., 0]
    white[..., 2] += z_by_x * xyz[..., 0] + z_by_y * xyz[..., 1]
    return white


def linearise(problem: Problem, state: State) -> Linear:
    """Linearise the whitened residuals about a state."""
    before = problem.panel(state.terms)
    gain = 1.0 + _gain_of(problem, state.gains)[:, np.newaxis]
    xyz = problem.predict(state.terms, before, state.tips)
    free = _by_parameters(problem, state, before, xyz) * gain
    by_tips = _by_tips(problem, state, before, xyz) * gain
    # Tips of hour 0 are the same unknowns in every block: they are global.
    if problem.from_first_hour:
        free, by_tips = np.concatenate([free, by_tips]), by_tips[:0]
    # Curve modes of a native display are global too; a state holds no sizes of these modes.
    if problem.native and len(problem.curve_modes):
        free = np.concatenate([free, problem.curve_modes * gain])
    local = np.concatenate([by_tips, _by_gains(problem, xyz, state.gains.size)])
    return Linear(whiten(problem, problem.xyz - xyz * gain), whiten(problem, local), whiten(problem, free))


def _by_parameters(problem: Problem, state: State, before: Panel, xyz: Array) -> Array:
    """Numerical derivatives by the free parameters of effects, (p, n, 3)."""
    columns = []
    for index, term in enumerate(state.terms):
        for name in term.free:
            moved, step = term.nudged(name)
            terms = (*state.terms[:index], moved, *state.terms[index + 1 :])
            behind = before if term.effect.stage in BEHIND_PANEL else problem.panel(terms)
            columns.append((problem.predict(terms, behind, state.tips) - xyz) / step)
    return np.array(columns).reshape(-1, *xyz.shape)


def _by_tips(problem: Problem, state: State, before: Panel, xyz: Array) -> Array:
    """Derivatives by the twelve values of the tips of a reading's own hour, in units of ``tip_scale``: (12, n, 3)."""
    size = tip_scale(problem)
    if not problem.from_first_hour and not any(term.effect.stage in BEHIND_PANEL for term in state.terms):
        before = problem.first_session_model.relative_to_first_session(state.terms, before)
        shares = before.shares * (1.0 - problem.scene(state.tips).capped)
        direct = np.zeros((4, 3, *xyz.shape))
        for k in range(3):
            direct[:, k, :, k] = shares.T * size[:, k, np.newaxis]
        if before.black:
            direct[0, range(3), :, range(3)] += (before.of_white * (1.0 - problem.scene(state.tips).capped) * size[0]).T
        if before.gain is not None:
            direct *= before.gain
        return direct.reshape(12, *xyz.shape)
    if problem.holds_white or any(mixes(term) for term in state.terms):
        moved = state.tips + (np.eye(12).reshape(12, 4, 3) * size * NUDGE)[:, np.newaxis]
        return (problem.predict(state.terms, before, moved) - xyz) / NUDGE
    # No effect mixes X, Y and Z here: a step of all three together gives the derivatives of each.
    moved = state.tips + (np.eye(4)[:, :, np.newaxis] * size * NUDGE)[:, np.newaxis]
    together = (problem.predict(state.terms, before, moved) - xyz) / NUDGE
    apart = np.zeros((4, 3, *xyz.shape))
    for k in range(3):
        apart[:, k, :, k] = together[..., k]
    return apart.reshape(12, *xyz.shape)


def mixes(term: Term) -> bool:
    """Whether an effect behind the panel mixes X, Y and Z: tested on two colours."""
    stage = term.effect.stage
    if stage not in BEHIND_PANEL:
        return False
    light = np.array([[[0.9, 1.0, 1.1], [0.4, 0.2, 0.1], [0.3, 0.6, 0.1], [0.2, 0.1, 0.9]]] * 2)
    light = light if stage == "emission" else light[:, 0]
    scene = Scene(
        hours=np.full((2, 1), LIFE_H / 2),
        code=np.array([[0.7, 0.7, 0.7], [0.2, 0.2, 0.2]]),
        white=np.array([[0.9, 1.0, 1.1]]),
        fresh_white=np.array([[0.9, 1.0, 1.1]]),
        **UNUSUAL,
    )
    try:
        plain = term.effect.function(light, scene, **term.values)
        nudged = term.effect.function(light * np.array([1.01, 1.0, 1.0]), scene, **term.values)
    except LutgenError:
        # The effect acts on spectra, which this scene lacks: it mixes X, Y and Z.
        return True
    return bool(np.any(plain[..., 1:] != nudged[..., 1:]))


def tip_scale(problem: Problem) -> Array:
    """Unit of each tip unknown, (4, 3), cd/m²: a thousandth of the tip."""
    tips = problem.measured_tips[0]
    return np.asarray(1e-3 * np.maximum(np.abs(tips), 0.05 * tips[:, 1:2]))


def _by_gains(problem: Problem, xyz: Array, count: int) -> Array:
    """Derivatives by the session gains, (G, n, 3); (0, n, 3) if no reading has a gain."""
    if (problem.gains < 0).all():
        return np.zeros((0, *xyz.shape))
    of_gain = problem.gains[np.newaxis] == np.arange(count)[:, np.newaxis]
    return np.asarray(of_gain[..., np.newaxis] * xyz)
