"""The error, the effects and the verdict as plain values for the page, from the library's results."""

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np

from lutgen.colorimetry import D65, Array, linear_to_code, xy_to_uv, xyz_to_linear, xyz_to_xyY
from lutgen.criticism.compare.comparison import Comparison
from lutgen.criticism.compare.slices import labels_of
from lutgen.criticism.diagnose import Diagnosis, parameters_of
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.refine import Refinement
from lutgen.criticism.search.candidates import STRONG
from lutgen.explore.opened import Opened
from lutgen.numerals import readable, times, with_error
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.rest import TIP_DRIVES
from lutgen.readings.table import TIP_NAMES
from lutgen.report.comparison import NAMES

#: Half the width of a parameter's 95 % interval, in standard errors.
INTERVAL = 1.96


def error_json(
    comparison: Comparison,
    opened: Opened,
    refinement: Refinement | None = None,
    *,
    provisional: bool = False,
    what_if: bool = False,
) -> dict[str, Any]:
    """Return the error of a model; ``refinement``: its fit, from which the support by the readings follows."""
    return {
        "provisional": provisional,
        "what_if": what_if,
        "noise_ratio": comparison.ratio,
        "mean_de2000": comparison.error.delta_e_mean,
        "noise_de2000": comparison.floor.delta_e_mean,
        "agrees": comparison.agrees,
        "sentence": _sentence(comparison),
        "effects": _fitted(comparison, opened, refinement),
        "slices": _slices(comparison),
        "readings": _readings(comparison),
        "drift": _drift(comparison),
    }


def _sentence(comparison: Comparison) -> str:
    """Return the sentence of ``lutgen compare`` on the error, without the numbers that the page shows separately."""
    fails = comparison.where and not comparison.agrees
    return comparison.direction.sentence() if fails else comparison.sentence()


def _fitted(comparison: Comparison, opened: Opened, refinement: Refinement | None) -> list[dict[str, Any]]:
    estimates = parameters_of(refinement.final) if refinement else {}
    support = _support(opened, refinement) if refinement else {}
    lines = []
    for term in comparison.terms:
        name, parameters = term.effect.name, []
        for key, parameter in term.effect.parameters.items():
            known = estimates.get(name, {}).get(key, {})
            if known and not known["free"]:
                continue
            value, stderr, (least, most) = float(term.values[key]), known.get("stderr"), parameter.bounds
            parameters.append(
                {
                    "name": key,
                    "words": parameter.meaning,
                    "value": value,
                    "fit": with_error(value, stderr, parameter.unit),
                    # Ends of the 95 % interval within the bounds.
                    "low": None if stderr is None else max(value - INTERVAL * stderr, least),
                    "high": None if stderr is None else min(value + INTERVAL * stderr, most),
                    "bounds": [float(least), float(most)],
                    "unit": parameter.unit,
                }
            )
        supported, why = support.get(name, (True, ""))
        given = name in opened.given
        lines.append({"name": name, "given": given, "parameters": parameters, "supported": supported, "said": why})
    return lines


def _support(opened: Opened, refinement: Refinement) -> dict[str, tuple[bool, str]]:
    """Return for each added effect, in turn, whether the readings support it, and the reason if not: BIC and error."""
    names = tuple(step.effect for step in refinement.steps)
    course = opened.course.sound(names)
    support, before, error = {}, course.base, refinement.before.ratio
    for place, step in enumerate(refinement.steps):
        fit = course.fit(names[: place + 1])
        gain, ratio = before.bic - fit.bic, step.comparison.ratio
        supported = bool(gain > STRONG and ratio < error)
        falls = f"BIC falls by {gain:.1f}, where {STRONG:g} is strong"
        why = f"{falls}; the error goes from {times(error)} to {times(ratio)}."
        support[step.effect] = supported, "" if supported else f"The readings do not support {step.effect}: {why}"
        before, error = fit, ratio
    return support


def _slices(comparison: Comparison) -> list[dict[str, Any]]:
    problem, dimensions = comparison.problem, []
    labels, judged = labels_of(problem), ~problem.is_anchor
    for by, of in labels.items():
        points = [
            {
                "at": _place(problem, by, each.slice, rows := np.flatnonzero(judged & (of == each.slice))),
                "label": each.slice,
                "ratio": each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0,
                "rows": rows.tolist(),
                "place": place,
            }
            for place, each in enumerate(each for each in comparison.where if each.by == by)
        ]
        if points:
            column = COLUMNS.get(by)
            unit = "h" if by == "hour" else column.unit if column else ""
            dimensions.append({"name": by, "label": NAMES.get(by, by), "unit": unit, "points": points})
    _put_within(dimensions, comparison.sizes[1])
    return dimensions


def _put_within(slices: Sequence[dict[str, Any]], sigma: Array) -> None:
    """Add to each point ``within``: the errors of all points over the readings that they share with this point.

    The page draws these errors when a user selects the point. ``sigma`` holds the errors of all readings in units of
    the noise, (n,).
    """
    points = [point for each in slices for point in each["points"]]
    member = np.array([np.isin(np.arange(sigma.size), point["rows"]) for point in points], dtype=np.float64)
    member = member.reshape(len(points), sigma.size)
    squares, counts = member @ (member * sigma**2).T, member @ member.T
    mean = squares / np.where(counts > 0, counts, np.nan)
    diagonal = np.diag(mean)
    # A point's error is in units of the point's own noise, for every subset of its readings.
    with np.errstate(invalid="ignore"):  # without any error the ratio is undefined
        ratio = np.array([point["ratio"] for point in points])[:, np.newaxis] * np.sqrt(mean / diagonal[:, np.newaxis])
    for place, point in enumerate(points):
        errors = iter(None if np.isnan(error) else round(error, 4) for error in ratio[:, place].tolist())
        point["within"] = {each["name"]: list(islice(errors, len(each["points"]))) for each in slices}


def _place(problem: Problem, by: str, label: str, rows: Any) -> float | str:
    """Return a slice's place on its axis: its hour, the mean of its column, or its name if it has no number."""
    if by == "hour":
        return float(problem.hours[problem.hour_of[rows[0]]])
    if by not in COLUMNS:
        return label
    values = problem.readings.column(by)[problem.rows][rows]
    return float(values.mean()) if np.isfinite(values).all() else label


def _readings(comparison: Comparison) -> list[dict[str, Any]]:
    problem = comparison.problem
    readings, rows = problem.readings, problem.rows
    delta_e, sigma = comparison.sizes
    measured, predicted = (_shown(problem, xyz) for xyz in (problem.xyz, comparison.predicted))
    columns = {
        "row": range(rows.size),
        "line": readings.lines[rows].tolist(),
        "patch": readings.drive[rows].tolist(),
        "hours": readings.hours[rows].tolist(),
        "measured": measured.tolist(),
        "predicted": predicted.tolist(),
        "de2000": np.round(delta_e, 4).tolist(),
        "sigma": np.round(sigma, 3).tolist(),
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _shown(problem: Problem, xyz: Array) -> Any:
    """Return code values 0..255 of light relative to the white of hour 0, which is shown as D65: (n, 3)."""
    linear = xyz_to_linear(xyz / problem.measured_tips[0, 0] * D65)
    return np.rint(255.0 * linear_to_code(np.clip(linear, 0.0, 1.0))).astype(int)


def _drift(comparison: Comparison) -> list[dict[str, Any]]:
    """Return measured and predicted chromaticity u'v' of white and primaries at each hour of their readings."""
    problem = comparison.problem
    tips = []
    for name, tip in zip(TIP_NAMES, TIP_DRIVES, strict=True):
        points = []
        for place, hour in enumerate(problem.hours):
            of_tip = problem.is_at_rest & (problem.hour_of == place) & (problem.drive == tip).all(axis=1)
            if of_tip.any():
                means = np.array([xyz[of_tip].mean(axis=0) for xyz in (problem.xyz, comparison.predicted)])
                uv = (xy_to_uv(xyz_to_xyY(mean)[:2]) for mean in means)
                points.append([float(hour), *(round(float(value), 6) for each in uv for value in each)])
        tips.append({"name": name, "points": points})
    return tips


def effects_json(opened: Opened, alone: Mapping[str, float | None], on: Sequence[str]) -> list[dict[str, Any]]:
    """Return the effects that a search under this baseline may choose, and the effects of the saved model."""
    seen, listed = opened.visibility(), []
    given = opened.given
    for name in (*given, *opened.choices):
        effect, each = opened.course.effects[name], seen.get(name)
        amplitude = effect.parameters.get(each.parameter) if each else None
        listed.append(
            {
                "name": name,
                "sentence": effect.summary,
                "sees_words": _sees(each) if each else "has it already",
                "sees_of": amplitude.meaning if amplitude and each and each.visible else "",
                "visible": bool(each and each.visible) or name in given,
                "alone_noise": alone.get(name),
                "tried": name in alone or name in given,
                "on": name in on or name in given,
                "given": name in given,
                "own": effect.origin != "built-in",
            }
        )
    return listed


def _sees(each: Any) -> str:
    """Return an effect's smallest size that these readings can detect, as text."""
    if not each.visible:
        return "cannot"
    if each.smallest_detectable is None:
        return "any size"
    size = readable(each.smallest_detectable, 3)
    return size if each.unit in {"1", ""} else f"{size} {each.unit}"


def verdict_json(diagnosis: Diagnosis, opened: Opened) -> dict[str, Any]:
    """Return the verdict's sentence, the effects that it adds to the model, their rivals, and the next measurements."""
    verdict = diagnosis.verdict
    # Of effects that these readings do not distinguish, only the likeliest is added.
    added = [step.name for step in diagnosis.explanation.steps if step.name in verdict.effects]
    return {
        "name": verdict.name,
        "sentence": verdict.sentence,
        "effects": list(opened.in_order(added)),
        "rivals": [list(each) for each in verdict.rivals],
        "remarks": list(verdict.remarks),
        "next": " ".join(f"To tell {' from '.join(each.separates)}: {each.name}." for each in diagnosis.measure_next),
    }
