"""Hidden effects, each at its physical stage of the display, in the catalogue's form and in another form.

``same`` is the equation of lutgen's catalogue. ``other`` is the same physics with a different curve (S-curves for
powers, τ^1.3 for τ, |u|⁴ for ρ², rational for exponential). ``outside`` is physics that the catalogue does not have.
The names are those of the catalogue. Every effect has one size, in the unit given; size 0 is no effect. An effect may
also change the display at the tips' hours and colours, as on a real display.

Signal at each stage: ``drive`` code values (n, 3) · ``transfer`` and ``mixing`` linear light (n, 3) · ``emission``
spectra of the three primaries (n, 3, 81) · ``optics`` and ``viewing`` their sum (n, 81) · ``instrument`` XYZ in cd/m²
(n, 3).
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from tests.virtual_display.physics.effect import EFFECTS, STAGES, Effect, Scene, Traits

__all__ = ["EFFECTS", "STAGES", "Effect", "Scene", "Traits", "find", "names"]

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")


def find(name: str, form: str) -> Effect:
    """Return the effect of this name and form. Raises KeyError, which lists the existing effects."""
    if (name, form) not in EFFECTS:
        known = ", ".join(f"{effect} ({form})" for effect, form in sorted(EFFECTS))
        raise KeyError(f"no hidden effect {name!r} in form {form!r}. Pick one of: {known}.")
    return EFFECTS[name, form]


def names(*, baseline: str = "colour-points") -> list[str]:
    """Return the names of the catalogue's effects that are visible from a baseline, sorted."""
    return sorted(effect.name for effect in EFFECTS.values() if effect.form == "same" and effect.baseline == baseline)
