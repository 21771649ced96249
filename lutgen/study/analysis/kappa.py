"""Cohen's κ: agreement beyond what two readings with these shares of answers would have by chance."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from lutgen.study.analysis.intervals import Interval, Z

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.study.analysis.agreement import Pair


@dataclass(frozen=True)
class Kappa:
    """κ of the pairs of a condition: ``of`` is ``side`` (positive or negative) or ``category``.

    κ and its interval are NaN where all readings gave the same answer: chance alone would agree always.
    """

    condition: str
    of: str
    n: int
    percent: float
    kappa: float
    ci95: Interval


def kappas(conditions: Sequence[str], found: Sequence[Pair]) -> tuple[Kappa, ...]:
    """κ of every condition that has pairs, on sides and on categories."""
    made = []
    for condition in conditions:
        there = [pair for pair in found if pair.answer.condition == condition]
        if there:
            sides = [(str(pair.answer.positive), str(pair.reference.positive)) for pair in there]
            categories = [(pair.answer.category, pair.reference.category) for pair in there]
            made += [_kappa(condition, "side", sides), _kappa(condition, "category", categories)]
    return tuple(made)


def _kappa(condition: str, of: str, readings: Sequence[tuple[str, str]]) -> Kappa:
    names = sorted({name for pair in readings for name in pair})
    table = np.zeros((len(names), len(names)))
    for one, other in readings:
        table[names.index(one), names.index(other)] += 1
    value, error = cohen(table)
    n = len(readings)
    return Kappa(condition, of, n, 100 * float(np.trace(table)) / n, value, (value - Z * error, value + Z * error))


def cohen(table: Array) -> tuple[float, float]:
    """κ and its standard error from a square table of counts, (k, k); NaN where chance agrees always.

    Cohen 1960, doi:10.1177/001316446002000104; error by Fleiss, Cohen & Everitt 1969, doi:10.1037/h0028106.
    """
    n = table.sum()
    share = table / n
    rows, columns = share.sum(axis=1), share.sum(axis=0)
    seen, chance = float(np.trace(share)), float(rows @ columns)
    if chance >= 1:
        return float("nan"), float("nan")
    kappa = (seen - chance) / (1 - chance)
    both = rows[np.newaxis, :] + columns[:, np.newaxis]
    diagonal = np.diag(share) @ (1 - np.diag(both) * (1 - kappa)) ** 2
    other = (1 - kappa) ** 2 * ((share * both**2).sum() - np.diag(share) @ np.diag(both) ** 2)
    variance = (diagonal + other - (kappa - chance * (1 - kappa)) ** 2) / (n * (1 - chance) ** 2)
    return kappa, sqrt(max(float(variance), 0.0))
