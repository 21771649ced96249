"""``Campaign``: one display, measured over its life with one design and one instrument; as a CSV and as true light."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_display import designs
from tests.virtual_display.display import Display, Hidden, display_of, xyz_at_eye
from tests.virtual_display.instrument import NOISE
from tests.virtual_display.physics import find
from tests.virtual_display.readings import Readings, at_rest

if TYPE_CHECKING:
    from tests.virtual_display.spectra import Array

#: Columns that only the full design has, after hour, R, G, B.
CONDITIONS = ("u", "v", "ambient_lx", "warmup_min", "temperature_c", "window", "surround")


@dataclass(frozen=True)
class Campaign:
    """All parameters of a data set.

    Attributes
    ----------
    display
        Display class, a key of ``spectra.CLASSES``.
    design, hours
        One of ``designs.DESIGNS``, and the hours of the sessions.
    hidden
        Effects as (name, size, form).
    noise
        A key of ``instrument.NOISE``.
    seed
        Random seed of the display, its traits, the design's mixtures, and the noise.
    baseline
        ``colour-points``: the display ages, and the tips show the aging. ``first-hour``: only the hidden effect ages
        the display.
    held
        Whether a sensor holds white's luminance.
    ageing
        Rate of the aging that tips absorb; 1 is usual.
    room_lx
        Room light at every reading, absent from the file.
    metadata
        Further ``# key: value`` lines; they replace lines with the same key.

    """

    display: str = "white LED LCD"
    design: str = "full"
    hours: tuple[float, ...] = designs.HOURS
    hidden: Hidden = ()
    noise: str = "good"
    seed: int = 0
    baseline: str = "colour-points"
    held: bool = False
    ageing: float = 1.0
    room_lx: float = 0.0
    metadata: tuple[tuple[str, str], ...] = ()

    @property
    def readings(self) -> Readings:
        """Return the patches and conditions, in reading order."""
        planned = designs.readings(self.design, self.hours, self.seed)
        return replace(planned, ambient_lx=planned.ambient_lx + self.room_lx)

    @property
    def panel(self) -> Display:
        """Return the display."""
        ageing = self.ageing if self.baseline == "colour-points" else 0.0
        return display_of(self.display, seed=self.seed, ageing=ageing, held=self.held)


def noise_free(campaign: Campaign, hidden: Hidden | None = None) -> Array:
    """Return XYZ in cd/m² of the campaign's readings, without noise; ``hidden`` replaces the hidden effects."""
    effects = campaign.hidden if hidden is None else hidden
    return xyz_at_eye(campaign.panel, campaign.readings, effects, seed=campaign.seed)


def truth(campaign: Campaign, code: Array, hours: float) -> Array:
    """Return XYZ in cd/m² that the display shows for code values (m, 3).

    The conditions are: centre, warm, dark room, full screen, no instrument.
    """
    shown = tuple(item for item in campaign.hidden if find(item[0], item[2]).stage != "instrument")
    return xyz_at_eye(campaign.panel, at_rest(code, hours), shown, seed=campaign.seed)


def measured(campaign: Campaign, *, scatter: float = 1.0) -> Array:
    """Return XYZ in cd/m² as the instrument reports it, (n, 3); ``scatter`` multiplies the noise of each reading."""
    rng = np.random.default_rng([campaign.seed, 0x501])
    _, session = np.unique(campaign.readings.hours, return_inverse=True)
    return NOISE[campaign.noise].times(scatter).read(noise_free(campaign), session, rng)


def csv_text(campaign: Campaign) -> str:
    """Return the data set as lutgen's CSV, without the hidden effects."""
    readings = campaign.readings
    return table(readings, measured(campaign), header(campaign), conditions=campaign.design == "full")


def header(campaign: Campaign) -> dict[str, str]:
    """Return the ``# key: value`` lines."""
    noise = NOISE[campaign.noise]
    entries = {
        "source": "SIMULATED, not measured: tests/virtual_display of lutgen",
        "display": f"simulated {campaign.display}",
        "instrument": (
            f"simulated colorimeter, 1 sigma {100 * noise.relative:g} % and {noise.floor_cd_m2:g} cd/m2 a reading"
        ),
        "session_gain": f"{noise.session:g}",
        "luminance": "held" if campaign.held else "free",
    }
    return entries | dict(campaign.metadata)


def table(readings: Readings, xyz: Array, lines: dict[str, str], *, conditions: bool) -> str:
    """Write readings and their XYZ as text, with six significant digits."""
    columns = {"hour": readings.hours, **dict(zip("RGB", readings.drive.T, strict=True))}
    if conditions:
        columns |= {name: getattr(readings, name) for name in CONDITIONS}
    columns |= dict(zip("XYZ", xyz.T, strict=True))
    cells = [[_cell(value) for value in values] for values in columns.values()]
    names = [*columns]
    if conditions:
        names, cells = [*names, "note"], [*cells, list(readings.note)]
    rows = [",".join(names), *(",".join(row) for row in zip(*cells, strict=True))]
    return "\n".join([*(f"# {key}: {value}" for key, value in lines.items()), *rows]) + "\n"


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.6g}"
