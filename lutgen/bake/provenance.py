"""The texts in LUTs and configs that describe their origin and their errors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.config import CORRECTION, SIMULATION, AgedConfig
from lutgen.bake.formats import Provenance
from lutgen.bake.littlecms import source_profile_in
from lutgen.bake.manifest import sha256
from lutgen.display import MODES, compensation_of, hour_name
from lutgen.numerals import in_percent
from lutgen.version import __version__

if TYPE_CHECKING:
    from lutgen.bake.figures import Figures
    from lutgen.bake.lut import Lut, MatrixLut
    from lutgen.bake.plan import BuildPlan
    from lutgen.display import AgedDisplay, DisplayModel
    from lutgen.display.trace import Applied

_SENDS = "the code values with which an aged display looks un-aged"
_OUTSIDE = "drives outside 0..1 are for the display to clip"


def provenance_of(model: DisplayModel, aged: AgedDisplay, lut: Lut | MatrixLut, error: Figures) -> Provenance:
    """Return the description inside a LUT: its inputs and its errors."""
    readings, link, source = model.measurements, compensation_of(aged), source_profile_in(aged)
    grid = f"{lut.size}^3 in {lut.space} values, tetrahedral" if lut.size else "one matrix in linear light"
    figures = f"dE2000 of the table mean {error.mean:.4f}, 99 % {error.p99:.4f}, max {error.max:.4f}"
    hour = hour_name(aged.hours)
    first = _SENDS if link else "what an aged display shows, for an un-aged sRGB viewer"
    lines = (
        f"lutgen {__version__}: {first}",
        f"display: {Path(readings.file).name}, SHA-256 {readings.sha256}",
        *(f"source: {text}" for key, text in readings.metadata.items() if key == "source"),
        f"model: reference {model.reference}, selection {model.selection}, luminance {model.luminance.name}",
        *_refinements(model),
        f"mode: {aged.mode}",
        f"hours: {hour.removesuffix('h')}",
        *([f"source profile: {source.name}, SHA-256 {sha256(source.data)}"] if source else []),
        *([f"light of the un-aged display: times {link.scale:.6f}; {_OUTSIDE}"] if link else []),
        f"grid: {grid}",
        f"fidelity: {figures} over {error.colours} colours, borders included; certificate in manifest.json",
    )
    name, kind = ("Correction of an aged display", "compensate-") if link else ("Aged display", "")
    identifier = f"lutgen-{kind}{aged.mode}-{hour}-{readings.sha256[:12]}"
    return Provenance(f"{name}, {aged.mode}, {hour}", identifier, lines, "compensate" if link else "simulate")


def _refinements(model: DisplayModel) -> list[str]:
    """Return the choices of a model that differ from the paper, one per line, in ASCII as a .cube requires."""
    lines = {
        "colour-points": [],
        "first-hour": ["baseline: white and primaries of hour 0 alone, all aging comes from the effects"],
        "native": ["baseline: native, the display's own model of the first session"],
        "native-first-hour": [
            "baseline: the display's own model of the first session alone, all aging comes from the effects"
        ],
    }[model.baseline]
    acting: tuple[Applied, ...] = (*model.known, *model.baked)
    for each in acting:
        values = ", ".join(f"{name} {value:.6g}" for name, value in each.values.items())
        lines.append(f"effect: {each.effect.name}{f' ({values})' if values else ''}")
    stated = ", ".join(f"{name} = {value:g}" for name, value in model.conditions.stated().items())
    return lines + ([f"at: {stated}"] if stated else [])


def config_of_display(aged: AgedDisplay, lut: str, *, unclipped: bool) -> AgedConfig:
    """Return the config of one mode and hour. ``unclipped``: its LUT keeps numbers outside 0..1."""
    hour, link = hour_name(aged.hours), compensation_of(aged)
    shown = f"mode {aged.mode} ({MODES[aged.mode]}), {hour}."
    if link is None:
        return AgedConfig(f"{aged.mode}_{hour}", f"An aged display: {shown} {_reach(unclipped=unclipped)}", lut)
    dimmed = f" Everything is dimmed to {in_percent(link.scale, 1)} of its light." if link.scale < 1.0 else ""
    text = f"Compensated for an aged display: {shown}{dimmed} Other displays show it wrong."
    return AgedConfig(f"compensate_{aged.mode}_{hour}", text, lut, words=CORRECTION)


def config_of_all(plan: BuildPlan, lut: str, *, unclipped: bool) -> AgedConfig:
    """Return the common config, which selects modes and hours by context variables."""
    first, last = (hour_name(hour).removesuffix("h") for hour in (min(plan.hours), max(plan.hours)))
    correction = plan.direction == "compensate"
    mode = "chroma" if "chroma" in plan.modes else plan.modes[0]
    reach = "Other displays show it wrong." if correction else _reach(unclipped=unclipped)
    text = (
        f"{'Compensated for aged' if correction else 'Aged'} displays: choose by the context variables "
        f"AGING_MODE ({', '.join(plan.modes)}) and AGING_HOURS ({first} to {last}). {reach}"
    )
    return AgedConfig(
        "compensated_displays" if correction else "aged_displays",
        text,
        f"${{AGING_MODE}}/${{AGING_HOURS}}h/{lut}",
        {"AGING_HOURS": last, "AGING_MODE": mode},
        CORRECTION if correction else SIMULATION,
    )


def _reach(*, unclipped: bool) -> str:
    if unclipped:
        return "Aged colours outside sRGB reach wider viewers."
    return "Aged colours are clipped to sRGB, on wider viewers too."
