"""Rewritings that add readings to the file: functions from a ``Truth`` and a seed to a ``Truth``."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.rewritings.rewriting import CannotRewrite, name_of
from tests.generators.table import at_rest, is_colour_point

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from tests.generators.truth import Truth

    OfTruth = Callable[[Truth, int], Truth]

OF_TRUTH: dict[str, OfTruth] = {}

#: Hours between a session and the extra session after it; no display ages visibly in this time.
SOON = 24.0


def _of_truth(rewrite: OfTruth) -> OfTruth:
    OF_TRUTH[name_of(rewrite)] = rewrite
    return rewrite


def _again(truth: Truth, rows: NDArray[np.intp], name: str) -> Truth:
    """Return the truth with a second reading of these rows, soon afterwards, in a session of this name."""
    new = np.concatenate([np.arange(truth.hours.size), rows])
    order = truth.order[new].astype(float)
    order[truth.hours.size :] += truth.order.max() + 1.0
    hours = truth.hours[new].copy()
    hours[truth.hours.size :] += SOON
    session = truth.session + (name,) * rows.size
    # Stable, so that the existing readings keep their order.
    place = np.argsort(hours, kind="stable")
    new = new[place]
    return replace(
        truth,
        hours=hours[place],
        drive=truth.drive[new],
        xyz_cd_m2=truth.xyz_cd_m2[new],
        conditions={key: values[new] for key, values in truth.conditions.items()},
        session=tuple(session[i] for i in place),
        order=order[place],
        note=tuple(truth.note[i] for i in new),
    )


def _points(truth: Truth) -> NDArray[np.bool_]:
    return is_colour_point(truth.drive) & at_rest(truth.conditions, truth.drive, truth.note)


@_of_truth
def extra_sessions(truth: Truth, seed: int) -> Truth:
    """Two extra sessions in between."""
    hours = np.unique(truth.hours[_points(truth)])[1:-1]
    if hours.size < 2:
        raise CannotRewrite("fewer than four hours at which the colour points were read")
    for number, hour in enumerate(np.random.default_rng(seed).choice(hours, 2, replace=False)):
        truth = _again(truth, np.flatnonzero(truth.hours == hour), f"extra {number + 1}")
    return truth


@_of_truth
def extra_colour_points(truth: Truth, seed: int) -> Truth:
    """An extra session of colour points alone."""
    points = _points(truth)
    hour = np.random.default_rng(seed).choice(np.unique(truth.hours[points])[1:])
    return _again(truth, np.flatnonzero(points & (truth.hours == hour)), "colour points again")
