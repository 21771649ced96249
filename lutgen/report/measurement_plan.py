"""The page of ``lutgen plan``: the patches to measure next, and what each set of them would show."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby

from lutgen.criticism.plan import MeasurementPlan
from lutgen.criticism.search.separate import Patch
from lutgen.numerals import readable
from lutgen.readings.conditions import COLUMNS, OF_COLUMN
from lutgen.report.parts import Headline, Part, Table

#: Purpose of a plan → headings of each set's two numbers: with the present readings, and with the set added.
GAINS = {
    "between": ("χ² between them today", "with this set"),
    "effect": ("detectable from today", "with this set"),
    "coverage": ("", "effects that it opens"),
}


def plan_page(plan: MeasurementPlan, kind: str, written: Sequence[str]) -> Iterator[Part]:
    """Yield what ``lutgen plan`` prints; ``kind`` is a key of ``GAINS``."""
    yield Headline(plan.sentence)
    if not plan.patches:
        return
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
    """Return a table of the patches. Neighbours that differ in at most one condition share a row."""
    # Patches under the same conditions: the first of them, and how often each code is read.
    runs = (list(run) for _, run in groupby(patches, _row_key))
    groups = [(run[0], Counter(patch.code for patch in run)) for run in runs]
    rows = []
    # Neighbouring groups share a row if they have the same code values under other values of the same conditions.
    for (codes, _, note), row in groupby(groups, lambda group: (group[1], [*group[0].conditions], group[0].note)):
        firsts = [first for first, _ in row]
        conditions = [*_conditions(firsts), *([note] if note else [])]
        listed = []
        for code, count in codes.items():
            text = f"{code[0]:g}" if len(set(code)) == 1 else ",".join(f"{value:g}" for value in code)
            listed.append(f"{text} ×{count}" if count > 1 else text)
        rows.append((str(len(firsts) * codes.total()), ", ".join(conditions), "  ".join(listed)))
    return Table(("readings", "conditions", "R, G, B"), rows, words=range(3))


def _row_key(patch: Patch) -> tuple[object, ...]:
    """Return what the patches of a row have in common: conditions, note, and kind (pure, grey, ramp, mixture)."""
    lit = sum(value > 0 for value in patch.code)
    pure = set(patch.code) <= {0.0, 1.0} and lit in {0, 1, 3}
    kind = "pure" if pure else "grey" if len(set(patch.code)) == 1 else "ramp" if lit == 1 else "mixture"
    return tuple(patch.conditions.items()), patch.note, "" if patch.conditions else kind


def _conditions(patches: Sequence[Patch]) -> list[str]:
    values = [patch.conditions for patch in patches]
    names = [*values[0]]
    if len(values) > 1 and len(names) > len({OF_COLUMN[name].key for name in names}) == 1:
        return [f"{','.join(names)} = " + " ".join(",".join(f"{each[name]:g}" for name in names) for each in values)]
    listed = {name: ", ".join(dict.fromkeys(f"{each[name]:g}" for each in values)) for name in values[0]}
    units = {name: COLUMNS[name].unit for name in listed}
    return [f"{text} {units[name]}" if units[name] else f"{name} {text}" for name, text in listed.items()]


def _gain_table(plan: MeasurementPlan, kind: str) -> Table:
    """Return a table of the gain of each set, without sets that have no gain."""
    before, after = GAINS[kind]
    rows = []
    for name, (today, with_set) in plan.gains.items():
        cells = ["not at all" if each is None else readable(each, 3) for each in (today, with_set)]
        if cells[0] != cells[1]:
            rows.append((name, *(cells if before else cells[1:])))
    return Table(("set", before, after) if before else ("set", after), rows)
