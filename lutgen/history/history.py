"""The history of a display: white, black, contrast, colours and γ over its sessions, and limits for them."""

import re
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from lutgen import names
from lutgen.cells import number
from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.history.colour_points import ALIKE, BLACK, FLOOR_CD_M2
from lutgen.history.inspect import Inspection, inspect_session
from lutgen.history.remarks import is_black_readable
from lutgen.history.transfer import ContrastResponse, contrast_response
from lutgen.readings.campaign import Campaign


@dataclass(frozen=True)
class Quantity:
    """A quantity that is followed over time."""

    #: The quantity in a sentence, and its description with its unit.
    noun: str
    description: str
    #: Format of its figures in a table, and its unit after a figure in a sentence.
    digits: str
    unit: str = ""
    #: Repeatability between sessions, 1 σ, if it is the same at every size.
    noise: float | None = None
    #: Whether the quantity is a share: % after its limit does not mean a share of the first session's figure.
    is_share: bool = False


QUANTITIES = {
    "white": Quantity("white", "luminance of white, cd/m²", ".1f", " cd/m²"),
    "black": Quantity("black", "luminance of black, cd/m²", ".3f", " cd/m²"),
    "contrast": Quantity("contrast", "contrast: white over black", ".0f", ":1"),
    "white-shift": Quantity("white's colour", "Δu'v' of white since the first session", ".4f", noise=0.001),
    "primaries-shift": Quantity(
        "a primary's colour", "largest Δu'v' of a primary since the first session", ".4f", noise=0.001
    ),
    "gamma": Quantity("γ", "γ of the greys", ".2f", noise=0.02),
    "non-uniformity": Quantity("non-uniformity", "non-uniformity over the screen", ".0%", noise=0.01, is_share=True),
    "gsdf": Quantity(
        "the deviation from DICOM's contrast response", "largest deviation of contrast from DICOM PS3.14", ".0%",
        noise=0.03, is_share=True,
    ),
    "ambient": Quantity("the room's light over black", "room light over black", ".2f", is_share=True),
}  # fmt: skip


@dataclass(frozen=True)
class History:
    """Figures over time."""

    #: The sessions.
    campaign: Campaign
    #: Indices of the sessions in the campaign, sorted by time, (n,).
    places: tuple[int, ...]
    #: Time since the earliest session, (n,), and its unit: "hours" of operation, or "days" if only dates are known.
    time: Array
    unit: str
    #: Quantity → figures, (n,), NaN if a session lacks the patches; and quantity → repeatability, 1 σ, (n,).
    values: dict[str, Array]
    errors: dict[str, Array]
    #: Contrast response of each session's greys, (n,); None with too few greys.
    responses: tuple[ContrastResponse | None, ...]


def history(campaign: Campaign, ambient_cd_m2: float = 0.0, used: Collection[int] | None = None) -> History:
    """Collect the figures of all sessions. Raises LutgenError: no hours and no dates, or a relative session.

    ``used``: indices in the campaign (default: all). Shifts of colours are relative to the first of these sessions that
    read the colours.
    """
    time, unit = times(campaign)
    order = np.argsort(time, kind="stable")
    for entry in campaign.entries:
        # Raises LutgenError for a relative session.
        _ = entry.session.xyz_cd_m2
    inspections = [inspect_session(campaign.entries[place].session) for place in order]
    responses = tuple(contrast_response(each.session, ambient_cd_m2) for each in inspections)
    starts = np.array([used is None or place in used for place in order.tolist()])
    values, errors = _figures(inspections, responses, ambient_cd_m2, starts)
    return History(campaign, tuple(order.tolist()), time[order], unit, values, errors, responses)


def times(campaign: Campaign) -> tuple[Array, str]:
    """Return time since the earliest session, (n,), and its unit: hours if known, otherwise days."""
    dated = [entry.date for entry in campaign.entries if entry.date]
    counted = all(entry.hours is not None for entry in campaign.entries)
    if campaign.hours_per_day is None and not counted and len(dated) == len(campaign.entries):
        days = np.array([each.toordinal() for each in dated], dtype=np.float64)
        return days - days.min(), "days"
    return campaign.hours(), "hours"


def _figures(
    inspections: list[Inspection], responses: tuple[ContrastResponse | None, ...], ambient: float, starts: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    read = [each.white for each in inspections], [each.black for each in inspections]
    white, black = (np.array([np.nan if xyz is None else float(xyz[1]) for xyz in each]) for each in read)
    readable = np.array([is_black_readable(each.session) for each in inspections])
    with np.errstate(divide="ignore", invalid="ignore"):
        contrast = np.where(
            (readable | (ambient > 0)) & (black + ambient > 0), (white + ambient) / (black + ambient), np.nan
        )
        share = np.where(black > 0, ambient / black, np.nan) if ambient else np.full(len(inspections), np.nan)
        low, high = np.array([each.uniformity or (np.nan, np.nan) for each in inspections]).T
        uneven = 2.0 * (high - low) / (high + low)
    dark = np.hypot(BLACK * black, FLOOR_CD_M2)
    values = {
        "white": white,
        "black": black,
        "contrast": contrast,
        "white-shift": _shift([None if each.white is None else [each.white] for each in inspections], starts),
        "primaries-shift": _shift(
            [list(each.primaries.xyz.values()) if each.primaries and len(each.primaries.xyz) == 3 else None
             for each in inspections],
            starts,
        ),
        "gamma": np.array([each.gamma for each in inspections], np.float64),
        "non-uniformity": uneven,
        "gsdf": np.array([np.nan if each is None else each.worst for each in responses]),
        "ambient": share,
    }  # fmt: skip
    errors = {
        "white": ALIKE * white,
        "black": dark,
        "contrast": contrast * np.hypot(ALIKE, dark / np.maximum(black + ambient, 1e-9)),
        **{name: np.full(len(inspections), each.noise) for name, each in QUANTITIES.items() if each.noise},
        "ambient": share * np.hypot(BLACK, FLOOR_CD_M2 / np.maximum(black, 1e-9)),
    }
    if not np.isfinite(white).any():
        file = inspections[0].session.file
        raise LutgenError(f"{file}: no session of the campaign read white; nothing can be followed.")
    return values, errors


def _shift(colours: list[list[Array] | None], starts: Array) -> Array:
    """Return the largest Δu'v' of each session's colours against the first of ``starts`` that has the colours, (n,)."""
    first = next((each for each, may in zip(colours, starts, strict=True) if may and each is not None), None)
    if first is None:
        return np.full(len(colours), np.nan)
    start = xyz_to_uv(np.array(first))
    moves = [None if each is None else np.hypot(*(xyz_to_uv(np.array(each)) - start).T).max() for each in colours]
    return np.array(moves, np.float64)


_TG18 = "AAPM TG18, Samei et al. 2005, doi:10.1118/1.1861159"
_ACR = "ACR–AAPM–SIIM, Norweck et al. 2013, doi:10.1007/s10278-012-9522-2"
_TG270 = "AAPM report 270, 2019, doi:10.37206/183"
_DIN = "DIN 6868-157"
_RANZCR = "RANZCR Standards of Practice for Clinical Radiology, appendix D, as a maker of displays quotes it"
_PS3_14 = "DICOM PS3.14 conformance as AAPM TG18 asks, doi:10.1118/1.1861159"


@dataclass(frozen=True)
class Limit:
    """A limit."""

    #: One of ``history.QUANTITIES``.
    quantity: str
    #: In the quantity's unit; if ``relative``, as a share of the first session's figure.
    value: float
    #: The publication, or "user".
    source: str
    #: Whether the figure must stay at or above ``value``; False: at or below.
    above: bool = True
    relative: bool = False
    #: Whether somebody compared the number with its source, or with a quotation of its source; False: the number is
    #: from memory. The reports of AAPM and ACR were not available when this table was written: check them before you
    #: rely on a limit.
    verified: bool = True

    @property
    def text(self) -> str:
        """The limit as users type it."""
        share = self.relative or QUANTITIES[self.quantity].is_share
        number = f"{100.0 * self.value:.3g}%" if share else f"{self.value:g}"
        return f"{self.quantity}{'>=' if self.above else '<='}{number}"


def _set(source: str, *, verified: bool = True, **most: float) -> tuple[Limit, ...]:
    """Return limits of one source: lower limits of white and contrast, upper limits of the other quantities."""
    return tuple(
        Limit(name.replace("_", "-"), value, source, above=name in {"white", "contrast"}, verified=verified)
        for name, value in most.items()
    )


def _conforming(share: float) -> tuple[Limit, ...]:
    """Return TG18's limits other than those of luminance: contrast response, uniformity, and room light."""
    return (
        Limit("gsdf", share, _PS3_14, above=False),
        *_set(_TG18, verified=False, non_uniformity=0.3, ambient=2.0 / 3.0),
    )


#: Name of a set → its limits. Contrast includes the room's light on the screen, which --ambient adds. ``ambient`` is
#: the light of the room divided by the light of black: at most ⅔, better ¼. No publication gives limits for a drift
#: over time; the set ``drift`` has usual values: 0.01 is TG18's limit for the colour over one screen, and LED makers
#: call 70 % the end of life.
SETS: dict[str, tuple[Limit, ...]] = {
    names.TG18_PRIMARY: (*_set(_TG18, white=170.0, contrast=250.0), *_conforming(0.1)),
    names.TG18_SECONDARY: (*_set(_TG18, white=100.0, contrast=100.0), *_conforming(0.2)),
    # The standard recommends a ratio of 350; 250 is not in it.
    names.ACR_DIAGNOSTIC: (*_set(_ACR, white=350.0, contrast=350.0), *_conforming(0.1)),
    names.MAMMOGRAPHY: (*_set(_ACR, verified=False, white=420.0, contrast=350.0), *_conforming(0.1)),
    names.TG270_DIAGNOSTIC: _set(
        _TG270, verified=False, white=350.0, contrast=250.0, gsdf=0.1, non_uniformity=0.3, ambient=0.25
    ),
    names.DIN_6868: _set(_DIN, verified=False, white=250.0, contrast=250.0, non_uniformity=0.3),
    names.RANZCR: _set(_RANZCR, white=350.0, contrast=250.0, gsdf=0.1, non_uniformity=0.3),
    names.DRIFT: (
        Limit("white", 0.7, "usual, set your own", relative=True),
        Limit("white-shift", 0.01, "usual, set your own", above=False),
    ),
}


def limits_of(name: str) -> tuple[Limit, ...]:
    """Return a published set of limits. Raises LutgenError for an unknown name."""
    refuse_unknown("set of limits", name, SETS)
    return SETS[name]


def parse_limit(text: str) -> Limit:
    """Read a limit such as ``white>=200``, ``white>=80%`` or ``white-shift<=0.005``. Raises LutgenError."""
    parts = re.fullmatch(r"\s*([a-z-]+)\s*(>=|<=)\s*([^%\s]+)\s*(%?)\s*", text, re.ASCII)
    if not parts:
        allowed = "write a quantity, >= or <=, and a number, such as white>=200 or white>=80%"
        raise LutgenError(f"--limit {text!r}: {allowed}.")
    name, side, written, percent = parts.groups()
    refuse_unknown("quantity of --limit", name, QUANTITIES)
    value = number(written)
    if value is None or value <= 0:
        raise LutgenError(f"--limit {text!r}: {written} is no number above 0.")
    relative = bool(percent) and not QUANTITIES[name].is_share
    return Limit(name, value / 100.0 if percent else value, "user", above=side == ">=", relative=relative)
