"""Groups of readings of a simulated campaign, by patch, time and condition."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.truth import Truth

    Mask = NDArray[np.bool_]


def groups(truth: Truth) -> dict[str, Mask]:
    """Return every group of readings (n,) of a simulated campaign of the full design in the plain way of writing."""
    drive, rest = truth.drive, {"u": 0.5, "v": 0.5, "ambient_lx": 0.0, "warmup_min": 60.0, "temperature_c": 23.0}
    lit = (drive > 0.001).sum(axis=1)
    away = {column: truth.conditions[column] != value for column, value in rest.items()}
    capped = np.array([note == "lens cap" for note in truth.note])
    window = truth.conditions["window"] < 1
    single = (lit == 1) & (drive.max(axis=1) < 0.999)
    level = np.where(lit > 0, drive.max(axis=1), 0.0)
    return {
        "first": truth.hours == 0,
        "later": truth.hours > 0,
        "last": truth.hours == truth.hours.max(),
        "capped": capped,
        "shrouded": np.array([note == "shrouded" for note in truth.note]),
        "black": (lit == 0) & ~capped,
        "white": (drive > 0.999).all(axis=1),
        "corner": ((drive < 0.001) | (drive > 0.999)).all(axis=1),
        "grey": (np.ptp(drive, axis=1) < 1e-3) & (level > 0.001) & (level < 0.999),
        "middle": (level > 0.35) & (level < 0.7),
        "dark": (level > 0.001) & (level < 0.2),
        "bright": (level > 0.9) & (level < 0.999),
        "single": single,
        "one": (lit <= 1) & ~capped,
        "mixed": lit > 1,
        "off-centre": away["u"] | away["v"],
        "lit room": away["ambient_lx"],
        "cold": away["warmup_min"],
        "warm room": away["temperature_c"],
        "window": window,
        "surround": truth.conditions["surround"] > 0,
        "rest": ~(np.any(list(away.values()), axis=0) | window | capped),
        "all": np.ones(len(truth.hours), dtype=bool),
    }


def select(truth: Truth, words: str) -> Mask:
    """Return the simulated readings (n,) in all the groups, such as "last, grey, rest"; "not-" negates a group."""
    known = groups(truth)
    chosen = known["all"]
    for word in words.split(", "):
        chosen = chosen & (~known[word[4:]] if word.startswith("not-") else known[word])
    return chosen
