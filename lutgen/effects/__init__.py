"""Physical effects: the built-in catalogue and users' own effects.

Built-in effects are the modules of ``lutgen/effects/catalogue``. Installed packages add effects by the entry-point
group ``lutgen.effects``. :func:`lutgen.effects.own.load_file` reads a user's file.

``declare`` holds the declaration of an effect. ``contract`` holds the clauses that every effect must satisfy. ``scene``
holds the inputs of an effect besides its signal. Each file of the catalogue is one effect; the files here serve all
effects.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from lutgen.effects.declare import STAGES, Effect, Parameter, chain_order, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import growth
from lutgen.errors import LutgenError

__all__ = ["STAGES", "Effect", "Parameter", "Scene", "catalogue", "effect", "growth"]

#: Imported by a string, because the package and the function :func:`catalogue` below have the same name.
_FOLDER = import_module("lutgen.effects.catalogue")


@cache
def catalogue() -> dict[str, Effect]:
    """Return the built-in effects by name, sorted by stage, then by name."""
    effects = []
    for module in iter_modules(_FOLDER.__path__):
        declared = getattr(import_module(f"{_FOLDER.__name__}.{module.name}"), module.name, None)
        if not isinstance(declared, Effect):
            raise LutgenError(f"lutgen/effects/catalogue/{module.name}.py holds no effect named {module.name}.")
        effects.append(declared)
    return {each.name: each for each in sorted(effects, key=chain_order)}
