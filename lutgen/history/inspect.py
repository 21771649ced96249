"""Inspect one session without a model: its figures, remarks and missing patches, as ``lutgen inspect`` shows them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lutgen.colorimetry import Array, xyz_to_xyY
from lutgen.history import remarks, transfer
from lutgen.history.patches import CHANNELS, Primaries, additivity, mean_xyz, primaries, ramp
from lutgen.history.steadiness import left_out, steadiness
from lutgen.readings.session import Session
from lutgen.readings.steadiness import Steadiness


@dataclass(frozen=True)
class Inspection:
    """Results of one session."""

    #: The readings, without misread readings.
    session: Session
    #: Mean XYZ, (3,), in the session's unit (cd/m², or relative to white); None: not read.
    white: Array | None
    black: Array | None
    #: See their modules; None if the session lacks the patches.
    primaries: Primaries | None
    #: "grey" and the channels → transfer curve, of the ramps that were read.
    curves: dict[str, transfer.Transfer]
    #: Y of white over the sum of the primaries' Y, all minus black; None: white or a primary is missing.
    additivity: float | None
    #: See their modules; None if the session lacks the patches.
    greys: transfer.GreyTracking | None
    steadiness: Steadiness | None
    calibration: transfer.Calibration | None
    #: Smallest and largest luminance of white over the screen, relative to the centre; None: one place.
    uniformity: tuple[float, float] | None
    #: Sentences on the readings that were left out.
    misread: tuple[str, ...] = ()

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the session, each with its figure, most serious first."""
        return (
            *self.session.remarks,
            *(f"Misread: {each}." for each in self.misread),
            *remarks.on_steadiness(self.steadiness),
            *remarks.on_black(self.session, self.white, self.black),
            *remarks.on_additivity(self.additivity, self.black),
            *remarks.on_calibration(self.calibration),
            *remarks.on_white(self.session, self.white, self.calibration),
            *remarks.on_primaries(self.primaries),
            *remarks.on_clipping(self.curves),
            *remarks.on_curve(self.curves),
            *remarks.on_greys(self.greys),
            *remarks.on_uniformity(self.uniformity),
        )

    @cached_property
    def missing(self) -> tuple[str, ...]:
        """Sentences on missing patches and the diagnoses that need these patches."""
        return (*remarks.missing_patches(self.session), *remarks.missing_records(self.session))

    @property
    def contrast(self) -> float | None:
        """Y of white over Y of black; None if white or black was not read, or the meter cannot read so dark a black."""
        if self.white is None or self.black is None or not remarks.is_black_readable(self.session):
            return None
        return float(self.white[1] / self.black[1])

    @property
    def gamma(self) -> float | None:
        """γ of the greys."""
        return self.curves["grey"].gamma if "grey" in self.curves else None

    def as_json(self) -> dict[str, Any]:
        """Return the entry of ``lutgen inspect --json``; its schema is ``lutgen/history/schema/inspect.json``."""
        session, steady, greys, tips = self.session, self.steadiness, self.greys, self.primaries
        return {
            "file": session.file,
            "sha256": session.sha256,
            "format": session.form,
            "readings": len(session.drive),
            "created": session.created.isoformat() if session.created else None,
            "instrument": session.instrument or None,
            "display": session.display or None,
            "unit": "cd/m2" if session.absolute else "relative",
            "white": _colour_json(self.white),
            "black": _colour_json(self.black),
            "contrast": self.contrast,
            "primaries": {name[0]: _colour_json(tips.xyz.get(name)) if tips else None for name in CHANNELS},
            "gamut": tips and {"nearest": tips.nearest, "shift_uv": tips.shift, "srgb_coverage": tips.coverage},
            "gamma": self.gamma,
            "transfer": {name: _curve_json(curve) for name, curve in self.curves.items()},
            "additivity": self.additivity,
            "grey_tracking": greys
            and {
                "drive": greys.drive.tolist(),
                "delta_e": greys.delta_e.tolist(),
                "shift_uv": np.hypot(*greys.shift.T).tolist(),
            },
            "noise": steady and steady.noise,
            "repeats": steady
            and {
                "patches": steady.patches,
                "readings": steady.readings,
                "dark_noise": steady.dark_noise,
                "drift": steady.drift,
                "shift_uv": steady.shift,
                "order": steady.order.tolist(),
                "ratio": steady.ratio.tolist(),
            },
            "calibration": _calibration_json(self),
            "uniformity": dict(zip(("lowest", "highest"), self.uniformity, strict=True)) if self.uniformity else None,
            "remarks": list(self.remarks),
            "missing": list(self.missing),
        }


def _colour_json(xyz: Array | None) -> dict[str, float | None] | None:
    if xyz is None:
        return None
    x, y, luminance = xyz_to_xyY(xyz).tolist()
    return {"x": x, "y": y, "Y": luminance}


def _curve_json(curve: transfer.Transfer) -> dict[str, Any]:
    return {
        "gamma": curve.gamma,
        "residual": curve.residual,
        "drive": curve.drive.tolist(),
        "linear": curve.linear.tolist(),
        "lightness_from_srgb": curve.lightness.tolist(),
    }


def _calibration_json(inspection: Inspection) -> dict[str, Any] | None:
    loaded = inspection.calibration
    if loaded is None:
        return None
    return {
        "ends": dict(zip("rgb", loaded.ends.tolist(), strict=True)),
        "starts": dict(zip("rgb", loaded.starts.tolist(), strict=True)),
        "at_stop": list(loaded.at_stop),
        "luminance_cost": loaded.cost,
        "monotonic": loaded.monotonic,
        "bend": loaded.bend,
        "target": loaded.target,
        "native_gamma": {name[0]: transfer.native_gamma(inspection.session, name) for name in CHANNELS},
    }


def inspect_session(session: Session) -> Inspection:
    """Inspect a session without a model. A figure is None if the session lacks its patches; ``missing`` names these."""
    session, misread = left_out(session)
    white, black = mean_xyz(session, "white"), mean_xyz(session, "black")
    ramps = {name: ramp(session, name) for name in ("grey", *CHANNELS)}
    curves = {name: curve for name, each in ramps.items() if (curve := transfer.transfer(each, black)) is not None}
    return Inspection(
        session=session,
        white=white,
        black=black,
        primaries=primaries(session),
        curves=curves,
        additivity=additivity(session),
        greys=transfer.grey_tracking(ramps["grey"], white),
        steadiness=steadiness(session),
        calibration=transfer.calibration(session),
        uniformity=_uniformity(session),
        misread=misread,
    )


def _uniformity(session: Session) -> tuple[float, float] | None:
    if session.positions is None:
        return None
    white = np.array(session.kinds) == "white"
    middle = session.xyz[white & session.central, 1]
    if not middle.size or middle.mean() <= 0 or np.count_nonzero(white) == middle.size:
        return None
    ratio = session.xyz[white, 1] / middle.mean()
    return float(ratio.min()), float(ratio.max())
