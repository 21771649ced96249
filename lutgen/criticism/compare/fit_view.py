"""Data for plots of one effect of a fit: the readings that it changes most, predicted with and without the effect."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.criticism.fit.anchored import anchored
from lutgen.criticism.fit.families import condition_of
from lutgen.numerals import spaced
from lutgen.readings.conditions import CONDITIONS, OF_COLUMN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem
    from lutgen.effects import Effect

#: Largest number of curves in one plot, and of bars in one plot.
CURVES, PATCHES = 3, 12

#: X or Z is drawn instead of Y if the effect changes it this many times more, in σ.
BETTER = 2.0

#: Differences are given in cd/m² below this share of white's light, and in percent above.
DARK = 0.05

#: Names of the codes in which every channel is 0 or 1.
NAMES = {
    (0.0, 0.0, 0.0): "black",
    (1.0, 1.0, 1.0): "white",
    (1.0, 0.0, 0.0): "red",
    (0.0, 1.0, 0.0): "green",
    (0.0, 0.0, 1.0): "blue",
    (0.0, 1.0, 1.0): "cyan",
    (1.0, 0.0, 1.0): "magenta",
    (1.0, 1.0, 0.0): "yellow",
}

#: A patch has a bar if the effect changes it by at least this share of the largest change.
WORTH_A_BAR = 0.04


class Bar(NamedTuple):
    """A patch: name, code value, and the measured and predicted differences from the model without the effect, in σ."""

    name: str
    code: Array
    measured: float
    with_it: float


class Way(NamedTuple):
    """The horizontal axis of an effect's first plot: label, values (n,), and the columns that give the values."""

    name: str
    values: Array
    columns: tuple[str, ...]


class Curve(NamedTuple):
    """Readings along this axis: places, measured difference, its 1 σ, predicted difference; (m,) each."""

    name: str
    places: Array
    measured: Array
    sigma: Array
    with_it: Array


@dataclass(frozen=True)
class View:
    """One effect of a fit: predictions without it and with it.

    Attributes
    ----------
    problem, effect
        The readings, and the effect.
    without, with_it
        XYZ predicted, (n, 3), cd/m².

    """

    problem: Problem
    effect: Effect
    without: Array
    with_it: Array

    @classmethod
    def of(cls, problem: Problem, terms: Sequence[Term], effect: Effect) -> View:
        """Remove one effect from a fit; the other effects keep their parameters."""
        rest = [term for term in terms if term.effect.name != effect.name]
        return cls(problem, effect, anchored(problem, rest), anchored(problem, terms))

    @cached_property
    def sigma(self) -> Array:
        """Noise of each reading, 1 σ, (n, 3), cd/m²."""
        covariance = self.problem.covariance(self.with_it)
        return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

    @cached_property
    def axis(self) -> int:
        """Index of the component of XYZ that shows the effect best; Y unless another component shows it much better."""
        strength = (((self.with_it - self.without) / self.sigma) ** 2).sum(axis=0)
        best = int(np.argmax(strength))
        return best if strength[best] > BETTER**2 * strength[1] else 1

    @cached_property
    def change(self) -> Array:
        """Change of this component by the effect, in σ, (n,)."""
        return np.asarray(((self.with_it - self.without) / self.sigma)[:, self.axis])

    @cached_property
    def residual(self) -> Array:
        """Measured minus predicted without the effect, in this component, in σ, (n,)."""
        return np.asarray(((self.problem.xyz - self.without) / self.sigma)[:, self.axis])

    @property
    def component(self) -> str:
        """X, Y or Z."""
        return "XYZ"[self.axis]

    @cached_property
    def way(self) -> Way:
        """Horizontal axis: the condition that the effect needs; otherwise code value or hours, by its stage."""
        problem, needs = self.problem, self.effect.needs
        scene = problem.scene(problem.measured_tips)
        for condition in CONDITIONS:
            names = tuple(column.name for column in condition.columns)
            if set(names) & set(needs):
                values = condition.along({name: getattr(scene, name) for name in names})
                # A session has only one or two temperatures; therefore a curve joins readings of all hours.
                return Way(
                    condition.axis or condition.columns[0].words,
                    np.broadcast_to(values[:, 0], problem.rows.size),
                    (*names, *(("hour",) if condition.scatters else ())),
                )
        if self.effect.stage in {"drive", "transfer", "mixing"} or (
            self.effect.stage == "emission" and not problem.from_first_hour
        ):
            return Way("code value", problem.drive.max(axis=1), ())
        return Way("operating hours", problem.hours[problem.hour_of], ("hour",))

    @cached_property
    def curves(self) -> list[Curve]:
        """Curves of the patches that show the effect best; the readings of a curve differ only along the axis."""
        groups = self._groups()
        strength = {key: float((self.change[here] ** 2).sum()) for key, here in groups.items()}
        order = sorted((key for key in groups if strength[key] > 0), key=lambda key: -strength[key])
        if not order:
            return []
        if "hour" in self.way.columns:
            return [self._curve(groups[key]) for key in self._distinct(order, groups)]
        # The same patches at the first, a middle and the last hour.
        best = self._patch_of(groups[order[0]])
        same = [groups[key] for key in order if self._patch_of(groups[key]) == best]
        same.sort(key=lambda here: float(self.problem.hour_of[here[0]]))
        chosen = sorted({0, len(same) // 2, len(same) - 1})
        return [self._curve(same[index]) for index in chosen]

    def _distinct(
        self, order: list[tuple[float, ...]], groups: dict[tuple[float, ...], NDArray[np.intp]]
    ) -> list[tuple[float, ...]]:
        """Return the strongest groups with different code values."""
        strongest: dict[tuple[float, ...], tuple[float, ...]] = {}
        for key in order:
            code = tuple(self.problem.drive[groups[key][0]])
            strongest.setdefault(code, key)
        return list(strongest.values())[:CURVES]

    def _patch_of(self, here: NDArray[np.intp]) -> tuple[float, ...]:
        """Return the common properties of the readings of one curve, without the hour."""
        return tuple(np.delete(self._keys[here[0]], 0).tolist())

    @cached_property
    def _keys(self) -> Array:
        """Hour and all other properties of the readings, except the property of the axis, (n, m)."""
        problem, columns = self.problem, self.way.columns
        levels = self.way.name == "code value"
        code = self.problem.drive
        top = code.max(axis=1, keepdims=True)
        # If the axis is the code value, the ratio of the channels identifies a colour.
        patch = np.round(code / np.where(top > 0, top, 1.0), 2) if levels else code
        hour = np.zeros(len(code)) if "hour" in columns else problem.hours[problem.hour_of]
        kept = [
            name
            for name, condition in OF_COLUMN.items()
            if name in problem.readings.conditions and name not in columns and not condition.scatters
        ]
        conditions = [np.nan_to_num(problem.readings.conditions[name][problem.rows], nan=-1.0) for name in kept]
        return np.column_stack([hour, *patch.T, *conditions, problem.is_capped.astype(float)])

    def _groups(self) -> dict[tuple[float, ...], NDArray[np.intp]]:
        rows_of: dict[tuple[float, ...], list[int]] = {}
        for index, key in enumerate(map(tuple, self._keys.tolist())):
            if self.way.name != "code value" or self.way.values[index] > 0:
                rows_of.setdefault(key, []).append(index)
        groups = {key: np.array(rows) for key, rows in rows_of.items()}
        return {key: here for key, here in groups.items() if np.unique(self.way.values[here]).size >= 3}

    def _curve(self, here: NDArray[np.intp]) -> Curve:
        places, index = np.unique(self.way.values[here], return_inverse=True)
        count = np.bincount(index)

        def mean(values: Array) -> Array:
            unit = self.without[here, self.axis] / 100.0 if self.unit == "%" else 1.0
            return np.asarray(np.bincount(index, values[here, self.axis] / unit) / count)

        without = mean(self.without)
        return Curve(
            self.named(int(here[0])),
            places,
            mean(self.problem.xyz) - without,
            mean(self.sigma) / np.sqrt(count),
            mean(self.with_it) - without,
        )

    @cached_property
    def unit(self) -> str:
        """Unit of the curves: percent of the model without the effect; cd/m² if the strongest readings are dark."""
        strongest = np.argsort(-np.abs(self.change))[: max(self.change.size // 50, 3)]
        white = self.problem.measured_tips[0, 0, self.axis]
        dark = float(np.median(self.without[strongest, self.axis])) < DARK * white
        return "cd/m²" if dark and self.way.name != "code value" else "%"

    def named(self, index: int) -> str:
        """Return the name of a reading for the legend of a curve: patch and hour, without the property of the axis."""
        hour = (
            ""
            if "hour" in self.way.columns
            else f", {spaced(float(self.problem.hours[self.problem.hour_of[index]]))} h"
        )
        code = self.problem.drive[index]
        if self.way.name == "code value":
            lit = _lit(code)
            even = np.ptp(code[code > 0]) < 1e-9 if (code > 0).any() else True
            patch = {"white": "greys"}.get(NAMES[lit], f"{NAMES[lit]} ramp") if even else "mixtures"
        else:
            patch = patch_name(code)
        condition = self._condition(index) if self.way.columns == ("hour",) else ""
        return f"{patch}{_joint(condition)}{condition}{hour}"

    def patches(self) -> list[Bar]:
        """Return the patches that the effect changes most, at the hour with the largest changes."""
        hour = int(np.argmax(np.bincount(self.problem.hour_of, self.change**2)))
        rows_of: dict[str, list[int]] = {}
        for index in np.flatnonzero(self.problem.hour_of == hour):
            condition = self._condition(int(index))
            name = patch_name(self.problem.drive[index])
            rows_of.setdefault(f"{name}{_joint(condition)}{condition}", []).append(int(index))
        bars = [
            Bar(name, self.problem.drive[here[0]], float(self.residual[here].mean()), float(self.change[here].mean()))
            for name, here in rows_of.items()
        ]
        bars.sort(key=lambda bar: -abs(bar.with_it))
        return [bar for bar in bars if abs(bar.with_it) > WORTH_A_BAR * abs(bars[0].with_it)][:PATCHES]

    def _condition(self, index: int) -> str:
        """Return the condition of a reading in words; "" if the reading is at rest."""
        if self.problem.is_capped[index]:
            return "lens cap"
        row, kind = self.problem.rows[index], str(condition_of(self.problem)[index])
        condition = next((each for each in CONDITIONS if each.cell == kind), None)
        if condition is None:
            return ""
        return condition.short.format(*(self.problem.readings.column(each.name)[row] for each in condition.columns))

    def sentence(self) -> str:
        """Name the reading that the effect changes most, and its error with and without the effect."""
        strong = int(np.argmax(np.abs(self.change)))
        drive = self.problem.drive
        same = (np.abs(drive - drive[strong]).max(axis=1) < 1e-9) & self._same_condition(strong)
        measured = float((self.problem.xyz - self.without)[same, self.axis].mean())
        left = float((self.problem.xyz - self.with_it)[same, self.axis].mean())
        size = f"{abs(measured):.3g} cd/m²"
        rest = f"{abs(left):.2g} cd/m²" if abs(left) >= 0.001 else "less than 0.001 cd/m²"
        more = (
            ("brighter", "darker") if self.axis == 1 else (f"richer in {self.component}", f"poorer in {self.component}")
        )
        where = patch_name(drive[strong])
        condition = self._condition(strong)
        cell = condition_of(self.problem)[strong]
        before = next((each.before for each in CONDITIONS if each.cell == cell), "")
        reading = f"{where} {before}{condition}" if condition else where
        when = spaced(float(self.problem.hours[self.problem.hour_of[strong]]))
        return (
            f"Without {self.effect.name}, {reading} at {when} h is {size} {more[0] if measured > 0 else more[1]} than "
            f"the model says; with it {rest} is left"
        )

    def _same_condition(self, index: int) -> NDArray[np.bool_]:
        """Return a mask of the readings with equal hour and condition, and nearly equal change by the effect, (n,)."""
        condition = condition_of(self.problem)
        same = (condition == condition[index]) & (self.problem.hour_of == self.problem.hour_of[index])
        return np.asarray(same & (np.abs(self.change - self.change[index]) < 0.2 * abs(self.change[index]) + 1.0))


def _lit(code: Array) -> tuple[float, float, float]:
    """Return the code value with the same channels at full drive."""
    red, green, blue = (float(value > 0) for value in code)
    return red, green, blue


def _joint(condition: str) -> str:
    return "" if not condition else " " if condition.startswith("(") else ", "


def patch_name(code: Array) -> str:
    """Return the name of a code value."""
    red, green, blue = (float(value) for value in code)
    top = max(red, green, blue)
    if top == 0 or {red, green, blue} > {0.0, top} or len({red, green, blue} - {0.0}) > 1:
        return NAMES.get((red, green, blue), f"{red:.2g} {green:.2g} {blue:.2g}")
    name = NAMES[_lit(code)]
    return name if top == 1 else f"{'grey' if name == 'white' else name} {top:g}"
