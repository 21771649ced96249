"""The history of a display: white, black, contrast, colours and γ over the sessions of a campaign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.errors import LutgenError
from lutgen.history.colour_points import ALIKE, BLACK, FLOOR_CD_M2
from lutgen.history.inspect import Inspection, inspect_session
from lutgen.history.transfer import ContrastResponse, contrast_response

if TYPE_CHECKING:
    from lutgen.readings.campaign import Campaign

#: Quantity → what it is, with its unit.
QUANTITIES = {
    "white": "luminance of white, cd/m²",
    "black": "luminance of black, cd/m²",
    "contrast": "contrast: white over black",
    "white-shift": "Δu'v' of white since the first session",
    "primaries-shift": "largest Δu'v' of a primary since then",
    "gamma": "γ of the greys",
    "non-uniformity": "non-uniformity over the screen",
    "gsdf": "largest deviation from DICOM's",
    "ambient": "the room's light over that of black",
}

#: What the colour of white or a primary repeats to between sessions, Δu'v', γ, evenness and contrast response, 1 σ.
COLOUR_NOISE, GAMMA_NOISE, EVEN_NOISE, GSDF_NOISE = 0.0010, 0.02, 0.01, 0.03


@dataclass(frozen=True)
class History:
    """Figures over time."""

    #: The sessions.
    campaign: Campaign
    #: Places of the sessions in the campaign, by time, (n,).
    places: tuple[int, ...]
    #: Since the earliest session, (n,): "hours" of operation, or "days" where only dates are known.
    time: Array
    unit: str
    #: Quantity → figures, (n,), NaN where a session does not tell; and what they repeat to, 1 σ, (n,).
    values: dict[str, Array]
    errors: dict[str, Array]
    #: Contrast response of each session's greys, (n,); None where they do not tell.
    responses: tuple[ContrastResponse | None, ...] = ()


def history(campaign: Campaign, ambient_cd_m2: float = 0.0) -> History:
    """Collect the figures of all sessions. Raises LutgenError: no hours and no dates, or a relative session."""
    time, unit = times(campaign)
    order = np.argsort(time, kind="stable")
    for entry in campaign.entries:
        _ = entry.session.xyz_cd_m2
    inspections = [inspect_session(campaign.entries[place].session) for place in order]
    responses = tuple(contrast_response(each.session, ambient_cd_m2) for each in inspections)
    values, errors = _figures(inspections, responses, ambient_cd_m2)
    return History(campaign, tuple(order.tolist()), time[order], unit, values, errors, responses)


def times(campaign: Campaign) -> tuple[Array, str]:
    """Return time since the earliest session, (n,), and its unit: hours where they can be told, else days."""
    dated = [entry.date for entry in campaign.entries if entry.date]
    counted = all(entry.hours is not None for entry in campaign.entries)
    if campaign.hours_per_day is None and not counted and len(dated) == len(campaign.entries):
        days = np.array([each.toordinal() for each in dated], dtype=np.float64)
        return days - days.min(), "days"
    return campaign.hours(), "hours"


def _figures(
    inspections: list[Inspection], responses: tuple[ContrastResponse | None, ...], ambient: float
) -> tuple[dict[str, Array], dict[str, Array]]:
    white, black = (_luminance(inspections, kind) for kind in ("white", "black"))
    with np.errstate(divide="ignore", invalid="ignore"):
        contrast = np.where(black + ambient > 0, (white + ambient) / (black + ambient), np.nan)
        share = np.where(black > 0, ambient / black, np.nan) if ambient else np.full(len(inspections), np.nan)
    ends = [each.uniformity or (np.nan, np.nan) for each in inspections]
    even = [2.0 * (high - low) / (high + low) for low, high in ends]
    dark = np.hypot(BLACK * black, FLOOR_CD_M2)
    values = {
        "white": white,
        "black": black,
        "contrast": contrast,
        "white-shift": _shift([None if each.white is None else [each.white] for each in inspections]),
        "primaries-shift": _shift(
            [list(each.primaries.xyz.values()) if each.primaries and len(each.primaries.xyz) == 3 else None
             for each in inspections]
        ),
        "gamma": np.array([np.nan if each.gamma is None else each.gamma for each in inspections]),
        "non-uniformity": np.array(even),
        "gsdf": np.array([np.nan if each is None else each.worst for each in responses]),
        "ambient": share,
    }  # fmt: skip
    errors = {
        "white": ALIKE * white,
        "black": dark,
        "contrast": contrast * np.hypot(ALIKE, dark / np.maximum(black + ambient, 1e-9)),
        "white-shift": np.full(len(inspections), COLOUR_NOISE),
        "primaries-shift": np.full(len(inspections), COLOUR_NOISE),
        "gamma": np.full(len(inspections), GAMMA_NOISE),
        "non-uniformity": np.full(len(inspections), EVEN_NOISE),
        "gsdf": np.full(len(inspections), GSDF_NOISE),
        "ambient": share * np.hypot(BLACK, FLOOR_CD_M2 / np.maximum(black, 1e-9)),
    }
    if not np.isfinite(white).any():
        raise LutgenError(
            f"{inspections[0].session.file}: no session of the campaign read white; nothing can be followed."
        )
    return values, errors


def _luminance(inspections: list[Inspection], kind: str) -> Array:
    read = [getattr(each, kind) for each in inspections]
    return np.array([np.nan if each is None else float(each[1]) for each in read])


def _shift(colours: list[list[Array] | None]) -> Array:
    """Largest Δu'v' of a list of colours against those of the first session that has them, (n,)."""
    first = next((each for each in colours if each is not None), None)
    if first is None:
        return np.full(len(colours), np.nan)
    start = _uv(first)
    return np.array([np.nan if each is None else float(np.hypot(*(_uv(each) - start).T).max()) for each in colours])


def _uv(colours: list[Array]) -> Array:
    return xyz_to_uv(np.array(colours))
