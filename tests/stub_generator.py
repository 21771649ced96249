"""A generator of a few readings, for tests of the scoring: an additive display with a leak, or uniform decay."""

from collections.abc import Mapping

import numpy as np

from tests.generators.truth import Truth

KINDS = ("black-level", "crosstalk", "edge-falloff", "backlight-decay")
OUTSIDE = ("mood",)
KIN = {"mood": "black-level"}

PRIMARIES = np.array([[80.0, 40.0, 4.0], [70.0, 150.0, 20.0], [35.0, 14.0, 190.0]])
PATCHES = np.array(
    [
        *[(1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)] * 2,
        *[(0, 0, 0)] * 2,
        *[(level, level, level) for level in (0.1, 0.3, 0.5, 0.8)],
        *[(0.2, 0.6, 0.9), (0.7, 0.3, 0.1)],
    ]
)


def campaign(seed: int, hidden: Mapping[str, float], *, design: str = "full", habits: int = 0) -> Truth:
    """Return five hours of the same patches.

    ``black-level`` adds 0.3 cd/m²; ``backlight-decay`` removes 30 % of the light.
    """
    del design, habits
    hours = np.repeat([0.0, 3000.0, 7000.0, 12000.0, 18000.0], len(PATCHES))
    drive = np.tile(PATCHES, (5, 1)).astype(float)
    linear = np.where(drive <= 0.04045, drive / 12.92, ((drive + 0.055) / 1.055) ** 2.4)
    light = linear @ (PRIMARIES * np.random.default_rng(seed).uniform(0.9, 1.1))
    age = (hours / 18000.0)[:, np.newaxis]
    light = light * (1.0 - 0.3 * hidden.get("backlight-decay", 0.0) * age)
    light = light + 0.3 * (hidden.get("black-level", 0.0) + hidden.get("mood", 0.0)) * (0.3 + age)
    return Truth(
        hours=hours,
        drive=drive,
        xyz_cd_m2=light,
        conditions={},
        session=tuple(f"{hour:g}" for hour in hours),
        order=np.arange(hours.size, dtype=float),
        note=("",) * hours.size,
        metadata={"display": "stub"},
        hidden=dict(hidden),
    )
