"""The page of ``lutgen inspect``: a table of sessions, then the channels and the remarks of each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.colorimetry import xyz_to_xyY
from lutgen.history.patches import CHANNELS
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.history import Inspection
    from lutgen.report.parts import Part


def inspect_page(inspections: Sequence[Inspection]) -> Iterator[Part]:
    """Yield what ``lutgen inspect`` prints."""
    if len(inspections) > 1:
        yield overview(inspections)
    for number, each in enumerate(inspections, start=1):
        if number > 1 or len(inspections) > 1:
            yield ""
        yield Headline(f"{f'{number}  ' if len(inspections) > 1 else ''}{Path(each.session.file).name}")
        yield origin(each)
        if len(inspections) == 1:
            yield overview(inspections)
        if each.primaries or each.calibration:
            yield channels(each)
        yield from (f"• {remark}" for remark in each.remarks)
        if each.wanting:
            yield f"Missing: {' '.join(each.wanting)}"


def origin(inspection: Inspection) -> str:
    """Name the origin of a session: readings, format, display, instrument, date."""
    session = inspection.session
    parts = [f"{len(session.drive)} readings", session.form]
    parts += [text for text in (session.display, session.instrument) if text]
    if session.created:
        parts.append(f"{session.created:%Y-%m-%d %H:%M}")
    simulated = next((text for key, text in session.metadata.items() if key.upper() == "SIMULATED"), "")
    return f"{', '.join(parts)}.{f' Simulated: {simulated}.' if simulated else ''}"


def overview(inspections: Sequence[Inspection]) -> Table:
    """Tabulate the main figures of the sessions; a dash where a session has no reading for one."""
    unit = "cd/m²" if all(each.session.absolute for each in inspections) else "Y"
    heads = ("x", "y", f"white {unit}", "black", "contrast", "γ", "max ΔL*", "W/ΣRGB", "max grey ΔE", "noise", "drift")
    numbers = map(str, range(1, len(inspections) + 1)) if len(inspections) > 1 else [""]
    rows = [(number, *_figures(each)) for number, each in zip(numbers, inspections, strict=True)]
    return Table(("", *heads), rows)


def _figures(each: Inspection) -> list[str]:
    dash = "–"
    grey, steady = each.curves.get("grey"), each.steadiness
    x, y, white = xyz_to_xyY(each.white).tolist() if each.white is not None else (None, None, None)
    off = grey.lightness[grey.worst] if grey else None
    return [
        dash if value is None else f"{value:{form}}"
        for value, form in (
            (x, ".4f"),
            (y, ".4f"),
            (white, ".1f" if each.session.absolute else ".3f"),
            (each.black[1] if each.black is not None else None, ".3g"),
            (each.contrast, ".0f"),
            (each.gamma, ".2f"),
            (off, "+.1f"),
            (each.additivity, ".3f"),
            (each.greys.delta_e.max() if each.greys else None, ".1f"),
            (steady.noise if steady else None, ".2%"),
            (steady.drift if steady else None, "+.1%"),
        )
    ]


def channels(inspection: Inspection) -> Table:
    """Tabulate red, green and blue: chromaticity, distance from the standards, γ, end of the calibration curve."""
    tips, loop = inspection.primaries, inspection.calibration
    gamuts = list(tips.shift) if tips else []
    rows = []
    for place, name in enumerate(CHANNELS):
        known = tips is not None and name in tips.xyz
        x, y, luminance = (
            (f"{v:{f}}" for v, f in zip(xyz_to_xyY(tips.xyz[name]), (".4f", ".4f", ".4g"), strict=True))
            if tips and known
            else ("–",) * 3
        )
        shifts = [f"{tips.shift[gamut][name]:.3f}" if tips and known else "–" for gamut in gamuts]
        curve = inspection.curves.get(name)
        gamma = f"{curve.gamma:.2f}" if curve and curve.gamma is not None else "–"
        rows.append((name, x, y, luminance, *shifts, gamma, f"{loop.ends[place]:.3f}" if loop else "–"))
    headings = ("channel", "x", "y", "Y", *(f"Δu'v' {gamut}" for gamut in gamuts), "γ", "calibration ends")
    return Table(headings, rows)
