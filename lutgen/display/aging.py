"""The aging of a measured display in the quantities that display engineers use: the output of ``lutgen show``.

Chromaticity differences are Euclidean in the CIE 1976 UCS diagram (CIE 15:2018, 8.1). Correlated colour temperature
(CCT) and D_uv, the distance from the Planckian locus, follow Ohno 2013, doi:10.1080/15502724.2014.839020.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import LINEAR_TO_XYZ, Array, xy_to_uv, xyz_to_uv
from lutgen.display import AppliedEffect, DisplayModel, what_luts_carry
from lutgen.numerals import spaced, with_error
from lutgen.readings import TIP_NAMES, Measurements

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Largest distance from the Planckian locus at which a correlated colour temperature is defined (CIE 15:2018, 9.5).
MAX_DUV = 0.05

#: Smallest Δu'v' of a shift with a direction: about the repeatability of a good meter.
UNMOVED = 0.001

#: Tolerance for a held luminance of white, as a share. Sensors of medical displays hold white within 1 to 2 %.
HELD = 0.02


@dataclass(frozen=True)
class Shown:
    """The aging of a display at n hours. Second axes are white, red, green, blue."""

    measurements: Measurements
    #: Hours, increasing, (n,).
    hours: Array
    #: xyY with Y in cd/m², (n, 4, 3): interpolated linearly between measured times; with effects the model's xyY.
    xyY: Array  # noqa: N815 - the CIE's own spelling
    #: CIE 1976 u', v', (n, 4, 2).
    uv: Array
    #: CCT of white in kelvin (NaN: too far from the Planckian locus), and D_uv, positive above the locus, (n,) each.
    cct: Array
    duv: Array
    #: CCT of white at hour 0, in kelvin.
    cct_new: float
    #: Δu'v' since hour 0, shape (n, 4).
    shift: Array
    #: Direction of white's shift since hour 0: the nearest of the six hues of sRGB, or "" without a shift, n texts.
    direction: tuple[str, ...]
    #: Y relative to hour 0, shape (n, 4).
    luminance: Array
    #: (Y_r + Y_g + Y_b − Y_w) / Y_w, shape (n,).
    non_additivity: Array
    #: Effects of the model, in chain order.
    effects: tuple[AppliedEffect, ...] = ()
    #: Sentences on conditions that a LUT fixes, and on effects that no LUT of the model can carry.
    remarks: tuple[str, ...] = ()
    #: Verdict of the fit.
    verdict: str = ""

    @property
    def provenance(self) -> str:
        """The source of the readings, in one sentence."""
        return self.measurements.provenance

    def sentence(self) -> str:
        """Summarise the last hour in one sentence: white point, luminance, the primary that has changed most.

        Readings of one hour show no aging, and the sentence says so.
        """
        if np.unique(self.measurements.hours).size == 1:
            return f"There is one session, at {spaced(self.hours[-1])} h, so that no aging can be shown."
        parts = [f"By {spaced(self.hours[-1])} h {self._white()}", self._luminance(), self._primary()]
        return "; ".join(part for part in parts if part) + "."

    def as_json(self) -> dict[str, Any]:
        """Return JSON: schema, display, and one object for each hour."""
        readings = self.measurements
        return {
            "schema": 1,
            "display": {
                "file": Path(readings.file).name,
                "sha256": readings.sha256,
                "metadata": dict(readings.metadata),
                "summary": self.sentence(),
            },
            **({"model": self._model_as_json()} if self.effects else {}),
            "hours": [self._hour_as_json(row) for row in range(self.hours.size)],
        }

    def effects_in_words(self) -> list[str]:
        """Return one line for each effect: its fitted parameters, and its other parameters that differ from rest."""
        return [f"{each.effect.name}: {', '.join(_values_in_words(each)) or 'on'}" for each in self.effects]

    def _model_as_json(self) -> dict[str, Any]:
        effects = []
        for each in self.effects:
            parameters = {
                name: {**asdict(estimate), "unit": each.effect.parameters[name].unit, "free": name in each.free}
                for name, estimate in each.estimates.items()
            }
            effects.append({"name": each.effect.name, "origin": each.effect.origin, "parameters": parameters})
        return {"verdict": self.verdict, "effects": effects, "remarks": list(self.remarks)}

    def _white(self) -> str:
        moved = self.shift[-1, 0]
        if not self.direction[-1]:
            return f"white has hardly moved (Δu'v' {moved:.4f})"
        kelvin = f" ({self.cct_new:.0f} K → {self.cct[-1]:.0f} K)"
        known = np.isfinite(self.cct_new) and np.isfinite(self.cct[-1])
        return f"white has moved Δu'v' {moved:.3f} toward {self.direction[-1]}{kelvin if known else ''}"

    def _luminance(self) -> str:
        white = self.luminance[:, 0]
        off = float(np.abs(white - 1.0).max())
        if off <= HELD:
            return f"its luminance is held to {100 * off:.1f} %"
        return f"its luminance has {'fallen' if white[-1] < 1 else 'risen'} to {100 * white[-1]:.0f} %"

    def _primary(self) -> str:
        """Return a clause on the primary whose luminance relative to white has changed most, or ""."""
        against_white = self.luminance[-1, 1:] / self.luminance[-1, 0] - 1.0
        worst = int(np.argmax(np.abs(against_white)))
        change = against_white[worst]
        if abs(change) < HELD:
            return ""
        verb = "lost" if change < 0 else "gained"
        return f"{TIP_NAMES[1 + worst]} has {verb} {100 * abs(change):.0f} % against white"

    def _hour_as_json(self, row: int) -> dict[str, Any]:
        tips = {
            name: {
                "x": float(self.xyY[row, i, 0]),
                "y": float(self.xyY[row, i, 1]),
                "Y_cd_m2": float(self.xyY[row, i, 2]),
                "delta_uv": float(self.shift[row, i]),
                "relative_luminance": float(self.luminance[row, i]),
            }
            for i, name in enumerate(TIP_NAMES)
        }
        return {
            "hours": float(self.hours[row]),
            "cct_k": float(self.cct[row]) if np.isfinite(self.cct[row]) else None,
            "duv": float(self.duv[row]) if np.isfinite(self.duv[row]) else None,
            "direction": self.direction[row] or None,
            "non_additivity": float(self.non_additivity[row]),
            **tips,
        }


def show(model: DisplayModel, hours: Sequence[float] | None = None) -> Shown:
    """Return the aging of the display of ``model``.

    Parameters
    ----------
    hours
        Hours, increasing; default: every measured time.

    Raises
    ------
    LutgenError
        Hours outside the measured span.

    """
    times = model.tips.hours if hours is None else np.array(hours, dtype=np.float64)
    fresh, xyY = model.shown_tips(0.0), np.array([model.shown_tips(float(hour)) for hour in times])
    uv, new = xy_to_uv(xyY[..., :2]), xy_to_uv(fresh[:, :2])
    cct, duv = cct_and_duv(np.concatenate([new[:1], uv[:, 0]]))
    luminance = xyY[..., 2]
    return Shown(
        measurements=model.measurements,
        hours=times,
        xyY=xyY,
        uv=uv,
        cct=cct[1:],
        duv=duv[1:],
        cct_new=float(cct[0]),
        shift=np.linalg.norm(uv - new, axis=-1),
        direction=tuple(toward(moved) for moved in uv[:, 0] - new[0]),
        luminance=luminance / fresh[:, 2],
        non_additivity=(luminance[:, 1:].sum(axis=1) - luminance[:, 0]) / luminance[:, 0],
        effects=model.effects,
        remarks=tuple(what_luts_carry(model)),
        verdict=model.verdict,
    )


def _values_in_words(each: AppliedEffect) -> list[str]:
    rest, values = each.effect.rest(), []
    for name, estimate in each.estimates.items():
        if name in each.free or estimate.value != rest[name]:
            value = with_error(estimate.value, estimate.stderr, each.effect.parameters[name].unit)
            values.append(f"{name} {value}{' (at its bound)' if estimate.at_bound else ''}")
    return values


def cct_and_duv(uv: Array) -> tuple[Array, Array]:
    """Convert CIE 1976 u', v' (n, 2) to CCT in kelvin and D_uv, (n,) each; both are NaN beyond ``MAX_DUV``."""
    from colour.temperature import uv_to_CCT_Ohno2013

    cct, duv = np.moveaxis(np.asarray(uv_to_CCT_Ohno2013(uv * (1.0, 2.0 / 3.0)), dtype=np.float64), -1, 0)
    near = np.abs(duv) <= MAX_DUV
    return np.where(near, cct, np.nan), np.where(near, duv, np.nan)


def toward(moved: Array) -> str:
    """Return the hue in the direction of a shift in u'v', (2,); "" for a shift shorter than ``UNMOVED``."""
    if np.hypot(*moved) < UNMOVED:
        return ""
    return max(_HUES, key=lambda name: float(_HUES[name] @ moved))


_DRIVES = {"red": "100", "yellow": "110", "green": "010", "cyan": "011", "blue": "001", "magenta": "101"}
_SHIFTS = {
    name: xyz_to_uv(LINEAR_TO_XYZ @ np.array(list(drive), dtype=float)) - xyz_to_uv(LINEAR_TO_XYZ.sum(axis=1))
    for name, drive in _DRIVES.items()
}

#: Unit vectors in u'v' from sRGB's white to its primaries and secondaries.
_HUES = {name: shift / np.hypot(*shift) for name, shift in _SHIFTS.items()}
