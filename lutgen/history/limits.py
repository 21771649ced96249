"""Limits that a display must keep: published ones, and the user's own."""

from __future__ import annotations

import re
from dataclasses import dataclass

from lutgen.cells import number
from lutgen.errors import LutgenError, pick_one
from lutgen.history.history import QUANTITIES
from lutgen.names import ACR_DIAGNOSTIC, DRIFT, TG18_PRIMARY, TG18_SECONDARY

_TG18 = "AAPM TG18, Samei et al. 2005, doi:10.1118/1.1861159"
_ACR = "ACR–AAPM–SIIM, Norweck et al. 2013, doi:10.1007/s10278-012-9522-2"


@dataclass(frozen=True)
class Limit:
    """A limit.

    Attributes
    ----------
    quantity
        One of ``history.QUANTITIES``.
    value
        In the quantity's unit, or where ``relative`` as a share of the first session's figure.
    source
        Who published it, or "user".
    above
        Whether the figure must stay at or above ``value``; else at or below.

    """

    quantity: str
    value: float
    source: str
    above: bool = True
    relative: bool = False

    @property
    def text(self) -> str:
        """The limit as it is typed."""
        number = f"{100.0 * self.value:g}%" if self.relative else f"{self.value:g}"
        return f"{self.quantity}{'>=' if self.above else '<='}{number}"


#: Name of a set → its limits. TG18 and the technical standard also ask of contrast with the room's light on the screen:
#: read it so. What they do not publish for a drift over time (colour, a share of the first luminance) is no more than
#: usual: 0.01 is TG18's for the colour over one screen, 70 % what LED makers call the end of life.
SETS: dict[str, tuple[Limit, ...]] = {
    TG18_PRIMARY: (Limit("white", 170.0, _TG18), Limit("contrast", 250.0, _TG18)),
    TG18_SECONDARY: (Limit("white", 100.0, _TG18), Limit("contrast", 100.0, _TG18)),
    ACR_DIAGNOSTIC: (Limit("white", 350.0, _ACR), Limit("contrast", 250.0, _ACR)),
    DRIFT: (
        Limit("white", 0.7, "usual, set your own", relative=True),
        Limit("white-shift", 0.01, "usual, set your own", above=False),
    ),
}


def limits_of(name: str) -> tuple[Limit, ...]:
    """Return a published set. Raises LutgenError where there is none of that name."""
    if name not in SETS:
        raise pick_one("set of limits", name, SETS)
    return SETS[name]


def parse_limit(text: str) -> Limit:
    """Read a limit such as ``white>=200``, ``white>=80%`` (of the first session) or ``white-shift<=0.005``.

    Raises
    ------
    LutgenError
        It is none, or of no quantity that is followed.

    """
    found = re.fullmatch(r"\s*([a-z-]+)\s*(>=|<=)\s*([^%\s]+)\s*(%?)\s*", text, re.ASCII)
    if not found:
        message = f"--limit {text!r}: write a quantity, >= or <=, and a number, such as white>=200 or white>=80%."
        raise LutgenError(message)
    name, side, written, percent = found.groups()
    if name not in QUANTITIES:
        raise pick_one("quantity of --limit", name, QUANTITIES)
    value = number(written)
    if value is None or value <= 0:
        raise LutgenError(f"--limit {text!r}: {written} is no number above 0.")
    return Limit(name, value / 100.0 if percent else value, "user", above=side == ">=", relative=bool(percent))
