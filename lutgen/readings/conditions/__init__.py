"""Conditions under which a reading is taken: one file each, found by being in this folder.

A file declares one ``CONDITION``: its columns with unit, range and the meaning of a blank cell, how far from rest a
value may lie, its words in tables and sentences, and how a plan varies it. Whatever knows conditions (reading and
checking tables, rest, tables of errors, ``--at``, plans, effects, plots) asks this registry.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from lutgen.readings.conditions.declare import Column, Condition, Variation

__all__ = ["COLUMNS", "CONDITIONS", "Column", "Condition", "Variation"]

#: Every condition, in the order of tables.
CONDITIONS: tuple[Condition, ...] = tuple(
    sorted(
        (
            import_module(f"{__name__}.{module.name}").CONDITION
            for module in iter_modules(__path__)
            if module.name != "declare"
        ),
        key=lambda condition: condition.place,
    )
)

#: Every column by its name, in the order of tables.
COLUMNS: dict[str, Column] = {column.name: column for condition in CONDITIONS for column in condition.columns}
