"""The pages of ``lutgen diagnose`` and ``refine``: the verdict, the fitted effects, what would refute the verdict."""

from collections.abc import Iterator, Mapping
from math import ceil
from typing import Any

import numpy as np

from lutgen.criticism.diagnose import Diagnosis, Ranked, candidates, parameters_of
from lutgen.criticism.refine import Refinement
from lutgen.criticism.search.separate import Separation
from lutgen.criticism.verdict.black import CAUSES
from lutgen.criticism.verdict.visibility import Visibility, relative_size, typical_size, with_steady_zero
from lutgen.effects import Effect
from lutgen.effects.shapes import is_knot
from lutgen.errors import listed
from lutgen.numerals import percent, readable, times, with_error
from lutgen.readings import Measurements
from lutgen.readings.table import is_capped, is_shrouded, says_cap, says_shroud
from lutgen.report.comparison import data_line, fresh_lines, from_own_model
from lutgen.report.effect_sketch import STUB_FILE, STUB_NAME, sketch
from lutgen.report.parts import Code, Headline, Part, Table

#: Most rows of the ranking, and most parameters in a row.
RANKED, LISTED = 6, 2

#: χ² that separates two rivals clearly, and the largest number of repetitions of a set that is proposed.
CLEARLY, TOO_OFTEN = 20.0, 10

#: A steady zero of the meter is mentioned if it makes a leak detectable at less than this share of the size.
LESS_HIDDEN = 0.9


def diagnose_page(
    diagnosis: Diagnosis, effects: Mapping[str, Effect], again: str, stub: str | None = None, *, verbose: bool = False
) -> Iterator[Part]:
    """Yield what ``lutgen diagnose`` prints; ``again``: DATA and options as the next command repeats them."""
    verdict = diagnosis.verdict
    yield Headline(f"{verdict.name}: {verdict.sentence}")
    before = diagnosis.comparison
    yield _error(diagnosis)
    if _is_fitted(diagnosis):
        after = diagnosis.after
        yield (
            f"With {listed(each.name for each in diagnosis.explanation.steps)}: mean ΔE2000 "
            f"{after.error.delta_e_mean:.2f}, from {times(before.ratio)} to {times(after.ratio)} the noise."
        )
    yield from _advice(diagnosis, again, stub)
    if _is_fitted(diagnosis):
        yield ""
        yield parameter_table(parameters_of(diagnosis.explanation.final), effects)
    rivals = [f"These data cannot tell apart: {listed(each)}." for each in verdict.rivals]
    rivals += [_separation(each, again) for each in diagnosis.measure_next]
    remarks = () if verdict.name == "unexplained" else verdict.remarks
    for part in (rivals, remarks, _refutation(diagnosis, effects)):
        if part:
            yield ""
            yield from part
    yield ""
    yield data_line(diagnosis.problem)
    if before.first_session and before.first_session.is_another:
        yield from fresh_lines(before)
    yield ""
    yield (
        "Smallest detectable size of each effect: a diagnosis finds an effect of this size in nine of ten such "
        "campaigns."
    )
    yield visibility_table(diagnosis.visibility, effects, verbose=verbose)
    yield from _hidden_by_zero(diagnosis, effects)
    if verbose:
        yield (
            "Each detectable size allows for the hidden share: a precise meter may show an effect of which more than "
            "99 % is hidden."
        )
    if verbose and diagnosis.ranking:
        yield ""
        base = diagnosis.explanation.base
        # The root mean square of a fit's residuals from noise alone: below 1, as free parameters fit noise.
        rms = (base.freedom * diagnosis.error.variance / base.readings) ** 0.5
        yield f"Each effect alone, fitted with white and primaries, best first (noise: {rms:.2f} σ):"
        yield _ranking_table(diagnosis.ranking, effects)
        yield from _held_out_lines(diagnosis.ranking)
    if not verbose:
        yield "--verbose also prints the fit of each effect alone."


def _hidden_by_zero(diagnosis: Diagnosis, effects: Mapping[str, Effect]) -> Iterator[str]:
    """Say from which size a leak of black would be detectable if the meter's zero were the same in all sessions."""
    base, name = diagnosis.explanation.base, "black-level"
    seen = [each for each in diagnosis.visibility if each.effect == name and each.visible]
    if not seen or not base.problem.offset_cd_m2:
        return
    (effect,) = candidates({name: effects[name]}, base.problem.baseline, ())
    steady = with_steady_zero(base, effect).smallest_detectable
    if steady is not None and steady < LESS_HIDDEN * (seen[0].smallest_detectable or 0.0):
        zero = f"{readable(base.problem.offset_cd_m2, 2)} cd/m²"
        yield (
            f"The zero of the meter differs between sessions (1 σ: {zero}). With a steady zero, {name} would be "
            f"detectable from {readable(steady, 3)}."
        )


def visibility_table(seen: tuple[Visibility, ...], effects: Mapping[str, Effect], *, verbose: bool = True) -> Table:
    """Return a table of each effect's smallest detectable size, the most visible effect first."""
    rows = []
    ordered = sorted(seen, key=lambda each: (not each.visible, relative_size(each, effects) or 0.0))
    for each in ordered:
        unit = f" {each.unit}" if each.unit not in {"1", ""} else ""
        size = f"{readable(each.smallest_detectable, 3)}{unit}" if each.smallest_detectable is not None else "any"
        known = each.parameter in effects[each.effect].parameters
        usual = typical_size(effects[each.effect], each.parameter) if known else 0.0
        typical = f"{readable(usual, 3)}{unit}" if usual else "–"
        seen_from = size if each.visible else "cannot be seen"
        rows.append((each.effect, seen_from, typical, each.parameter, percent(each.absorbed)))
    headings = ("effect", "detectable from", "typical", "parameter", "hidden by re-measured white and primaries")
    faint = [n for n, each in enumerate(ordered) if not each.visible]
    count = len(headings) if verbose else 3
    return Table(headings[:count], [row[:count] for row in rows], words=(0, 3)[: 2 if verbose else 1], faint=faint)


def parameter_table(parameters: Mapping[str, Mapping[str, Mapping[str, Any]]], effects: Mapping[str, Effect]) -> Table:
    """Return a table of every fitted parameter ± its standard error, and its meaning."""
    rows = []
    for name, values in parameters.items():
        shown = name
        for key, each in values.items():
            if each["free"]:
                estimate = estimate_in_words(each, effects[name], key)
                rows.append((shown, key, estimate, effects[name].parameters[key].meaning))
                shown = ""
        if shown:
            rows.append((shown, "–", "on", effects[name].summary))
    return Table(("effect", "parameter", "value", "what it is"), rows, words=(0, 1, 3))


def estimate_in_words(estimate: Mapping[str, Any], effect: Effect, name: str) -> str:
    """Return value ± standard error with its unit; mark a value at its bound, or not determined by the readings."""
    text = with_error(estimate["value"], estimate["stderr"], estimate["unit"])
    if estimate["at_bound"]:
        return f"{text}, at its bound"
    searched = bool(effect.parameters[name].grid)
    return f"{text}, not determined" if estimate["free"] and estimate["stderr"] is None and not searched else text


def _ranking_table(ranking: tuple[Ranked, ...], effects: Mapping[str, Effect]) -> Table:
    rows = [
        (
            each.effect,
            f"{each.delta_bic:.0f}",
            f"{each.rms_sigma:.2f}",
            "–" if (held := each.held_out_rms_sigma) is None else f"{held:.2f}" if held < 1000 else readable(held, 3),
            percent(each.explained),
            _in_short(each, effects[each.effect]),
        )
        for each in ranking[:RANKED]
    ]
    return Table(("effect", "ΔBIC", "rms σ", "held out", "explains", "parameters"), rows, words=(0, 5))


def _held_out_lines(ranking: tuple[Ranked, ...]) -> Iterator[str]:
    """Yield lines on the meaning of "held out", and on the groups of readings that are left out for each effect."""
    counted = [each for each in ranking[:RANKED] if each.held_out_cells is not None]
    if not counted:
        return
    yield (
        f"Held out: error of readings that are withheld from the fit, one group at a time (a colour family or a "
        f"condition of one hour, or a session; {counted[0].held_out_cells} groups)."
    )
    without = [f"{each.held_out_left_out} for {each.effect}" for each in counted if each.held_out_left_out]
    if without:
        yield f"Groups that cannot be held out, since only they determine a parameter: {', '.join(without)}."
    else:
        yield "Every group was held out: no parameter is determined by only one group."


def _in_short(each: Ranked, effect: Effect) -> str:
    """Return the first free parameters as text; all knots of a level curve count as one parameter."""
    plain = [name for name in each.form if not is_knot(name)]
    words = [f"{name} {estimate_in_words(each.parameters[name], effect, name)}" for name in plain[:LISTED]]
    more = len(plain) - LISTED
    words += [f"{more} more"] if more > 0 else []
    knots = len(each.form) - len(plain)
    return ", ".join([*words, *([f"a curve of {knots} levels"] if knots else [])]) or "on"


def _separation(each: Separation, again: str) -> str:
    """Return which readings, repeated how often, separate two rivals, or why no readings of one session do."""
    first, second = each.separates
    if each.before > CLEARLY:
        return (
            f"The formulas of {first} and {second} differ on these readings by a χ² of {each.before:.0f}, but neither "
            f"is exact: either may be the cause."
        )
    repetitions, gain = _repetitions(each), each.after - each.before
    if repetitions > TOO_OFTEN:
        return (
            f"{second} would explain these readings almost as well as {first}. Nothing in one more session would tell "
            f"the two apart, but within the range of these readings both give the same LUTs."
        )
    often = f", read {repetitions} times," if repetitions > 1 else ""
    return (
        f"To tell {first} from {second}: {each.name}. {len(each.patches)} readings{often} raise the χ² between them "
        f"from {each.before:.3g} to {each.before + repetitions * gain:.3g} ({CLEARLY:g} is clear).\n"
        f"  lutgen plan {again} --between {first},{second} -o plan.csv"
    )


def _repetitions(each: Separation) -> int:
    """Return how often the readings must be repeated to separate two rivals; above ``TOO_OFTEN``: nothing does."""
    gain = each.after - each.before
    return ceil(max(CLEARLY - each.before, 1.0) / gain) if gain > 0 else TOO_OFTEN + 1


def _error(diagnosis: Diagnosis) -> str:
    """Return the sentence on the error of the model without the effects; it does not contradict the verdict."""
    before, verdict = diagnosis.comparison, diagnosis.verdict
    sentence, error, floor = before.sentence(), before.error, before.floor
    if verdict.name == "consistent" and not before.agrees:
        shared = ["the meter's dark offset", "the meter's gain"]
        if diagnosis.problem.native:
            shared.append("the errors of the display's own model")
        # Weights of a Student t: the noise of these readings has heavy tails.
        few = " Readings far from the others count less." if diagnosis.problem.weights is not None else ""
        return (
            f"The readings differ from the model by {times(before.ratio)} the noise of single readings (mean ΔE2000 "
            f"{error.delta_e_mean:.2f} where this noise alone gives {floor.delta_e_mean:.2f}). Errors that many "
            f"readings share explain the difference: {listed(shared)}.{few}"
        )
    if before.agrees and verdict.name not in {"consistent", "measurement-problem"}:
        is_of_black = verdict.effects and not _is_fitted(diagnosis)
        what = _IF_ZERO if is_of_black else "All readings together hardly show it"
        sentence = (
            f"{what}: {times(before.ratio)} the noise, mean ΔE2000 {error.delta_e_mean:.2f} where noise alone gives "
            f"{floor.delta_e_mean:.2f}."
        )
    # No named effect shows in the mean: single readings may show it all the same.
    if verdict.effects and not any(verdict.shares_delta_e.values()) and error.delta_e_max > floor.delta_e_max:
        largest = f"The largest error of a reading is {error.delta_e_max:.2f} (noise: {floor.delta_e_max:.2f})."
        sentence = f"{sentence} {largest}"
    return sentence


def _is_fitted(diagnosis: Diagnosis) -> bool:
    """Whether the verdict names fitted effects. Effects that only the blacks of sessions suggest are not fitted."""
    return bool(diagnosis.verdict.effects and diagnosis.explanation.steps)


#: The error of blacks that differ between sessions: the fit takes the difference as an error of the meter.
_IF_ZERO = "If the zero of the meter makes the blacks differ, the readings agree with the model"


def _refutation(diagnosis: Diagnosis, effects: Mapping[str, Effect]) -> list[str]:
    """Return the observations that would refute the verdict."""
    verdict = diagnosis.verdict
    lines = []
    for name in verdict.effects[:1] if verdict.name == "one-of" else verdict.effects:
        confused = effects[name].confused_with or {}
        others = [(other, how) for other, how in confused.items() if other not in verdict.effects]
        # Name at most three rivals of an effect, and nothing that these readings already hold.
        others = [each for each in others if not _is_held(each[1], diagnosis.problem.readings)][:3]
        of = f" in place of {name}" if len(verdict.effects) > 1 else ""
        lines += [f"  to rule out {other}{of}: {how}" for other, how in others]
    if verdict.effects:
        lines.append("  a new session that the refined model misses by more than the noise (compare NEW.csv --model …)")
    if verdict.name in _REFUTES:
        lines.append(f"  {_REFUTES[verdict.name]}")
    return ["What would refute this:", *lines] if lines else []


def _is_held(how: str, readings: Measurements) -> bool:
    """Whether several sessions hold the readings that ``how`` asks for, with a capped lens or behind a shroud."""
    asked = is_capped(readings) if says_cap(how) else is_shrouded(readings) if says_shroud(how) else None
    return asked is not None and np.unique(readings.hours[asked]).size > 1


#: Verdict → the observation that would refute it.
_REFUTES = {
    "consistent": "readings of another kind: effects that these readings cannot show are not excluded",
    "unexplained": "an effect of your own, with which nothing but noise is left",
    "measurement-problem": "the same readings again, with the same result",
}


def _advice(diagnosis: Diagnosis, again: str, stub_file: str | None) -> Iterator[Part]:
    """Yield what to do next; for the verdict ``unexplained``, first the remarks on possible faults of the readings."""
    verdict = diagnosis.verdict
    own = from_own_model(diagnosis.comparison, again) if verdict.name != "consistent" else ""
    if own:
        first = "This display differs from sRGB in its first session already."
        yield f"{first} Start from its own model:  lutgen diagnose {own}"
    if verdict.name == "unexplained" and verdict.remarks:
        yield from ("", *verdict.remarks, "")
    if not own or stub_file or verdict.name != "unexplained":
        yield from _next(diagnosis, again, stub_file)


def _next(diagnosis: Diagnosis, again: str, stub_file: str | None) -> Iterator[Part]:
    verdict = diagnosis.verdict
    if verdict.name == "unexplained":
        file = stub_file or STUB_FILE
        if stub_file:
            yield f"An effect of your own to start from: {stub_file}"
        else:
            yield f"An effect of your own to start from (--stub {STUB_FILE} writes it):"
            yield ""
            yield Code(sketch(diagnosis))
            yield f"Next, write the file and edit it:  lutgen diagnose {again} --stub {file}"
        yield f"{'Next' if stub_file else 'Then'}:  lutgen refine {again} --effects {file} --add {STUB_NAME}"
    elif verdict.name == "measurement-problem":
        yield "Next: measure again, or correct the file. Do not add an effect to the model yet."
    elif verdict.name == "consistent":
        yield f"Next, what to measure to see more:  lutgen plan {again} -o plan.csv"
    elif verdict.effects == CAUSES and not _is_fitted(diagnosis):
        yield f"Next: read black with the lens capped in every session, then  lutgen diagnose {again}"
        yield f"What else changed between the sessions:  lutgen sessions explain {again.partition(' --')[0]}"
    elif len(verdict.rivals) == 1 and verdict.name == "one-of":
        likeliest = f"lutgen refine {again} --add {verdict.effects[0]} -o my-display.toml"
        tests = [each for each in diagnosis.measure_next if each.before <= CLEARLY and _repetitions(each) <= TOO_OFTEN]
        yield f"Next, {'measure what separates them; or ' if tests else ''}go on with the likeliest:  {likeliest}"
    else:
        # Effects of one-of without rivals were fitted together: the cause is uncertain, not the light that they give.
        is_joint = verdict.name == "one-of" and len(verdict.effects) > 1
        how = ", add them together, since one alone fits these readings worse" if is_joint else ""
        yield f"Next{how}:  lutgen refine {again} --add {','.join(verdict.effects)} -o my-display.toml"


def refine_page(refinement: Refinement, effects: Mapping[str, Effect], data: str, model: str | None) -> Iterator[Part]:
    """Yield what ``lutgen refine`` prints; ``data`` is DATA quoted for a shell, ``model`` the model file written."""
    yield Headline(refinement.sentence())
    if refinement.diagnosis:
        verdict = refinement.diagnosis.verdict
        yield f"Verdict: {verdict.name}: {verdict.sentence}"
    problem = refinement.final.problem
    yield data_line(problem)
    contradicted = np.setdiff1d(np.arange(problem.readings.hours.size), [*problem.rows, *problem.noise.outliers])
    if contradicted.size:
        places = problem.readings.places(contradicted.tolist())
        yield f"Left out of the fit, because other readings contradict them: {places}."
    yield ""
    yield _steps_table(refinement)
    if refinement.final.terms:
        yield ""
        yield parameter_table(parameters_of(refinement.final), effects)
        yield ""
        yield from refinement.carried() or ["LUTs of this model carry all its effects."]
    yield ""
    if not refinement.after.agrees and not refinement.diagnosis:
        keep = "" if refinement.improves else " --keep"
        first = "Next" if model else f"Write the model (-o MODEL.toml{keep}), then"
        yield f"Part of the error remains unexplained. {first}:  lutgen diagnose {data} --model {model or 'MODEL.toml'}"
    if model:
        last = f"{float(problem.hours[-1]):g}"
        yield f"Model written: {model}. Bake it:  lutgen build --model {model} --hours 0..{last} -o aged/"
    elif refinement.improves:
        yield "No model was written: -o MODEL.toml writes it."


def _steps_table(refinement: Refinement) -> Table:
    terms = ", ".join(term.effect.name for term in refinement.before.terms)
    bare = "the display's own model" if refinement.before.problem.native else "the paper's model"
    stages = {
        f"the model with {terms}" if terms else bare: refinement.before,
        **{f"+ {step.effect}": step.comparison for step in refinement.steps},
    }
    rows = [
        (name, f"{each.error.delta_e_mean:.3f}", f"{each.floor.delta_e_mean:.3f}", times(each.ratio))
        for name, each in stages.items()
    ]
    return Table(("model", "mean ΔE2000", "noise alone", "× the noise"), rows)
