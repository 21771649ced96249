"""A slow reference of the fit: one reading at a time, every unknown in one vector, solved by scipy.

The paper's six steps, each effect's formula and the noise are implemented again in a few lines. The code shares nothing
with lutgen. Tips, gains and parameters are all unknowns of one ``scipy.optimize.least_squares``. lutgen eliminates most
of them block by block; both methods must give the same result.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from lutgen.readings import Measurements

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Values = Mapping[str, float]

TIPS = ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
D65 = (0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290)
#: For the paper's T'_i: the tips that it reproduces, and the inverse of their drives as columns.
KEPT = [[j for j in range(4) if j != i] for i in range(4)]
UNDRIVEN = [np.linalg.inv(np.array([TIPS[j] for j in kept]).T) for kept in KEPT]
LIFE_H = 18_000.0
SHARED = 0.6

#: Correlation of X, Y and Z in the noise floor.
FLOOR_SHARED = 0.3
TIE = 1e-9

#: White and primaries of a typical display at hour 0, cd/m²; white is not exactly the sum of its primaries.
FRESH = np.array([[235.0, 248.0, 268.0], [104.0, 54.0, 5.0], [89.0, 178.0, 30.0], [44.0, 18.0, 235.0]])


GREYS = tuple((level, level, level) for level in (0.0, 0.1, 0.3, 0.5, 0.8))
RAMPS = ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5), (0.8, 0.8, 0.0), (0.0, 0.9, 0.9))
MIXTURES = ((0.9, 0.2, 0.4), (0.3, 0.8, 0.6), (0.7, 0.6, 0.95), (0.2, 0.4, 0.3))
CORNERS = tuple({"u": u, "v": v} for u in (0.1, 0.9) for v in (0.1, 0.9))
HOURS = (0.0, 7000.0, 16_000.0)

#: True parameters of a display, and the baseline that shows them. No value lies on a bound.
TRUTHS = {
    "black-level": ({"new": 0.002, "grown": 0.003}, "colour-points"),
    "crosstalk": ({"new": 0.02, "grown": 0.05}, "colour-points"),
    "eotf-drift": ({"new": 0.03, "grown": 0.15}, "colour-points"),
    "edge-falloff": ({"new": 0.1, "grown": 0.2}, "colour-points"),
    "ambient-reflection": ({"reflectance": 0.02}, "colour-points"),
    "backlight-decay": ({"loss": 0.9, "beta": 1.41}, "first-hour"),
    "channel-decay": ({"red": 0.2, "green": 0.3, "blue": 0.7}, "first-hour"),
}


@dataclass(frozen=True)
class Reading:
    """A patch and its reading; ``where`` holds the conditions that are not at rest."""

    hour: float
    code: tuple[float, float, float]
    xyz: tuple[float, float, float] = (1.0, 1.0, 1.0)
    session: str = ""
    where: Values = field(default_factory=dict)

    def at(self, name: str, otherwise: float) -> float:
        """Return a condition, or ``otherwise`` if it is absent."""
        return self.where.get(name, otherwise)


class Fault(NamedTuple):
    """An effect by its formula: it acts on linear light, on the four tips, or on the light that leaves the display."""

    linear: Callable[[list[float], float, Values], list[float]] = lambda linear, _tau, _p: linear
    tips: Callable[[Array, float, Values], Array] = lambda tips, _tau, _p: tips
    xyz: Callable[[Array, Array, Reading, float, Values], Array] = lambda xyz, _white, _reading, _tau, _p: xyz


class Answer(NamedTuple):
    """The result of the reference fit: χ², parameters and their standard errors."""

    chi2: float
    values: dict[str, float]
    stderr: dict[str, float]


def _crosstalk(linear: list[float], tau: float, p: Values) -> list[float]:
    chi = p["new"] + p["grown"] * tau
    return [light * (1.0 - chi * (sum(linear) - light)) for light in linear]


def _eotf(linear: list[float], tau: float, p: Values) -> list[float]:
    return [light ** (1.0 + p["new"] + p["grown"] * tau) for light in linear]


def _edge(xyz: Array, white: Array, reading: Reading, tau: float, p: Values) -> Array:
    del white
    squared = 2.0 * ((reading.at("u", 0.5) - 0.5) ** 2 + (reading.at("v", 0.5) - 0.5) ** 2)
    return np.asarray(xyz * (1.0 - (p["new"] + p["grown"] * tau) * squared))


def _room(xyz: Array, white: Array, reading: Reading, tau: float, p: Values) -> Array:
    del white, tau
    return np.asarray(xyz + p["reflectance"] * reading.at("ambient_lx", 0.0) * np.array(D65))


def _black(xyz: Array, white: Array, reading: Reading, tau: float, p: Values) -> Array:
    del reading
    return np.asarray(xyz + (p["new"] + p["grown"] * tau) * white)


def _backlight(tips: Array, tau: float, p: Values) -> Array:
    return np.asarray(tips * np.exp(-p["loss"] * tau ** p["beta"]))


def _channels(tips: Array, tau: float, p: Values) -> Array:
    shares = [np.exp(-p[name] * tau) for name in ("red", "green", "blue")]
    primaries = [gain * tip for gain, tip in zip(shares, tips[1:], strict=True)]
    beside = (tips[0] - sum(tips[1:])) * (sum(shares) / 3.0)
    return np.array([sum(primaries) + beside, *primaries])


FAULTS = {
    "black-level": Fault(xyz=_black),
    "crosstalk": Fault(linear=_crosstalk),
    "eotf-drift": Fault(linear=_eotf),
    "edge-falloff": Fault(xyz=_edge),
    "ambient-reflection": Fault(xyz=_room),
    "backlight-decay": Fault(tips=_backlight),
    "channel-decay": Fault(tips=_channels),
}


def srgb_light(code: float) -> float:
    """IEC 61966-2-1."""
    return code / 12.92 if code <= 0.04045 else float(((code + 0.055) / 1.055) ** 2.4)


def matrices(tips: Array) -> list[Array]:
    """Return the paper's T_w, T_r, T_g, T_b.

    T'_i reproduces the tips other than i; T_i is the mean of the T' other than i.
    """
    three = [tips[kept].T @ undriven for kept, undriven in zip(KEPT, UNDRIVEN, strict=True)]
    return [np.asarray((three[a] + three[b] + three[c]) / 3.0) for a, b, c in KEPT]


class Asked(NamedTuple):
    """A code value: its linear light, and the paper's matrices for it, those of the nearest tips."""

    light: list[float]
    nearest: list[int]

    @classmethod
    def of(cls, code: tuple[float, float, float]) -> Asked:
        light = [srgb_light(value) for value in code]
        distances = [sum((a - b) ** 2 for a, b in zip(light, tip, strict=True)) ** 0.5 for tip in TIPS]
        return cls(light, [i for i, distance in enumerate(distances) if distance <= min(distances) + TIE])


def shown(reading: Reading, tips: Array, fault: Fault, p: Values, known: dict[object, Any] | None = None) -> Array:
    """Return XYZ of one reading, cd/m². ``known`` caches the values that the readings of an hour have in common."""
    tau, known = reading.hour / LIFE_H, {} if known is None else known
    if reading.code not in known:
        known[reading.code] = Asked.of(reading.code)
    if reading.hour not in known:
        known[reading.hour] = matrices(fault.tips(tips, tau, p))
    asked, averaged = known[reading.code], known[reading.hour]
    matrix = sum(averaged[i] for i in asked.nearest) / len(asked.nearest)
    return fault.xyz(matrix @ fault.linear(asked.light, tau, p), tips[0], reading, tau, p)


def covariance(xyz: Array, relative: float, floor: float) -> Array:
    """Return the 3 × 3 covariance of one reading: the light's noise and the floor, each with its own correlation."""
    light = relative * np.asarray(xyz)
    total = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            total[i, j] = light[i] * light[j] * (1.0 if i == j else SHARED) + floor**2 * (
                1.0 if i == j else FLOOR_SHARED
            )
    return total


def noisy(
    readings: Sequence[Reading], tips: Mapping[float, Array], fault: Fault, p: Values, seed: int
) -> list[Reading]:
    """Read every patch, with noise of 0.2 % and 0.003 cd/m², and a gain of 0.3 % per session."""
    rng = np.random.default_rng(seed)
    gains = {key: 0.003 * rng.standard_normal() for key in sorted({(r.hour, r.session) for r in readings})}
    rows = []
    for each in readings:
        light = shown(each, tips[each.hour], fault, p) * (1.0 + gains[each.hour, each.session])
        root = np.linalg.cholesky(covariance(light, 0.002, 0.003))
        x, y, z = light + root @ rng.standard_normal(3)
        rows.append(replace(each, xyz=(float(x), float(y), float(z))))
    return rows


def session(hour: float, name: str = "") -> list[Reading]:
    """Return tips and black twice, greys, ramps, mixtures, a grey in four corners, and black in a lit room."""
    rest = [Reading(hour, code, session=name) for code in (*TIPS, *TIPS, *GREYS, *GREYS[:1], *RAMPS, *MIXTURES)]
    corners = [Reading(hour, (0.8, 0.8, 0.8), session=name, where=where) for where in CORNERS]
    room = [Reading(hour, (0.0, 0.0, 0.0), session=name, where={"ambient_lx": lx}) for lx in (50.0, 200.0)]
    return [*rest, *corners, *room]


def display(hours: Sequence[float] = HOURS, ageing: float = 0.3) -> dict[float, Array]:
    """Return tips that dim over the hours, blue's Z most."""
    return {hour: FRESH * (1.0 - ageing * hour / 18_000.0 * np.array([0.8, 0.9, 1.1])) for hour in hours}


def measured(name: str, *, seed: int = 1, values: Mapping[str, float] | None = None) -> list[Reading]:
    truth, baseline = TRUTHS[name]
    tips = display(ageing=0.0 if baseline == "first-hour" else 0.3)
    readings = [each for hour in HOURS for each in session(hour)]
    return noisy(readings, tips, FAULTS[name], values or truth, seed=seed)


def table(readings: Sequence[Reading], **metadata: str) -> Measurements:
    """Return the readings in lutgen's type."""
    names = sorted({name for each in readings for name in each.where})
    rest = {"u": 0.5, "v": 0.5, "ambient_lx": 0.0, "window": 1.0}
    return Measurements(
        hours=np.array([each.hour for each in readings]),
        drive=np.array([each.code for each in readings]),
        xyz_cd_m2=np.array([each.xyz for each in readings]),
        lines=np.arange(2.0, 2.0 + len(readings)),
        conditions={name: np.array([each.at(name, rest[name]) for each in readings]) for name in names},
        session=tuple(each.session for each in readings),
        metadata={"session_gain": "0.003", **metadata},
    )


def solve(
    readings: Sequence[Reading],
    fault: Fault,
    bounds: Mapping[str, tuple[float, float]],
    *,
    fresh: bool = False,
    held: bool = False,
) -> Answer:
    """Fit tips, gains and parameters at once, starting from the middle of the parameters' bounds.

    Under ``first-hour`` the tips are those of hour 0, and every session has a gain. Otherwise each hour has its own
    tips, and a gain is only needed where an hour has several sessions or no tips. ``held``: a sensor keeps white at the
    luminance of hour 0.
    """
    hours = sorted({each.hour for each in readings})
    knots = [hour for hour in hours if any(each.hour == hour and each.code in TIPS for each in readings)]
    sessions = sorted({(each.hour, each.session) for each in readings})
    crowded = [
        key for key in sessions if fresh or key[0] not in knots or sum(key[0] == hour for hour, _ in sessions) > 1
    ]
    measured = {hour: _mean_tips(readings, hour) for hour in (knots[:1] if fresh else knots)}
    slack = {} if fresh else {hour: _slack(measured, hour) for hour in hours if hour not in knots}
    latent = {**measured, **{hour: _on_the_line(measured, hour) for hour in slack}}
    whiteners = [np.linalg.inv(np.linalg.cholesky(covariance(mean, 0.002, 0.003))) for mean in _patch_means(readings)]
    names, places = list(bounds), 12 * len(latent)
    asked: dict[object, Any] = {each.code: Asked.of(each.code) for each in readings}

    def unpacked(x: Array) -> tuple[dict[float, Array], dict[tuple[float, str], float], dict[str, float]]:
        moved = 1.0 + 1e-3 * x[:places].reshape(len(latent), 4, 3)
        tips = {hour: tip * share for (hour, tip), share in zip(latent.items(), moved, strict=True)}
        rest = [float(value) for value in x[places:]]
        return (
            tips,
            {key: 0.003 * rest[k] for k, key in enumerate(crowded)},
            dict(zip(names, rest[len(crowded) :], strict=True)),
        )

    def residuals(x: Array) -> Array:
        tips, gains, p = unpacked(x)
        terms = [gain / 0.003 for gain in gains.values()]
        for hour, width in slack.items():
            terms += list(((tips[hour] - _on_the_line({knot: tips[knot] for knot in knots}, hour)) / width).ravel())
        known = dict(asked)
        for each, whitener in zip(readings, whiteners, strict=True):
            mine = tips[knots[0] if fresh else each.hour]
            light = shown(each, mine, fault, p, known) * (1.0 + gains.get((each.hour, each.session), 0.0))
            if held:
                white = [shown(Reading(hour, TIPS[0]), mine, fault, p, known)[1] for hour in (knots[0], each.hour)]
                light = light * white[0] / white[1]
            terms += list(whitener @ (np.array(each.xyz) - light))
        return np.array(terms)

    free = places + len(crowded)
    low = np.array([*[-np.inf] * free, *(low for low, _ in bounds.values())])
    high = np.array([*[np.inf] * free, *(high for _, high in bounds.values())])
    start = np.array([*[0.0] * free, *(0.4 * low + 0.6 * high for low, high in bounds.values())])
    end = least_squares(residuals, start, bounds=(low, high), x_scale="jac", ftol=1e-14, xtol=1e-12, gtol=1e-12)
    _, _, values = unpacked(end.x)
    errors = np.sqrt(np.diag(np.linalg.pinv(end.jac.T @ end.jac)))[free:]
    return Answer(2.0 * float(end.cost), values, dict(zip(names, map(float, errors), strict=True)))


def _mean_tips(readings: Sequence[Reading], hour: float) -> Array:
    rows = []
    for tip in TIPS:
        here = [each.xyz for each in readings if each.hour == hour and each.code == tip and not each.where]
        rows.append([sum(values) / len(here) for values in zip(*here, strict=True)])
    return np.array(rows)


def _on_the_line(tips: Mapping[float, Array], hour: float) -> Array:
    """Return tips between two hours by linear interpolation."""
    before, after = max(each for each in tips if each < hour), min(each for each in tips if each > hour)
    share = (hour - before) / (after - before)
    return np.asarray((1.0 - share) * tips[before] + share * tips[after])


def _slack(tips: Mapping[float, Array], hour: float) -> Array:
    """Return the deviation of a parabola through neighbouring hours from its chord.

    It is an eighth of the second derivative × span².
    """
    hours = sorted(tips)
    after = next(k for k, each in enumerate(hours) if each > hour)
    span, bent = hours[after] - hours[after - 1], np.zeros((4, 3))
    for middle in (after - 1, after):
        if 0 < middle < len(hours) - 1:
            a, b, c = hours[middle - 1 : middle + 2]
            second = ((tips[c] - tips[b]) / (c - b) - (tips[b] - tips[a]) / (b - a)) / ((c - a) / 2.0)
            bent = np.maximum(bent, np.abs(second) * span**2 / 8.0)
    return np.maximum(bent, 2e-4 * np.abs(_on_the_line(tips, hour)) + 1e-6)


def _patch_means(readings: Sequence[Reading]) -> list[Array]:
    """Return the mean of each reading's replicates; the noise is computed from this light."""
    kin: dict[object, list[Array]] = {}
    keys = [(each.hour, each.code, each.session, tuple(sorted(each.where.items()))) for each in readings]
    for key, each in zip(keys, readings, strict=True):
        kin.setdefault(key, []).append(np.array(each.xyz))
    return [np.mean(kin[key], axis=0) for key in keys]
