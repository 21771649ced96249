"""The generator of tests/virtual_display behind the interface of the other generators; its forms differ from lutgen's.

The generator always writes files in its own way; ``habits`` has no effect here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.truth import Truth
from tests.virtual_display import designs
from tests.virtual_display.campaign import CONDITIONS, Campaign, header, noise_free
from tests.virtual_display.physics import EFFECTS, find, names
from tests.virtual_display.sealed import KIN
from tests.virtual_display.spectra import CLASSES

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["KIN", "KINDS", "OUTSIDE", "campaign"]

#: Effects of the display's own aging. When one of them is hidden, the display ages by it alone.
_LAWS = tuple(names(baseline="first-hour"))

KINDS = (*names(), *_LAWS)
OUTSIDE = tuple(sorted(name for name, form in EFFECTS if form == "outside"))

_DESIGNS = {"full": "full", "grey": "greys", "colour": "colours", "few": "greys"}
_FEW_HOURS = designs.HOURS[::2]


def campaign(seed: int, hidden: Mapping[str, float], *, design: str = "full", habits: int = 0) -> Truth:
    """Return one campaign. ``hidden`` maps an effect to its strength; 1.0 is typical.

    The code values have a whole number of bits.
    """
    del habits
    random = np.random.default_rng([seed, 0x0025])
    effects = {name: find(name, "outside" if name in OUTSIDE else "other") for name in hidden}
    classes = [str(name) for name in random.permutation(list(CLASSES))]
    planned = Campaign(
        display=next(name for name in classes if all(name in effect.classes for effect in effects.values())),
        design=_DESIGNS[design],
        hours=_FEW_HOURS if design == "few" else designs.HOURS,
        hidden=tuple((name, _size(name, effects[name].typical * hidden[name]), effects[name].form) for name in hidden),
        seed=seed,
        baseline="first-hour" if set(hidden) & set(_LAWS) else "colour-points",
        held=bool(random.integers(2)),
    )
    readings = planned.readings
    stated = header(planned)
    return Truth(
        hours=readings.hours,
        drive=readings.drive,
        xyz_cd_m2=noise_free(planned),
        conditions={name: getattr(readings, name) for name in CONDITIONS} if design == "full" else {},
        session=tuple(f"{hour:g}" for hour in readings.hours),
        order=np.arange(readings.n, dtype=float),
        note=readings.note,
        metadata={name: stated[name] for name in ("source", "display", "luminance")},
        hidden=dict(hidden),
    )


def _size(name: str, size: float) -> float:
    if name != "quantization":
        return size
    bits = np.clip(np.round(np.log2(1.0 / size + 1.0)), 1, 40)
    return float(1.0 / (2.0**bits - 1.0))
