"""Errors of two models of the fresh display at the first session: the paper's display and the native display."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.fit.anchored import anchored
from lutgen.display.native import NativeDisplay
from lutgen.display.own_model import fit_own_model
from lutgen.display.own_model.sample import in_first_session, sample_of
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.criticism.fit.problem import Problem
    from lutgen.display.own_model import OwnModel

#: The display is not the paper's if the mean ΔE2000 of the paper's model is above this, and that of the native model is
#: less than half of it. Assumption: about twice the mean ΔE2000 that the noise of a good meter gives.
ANOTHER = 0.25


@dataclass(frozen=True)
class FirstSession:
    """Mean ΔE2000 of two models of the fresh display, at readings of hour 0 to which neither is fitted.

    Attributes
    ----------
    readings
        Number of these readings; white, primaries, and the native display's ramps and black are left out.
    paper, native
        Mean ΔE2000 of the paper's fresh display, and of the native one; None if no native display can be made.
    own
        Mean ΔE2000 of the display's own model (:mod:`lutgen.display.own_model`) on mixtures, held out by patch; None if
        there are too few.
    rungs
        Sentences on the ladder of the own model, one each.

    """

    readings: int
    paper: float
    native: float | None
    own: float | None = None
    rungs: tuple[str, ...] = ()

    @property
    def is_another(self) -> bool:
        """Whether the fresh display clearly is not the paper's, and the native display predicts it better."""
        return self.native is not None and self.paper > ANOTHER and self.native < self.paper / 2

    def sentence(self) -> str:
        """State both errors in one sentence."""
        sentence = (
            f"First session: the paper's un-aged display predicts {self.readings} readings with a mean ΔE2000 of "
            f"{self.paper:.2f}"
        )
        if self.native is None:
            return f"{sentence}."
        sentence = f"{sentence}, the native one with {self.native:.2f}"
        return (
            f"{sentence}."
            if self.native < self.paper
            else f"{sentence}: its own curves and black do not predict them better."
        )


def first_session(problem: Problem) -> FirstSession | None:
    """Compare readings of hour 0 with the paper's fresh display and the native one; None if no readings are left."""
    paper = replace(problem, baseline="colour-points", native=None, drawn=(), rows=problem.rows[problem.hour_of == 0])
    left_out = np.setdiff1d(np.arange(problem.readings.hours.size), problem.rows)
    try:
        own = problem.native or NativeDisplay.of(problem.readings, [int(row) for row in left_out])
    except LutgenError:
        own = None
    native = replace(paper, baseline="native", native=own)
    compared = paper.is_at_rest & ~paper.is_tip_anchor & ~native.curve_points
    if not compared.any():
        return None

    def error(posed: Problem) -> float:
        white = posed.measured_tips[0, 0]
        delta_e = delta_e_2000(xyz_to_lab(anchored(posed, ()), white), xyz_to_lab(posed.xyz, white))
        return float(delta_e[compared].mean())

    model = own.ladder if own else _own_model(problem)
    held_out, sentences = (model.error, model.sentences()) if model else (None, ())
    return FirstSession(int(compared.sum()), error(paper), error(native) if own else None, held_out, sentences)


def _own_model(problem: Problem) -> OwnModel | None:
    """Fit the own model to the first session; None if there are too few readings."""
    rows = problem.rows[in_first_session(problem.readings)[problem.rows]]
    try:
        return fit_own_model(sample_of(problem.readings, rows))
    except LutgenError:
        return None
