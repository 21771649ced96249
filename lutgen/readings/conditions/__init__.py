"""Conditions under which a reading is taken: one file for each condition. Every file in this folder is registered.

A file declares one ``CONDITION``: its columns with unit, range and the meaning of a blank cell; the span of values that
count as rest; its words in tables and sentences; and its variation in a measurement plan. The readers and checks of
tables, rest, tables of errors, ``--at``, plans, effects and plots use this registry.
"""

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
