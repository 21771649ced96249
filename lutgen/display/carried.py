"""What LUTs and pictures carry of a model: sentences on fixed conditions and on effects that are left out."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.display.conditions import REFERENCE, in_words
from lutgen.errors import listed
from lutgen.readings.conditions import OF_COLUMN
from lutgen.readings.conditions.position import PLACE

if TYPE_CHECKING:
    from lutgen.display.model import DisplayModel
    from lutgen.display.on_screen import OnScreen


def what_luts_carry(model: DisplayModel) -> list[str]:
    """Return a sentence on each condition that a bake of ``model`` fixes, and on each effect that no LUT can carry."""
    stairs = "gives the curves steps that are smaller than the spacing of a LUT; the error is part of 'border'."
    return _fixed(model, "Baked at", "which a LUT cannot carry") + [
        f"{name} {stairs}" for name in model.names_of_steps()
    ]


def what_pictures_carry(model: DisplayModel, on_screen: OnScreen | None = None) -> list[str]:
    """Return a sentence on each condition that is fixed when ``model`` is applied to a picture.

    ``on_screen``: position of the picture on the screen, which gives each pixel its own position.
    """
    fixed = _fixed(model, "Shown at", "which is taken as the same in all of the picture", PLACE if on_screen else ())
    return [*on_screen.sentences(), *fixed] if on_screen else fixed


def seen_on(model: DisplayModel, on_screen: OnScreen | None = None) -> dict[str, Any]:
    """Return the entries on the display in the JSON of commands on pictures: display, model, remarks, on_screen."""
    return {
        "display": {"file": model.measurements.file, "sha256": model.measurements.sha256},
        "model": model.file or None,
        "remarks": what_pictures_carry(model, on_screen),
        **({"on_screen": on_screen.as_json()} if on_screen else {}),
    }


def _fixed(model: DisplayModel, verb: str, but: str, free: tuple[str, ...] = ()) -> list[str]:
    stated = model.conditions.stated()
    columns = {}
    if model.baked:
        # A model without effects needs no probe.
        from lutgen.effects.probe import reacts_to

        columns = {each.effect.name: [on for on in reacts_to(each.effect) if on not in free] for each in model.baked}
    needs = {name for names in columns.values() for name in names} | set(stated)
    lines = [f"{verb}: {in_words(model.conditions, needs)}."] if needs else []
    for effect, names in columns.items():
        if names:
            on = listed(dict.fromkeys(OF_COLUMN[name].depends for name in names))
            lines.append(f"{effect} depends on {on}, {but}.")
    lines += [f"Nothing in this model depends on {name}." for name in stated if not _matters(model, name)]
    return lines + [
        f"{each.effect.name} is left out: it belongs to the instrument, not to the display."
        for each in model.effects
        if each.effect.stage == "instrument"
    ]


def _matters(model: DisplayModel, name: str) -> bool:
    """Whether the usual value of a condition changes a test colour at the first or the last hour."""
    usual = replace(model, conditions=replace(model.conditions, **{name: getattr(REFERENCE, name)}))
    code = np.array(list(product((0.0, 0.25, 0.5, 1.0), repeat=3)))
    for hours in (float(model.tips.hours[0]), float(model.tips.hours[-1])):
        here, there = (each.at("chroma", hours).code_to_xyz(code) for each in (model, usual))
        if (here != there).any():
            return True
    return False


def not_measured(model: DisplayModel) -> str:
    """Return a sentence for a display that was not measured; "" for a measured display."""
    source = model.measurements.metadata.get("source", "")
    # Readings that were not measured have such a first word in their line `# source: …`.
    word = next((word for word in ("RECONSTRUCTED", "SIMULATED") if source.startswith(word)), "")
    return f"This display is {word.lower()}, not measured." if word else ""
