"""Causes of a difference between two sessions, one a file in this folder; adding a cause is adding a file.

A module has one ``CAUSE``, which declares what the cause moves and what it leaves, how it changes white, primaries and
black, what proves it, and with which changes it may be confused; a module whose name begins with an underscore is no
cause. Verdicts are weighed from these declarations alone: no other file names a cause.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from lutgen.history.causes._cause import Cause

__all__ = ["Cause", "causes"]


@cache
def causes() -> dict[str, Cause]:
    """Name → cause, by name."""
    modules = [
        import_module(f"{__name__}.{each.name}") for each in iter_modules(__path__) if not each.name.startswith("_")
    ]
    found: list[Cause] = [module.CAUSE for module in modules]
    return {cause.name: cause for cause in sorted(found, key=lambda each: each.name)}
