"""Small simulated campaigns that the tests of compare, diagnose, refine and plan share, as CSV text."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from pathlib import Path

HOURS = (0.0, 6000.0, 18_000.0)

#: Sessions of the data sets with conditions. They are more numerous, because each has few readings of a condition.
MORE_HOURS = (0.0, 1000.0, 2500.0, 4500.0, 6000.0, 12_000.0, 18_000.0)

#: The name of a data set says what the data set shows.
CAMPAIGNS = {
    "leak": Campaign(design="greys", hours=HOURS, hidden=(("black-level", 0.002, "constant"),), seed=18),
    "healthy": Campaign(design="greys", hours=HOURS, seed=19),
    "healthy colours": Campaign(design="colours", hours=HOURS, seed=19),
    "edge": Campaign(design="full", hours=MORE_HOURS, hidden=(("edge-falloff", 0.15, "same"),), seed=9),
    "curve": Campaign(design="colours", hours=HOURS, hidden=(("eotf-drift", 0.12, "same"),), seed=7),
    "fading": Campaign(
        design="greys", hours=HOURS, hidden=(("backlight-decay", 0.4, "same"),), seed=16, baseline="first-hour"
    ),
    "outside": Campaign(design="full", hours=MORE_HOURS, hidden=(("colour-across", 0.1, "outside"),), seed=31),
    "tips only": Campaign(design="tips", hours=HOURS, seed=17),
    "one hour": Campaign(design="greys", hours=(0.0,), hidden=(("black-level", 0.002, "constant"),), seed=40),
}


@cache
def text_of(name: str) -> str:
    """Return the data set as CSV."""
    return csv_text(CAMPAIGNS[name])


def single(text: str) -> str:
    """Return the data set with one reading per patch and session, that is, without replicates."""
    head = [line for line in text.splitlines() if line.startswith("#")]
    header, *rows = [line for line in text.splitlines() if not line.startswith("#")]
    first: dict[str, str] = {}
    for row in rows:
        first.setdefault(row.rsplit(",", 3)[0], row)
    return "\n".join([*head, header, *first.values()]) + "\n"


def write(name: str, folder: Path) -> Path:
    """Write a data set into a folder."""
    path = folder / f"{name.replace(' ', '-')}.csv"
    path.write_text(text_of(name), encoding="utf-8")
    return path
