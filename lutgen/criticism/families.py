"""Readings that belong together: by hour, level, colour family, position and condition."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from lutgen.measurements.table import OPTIONAL, is_capped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.problem import Problem

#: Levels are reported in these bands of the largest code value.
LEVELS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)


def family_of(problem: Problem) -> NDArray[np.str_]:
    """Colour family of each reading, (n,): tips, black, grey, red, green, blue, secondary, mixture, lens cap."""
    drive = problem.readings.drive[problem.rows]
    red, green, blue = (drive > 0).T
    lit = red.astype(int) + green + blue
    top = drive.max(axis=1)
    full = ((drive == 0) | (drive == 1)).all(axis=1)
    even = np.ptp(drive, axis=1) == 0
    pair = (lit == 2) & (np.ptp(np.sort(drive, axis=1)[:, 1:], axis=1) == 0)
    names = np.select(
        [
            is_capped(problem.readings)[problem.rows],
            top == 0,
            full & ((lit == 1) | (lit == 3)),
            even,
            (lit == 1) & red,
            (lit == 1) & green,
            (lit == 1) & blue,
            pair,
        ],
        ["lens cap", "black", "tips", "grey", "red ramp", "green ramp", "blue ramp", "secondary"],
        "mixture",
    )
    return np.asarray(names)


def condition_of(problem: Problem) -> NDArray[np.str_]:
    """What is unusual about how each reading was taken, (n,): position, ambient, cold, window, heat, or nothing: ''."""
    conditions = {name: values[problem.rows] for name, values in problem.readings.conditions.items()}

    def value(name: str) -> Array:
        return np.asarray(conditions.get(name, np.full(problem.rows.size, OPTIONAL[name])))

    warm = value("temperature_c")
    known = warm[~np.isnan(warm)]
    usual = float(np.median(known)) if known.size else 0.0
    return np.asarray(
        np.select(
            [
                (np.abs(value("u") - 0.5) > 0.02) | (np.abs(value("v") - 0.5) > 0.02),
                value("ambient_lx") > 0,
                np.isfinite(value("warmup_min")),
                value("window") < 0.98,
                np.abs(np.nan_to_num(warm, nan=usual) - usual) > 3.0,
            ],
            ["position", "ambient", "cold", "window", "heat"],
            "",
        )
    )


def slices(problem: Problem) -> Mapping[str, NDArray[np.str_]]:
    """Label every reading in every way in which errors are reported: dimension → labels (n,); '' is left out."""
    hours = np.array([f"{hour:g} h" for hour in problem.hours])[problem.hour_of]
    top = problem.readings.drive[problem.rows].max(axis=1)
    band = np.clip(np.searchsorted(LEVELS, top, side="left"), 0, len(LEVELS) - 1)
    level = np.array(["0", *(f"{low:g}–{high:g}" for low, high in pairwise(LEVELS))])[band]
    labels: dict[str, NDArray[np.str_]] = {"hour": hours, "level": level, "family": family_of(problem)}
    conditions = problem.readings.conditions
    if {"u", "v"} <= set(conditions):
        u, v = conditions["u"][problem.rows], conditions["v"][problem.rows]
        labels["position"] = np.array([f"u {a:g}, v {b:g}" for a, b in zip(u, v, strict=True)])
    for name, unit in (("ambient_lx", "lx"), ("warmup_min", "min"), ("temperature_c", "°C"), ("window", "")):
        if name in conditions:
            labels[name] = _condition_labels(name, unit, conditions[name][problem.rows])
    return {by: label for by, label in labels.items() if np.unique(label).size > 1}


def _condition_labels(name: str, unit: str, values: Array) -> NDArray[np.str_]:
    shown = np.round(values / 2) * 2 if name == "temperature_c" else values
    unknown = "warm" if name == "warmup_min" else "unknown"
    return np.array([unknown if np.isnan(value) else f"{value:g} {unit}".strip() for value in shown])
