"""Estimated errors that all readings of a session share, besides its gain: a dark offset, and a slow drift of the gain.

The zero of an instrument differs from session to session, and its gain drifts within a session (``wander``). Both are
random effects: unknowns of each session whose variance is the same in all sessions. The variances are estimated from
the estimates of the single sessions: the offset's by restricted maximum likelihood (Patterson & Thompson 1971,
doi:10.1093/biomet/58.3.545), with a weak prior near an ordinary colorimeter (``dark_offsets``). No variance is assumed
to be zero.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import compress
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.first_session.errors import FirstErrors
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.local_unknowns import local_columns, prior_rows, spanned
from lutgen.criticism.noise.dark_offsets import offset_sd
from lutgen.criticism.noise.session_columns import SessionEstimate, shared_columns
from lutgen.criticism.noise.tails import tails_of, weights_at, weights_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Linear, Term
    from lutgen.criticism.fit.problem import Problem

    #: Departure of a gain from a line between two sessions, as a contrast: index of a session → index of its gain,
    #: weight.
    Line = dict[int, tuple[int, float]]

#: Weight of a reading that is certainly or possibly wrong in the fit from which all weights are computed.
NEARLY_NONE = 1e-6

#: Largest plausible drift of an instrument's gain, 1 σ; an assumption.
MOST = 0.02

#: Step of the logarithm of the standard deviation of gains.
STEP = 0.02

#: Degrees of freedom of Student's t distribution of the departures, and its squared scale at which it is most similar
#: to a normal distribution of σ 1.
FREEDOM, NORMAL = 4.0, 0.691

#: An error is estimated only if at least this share of its change cannot be absorbed by tips and gains.
LEAST_SEEN = 1e-2


def with_shared_errors(problem: Problem, terms: Sequence[Term] = ()) -> Problem:
    """Return a problem with estimated weights and standard deviations of offset and ``wander``, for given ``terms``."""
    problem = replace(problem, offset_cd_m2=0.0, wander=0.0, weights=None)
    fixed = [replace(term, free=()) for term in terms]
    if tails := tails_of(problem):
        # With heavy tails, outliers are expected: they get small weights, and are not left out.
        weights = np.ones(problem.readings.hours.size)
        # Errors far beyond the tails would change the fit, and so the residuals of other readings.
        weights[[*problem.noise.outliers, *problem.noise.contradictory]] = NEARLY_NONE
        problem = problem.with_outliers()
        fitted = fit(replace(problem, weights=weights), fixed)
        residual = fitted.residual / np.sqrt(weights[problem.rows])[:, np.newaxis]
        weights[problem.rows] = weights_of(problem, residual, tails)
        first_errors = FirstErrors.of(problem) if problem.first_readings else None
        if problem.first_readings and first_errors:
            # An outlier of the first session affects all later readings of its colour.
            sizes = first_errors.subtracted_from(fitted.linear.residual)[1]
            errors = problem.first_session_model.errors_of_exact(sizes)
            exact = problem.first_readings.exact
            weights[problem.rows[exact]] = weights_at((errors[exact] ** 2).sum(axis=1) / tails.scale**2, tails)
        problem = replace(problem, weights=weights)
    fitted = fit(problem, fixed)
    return replace(problem, offset_cd_m2=_offset(fitted), wander=_wander(fitted))


def _offset(fitted: Fit) -> float:
    """Standard deviation of the dark offset between sessions: stated by the instrument, or estimated."""
    problem = fitted.problem
    if problem.noise.states_offset:
        return problem.noise.offset_cd_m2
    capped = problem.is_capped
    # Black and the capped lens: readings that effects on curves, mixing and primaries do not change.
    dark = capped | (problem.is_at_rest & (problem.drive == 0).all(axis=1))
    if problem.native:
        # The black of a native display scales with its white, which black alone does not determine.
        dark |= problem.is_tip_anchor
    has_capped = np.unique(problem.hour_of[capped]).size > 1
    # Only a capped lens is free of the display's black. ``native=None``: here the first session has an offset of its
    # own, as later sessions have.
    unit = replace(problem, offset_cd_m2=1.0, native=None)
    offsets = _session_estimates(fitted, fitted.linear, capped if has_capped else dark, unit)
    return offset_sd(offsets, problem, capped=has_capped)


def _wander(fitted: Fit) -> float:
    """Standard deviation of the gain drift within a session."""
    problem = fitted.problem
    # With a baseline from hour 0, residuals of aging look like gains, so the drift of the instrument cannot be
    # estimated: return the usual value.
    if problem.from_first_hour:
        return problem.noise.wander
    linear = fitted.linear._replace(residual=fitted.residual)
    everything = np.ones(problem.rows.size, dtype=bool)
    return _gain_sd(_session_estimates(fitted, linear, everything, replace(problem, wander=1.0)), problem.noise.wander)


def _gain_sd(estimates: list[SessionEstimate], least: float) -> float:
    """Most likely standard deviation of the gains about lines in time, at least ``least``.

    The departures are projected on the principal axes of their covariance, because all gains of a session share the
    noise of white: this noise changes the departures along few axes.
    """
    sessions = [part for each in estimates for part in _by_session(each)]
    along_axes = []
    for place in range(len(sessions)):
        if departures := _departures(sessions, place):
            departure, noise, gain = departures
            variances, axes = np.linalg.eigh(noise)
            along_axes.append(np.array([(axes.T @ departure) ** 2, np.maximum(variances, 0.0), (axes**2).T @ gain]))
    return _likeliest_sd(np.concatenate(along_axes, axis=1), least) if along_axes else least


def _likeliest_sd(departures: Array, least: float) -> float:
    """Most likely standard deviation of gains from ``departures`` (3, k): squares, variances by noise and by gains.

    Departures have Student's t distribution: a misfit of a few kinds of readings changes the result little. If the
    estimate reaches ``MOST``, the instrument is not the cause: return ``least``.
    """
    squares, noise, gain = departures
    sds = least * np.exp(np.arange(0.0, np.log(MOST / least), STEP))
    variance = NORMAL * (noise + sds[:, np.newaxis] ** 2 * gain)
    loss = np.log(variance) + (FREEDOM + 1.0) * np.log1p(squares / variance / FREEDOM)
    best = int(np.argmin(loss.sum(axis=1)))
    return float(sds[best]) if best < sds.size - 1 else least


def _by_session(estimates: SessionEstimate) -> list[SessionEstimate]:
    """Split the estimates of an hour into sessions: a new session begins when a name occurs again."""
    starts = [0]
    for place, name in enumerate(estimates.names):
        if name in estimates.names[starts[-1] : place]:
            starts.append(place)
    parts = [slice(start, end) for start, end in zip(starts, [*starts[1:], len(estimates.names)], strict=True)]
    return [
        SessionEstimate(
            estimates.hour, estimates.names[part], estimates.estimate[part], estimates.covariance[part, part]
        )
        for part in parts
    ]


def _departures(sessions: list[SessionEstimate], place: int) -> tuple[Array, Array, Array] | None:
    """Departures of a session's gains from the lines between the gains of the sessions before and after.

    Departures (k,), their covariance by noise (k, k), and their variances by gains of σ 1 (k,). None if no gain has a
    session before and a session after.
    """
    here, lines = sessions[place], []
    for mine, name in enumerate(here.names):
        before = next((session for session in range(place - 1, -1, -1) if name in sessions[session].names), None)
        after = next((session for session in range(place + 1, len(sessions)) if name in sessions[session].names), None)
        if before is None or after is None:
            continue
        start, end = sessions[before].hour, sessions[after].hour
        share = (here.hour - start) / (end - start) if end > start else 0.5
        ends = {
            session: (sessions[session].names.index(name), size)
            for session, size in ((before, share - 1.0), (after, -share))
        }
        lines.append({place: (mine, 1.0), **ends})
    if not lines:
        return None

    def covariance(left: Line, right: Line) -> float:
        return sum(
            size * right[session][1] * float(sessions[session].covariance[which, right[session][0]])
            for session, (which, size) in left.items()
            if session in right
        )

    departure = np.array(
        [sum(size * sessions[session].estimate[which] for session, (which, size) in each.items()) for each in lines]
    )
    gain = np.array([sum(size**2 for _, size in each.values()) for each in lines])
    return departure, np.array([[covariance(left, right) for right in lines] for left in lines]), gain


def _session_estimates(fitted: Fit, linear: Linear, rows: NDArray[np.bool_], unit: Problem) -> list[SessionEstimate]:
    """Estimate the shared errors of one kind in each block, tips and gains of the block marginalised.

    ``linear``: the fit, linearised, with the residuals to use. ``rows``: the readings to use. ``unit``: the problem
    with a standard deviation of 1 of these errors.
    """
    problem, estimates = fitted.problem, []
    for whole in problem.blocks:
        here = whole[rows[whole]]
        if not here.size:
            continue
        hour = int(problem.hour_of[whole[0]])
        columns, gains = local_columns(problem, linear.local, whole, here)
        prior, off = prior_rows(problem, fitted.state, hour, gains, 0)
        names, shared = shared_columns(unit, whole, unit.whitener)
        shared = shared[:, np.searchsorted(whole, here)]
        count = len(shared)
        # An array may have no columns; numpy then cannot infer the length of a reshape.
        local = np.concatenate([columns.reshape(len(columns), 3 * here.size).T, prior])
        signatures = np.concatenate([shared.reshape(count, 3 * here.size).T, np.zeros((len(off), count))])
        right = np.concatenate([linear.residual[here].ravel(), off])
        q = spanned(local)
        unabsorbed, right = signatures - q @ (q.T @ signatures), right - q @ (q.T @ right)
        # Errors that tips and gains of the block absorb completely cannot be estimated, for example the gain of the
        # tips.
        estimable = np.linalg.norm(unabsorbed, axis=0) > LEAST_SEEN * np.linalg.norm(signatures, axis=0)
        if estimable.any():
            covariance = np.linalg.pinv(unabsorbed[:, estimable].T @ unabsorbed[:, estimable], hermitian=True)
            estimate = covariance @ (unabsorbed[:, estimable].T @ right)
            scale = _misfit(signatures[:, estimable] != 0, right - unabsorbed[:, estimable] @ estimate)
            covariance = covariance * np.outer(scale, scale)
            estimates.append(
                SessionEstimate(float(problem.hours[hour]), list(compress(names, estimable)), estimate, covariance)
            )
    return estimates


def _misfit(changed: NDArray[np.bool_], residual: Array) -> Array:
    """Root mean square residual of the values that each error changes, (k,); at least 1.

    A gain changes all its readings by the same share. If the residuals scatter by more than noise, the model of the
    display is wrong, and the standard error of the gain is scaled up by this factor.
    """
    squares = changed.T.astype(float) @ residual**2 / np.maximum(changed.sum(axis=0), 1)
    return np.asarray(np.sqrt(np.maximum(squares, 1.0)))
