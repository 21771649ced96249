"""What to measure next: a patch list for two rivals, for one effect, or for general coverage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.criticism.diagnose import candidates, known_under
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.model import estimate_noise
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.search.candidates import family
from lutgen.criticism.search.separate import POOL, Patch, Separation, separation, with_patches
from lutgen.criticism.verdict.visibility import visibility
from lutgen.errors import LutgenError, pick_one
from lutgen.readings.rest import TIP_DRIVES
from lutgen.readings.table import OPTIONAL

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.effects import Effect
    from lutgen.readings import Measurements

#: Tips and black, three times each: every session needs them, for the model and for the noise.
BASICS = tuple(
    Patch((float(r), float(g), float(b)), {}, "")
    for r, g, b in [*TIP_DRIVES.tolist(), [0.0, 0.0, 0.0]]
    for _ in range(3)
)

#: χ² between two rivals from which they are told apart.
CLEAR = 20.0

#: Strength that a rival's fitted effect is scaled to when the data hold none: three times what is detectable.
THREE_TIMES = 15.0


@dataclass(frozen=True)
class MeasurementPlan:
    """A ready-to-measure list.

    Attributes
    ----------
    sentence
        What it is for, and what it will bring.
    patches
        In measuring order, basics first.
    gains
        Pool set → by how much it lowers the smallest detectable size, or raises the separation: (before, after).

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
        """Return the list in the columns of the table of readings, hour and X, Y, Z left to be filled in."""
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
    value = OPTIONAL[name]
    return "" if value != value else f"{value:g}"  # noqa: PLR0124 - NaN: warm, or unknown


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
        Two effects to be told apart.
    effect
        One effect to be seen; neither: general coverage.

    Raises
    ------
    LutgenError
        Unknown effects.

    """
    known = known_under(effects, baseline)
    for name in (*(between or ()), *([effect] if effect else [])):
        if name not in known:
            raise pick_one("effect", name, known)
    estimate_noise(readings, instrument)
    problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    base = fit(with_shared_errors(problem))
    if between:
        return _between(base, known, between)
    return _for_effect(base, known[effect]) if effect else _coverage(base, candidates(known, baseline, ()))


def _between(base: Fit, known: Mapping[str, Effect], pair: tuple[str, str]) -> MeasurementPlan:
    if pair[0] == pair[1]:
        raise LutgenError(f"{pair[0]} cannot be told from itself. Name two different effects: --between A,B.")
    found = []
    for one, other in (pair, pair[::-1]):
        truth = _as_if_true(base, known[one])
        found.append(separation(truth, family(base_of(truth), known[other]).best, (one, other)))
    best = min(found, key=lambda each: each.after)
    if best.after < CLEAR and best.after - best.before < 1.0:
        raise LutgenError(
            f"no patch in one more session would tell {pair[0]} from {pair[1]}: re-measured white and primaries hide "
            f"all that they do. Use --baseline first-hour, or a spectrum."
        )
    sentence = (
        f"To tell {pair[0]} from {pair[1]}: {best.name}. It raises their separation (χ²) from {best.before:.3g} to "
        f"{best.after:.3g}; 20 is clear."
    )
    return MeasurementPlan(sentence, (*BASICS, *best.patches), {best.name: (best.before, best.after)}, best)


def _as_if_true(base: Fit, effect: Effect) -> Fit:
    """Fit an effect; where the data show too little of it, take it as three times the detectable size."""
    found = family(base, effect).best.fit
    if base.chi2 - found.chi2 >= THREE_TIMES**2:
        return found
    score, term = base.score, Term.at_rest(effect, effect.forms[0])
    sizes = {}
    for name in term.free:
        strength = float(abs(score.seen(term, name)[1]).max() and (score.seen(term, name)[1] ** 2).sum() ** 0.5)
        low, high = effect.parameters[name].bounds
        rest, typical = term.values[name], effect.parameters[name].value
        size = THREE_TIMES / strength if strength > 0 else abs(typical - rest)
        sizes[name] = min(max(rest + size, low), high)
    return fit(base.problem, (*base.terms, Term(effect, {**term.values, **sizes}, ())))


def base_of(truth: Fit) -> Fit:
    """Return the fit of noise-free readings of ``truth`` by the tips alone."""
    from dataclasses import replace

    exact = truth.problem.readings.with_light(truth.problem.readings.xyz_cd_m2.copy())
    exact.xyz_cd_m2[truth.problem.rows] = truth.predicted
    return fit(replace(truth.problem, readings=exact), (), State((), truth.tips, truth.gains))


def _for_effect(base: Fit, effect: Effect) -> MeasurementPlan:
    if effect.baseline == "first-hour" and not base.problem.from_first_hour:
        raise LutgenError(
            f"no patch in one more session would show {effect.name}: re-measured white and primaries hide it. Use "
            f"--baseline first-hour."
        )
    before = visibility(base, [effect])[0].smallest_detectable
    gains = {}
    for name, patches in POOL.items():
        problem = with_patches(base.problem, patches)
        gains[name] = (before, visibility(_noise_free(base, problem), [effect])[0].smallest_detectable)
    useful = {name: after for name, (_, after) in gains.items() if after is not None}
    if not useful:
        raise LutgenError(
            f"no patch in one more session would show {effect.name}: re-measured white and primaries hide it. Use "
            f"--baseline first-hour."
        )
    # Information goes by 1/size²; what a set adds of it is weighed against the time that it takes.
    already = before**-2 if before else 0.0
    best = max(useful, key=lambda name: (useful[name] ** -2 - already) / len(POOL[name]) ** 0.5)
    seen = visibility(base, [effect])[0]
    unit = f" {seen.unit}" if seen.unit not in {"1", ""} else ""
    was = "cannot be seen" if before is None else f"is seen from {before:.3g}{unit}"
    sentence = f"To see {effect.name}: {best}. Today it {was}; with these patches from {useful[best]:.3g}{unit}."
    return MeasurementPlan(sentence, (*BASICS, *POOL[best]), gains)


def _noise_free(base: Fit, problem: Problem) -> Fit:
    from dataclasses import replace

    from lutgen.criticism.fit.linear import predict

    exact = problem.readings.with_light(problem.readings.xyz_cd_m2.copy())
    exact.xyz_cd_m2[problem.rows] = predict(problem, State(base.terms, base.tips, base.gains))
    return fit(replace(problem, readings=exact), base.terms, State((), base.tips, base.gains))


def _coverage(base: Fit, effects: Sequence[Effect]) -> MeasurementPlan:
    """Choose, set by set, what makes most of the effects visible that are not; a full session where all are."""
    seen = {each.effect: each for each in visibility(base, effects)}
    blind = {name for name, each in seen.items() if not each.visible}
    chosen: list[str] = []
    gains: dict[str, tuple[float | None, float | None]] = {}
    opened = {}
    for name, patches in POOL.items():
        after = visibility(_noise_free(base, with_patches(base.problem, patches)), effects)
        opened[name] = {each.effect for each in after if each.visible} & blind
    while blind:
        best = max(opened, key=lambda name: len(opened[name] & blind))
        if not opened[best] & blind:
            break
        gains[best] = (None, float(len(opened[best] & blind)))
        blind -= opened[best]
        chosen.append(best)
    if not chosen:
        chosen = ["nine greys", "ramps of red, green, blue", "secondaries", "mixtures"]
    opened_now = sorted({name for each in chosen for name in opened.get(each, set())})
    brings = f" They open: {', '.join(opened_now)}." if opened_now else ""
    sentence = f"For general coverage: {'; '.join(chosen)}.{brings}"
    return MeasurementPlan(sentence, (*BASICS, *(patch for name in chosen for patch in POOL[name])), gains)
