"""Data sets with measurement faults: the display is healthy, but the table is wrong.

A diagnosis that names a physical effect is wrong. The best diagnosis names the row or the session.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_display.campaign import Campaign, header, measured, table

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.virtual_display.readings import Readings
    from tests.virtual_display.spectra import Array

#: Factor by which replicates scatter more than the file's instrument.
SCATTER = 10.0

#: Number of rows of two sessions that are exchanged.
EXCHANGED = 20


@dataclass(frozen=True)
class Broken:
    """A wrong table: its text, the fault, and the lines and hours of the fault."""

    text: str
    fault: str
    lines: tuple[int, ...] = ()
    hours: tuple[float, ...] = ()


def mistyped(campaign: Campaign, rng: np.random.Generator) -> Broken:
    """In one reading that is no tip, the first two digits of Y are exchanged: 47.31 becomes 74.31."""
    readings, xyz = campaign.readings, measured(campaign)
    ordinary = np.isnan(readings.warmup_min) & (readings.drive.max(axis=1) < 1.0) & (readings.capped == 1.0)
    digits = np.array([f"{abs(y):.1e}" for y in xyz[:, 1]])
    differ = np.array([abs(int(text[0]) - int(text[2])) >= 2 and text[2] != "0" for text in digits])
    row = int(rng.choice(np.flatnonzero(ordinary & differ & (xyz[:, 1] > 1.0))))
    scale = 10.0 ** int(digits[row][4:])
    first, second = int(digits[row][0]), int(digits[row][2])
    xyz[row, 1] += (second - first) * 0.9 * scale
    return Broken(_text(campaign, readings, xyz), "one reading mistyped", lines=(_line(campaign, row),))


def scattered(campaign: Campaign, rng: np.random.Generator) -> Broken:
    """Replicates scatter ten times as much as the instrument in the file's metadata."""
    del rng
    xyz = measured(campaign, scatter=SCATTER)
    return Broken(_text(campaign, campaign.readings, xyz), "replicates scatter 10 times the instrument's noise")


def exchanged(campaign: Campaign, rng: np.random.Generator) -> Broken:
    """Some rows of an early and a late session, not their tips, have exchanged readings."""
    aged = replace(campaign, ageing=1.5)
    readings, xyz = aged.readings, measured(aged)
    hours = (aged.hours[int(rng.integers(1, 4))], aged.hours[int(rng.integers(6, len(aged.hours)))])
    early, late = (np.flatnonzero(readings.hours == hour) for hour in hours)
    ordinary = (readings.drive[early].max(axis=1) < 1.0) & (readings.drive[early].max(axis=1) > 0.2)
    chosen = rng.choice(np.flatnonzero(ordinary), min(EXCHANGED, int(ordinary.sum()) // 2), replace=False)
    xyz[early[chosen]], xyz[late[chosen]] = xyz[late[chosen]], xyz[early[chosen]]
    lines = tuple(sorted(_line(aged, int(row)) for row in (*early[chosen], *late[chosen])))
    return Broken(_text(aged, readings, xyz), "rows of two sessions exchanged", lines=lines, hours=hours)


def mislabelled(campaign: Campaign, rng: np.random.Generator) -> Broken:
    """Two neighbouring sessions have exchanged hours."""
    readings, xyz = campaign.readings, measured(campaign)
    place = int(rng.integers(2, len(campaign.hours) - 2))
    hours = campaign.hours[place : place + 2]
    first, second = (np.flatnonzero(readings.hours == hour) for hour in hours)
    xyz[first], xyz[second] = xyz[second], xyz[first]
    return Broken(_text(campaign, readings, xyz), "two hours exchanged", hours=(hours[0], hours[1]))


FAULTS: tuple[Callable[[Campaign, np.random.Generator], Broken], ...] = (mistyped, scattered, exchanged, mislabelled)


def _text(campaign: Campaign, readings: Readings, xyz: Array) -> str:
    return table(readings, xyz, header(campaign), conditions=campaign.design == "full")


def _line(campaign: Campaign, row: int) -> int:
    """Return the file's line number of this reading: metadata, then the header, then the rows."""
    return len(header(campaign)) + 2 + row
