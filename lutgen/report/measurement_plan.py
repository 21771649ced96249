"""The page of ``lutgen plan``: which patches to measure, and how much each set of them adds to the readings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.numerals import readable
from lutgen.readings.conditions import COLUMNS
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.criticism.plan import MeasurementPlan
    from lutgen.criticism.separate import Patch

#: Purpose of a plan → headings of the two numbers of each set: with the readings of today, and with the set.
GAINS = {
    "between": ("χ² between them today", "with this set"),
    "effect": ("seen from today", "with this set"),
    "coverage": ("", "effects that it opens"),
}


def plan_page(plan: MeasurementPlan, kind: str, written: Sequence[str]) -> Iterator[Part]:
    """Yield what ``lutgen plan`` prints; ``kind`` is a key of ``GAINS``."""
    yield Headline(plan.sentence)
    yield ""
    yield f"{len(plan.patches)} readings, in this order:"
    yield _patch_table(plan.patches)
    if plan.gains:
        yield ""
        yield _gain_table(plan, kind)
    yield ""
    yield from [f"Written: {path}" for path in written] or ["-o PLAN.csv writes the list to be filled in."]
    if any(path.endswith(".ti1") for path in written) and any(patch.conditions for patch in plan.patches):
        yield "A .ti1 holds code values alone: position, room light, minutes, temperature and window are in the .csv."


def _patch_table(patches: Sequence[Patch]) -> Table:
    """Tabulate the patches; neighbours share a row when they differ in one condition at most."""
    rows = []
    for group in _joined(list(_grouped(patches))):
        codes = group[0][1]
        first = group[0][0]
        conditions = [*_conditions([patch for patch, _ in group]), *([first.note] if first.note else [])]
        count = len(group) * sum(codes.values())
        rows.append((str(count), ", ".join(conditions), "  ".join(_coded(code, n) for code, n in codes.items())))
    return Table(("readings", "conditions", "R, G, B"), rows, words=range(3))


#: Patches under the same conditions: the first of them, and how often each code is read.
_Group = tuple["Patch", dict[tuple[float, float, float], int]]


def _grouped(patches: Sequence[Patch]) -> Iterator[_Group]:
    first: Patch | None = None
    codes: dict[tuple[float, float, float], int] = {}
    for patch in patches:
        if first is not None and _row_key(patch) != _row_key(first):
            yield first, codes
            first, codes = None, {}
        first = first or patch
        codes[patch.code] = codes.get(patch.code, 0) + 1
    if first is not None:
        yield first, codes


def _row_key(patch: Patch) -> tuple[object, ...]:
    """Return what patches of one row have in common: conditions, note, and kind (pure, grey, ramp, mixture)."""
    lit = sum(value > 0 for value in patch.code)
    pure = set(patch.code) <= {0.0, 1.0} and lit in {0, 1, 3}
    kind = "pure" if pure else "grey" if len(set(patch.code)) == 1 else "ramp" if lit == 1 else "mixture"
    return tuple(patch.conditions.items()), patch.note, "" if patch.conditions else kind


def _joined(groups: Sequence[_Group]) -> Iterator[list[_Group]]:
    """Join neighbouring groups that have the same code values under other values of the same conditions."""
    run: list[_Group] = []
    for group in groups:
        if run and (group[1], [*group[0].conditions], group[0].note) != (
            run[0][1],
            [*run[0][0].conditions],
            run[0][0].note,
        ):
            yield run
            run = []
        run.append(group)
    yield run


def _conditions(patches: Sequence[Patch]) -> list[str]:
    values = [patch.conditions for patch in patches]
    if len(values) > 1 and [*values[0]] == ["u", "v"]:
        return ["u,v = " + " ".join(f"{each['u']:g},{each['v']:g}" for each in values)]
    listed = {name: ", ".join(dict.fromkeys(f"{each[name]:g}" for each in values)) for name in values[0]}
    return [" ".join(filter(None, (_before(name), text, COLUMNS[name].unit))) for name, text in listed.items()]


def _before(name: str) -> str:
    """The column's name, where no unit tells what its values are."""
    return "" if COLUMNS[name].unit else name


def _coded(code: tuple[float, float, float], times: int) -> str:
    text = f"{code[0]:g}" if code[0] == code[1] == code[2] else ",".join(f"{value:g}" for value in code)
    return f"{text} ×{times}" if times > 1 else text


def _gain_table(plan: MeasurementPlan, kind: str) -> Table:
    """Tabulate what each set adds, without the sets that add nothing."""
    before, after = GAINS[kind]
    rows = []
    for name, (today, then) in plan.gains.items():
        cells = ["not at all" if each is None else readable(each, 3) for each in (today, then)]
        if cells[0] != cells[1]:
            rows.append((name, *(cells if before else cells[1:])))
    return Table(("set", before, after) if before else ("set", after), rows)
