"""The first session beside two fresh displays: how far the paper's is from this one, and what its own curves leave."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.fit.anchored import anchored
from lutgen.display.native import NativeDisplay, sample_of
from lutgen.display.own_model import fit_own_model
from lutgen.errors import LutgenError
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from lutgen.criticism.fit.problem import Problem
    from lutgen.display.own_model import OwnModel

#: The paper's fresh display is another than this one from this mean ΔE2000 on, if the native one leaves half of it.
ANOTHER = 0.5


@dataclass(frozen=True)
class FirstSession:
    """Mean ΔE2000 of two fresh displays on readings at hour 0 that neither runs through.

    Attributes
    ----------
    readings
        Their number: neither white and primaries nor the ramps and black of the native display are among them.
    paper, native
        Of the paper's fresh display, and of the native one; None where the readings make none.
    own
        Of the display's own model (:mod:`lutgen.display.own_model`) on mixtures, held out by patch; None where these
        are too few.
    rungs
        What its ladder says, one sentence each.

    """

    readings: int
    paper: float
    native: float | None
    own: float | None = None
    rungs: tuple[str, ...] = ()

    @property
    def is_another(self) -> bool:
        """Whether this display clearly is not the paper's from the first day, and its own curves tell it better."""
        return self.native is not None and self.paper > ANOTHER and self.native < self.paper / 2

    def sentence(self) -> str:
        """Say both in plain words."""
        said = (
            f"First session: the paper's fresh display misses {self.readings} readings by mean ΔE2000 {self.paper:.2f}"
        )
        if self.native is None:
            return f"{said}."
        said = f"{said}, the native one by {self.native:.2f}"
        return f"{said}." if self.native < self.paper else f"{said}: curves and black of its own do not tell it better."


def first_session(problem: Problem) -> FirstSession | None:
    """Hold the readings of hour 0 against the paper's fresh display and the native one; None where none are left."""
    paper = replace(problem, baseline="colour-points", native=None, drawn=(), rows=problem.rows[problem.hour_of == 0])
    out = np.setdiff1d(np.arange(problem.readings.hours.size), problem.rows)
    try:
        own = problem.native or NativeDisplay.of(problem.readings, [int(row) for row in out])
    except LutgenError:
        own = None
    native = replace(paper, baseline="native", native=own)
    judged = paper.readings.at_rest()[paper.rows] & ~paper.is_tip_anchor & ~native.curve_points
    if not judged.any():
        return None

    def error(asked: Problem) -> float:
        white = asked.measured_tips[0, 0]
        found = delta_e_2000(xyz_to_lab(anchored(asked, ()), white), xyz_to_lab(asked.xyz, white))
        return float(found[judged].mean())

    model = own.ladder if own else _own_model(problem)
    held_out, said = (model.error, model.sentences()) if model else (None, ())
    return FirstSession(int(judged.sum()), error(paper), error(native) if own else None, held_out, said)


def _own_model(problem: Problem) -> OwnModel | None:
    """Fit the first session's own model; None where its readings are too few."""
    readings = problem.readings
    rows = problem.rows[problem.hour_of == 0]
    rows = rows[readings.at_rest()[rows] & ~is_capped(readings)[rows]]
    try:
        return fit_own_model(sample_of(readings, rows))
    except LutgenError:
        return None
