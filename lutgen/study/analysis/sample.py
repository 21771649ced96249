"""``Sample``: one measure under one condition, as its answers or as the figures that a paper prints of them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from statistics import fmean, stdev
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Item = TypeVar("Item")

#: What is measured beside the diagnosis → what it is and its unit: the paper's TTS and EOR.
MEASURES = {"time": "time to score, s", "ease": "ease of reading"}


@dataclass(frozen=True)
class Sample:
    """One measure under one condition.

    Attributes
    ----------
    measure
        A key of ``MEASURES``.
    condition
        How images were shown.
    n, mean, sd
        Answers, their mean, and their standard deviation with n − 1; NaN where n does not allow it.
    values
        The answers themselves; empty where only figures are known.

    """

    measure: str
    condition: str
    n: int
    mean: float
    sd: float
    values: tuple[float, ...] = ()


def sample_of(measure: str, condition: str, values: Sequence[float]) -> Sample:
    """Make the sample of at least one answer."""
    sd = stdev(values) if len(values) > 1 else float("nan")
    return Sample(measure, condition, len(values), fmean(values), sd, tuple(map(float, values)))


def pairs_of(items: Iterable[Item]) -> list[tuple[Item, Item]]:
    """Return every item with every later one: conditions are compared in their order, the un-aged one first."""
    return list(combinations(items, 2))
