"""The page of ``lutgen compare``: how large the error of a model is compared with the noise, and where it is large."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.compare import CLEAR
from lutgen.criticism.families import dimension
from lutgen.criticism.standing_out import over_noise, standing_out
from lutgen.numerals import spaced
from lutgen.readings.conditions import CONDITIONS
from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.criticism.compare import Comparison, Slice
    from lutgen.criticism.problem import Problem
    from lutgen.report.parts import Part

#: Rows of the tables: slices that stand out, and single readings.
SLICES, READINGS = 12, 5

#: Name of each dimension of slices in a table.
NAMES = {"hour": "hour", "level": "code value", "family": "patch"} | {
    dimension(each): each.heading for each in CONDITIONS if each.heading
}


def compare_page(comparison: Comparison, again: str = "") -> Iterator[Part]:
    """Yield what ``lutgen compare`` prints; ``again`` are the arguments with which ``lutgen diagnose`` goes on."""
    yield comparison.sentence()
    yield data_line(comparison.problem)
    yield from fresh_lines(comparison)
    if not comparison.where:
        return
    yield ""
    yield error_table(comparison)
    yield ""
    noticed = standing_out(comparison)
    if noticed:
        yield f"Where it stands out, worst first ({CLEAR:g} × noise is clear):"
        yield _slice_table(noticed[:SLICES])
    else:
        yield "No hour, colour or condition stands out from the others."
    yield ""
    yield "The worst readings:"
    yield _worst_table(comparison)
    if again and noticed:
        yield ""
        yield f"Which effect is missing:  lutgen diagnose {again}"


def fresh_lines(comparison: Comparison) -> Iterator[str]:
    """Say how well the model predicts the first session: sRGB's curves, and the display's own model if it is used."""
    first, native = comparison.first_session, comparison.problem.native
    if first:
        hint = " Start from its own: --baseline native." if first.is_another and not native else ""
        yield first.sentence() + hint
        if first.own is not None:
            yield f"Its own model: mean ΔE2000 {first.own:.2f} on mixtures held out."
            yield from (f"  {said}" for said in first.rungs)
    if native:
        yield from native.remarks
    if comparison.problem.discrepancy:
        yield comparison.problem.discrepancy.sentence()


def data_line(problem: Problem) -> str:
    """Count the readings, and name their hours, their noise and their source."""
    readings, noise = problem.readings, problem.noise
    hours = problem.hours
    known = {
        "replicates": "as replicates show",
        "instrument": "as stated",
        "assumed": "ASSUMED: there are no replicates",
    }
    out = readings.hours.size - problem.rows.size
    left_out = f" ({out} left out)" if out else ""
    span = f"at {hours.size} hours up to {spaced(float(hours[-1]))} h" if hours.size > 1 else f"at {hours[0]:g} h"
    return (
        f"{readings.hours.size} readings{left_out} {span}; baseline {problem.baseline}; noise of a reading "
        f"{100 * noise.relative:.2g} % and {noise.floor_cd_m2:.2g} cd/m², {known[noise.source]}.\n"
        f"{readings.provenance}"
    )


def error_table(comparison: Comparison) -> Table:
    """Tabulate the errors, the errors that noise alone gives, and the ratio of the two."""
    quantities = {
        "mean ΔE2000": "delta_e_mean",
        "95 % of readings below": "delta_e_p95",
        "largest": "delta_e_max",
        "root mean square in σ": "rms_sigma",
    }
    rows = []
    for name, key in quantities.items():
        error, floor = getattr(comparison.error, key), getattr(comparison.floor, key)
        rows.append((name, f"{error:.3f}", f"{floor:.3f}", f"{error / floor:.2f} ×" if floor else "–"))
    return Table(("", "error", "noise alone", "ratio"), rows)


def _slice_table(slices: list[Slice]) -> Table:
    rows = [
        (
            NAMES[each.by],
            each.slice,
            str(each.n),
            f"{each.delta_e_mean:.2f}",
            f"{each.floor_delta_e_mean:.2f}",
            f"{each.rms_sigma:.2f}",
            f"{each.floor_rms_sigma:.2f}",
            f"{over_noise(each):.2f} ×",
        )
        for each in slices
    ]
    clear = [number for number, each in enumerate(slices) if over_noise(each) > CLEAR]
    headings = ("by", "where", "readings", "mean ΔE2000", "noise alone", "rms σ", "noise alone", "ratio")
    return Table(headings, rows, words=range(2), strong=clear)


def _worst_table(comparison: Comparison) -> Table:
    rows = [
        (
            str(each.line),
            spaced(each.hour),
            ", ".join(f"{value:g}" for value in each.code),
            _conditions(comparison.problem, each.line),
            f"{each.delta_e:.2f}",
            f"{each.sigma:.1f}",
        )
        for each in comparison.worst[:READINGS]
    ]
    return Table(("line", "hour", "R, G, B", "conditions", "ΔE2000", "σ"), rows, words=range(4))


def _conditions(problem: Problem, line: int) -> str:
    """List the conditions of a reading that differ from rest: position, room light, window, minutes, note."""
    readings = problem.readings
    row = int((readings.lines == line).argmax())
    unusual = []
    for condition in CONDITIONS:
        away = readings.rest.away.get(condition.cell)
        if away is not None and away[row]:
            unusual.append(condition.short.format(*(readings.column(each.name)[row] for each in condition.columns)))
    note = readings.note[row] if readings.note else ""
    return ", ".join([*unusual, *([note] if note else [])])
