"""Limits that a display must keep: published ones, and the user's own."""

from __future__ import annotations

import re
from dataclasses import dataclass

from lutgen.cells import number
from lutgen.errors import LutgenError, pick_one
from lutgen.history.history import QUANTITIES
from lutgen.names import (
    ACR_DIAGNOSTIC,
    DIN_6868,
    DRIFT,
    MAMMOGRAPHY,
    RANZCR,
    TG18_PRIMARY,
    TG18_SECONDARY,
    TG270_DIAGNOSTIC,
)

_TG18 = "AAPM TG18, Samei et al. 2005, doi:10.1118/1.1861159"
_ACR = "ACR–AAPM–SIIM, Norweck et al. 2013, doi:10.1007/s10278-012-9522-2"
_TG270 = "AAPM report 270, 2019, doi:10.37206/183"
_DIN = "DIN 6868-157"
_RANZCR = "RANZCR Standards of Practice for Clinical Radiology, appendix D, as a maker of displays quotes it"
_PS3_14 = "DICOM PS3.14 conformance as AAPM TG18 asks, doi:10.1118/1.1861159"

#: Quantities that are shares themselves: % after their limit is no share of the first session's figure.
SHARES = ("non-uniformity", "gsdf", "ambient")


@dataclass(frozen=True)
class Limit:
    """A limit."""

    #: One of ``history.QUANTITIES``.
    quantity: str
    #: In the quantity's unit, or where ``relative`` as a share of the first session's figure.
    value: float
    #: Who published it, or "user".
    source: str
    #: Whether the figure must stay at or above ``value``; else at or below.
    above: bool = True
    relative: bool = False
    #: Whether somebody compared the number with its source, or read it where the source is quoted; else it is from
    #: memory. The reports of AAPM and ACR themselves were not at hand when this table was written: look there before a
    #: limit decides anything.
    verified: bool = True

    @property
    def text(self) -> str:
        """The limit as it is typed."""
        number = f"{100.0 * self.value:.3g}%" if self.relative or self.quantity in SHARES else f"{self.value:g}"
        return f"{self.quantity}{'>=' if self.above else '<='}{number}"


def _set(source: str, *, verified: bool = True, **most: float) -> tuple[Limit, ...]:
    """Limits of one source: white and contrast are kept from below, the others from above."""
    names = {name: name.replace("_", "-") for name in most}
    return tuple(
        Limit(names[name], value, source, above=name in {"white", "contrast"}, verified=verified)
        for name, value in most.items()
    )


def _conforming(share: float) -> tuple[Limit, ...]:
    """Limits that TG18 sets beside luminance: contrast response, the screen's evenness, and the room's light."""
    return (
        Limit("gsdf", share, _PS3_14, above=False),
        *_set(_TG18, verified=False, non_uniformity=0.3, ambient=2.0 / 3.0),
    )


#: Name of a set → its limits. Contrast includes the room's light on the screen: --ambient adds it. Ambient is the
#: room's light over black's: at most ⅔, better ¼. What nobody publishes for a drift over time (colour, a share of the
#: first luminance) is no more than usual: 0.01 is TG18's for the colour over one screen, 70 % what LED makers call the
#: end of life.
SETS: dict[str, tuple[Limit, ...]] = {
    TG18_PRIMARY: (*_set(_TG18, white=170.0, contrast=250.0), *_conforming(0.1)),
    TG18_SECONDARY: (*_set(_TG18, white=100.0, contrast=100.0), *_conforming(0.2)),
    # The standard recommends a ratio of 350; 250 is not in it.
    ACR_DIAGNOSTIC: (*_set(_ACR, white=350.0, contrast=350.0), *_conforming(0.1)),
    MAMMOGRAPHY: (*_set(_ACR, verified=False, white=420.0, contrast=350.0), *_conforming(0.1)),
    TG270_DIAGNOSTIC: _set(
        _TG270, verified=False, white=350.0, contrast=250.0, gsdf=0.1, non_uniformity=0.3, ambient=0.25
    ),
    DIN_6868: _set(_DIN, verified=False, white=250.0, contrast=250.0, non_uniformity=0.3),
    RANZCR: _set(_RANZCR, white=350.0, contrast=250.0, gsdf=0.1, non_uniformity=0.3),
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
    """Read a limit such as ``white>=200``, ``white>=80%`` or ``white-shift<=0.005``. Raises LutgenError."""
    found = re.fullmatch(r"\s*([a-z-]+)\s*(>=|<=)\s*([^%\s]+)\s*(%?)\s*", text, re.ASCII)
    if not found:
        raise LutgenError(
            f"--limit {text!r}: write a quantity, >= or <=, and a number, such as white>=200 or white>=80%."
        )
    name, side, written, percent = found.groups()
    if name not in QUANTITIES:
        raise pick_one("quantity of --limit", name, QUANTITIES)
    value = number(written)
    if value is None or value <= 0:
        raise LutgenError(f"--limit {text!r}: {written} is no number above 0.")
    relative = bool(percent) and name not in SHARES
    return Limit(name, value / 100.0 if percent else value, "user", above=side == ">=", relative=relative)
