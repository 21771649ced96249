"""Simulated displays with spectral emitters: lamps, filters and OLED stacks, seen by the CIE 1931 2° observer.

Every effect of the catalogue has a different form here, from textbooks of display physics. ``OUTSIDE`` lists effects of
real displays that the catalogue lacks. A display with no hidden effect ages, and its colour points follow this aging
completely.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tests.generators.spectral import habits as writing
from tests.generators.spectral.aging import AGING
from tests.generators.spectral.displays import panel
from tests.generators.spectral.emission import EMISSION
from tests.generators.spectral.laws import generator
from tests.generators.spectral.light import readings
from tests.generators.spectral.outside import LIGHT, PIXELS
from tests.generators.spectral.pixels import CODES, MIXING
from tests.generators.spectral.plan import plan
from tests.generators.spectral.plan import readings as planned
from tests.generators.spectral.viewing import INSTRUMENT, ROOM
from tests.generators.truth import Truth

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["KINDS", "OUTSIDE", "campaign"]

KINDS: tuple[str, ...] = tuple(dict.fromkeys((*CODES, *MIXING, *EMISSION, *ROOM, *INSTRUMENT, *AGING)))
OUTSIDE: tuple[str, ...] = (*PIXELS, *LIGHT)


def campaign(seed: int, hidden: Mapping[str, float], *, design: str = "full", habits: int = 0) -> Truth:
    """Noise-free readings of one simulated display.

    Parameters
    ----------
    seed
        Determines the display, its aging, and the shape of each hidden effect.
    hidden
        Effect of ``KINDS`` or ``OUTSIDE`` → strength: 1 is a typical size, 0 is no effect.
    design
        "full", "colour", "grey" or "few".
    habits
        Number of the way to write the campaign: 0 to 5, modulo 6.

    Raises
    ------
    ValueError
        An effect or design is unknown, or a strength is below 0.

    """
    unknown = sorted(set(hidden) - {*KINDS, *OUTSIDE})
    if unknown:
        raise ValueError(f"hidden kind {unknown[0]!r} is none. Pick one of: {', '.join((*KINDS, *OUTSIDE))}.")
    for name, strength in hidden.items():
        if not 0 <= strength < math.inf:
            message = f"hidden[{name!r}] is {strength}: a strength is a number from 0 on. Signs are drawn by the seed."
            raise ValueError(message)
    acting = {name: strength for name, strength in hidden.items() if strength > 0}
    habit = habits % writing.HABITS
    one_hour = [r for r in planned(design, generator(seed, "patches")) if not writing.left_out(r, habit)]
    timetable = plan(writing.hours(design, habit), one_hour, sessions=writing.sessions(habit))
    timetable = writing.in_truth(timetable, habit, generator(seed, "habit"))
    display = panel(generator(seed, "display"))
    xyz = readings(display, timetable, acting, seed)
    rows = writing.rows(timetable, habit, generator(seed, "rows"))
    names = writing.names(timetable, habit)
    return Truth(
        hours=timetable.hours[timetable.hour][rows],
        drive=timetable.drive[rows],
        xyz_cd_m2=xyz[rows],
        conditions={name: column[rows] for name, column in writing.logged(timetable, habit).items()},
        session=tuple(names[i] for i in rows),
        order=timetable.order[rows],
        note=tuple(timetable.note[i] for i in rows),
        metadata=writing.metadata(display.name, seed, design, habit),
        hidden=dict(hidden),
    )
