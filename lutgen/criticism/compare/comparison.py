"""Compare the model with readings: size of the error, noise floor, slices, worst readings, direction."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.compare.direction import Direction, direction
from lutgen.criticism.compare.drift import Drift, drifts
from lutgen.criticism.compare.slices import Errors, Reading, Slice, labels_of
from lutgen.criticism.first_session.baselines import FirstSession, first_session
from lutgen.criticism.fit.anchored import DRAWS, anchored, noise_only
from lutgen.criticism.fit.linear import whiten
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.numerals import times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Term
    from lutgen.readings import Measurements

#: 2: the noise is stated for X, Y and Z each, and names its instrument; ``by`` may be any condition.
SCHEMA = 2

#: Number of readings that are listed as the worst.
WORST = 10

#: Ratio of error to floor above which the error of a slice is too large: four standard deviations of the ratio for some
#: 30 values.
CLEAR = 1.5


@dataclass(frozen=True)
class Comparison:
    """The model against the readings.

    Attributes
    ----------
    problem, terms
        The problem, and the effects that the model has already.
    predicted
        XYZ that the model predicts, (n, 3), cd/m².
    error, floor
        Errors of all readings that are not tips, and the errors that noise alone gives.
    where
        Errors by hour, level, family and condition.
    worst
        The readings with the largest errors in σ.
    direction
        Direction of the error in the worst slice.

    """

    problem: Problem
    terms: tuple[Term, ...]
    predicted: Array
    error: Errors
    floor: Errors
    where: tuple[Slice, ...]
    worst: tuple[Reading, ...]
    direction: Direction

    @property
    def residual(self) -> Array:
        """Measured minus predicted, (n, 3), cd/m²."""
        return self.problem.xyz - self.predicted

    @cached_property
    def sizes(self) -> tuple[Array, Array]:
        """Error of every reading: ΔE2000 (n,), and its length in σ (n,)."""
        delta_e, sigma = _sizes(self.problem, self.predicted, self.residual)
        return delta_e, np.sqrt((sigma**2).sum(axis=1))

    @cached_property
    def first_session(self) -> FirstSession | None:
        """Errors in the first session: of the paper's fresh display, and of the display's own curves."""
        return first_session(self.problem)

    @cached_property
    def drifts(self) -> tuple[Drift, ...]:
        """Sessions whose light changed while they were measured."""
        return drifts(self.problem)

    @property
    def ratio(self) -> float:
        """Error over floor, by root mean square."""
        return self.error.rms_sigma / self.floor.rms_sigma if self.floor.rms_sigma else 0.0

    @property
    def agrees(self) -> bool:
        """Whether the ratio of error to noise exceeds 1 by less than three standard errors plus 0.1."""
        return bool(self.ratio < 1.0 + 3.0 / np.sqrt(max(3 * self.problem.rows.size, 1)) + 0.1)

    def sentence(self) -> str:
        """Say in plain words how well the model predicts the readings."""
        if not self.where:
            anchors = "white and primaries, which the model takes as given"
            if not self.problem.is_tip_anchor.all():
                anchors = "white, primaries, and the levels that the display's own curves run through"
            return f"These readings hold nothing but {anchors}: there is nothing to compare."
        size = f"mean ΔE2000 {self.error.delta_e_mean:.2f} where noise alone gives {self.floor.delta_e_mean:.2f}"
        if self.agrees:
            if self.drifts:
                return f"The model agrees with these measurements as well as they repeat, but they drift: {size}."
            return f"The model agrees with the measurements: {size}."
        few = self.error.delta_e_mean <= self.floor.delta_e_mean
        where = " in few readings, or in dark ones" if few else ""
        # A fit knows single colours from the first session; a baked display has only the curves.
        model = "The model" if self.problem.uses_first_readings else "The model as it is baked, with curves alone,"
        return f"{model} fails by {times(self.ratio)} the noise{where}: {size}. {self.direction.sentence()}"

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        readings = self.problem.readings
        return {
            "schema": SCHEMA,
            "data": {
                "file": readings.file,
                "sha256": readings.sha256,
                "readings": int(readings.hours.size),
                "hours": [float(hour) for hour in np.unique(readings.hours)],
            },
            "baseline": self.problem.baseline,
            "noise": noise_as_json(self.problem),
            "error": asdict(self.error),
            "floor": asdict(self.floor),
            "where": [{**asdict(each), "mean_residual_xyz": list(each.mean_residual_xyz)} for each in self.where],
            "worst": [{**asdict(each), "code": list(each.code)} for each in self.worst],
            "drifts": [{**asdict(each), "code": list(each.code)} for each in self.drifts],
            "first_session": asdict(self.first_session) if self.first_session else None,
            "left_out": lines_left_out(self.problem),
        }


def noise_as_json(problem: Problem) -> dict[str, Any]:
    """Return the noise of a problem's readings, and the shared errors of each session, as plain values."""
    noise = problem.noise
    return {
        "source": noise.source,
        "instrument": noise.instrument or None,
        "relative": [noise.relative * ratio for ratio in noise.ratio],
        "floor_cd_m2": [noise.floor_cd_m2 * ratio for ratio in noise.floor_ratio],
        "correlation": noise.correlation.tolist(),
        "floor_correlation": noise.floor_correlation.tolist(),
        "shot_cd_m2": noise.shot_cd_m2,
        "decimals": noise.digits.decimals,
        "significant": noise.digits.significant,
        "session": noise.session,
        "dark_offset_cd_m2": problem.offset_cd_m2,
        "gain_wander": problem.wander,
    }


def lines_left_out(problem: Problem) -> list[int]:
    """Return the lines in the file of the readings that are left out of the problem."""
    readings = problem.readings
    rows = np.setdiff1d(np.arange(readings.hours.size), problem.rows)
    return [int(line) for line in readings.lines[rows]]


def compare(
    readings: Measurements,
    *,
    baseline: str = "colour-points",
    selection: str = "nearest",
    instrument: str | None = None,
    terms: Sequence[Term] = (),
) -> Comparison:
    """Compare the paper's model, with the effects ``terms`` added, with readings.

    Parameters
    ----------
    readings
        The measurements.
    baseline
        ``colour-points``: white and primaries re-measured at each hour; ``first-hour``: only hour 0 known; ``native``,
        ``native-first-hour``: the same, starting from the first session's own transfer curves and black.
    selection
        The paper's choice of matrix.
    instrument
        Noise of the instrument: ``relative,floor_cd_m2``, a name such as ``cr-100``, or a TOML file; None: estimate it
        from replicates.
    terms
        Effects that the model has already.

    Raises
    ------
    LutgenError
        Unknown baseline, invalid noise, or readings that do not define a native display.

    """
    problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    return compare_problem(with_shared_errors(problem, terms), terms)


def compare_problem(problem: Problem, terms: Sequence[Term] = (), *, draws: int = DRAWS) -> Comparison:
    """Compare the model, with ``terms`` as they are, with a problem's readings; the floor is a mean over ``draws``."""
    problem = problem.as_baked
    predicted = anchored(problem, terms)
    judged = ~problem.is_anchor
    delta_e, sigma = _sizes(problem, predicted, problem.xyz - predicted)
    noise = [_sizes(problem, predicted, each) for each in noise_only(problem, predicted, draws)]
    floors = [_errors(each[0][judged], each[1][judged]) for each in noise]
    floor = Errors(*(float(np.mean([getattr(each, name) for each in floors])) for name in Errors.__dataclass_fields__))
    where = tuple(_slices(problem, predicted, judged, (delta_e, sigma), noise))
    return Comparison(
        problem,
        tuple(terms),
        predicted,
        _errors(delta_e[judged], sigma[judged]),
        floor,
        where,
        _worst(problem, delta_e, sigma, judged),
        direction(problem, predicted, judged, where),
    )


def _sizes(problem: Problem, predicted: Array, residual: Array) -> tuple[Array, Array]:
    """Return ΔE2000 (n,) and whitened residuals (n, 3)."""
    white = problem.measured_tips[0, 0]
    lab = xyz_to_lab(predicted, white), xyz_to_lab(predicted + residual, white)
    return delta_e_2000(*lab), whiten(problem, residual)


def _errors(delta_e: Array, sigma: Array) -> Errors:
    if not delta_e.size:
        return Errors(0.0, 0.0, 0.0, 0.0)
    quantile = float(np.quantile(delta_e, 0.95))
    return Errors(float(delta_e.mean()), quantile, float(delta_e.max()), float(np.sqrt((sigma**2).mean())))


def _slices(
    problem: Problem,
    predicted: Array,
    judged: NDArray[np.bool_],
    sizes: tuple[Array, Array],
    noise: list[tuple[Array, Array]],
) -> list[Slice]:
    delta_e, sigma = sizes
    residual = problem.xyz - predicted
    noise_de, noise_sigma = (np.array(each) for each in zip(*noise, strict=True))
    result = []
    for by, labels in labels_of(problem).items():
        named = labels[judged & (labels != "")]
        _, first = np.unique(named, return_index=True)
        for name in named[np.sort(first)]:
            here = judged & (labels == name)
            result.append(
                Slice(
                    by,
                    str(name),
                    int(here.sum()),
                    float(delta_e[here].mean()),
                    float(np.sqrt((sigma[here] ** 2).mean())),
                    _triple(residual[here].mean(axis=0)),
                    float(np.mean(noise_de.compress(here, axis=1).mean(axis=1))),
                    float(np.sqrt(np.mean((noise_sigma.compress(here, axis=1) ** 2).mean(axis=(1, 2))))),
                )
            )
    return result


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _worst(problem: Problem, delta_e: Array, sigma: Array, judged: NDArray[np.bool_]) -> tuple[Reading, ...]:
    size = np.where(judged, np.sqrt((sigma**2).sum(axis=1)), -1.0)
    readings = []
    for index in np.argsort(-size)[: min(WORST, int(judged.sum()))]:
        row = problem.rows[index]
        readings.append(
            Reading(
                int(problem.readings.lines[row]),
                float(problem.readings.hours[row]),
                _triple(problem.readings.drive[row]),
                float(delta_e[index]),
                float(size[index]),
            )
        )
    return tuple(readings)
