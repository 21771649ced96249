"""Hidden effects, each at the stage of the display where it happens, in the catalogue's form and in another one.

``same`` is the equation of lutgen's catalogue; ``other`` is the same physics told by a different curve (S-curves for
powers, τ^1.3 for τ, |u|⁴ for ρ², rational for exponential); ``outside`` is physics the catalogue does not have.
Names are the catalogue's. Every effect has one size, in the unit given, at which 0 is no effect; the display at the
tips' hour and colour may change with it, as a real one's would.

What passes: ``drive`` code values (n, 3) · ``transfer`` and ``mixing`` linear light (n, 3) · ``emission`` spectra of
the three primaries (n, 3, 81) · ``optics`` and ``viewing`` their sum (n, 81) · ``instrument`` XYZ in cd/m² (n, 3).
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from tests.virtual_display.physics.effect import EFFECTS, STAGES, Effect, Scene, Traits

__all__ = ["EFFECTS", "STAGES", "Effect", "Scene", "Traits", "find", "names"]

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")


def find(name: str, form: str) -> Effect:
    """Return the effect of this name and form. Raises KeyError naming what there is."""
    if (name, form) not in EFFECTS:
        known = ", ".join(f"{effect} ({form})" for effect, form in sorted(EFFECTS))
        raise KeyError(f"no hidden effect {name!r} in form {form!r}. Pick one of: {known}.")
    return EFFECTS[name, form]


def names(*, baseline: str = "colour-points") -> list[str]:
    """Names of the catalogue's effects that a baseline can see, sorted."""
    return sorted(effect.name for effect in EFFECTS.values() if effect.form == "same" and effect.baseline == baseline)
