"""The tables of an analysis as CSV, a file a table: a column a number, intervals in two."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from lutgen.study.analysis import Analysis

#: Files that ``--csv`` may write; a table without rows is left out.
FILES = (
    "table2.csv",
    "table2-tests.csv",
    "table3.csv",
    "table4.csv",
    "beyond-means.csv",
    "beyond-agreement.csv",
    "beyond-kappa.csv",
    "beyond-mixed.csv",
    "beyond-holm.csv",
)


def tables_csv(found: Analysis) -> dict[str, str]:
    """Return name → text of every table that has rows; the first line says where the figures come from."""
    rows: tuple[Iterable[Mapping[str, Any]], ...] = (
        map(asdict, found.table2.means),
        map(asdict, found.table2.tests),
        map(asdict, found.table3),
        map(asdict, found.table4),
        map(asdict, found.means),
        map(asdict, found.agreement),
        map(asdict, found.kappas),
        [
            {"measure": model.measure, "effect": model.effect, "against": model.against, "n": model.n, **asdict(each)}
            for model in found.mixed
            for each in model.effects
        ],
        map(asdict, found.holm),
    )
    flat = {name: [dict(_flat(row)) for row in table] for name, table in zip(FILES, rows, strict=True)}
    return {name: _text(table, found.sources) for name, table in flat.items() if table}


def _flat(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Lay out a row: intervals as ``…_low`` and ``…_high``, McNemar's test in columns of its own."""
    for name, value in row.items():
        if name == "mcnemar":
            for part in ("pairs", "first_only", "second_only", "p"):
                yield f"mcnemar_{part}", "" if value is None else value[part]
        elif isinstance(value, tuple):
            yield f"{name}_low", value[0]
            yield f"{name}_high", value[1]
        else:
            yield name, value


def _text(rows: list[dict[str, Any]], sources: Iterable[str]) -> str:
    text = io.StringIO()
    text.write(f"# {' '.join(sources)}\n")
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    """Write twelve figures, which no last bit of another processor reaches; nothing for what is not finite."""
    if not isinstance(value, float):
        return value
    return f"{value:.12g}" if isfinite(value) else ""
