"""Plan the next session: a patch list that distinguishes two effects, shows one effect, or gives general coverage."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING, Any

from lutgen.criticism.diagnose import candidates, known_under
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.search.candidates import HALF, family
from lutgen.criticism.search.separate import POOL, Patch, Separation, separation, with_patches
from lutgen.criticism.verdict.visibility import away_from_rest, typical_size, visibility
from lutgen.errors import LutgenError, pick_one
from lutgen.readings.rest import TIP_DRIVES
from lutgen.readings.table import OPTIONAL

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.effects import Effect
    from lutgen.readings import Measurements

#: Tips and black, three times each: every session needs these readings for the model and for the noise.
BASICS = tuple(
    Patch((float(r), float(g), float(b)), {}, "")
    for r, g, b in [*TIP_DRIVES.tolist(), [0.0, 0.0, 0.0]]
    for _ in range(3)
)

#: χ² between two rivals above which they are distinguished.
CLEAR = 20.0

#: Strength (root of χ²) to which a rival is scaled if the readings show less: three times the detectable strength.
THREE_TIMES_DETECTABLE = 15.0


@dataclass(frozen=True)
class MeasurementPlan:
    """A list of patches to measure.

    Attributes
    ----------
    sentence
        Purpose of the list, and what its patches will show.
    patches
        The patches in measuring order, basics first; empty if the present readings already show what was asked.
    gains
        Set of patches → smallest detectable size, or separation, (before, after). For general coverage: (None, number
        of effects that become visible).
    separation
        With ``between``: the patches that best distinguish the two effects; otherwise None.

    """

    sentence: str
    patches: tuple[Patch, ...]
    gains: Mapping[str, tuple[float | None, float | None]]
    separation: Separation | None = None

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "schema": 1,
            "sentence": self.sentence,
            "patches": [patch.as_json() for patch in self.patches],
            "sets": {name: {"before": before, "after": after} for name, (before, after) in self.gains.items()},
        }

    def as_csv(self) -> str:
        """Return the list as a table of readings in which hour and X, Y, Z are to be filled in."""
        used = [name for name in OPTIONAL if any(name in patch.conditions for patch in self.patches)]
        lines = [
            "# A patch list: fill in hour and X,Y,Z (cd/m2) of each row.",
            "# session_gain: 0.003",
            ",".join(["hour", "R", "G", "B", *used, "X", "Y", "Z", "note"]),
        ]
        for patch in self.patches:
            cells = [f"{patch.conditions[name]:g}" if name in patch.conditions else _rest(name) for name in used]
            lines.append(",".join(["", *(f"{value:g}" for value in patch.code), *cells, "", "", "", patch.note]))
        return "\n".join(lines) + "\n"

    def as_ti1(self) -> str:
        """Return the codes as a target for ArgyllCMS' ``spotread`` or ``dispread`` (CGATS .ti1), RGB 0..100."""
        rows = [
            f"{number} " + " ".join(f"{100 * value:.4f}" for value in patch.code) + " 0 0 0"
            for number, patch in enumerate(self.patches, start=1)
        ]
        head = [
            "CTI1", "", 'DESCRIPTOR "lutgen patch list"', 'ORIGINATOR "lutgen plan"', 'COLOR_REP "RGB"', "",
            "NUMBER_OF_FIELDS 7", "BEGIN_DATA_FORMAT", "SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z",
            "END_DATA_FORMAT", "", f"NUMBER_OF_SETS {len(rows)}", "BEGIN_DATA",
        ]  # fmt: skip
        return "\n".join([*head, *rows, "END_DATA", ""])


def _rest(name: str) -> str:
    """Return the cell of a condition at rest."""
    value = OPTIONAL[name]
    return "" if isnan(value) else f"{value:g}"  # NaN: warm, or unknown


def plan(
    readings: Measurements,
    *,
    between: tuple[str, str] | None = None,
    effect: str | None = None,
    baseline: str = "colour-points",
    selection: str = "nearest",
    instrument: str | None = None,
    effects: Mapping[str, Effect] | None = None,
) -> MeasurementPlan:
    """Plan the next session.

    Parameters
    ----------
    readings, baseline, selection, instrument, effects
        As in :func:`lutgen.criticism.diagnose.diagnose`.
    between
        Two effects to be distinguished.
    effect
        One effect to be shown. Without ``between`` and ``effect`` the plan gives general coverage.

    Raises
    ------
    LutgenError
        An effect is unknown, is given twice, or no patch of one more session can show or distinguish it.

    """
    known = known_under(effects, baseline)
    for name in (*(between or ()), *([effect] if effect else [])):
        if name not in known:
            raise pick_one("effect", name, known)
    if between and between[0] == between[1]:
        raise LutgenError(f"--between needs two different effects; {between[0]} was given twice.")
    problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    base = fit(with_shared_errors(problem))
    if between:
        return _between(base, known, between)
    return _for_effect(base, known[effect]) if effect else _coverage(base, candidates(known, baseline, ()))


def _between(base: Fit, known: Mapping[str, Effect], pair: tuple[str, str]) -> MeasurementPlan:
    fitted = {name: family(base, known[name]).best.fit for name in pair}
    separations = []
    for one, other in (pair, pair[::-1]):
        truth = _as_truth(base, fitted[one], known[one])
        separations.append(separation(truth, family(_fit_of_tips(truth), known[other]).best, (one, other)))
    differ = min(each.before for each in separations) >= CLEAR
    if differ and (told := _told_apart(base, fitted, separations)):
        return MeasurementPlan(f"{told} No further reading is needed for that.", (), {})
    best = min(separations, key=lambda each: each.after)
    if best.after < CLEAR and best.after - best.before < 1.0:
        why = _hidden(base, [known[name] for name in pair]) or _imitated(known, best)
        raise LutgenError(f"no patch in one more session would tell {pair[0]} from {pair[1]}: {why}")
    sentence = (
        f"To tell {pair[0]} from {pair[1]}: {best.name}. It raises their separation (χ²) from {best.before:.3g} to "
        f"{best.after:.3g}; {CLEAR:g} is clear."
    )
    if differ:
        sentence += (
            " Their formulas differ clearly on the present readings already, but both fit these readings about equally "
            "well, or another error is larger than either."
        )
    return MeasurementPlan(sentence, (*BASICS, *best.patches), {best.name: (best.before, best.after)}, best)


def _told_apart(base: Fit, fitted: Mapping[str, Fit], separations: Sequence[Separation]) -> str:
    """Return a sentence on how the present readings tell two effects apart; "" if they do not.

    ``separations`` say that either effect, if true, differs clearly from the other on these readings. That does not
    suffice if both fit the readings about equally well, or if neither explains most of what the model misses.
    """
    better, worse = sorted(fitted, key=lambda name: fitted[name].chi2)
    if all(base.chi2 - each.chi2 < THREE_TIMES_DETECTABLE**2 for each in fitted.values()):
        before = min(each.before for each in separations)
        return (
            f"These readings show neither {better} nor {worse}, and would tell them apart: at three times its "
            f"detectable size, each differs from the other by a χ² of at least {before:.3g}; {CLEAR:g} is clear."
        )
    # Where neither explains half of the excess, other errors decide which of the two fits better.
    excess = base.chi2 - base.freedom
    if fitted[worse].chi2 - fitted[better].chi2 < CLEAR or base.chi2 - fitted[better].chi2 < HALF * excess:
        return ""
    return (
        f"These readings already tell {better} from {worse}: {better} alone leaves a χ² of {fitted[better].chi2:.3g}, "
        f"{worse} alone {fitted[worse].chi2:.3g}; a difference of {CLEAR:g} is clear."
    )


def _hidden(base: Fit, effects: Sequence[Effect]) -> str:
    """Return the reason and the remedy if re-measured white and primaries hide some of the effects; else ""."""
    hidden = [each.name for each in effects if each.baseline == "first-hour"]
    if base.problem.from_first_hour or not hidden:
        return ""
    which = "it" if len(effects) == 1 else "both" if len(hidden) == len(effects) else hidden[0]
    foretelling = "native-first-hour" if base.problem.native else "first-hour"
    spectrum = ", or measure spectra" if len(effects) > 1 else ""
    return f"re-measured white and primaries hide {which}. Use --baseline {foretelling}{spectrum}."


def _imitated(known: Mapping[str, Effect], each: Separation) -> str:
    """Return the reason and the remedy if one effect imitates the other on all patches that a plan knows."""
    one, other = each.separates
    remedy = known[one].confused_with.get(other) or known[other].confused_with.get(one) or "a second meter"
    return (
        f"fitted to all patches that a plan knows, {other} shows the same light as {one} to within the noise (χ² "
        f"{each.after:.3g}; {CLEAR:g} is clear). What tells them apart: {remedy}."
    )


def _as_truth(base: Fit, fitted: Fit, effect: Effect) -> Fit:
    """Return the fit of an effect; if the readings show too little of it, with three times its detectable size."""
    if base.chi2 - fitted.chi2 >= THREE_TIMES_DETECTABLE**2:
        return fitted
    score, term = base.score, Term.at_rest(effect, effect.forms[0])
    sizes = {}
    for name in term.free:
        if name in effect.neutral:
            strength = float((score.seen(term, name)[1] ** 2).sum() ** 0.5)
            size = THREE_TIMES_DETECTABLE / strength if strength > 0 else typical_size(effect, name)
            sizes[name] = away_from_rest(effect, name, size)
    return fit(base.problem, (*base.terms, Term(effect, {**term.values, **sizes}, ())))


def _fit_of_tips(truth: Fit) -> Fit:
    """Return the fit of the tips alone to noise-free readings of ``truth``."""
    return fit(truth.problem.with_light(truth.predicted), (), truth.state)


def _for_effect(base: Fit, effect: Effect) -> MeasurementPlan:
    if why := _hidden(base, [effect]):
        raise LutgenError(f"no patch in one more session would show {effect.name}: {why}")
    seen = visibility(base, [effect])[0]
    before = seen.smallest_detectable
    gains = {}
    for name, patches in POOL.items():
        problem = with_patches(base.problem, patches)
        gains[name] = (before, visibility(_noise_free(base, problem), [effect])[0].smallest_detectable)
    useful = {name: after for name, (_, after) in gains.items() if after is not None}
    if not useful:
        raise LutgenError(
            f"no patch in one more session would show {effect.name}: on every set of patches that a plan knows, it "
            "changes the light by less than the noise, or the rest of the model absorbs the change. A better meter may "
            "show it."
        )
    # The information is 1/size². Its increase is divided by the root of the number of patches, which take time to read.
    already = before**-2 if before else 0.0
    best = max(useful, key=lambda name: (useful[name] ** -2 - already) / len(POOL[name]) ** 0.5)
    unit = f" {seen.unit}" if seen.unit not in {"1", ""} else ""
    was = "cannot be seen" if before is None else f"is seen from {before:.3g}{unit}"
    sentence = f"To see {effect.name}: {best}. Today it {was}; with these patches from {useful[best]:.3g}{unit}."
    return MeasurementPlan(sentence, (*BASICS, *POOL[best]), gains)


def _noise_free(base: Fit, problem: Problem) -> Fit:
    """Return the fit of the base's effects to noise-free readings of a problem with added patches."""
    return fit(problem.with_light(predict(problem, base.state)), base.terms, base.state)


def _coverage(base: Fit, effects: Sequence[Effect]) -> MeasurementPlan:
    """Choose set by set the patches that make most invisible effects visible; if no set does, a full session."""
    invisible = {each.effect for each in visibility(base, effects) if not each.visible}
    chosen: list[str] = []
    gains: dict[str, tuple[float | None, float | None]] = {}
    shown = {}
    for name, patches in POOL.items():
        after = visibility(_noise_free(base, with_patches(base.problem, patches)), effects)
        shown[name] = {each.effect for each in after if each.visible} & invisible
    while invisible:
        best = max(shown, key=lambda name: len(shown[name] & invisible))
        if not shown[best] & invisible:
            break
        gains[best] = (None, float(len(shown[best] & invisible)))
        invisible -= shown[best]
        chosen.append(best)
    if not chosen:
        chosen = ["nine greys", "ramps of red, green, blue", "secondaries", "mixtures"]
    effects_shown = sorted({name for each in chosen for name in shown[each]})
    result = f" They make visible: {', '.join(effects_shown)}." if effects_shown else ""
    sentence = f"For general coverage: {'; '.join(chosen)}.{result}"
    return MeasurementPlan(sentence, (*BASICS, *(patch for name in chosen for patch in POOL[name])), gains)
