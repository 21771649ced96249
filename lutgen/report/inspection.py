"""The pages of ``lutgen inspect`` and ``lutgen sessions explain``, and the picture of a session."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import SRGB_XY, code_to_linear, xy_to_uv, xyz_to_xyY
from lutgen.history.patches import CHANNELS, GAMUTS
from lutgen.history.transfer import lightness
from lutgen.numerals import spaced
from lutgen.report.aging_plot import TIP_COLOURS, chromaticity_diagram
from lutgen.report.drawing import BAND, BLACK, GREY, RED, named_once, picture, tidy
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes

    from lutgen.history import Inspection
    from lutgen.history.explain import Explanations
    from lutgen.readings.campaign import Campaign


def inspect_page(inspections: Sequence[Inspection]) -> Iterator[Part]:
    """Yield what ``lutgen inspect`` prints."""
    several = len(inspections) > 1
    in_all: Sequence[str] = ()
    if several:
        in_all = [told for told in inspections[0].missing if all(told in each.missing for each in inspections)]
        yield overview(inspections)
    for number, each in enumerate(inspections, start=1):
        if several:
            yield ""
        yield Headline(f"{f'{number}  ' if several else ''}{Path(each.session.file).name}")
        yield origin(each)
        if not several:
            yield overview(inspections)
        if each.primaries or each.calibration:
            yield channels(each)
        yield from (f"• {remark}" for remark in each.remarks)
        if missing := [told for told in each.missing if told not in in_all]:
            yield f"Missing: {' '.join(missing)}"
    if in_all:
        yield ""
        yield f"Missing in every session: {' '.join(in_all)}"


def origin(inspection: Inspection) -> str:
    """Return the origin of a session: readings, format, display, instrument, date."""
    session = inspection.session
    parts = [f"{len(session.drive)} readings", session.form]
    parts += [text for text in (session.display, session.instrument) if text]
    if session.created:
        parts.append(f"{session.created:%Y-%m-%d %H:%M}")
    simulated = next((text for key, text in session.metadata.items() if key.upper() == "SIMULATED"), "")
    return f"{', '.join(parts)}.{f' Simulated: {simulated}.' if simulated else ''}"


def overview(inspections: Sequence[Inspection]) -> Table:
    """Return a table of the main figures of the sessions; a dash: the session has no reading for the figure."""
    unit = "cd/m²" if all(each.session.absolute for each in inspections) else "Y"
    heads = ("x", "y", f"white {unit}", "black", "contrast", "γ", "max ΔL*", "W/ΣRGB", "max grey ΔE", "noise", "drift")
    numbers = map(str, range(1, len(inspections) + 1)) if len(inspections) > 1 else [""]
    rows = [(number, *_figures(each)) for number, each in zip(numbers, inspections, strict=True)]
    return Table(("", *heads), rows)


def _figures(each: Inspection) -> list[str]:
    grey, steady = each.curves.get("grey"), each.steadiness
    x, y, white = xyz_to_xyY(each.white).tolist() if each.white is not None else (None, None, None)
    return [
        "–" if value is None else f"{value:{form}}".replace("%", " %")
        for value, form in (
            (x, ".4f"),
            (y, ".4f"),
            (white, ".1f" if each.session.absolute else ".3f"),
            (each.black[1] if each.black is not None else None, ".3g"),
            (each.contrast, ".0f"),
            (each.gamma, ".2f"),
            (grey.lightness[grey.worst] if grey else None, "+.1f"),
            (each.additivity, ".3f"),
            (each.greys.delta_e.max() if each.greys else None, ".1f"),
            (steady.noise if steady else None, ".2%"),
            (steady.drift if steady else None, "+.1%"),
        )
    ]


def channels(inspection: Inspection) -> Table:
    """Return a table of the channels: chromaticity, distance from standards, γ, end of the calibration curve."""
    tips, loop = inspection.primaries, inspection.calibration
    gamuts = list(tips.shift) if tips else []
    rows = []
    for place, name in enumerate(CHANNELS):
        light = ["–"] * (3 + len(gamuts))
        if tips and name in tips.xyz:
            x, y, luminance = xyz_to_xyY(tips.xyz[name])
            light = [f"{x:.4f}", f"{y:.4f}", f"{luminance:.4g}", *(f"{tips.shift[each][name]:.3f}" for each in gamuts)]
        curve = inspection.curves.get(name)
        gamma = f"{curve.gamma:.2f}" if curve and curve.gamma is not None else "–"
        rows.append((name, *light, gamma, f"{loop.ends[place]:.3f}" if loop else "–"))
    headings = ("channel", "x", "y", "Y", *(f"Δu'v' {gamut}" for gamut in gamuts), "γ", "calibration ends")
    return Table(headings, rows)


def explanation_page(explanations: Explanations) -> Iterator[Part]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = explanations.campaign.entries[explanations.reference].session
    yield from simulated(explanations.campaign)
    yield f"Compared with {Path(reference.file).name}."
    explained = list(zip(explanations.pairs, explanations.verdicts, strict=True))
    in_hours = all(pair.hours is not None for pair in explanations.pairs)
    rows = []
    for pair, verdict in explained:
        time = pair.hours if in_hours else pair.days
        when = "–" if time is None else spaced(time if in_hours else round(time))
        name = Path(pair.after.session.file).name
        rows.append((name, when, verdict.kind, verdict.causes_in_words or "–", verdict.display))
    yield Table(("session", "hours" if in_hours else "days", "verdict", "cause", "the display"), rows)
    for pair, verdict in explained:
        yield ""
        yield Headline(Path(pair.after.session.file).name)
        yield verdict.sentence
        yield from (f"• {each}" for each in verdict.evidence)
        yield from (f"To confirm or refute: {each}." for each in verdict.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that names simulated sessions, if there are any."""
    metadata = (pair for entry in campaign.entries for pair in entry.session.metadata.items())
    notices = [text for key, text in metadata if key.upper() == "SIMULATED"]
    yield from (f"Simulated, not measured: {text}." for text in notices[:1])


#: Colours of the curves of greys and channels.
COLOURS = dict(zip(("grey", *CHANNELS), TIP_COLOURS, strict=True))

#: Least span of the axes of ΔL*, ΔE2000 and drift, so that noise does not look like an error.
_CALM_LIGHTNESS, _CALM_CAST, _CALM_DRIFT = 5.0, 4.0, 2.0

#: Most characters in a line of remarks, and most lines.
_REMARK_LETTERS, _REMARK_LINES = 63, 12


def picture_names(files: Sequence[str]) -> list[str]:
    """Return the name of each session's picture. Raises LutgenError if two names are equal.

    A session of a table is called "aged.csv, hour 2000" or "aged.csv, hour 2000, session A".
    """
    names = []
    for file in files:
        table, of_table, session = Path(file).name.partition(", hour ")
        hour = f"-hour-{session.replace(', ', '-').replace(' ', '-')}" if of_table else ""
        names.append(f"inspect-{Path(table).stem}{hour}.png")
    return named_once(names, "sessions")


def plot_inspection(inspection: Inspection, path: Path, *, force: bool = False) -> None:
    """Draw a session's page, the same bytes on every run. Raises LutgenError if it cannot be written."""
    foot = "u'v' and greys include the light of black; it is subtracted from the curves."
    second = f"{Path(inspection.session.file).name}: {origin(inspection)}"
    with picture(path, headline(inspection), second=second, foot=foot, height=9.4, force=force) as (figure, low, high):
        grid = figure.add_gridspec(
            1, 3, left=0.045, right=0.985, bottom=low + 0.06, top=high - 0.04, wspace=0.2, width_ratios=(1.15, 1, 1)
        )
        left = grid[0].subgridspec(2, 1, hspace=0.2, height_ratios=(2.3, 1))
        middle, right = grid[1].subgridspec(2, 1, hspace=0.32), grid[2].subgridspec(3, 1, hspace=0.62)
        chromaticities(figure.add_subplot(left[0]), inspection)
        what_stands_out(figure.add_subplot(left[1]), inspection)
        transfer_curve(figure.add_subplot(middle[0]), inspection)
        lightness_error(figure.add_subplot(middle[1]), inspection)
        casts(figure.add_subplot(right[0]), inspection)
        calibration_curves(figure.add_subplot(right[1]), inspection)
        (uniformity if inspection.uniformity else drift)(figure.add_subplot(right[2]), inspection)


def headline(inspection: Inspection) -> str:
    """Return a summary of a session in one line: white, contrast, γ, additivity."""
    parts = []
    if inspection.white is not None:
        parts.append(f"white {inspection.white[1]:.0f} cd/m²" if inspection.session.absolute else "relative to white")
    if inspection.contrast is not None:
        parts.append(f"contrast {inspection.contrast:.0f}")
    if inspection.gamma is not None:
        parts.append(f"γ {inspection.gamma:.2f}")
    if inspection.additivity is not None:
        parts.append(f"white / (R + G + B) {inspection.additivity:.3f}")
    name = inspection.session.display or Path(inspection.session.file).stem
    return f"{name[:30]}: {', '.join(parts) or 'no white, no curve'}"


def what_stands_out(axes: Axes, inspection: Inspection) -> None:
    """Write as many remarks as fit, the most serious first."""
    axes.axis("off")
    axes.set_title("What stands out", fontsize=12, loc="left", weight="bold")
    kept, space = [], _REMARK_LINES
    for remark in inspection.remarks:
        lines = textwrap.wrap(remark, _REMARK_LETTERS, initial_indent="• ", subsequent_indent="   ")
        if len(lines) > space:
            break
        kept += lines
        space -= len(lines)
    axes.text(0.0, 0.98, "\n".join(kept) or "Nothing.", fontsize=10, va="top", transform=axes.transAxes)


def chromaticities(axes: Axes, inspection: Inspection) -> None:
    """Draw the display's triangle and white in u'v' over those of sRGB and P3."""
    chromaticity_diagram(axes)
    for (name, xy), line in zip(list(GAMUTS.items())[:2], ("--", ":"), strict=True):
        uv = xy_to_uv(np.vstack([xy, xy[:1]]))
        axes.plot(*uv.T, line, color="#555555", linewidth=1.3, label=name)
    axes.plot(*xy_to_uv(SRGB_XY[0]), "+", color="#555555", markersize=12, label="D65")
    if inspection.primaries:
        uv = np.array([xy_to_uv(xy) for xy in inspection.primaries.xy.values()])
        closed = np.vstack([uv, uv[:1]]) if len(uv) == 3 else uv
        axes.plot(*closed.T, "o-", color=BLACK, linewidth=2.0, markersize=6, label="this display")
    if inspection.white is not None:
        uv = xy_to_uv(xyz_to_xyY(inspection.white)[:2])
        axes.plot(*uv, "o", color="white", markeredgecolor=BLACK, markersize=8, label="its white")
    axes.set(xlim=(-0.02, 0.65), ylim=(-0.02, 0.62), xlabel="u'", ylabel="v'", aspect="equal")
    axes.set_title("Primaries and white, CIE 1976 u'v'", fontsize=12, loc="left")
    axes.legend(loc="lower right", fontsize=10, frameon=False)


def transfer_curve(axes: Axes, inspection: Inspection) -> None:
    """Draw luminance, with black subtracted, against code value, over sRGB."""
    code = np.linspace(0.0, 1.0, 200)
    axes.plot(code, code_to_linear(code), color=GREY, linewidth=5, alpha=0.35, label="sRGB")
    for name, curve in inspection.curves.items():
        gamma = f", γ {curve.gamma:.2f}" if curve.gamma is not None else ""
        colour, label = COLOURS[name], f"{name}{gamma}"
        axes.plot(curve.drive, curve.linear, ".-", color=colour, markersize=4, linewidth=1.2, label=label)
    axes.set(xlabel="code value", ylabel="luminance / full drive", xlim=(0, 1.02))
    axes.set_title("Transfer curve", fontsize=12, loc="left")
    axes.legend(loc="upper left", fontsize=10, frameon=False)
    tidy(axes)


def lightness_error(axes: Axes, inspection: Inspection) -> None:
    """Draw the difference of L* between each curve and sRGB."""
    axes.axhspan(-1, 1, color=BAND, alpha=0.6, linewidth=0, label="hardly seen")
    reach = _CALM_LIGHTNESS
    for name, curve in inspection.curves.items():
        axes.plot(curve.drive, curve.lightness, ".-", color=COLOURS[name], markersize=4, linewidth=1.2)
        reach = max(reach, 1.1 * float(np.abs(curve.lightness).max()))
    code = np.linspace(0.01, 1.0, 200)
    off = lightness(code**2.2) - lightness(code_to_linear(code))
    axes.plot(code, off, "--", color=GREY, linewidth=1, label="γ 2.2")
    axes.set(xlabel="code value", ylabel="ΔL*, display − sRGB", ylim=(-reach, reach), xlim=(0, 1.02))
    axes.set_title("Deviation from sRGB: above 0 is lighter", fontsize=12, loc="left")
    axes.legend(loc="lower right", fontsize=9, frameon=False)
    tidy(axes)


def casts(axes: Axes, inspection: Inspection) -> None:
    """Draw the colour difference of greys from white, by code value."""
    axes.set_title("Grey tracking: ΔE2000 to white's colour", fontsize=12, loc="left")
    if inspection.greys is None:
        _note(axes, "no greys beside white")
        return
    axes.plot(inspection.greys.drive, inspection.greys.delta_e, ".-", color=BLACK, markersize=4)
    axes.axhline(1.0, color=GREY, linewidth=1, linestyle="--")
    reach = max(_CALM_CAST, 1.1 * float(inspection.greys.delta_e.max()))
    axes.set(xlim=(0, 1.02), ylim=(0, reach), xlabel="code value")
    tidy(axes)


def calibration_curves(axes: Axes, inspection: Inspection) -> None:
    """Draw output − input of the loaded calibration curves of each channel."""
    axes.set_title("Calibration: output − input", fontsize=12, loc="left")
    curves, loop = inspection.session.calibration, inspection.calibration
    if curves is None or loop is None:
        _note(axes, "no calibration curves in the file")
        return
    axes.axhline(0.0, color=GREY, linewidth=1)
    for place, name in enumerate(CHANNELS):
        stop = " (stop)" if name in loop.at_stop else ""
        label = f"{name} {loop.ends[place]:.3f}{stop}"
        axes.plot(curves[:, 0], curves[:, 1 + place] - curves[:, 0], color=COLOURS[name], label=label)
    axes.set(xlim=(0, 1.02), xlabel="code value in")
    axes.legend(loc="best", fontsize=9, frameon=False)
    tidy(axes)


def drift(axes: Axes, inspection: Inspection) -> None:
    """Draw repeated bright patches, in percent of their first reading, against their order in the session."""
    axes.set_title("Drift of repeated bright patches, %", fontsize=12, loc="left")
    steady = inspection.steadiness
    if steady is None:
        _note(axes, "no bright patch was read twice")
        return
    percent = 100.0 * (steady.ratio - 1.0)
    reach = max(_CALM_DRIFT, 1.15 * float(np.abs(percent).max()))
    axes.axhline(0.0, color=GREY, linewidth=1)
    axes.plot(100.0 * steady.order, percent, "o", color=RED if abs(steady.drift) >= 0.03 else BLACK, markersize=6)
    axes.set(xlim=(-2, 102), ylim=(-reach, reach), xlabel="readings done, %")
    tidy(axes)


def uniformity(axes: Axes, inspection: Inspection) -> None:
    """Write white's luminance at each place of the screen, in percent of the centre."""
    session = inspection.session
    axes.set_title("White over the screen, % of the middle", fontsize=12, loc="left")
    white = np.array(session.kinds) == "white"
    middle = session.xyz[white & session.central, 1].mean()
    places = session.positions if session.positions is not None else np.full((len(white), 2), 0.5)
    for (u, v), luminance in zip(places[white], session.xyz[white, 1], strict=True):
        axes.text(u, v, f"{100.0 * luminance / middle:.0f}", ha="center", va="center", fontsize=12)
    axes.set(xlim=(0, 1), ylim=(1, 0), xticks=[], yticks=[])


def _note(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color=GREY, fontsize=11)
    axes.set(xticks=[], yticks=[])
