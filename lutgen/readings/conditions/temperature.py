"""Temperature of the panel, or of the room."""

from math import isnan, nan

import numpy as np

from lutgen.readings.conditions import Array, Column, Condition, Sketch, Values, greys

#: Tolerance in kelvins for equal temperatures within a session. Luminance changes by about 0.3 % per kelvin.
FEW_KELVINS = 3.0

#: A gap of more than this (K) between sorted temperatures of a session means that the temperature was changed
#: deliberately; readings beyond the gap are not at rest. Sensors print steps of at most 1 K.
SET_ANEW = 1.5

#: Largest gap in kelvins between sorted temperatures of replicates. Logged temperatures scatter by less; deliberate
#: changes of the temperature are larger.
SCATTER_K = 0.75

#: Temperature that effects use if no temperature was logged, in °C.
REFERENCE_C = 25.0


def _signatures(values: Values, rest: Values) -> dict[str, Array]:
    warmer = values["temperature_c"] - rest["temperature_c"]
    return {} if np.isnan(warmer).all() else {"temperature": np.nan_to_num(warmer) / 10.0}


def _span(values: Array, rest: float) -> tuple[float, float]:
    """Return the span of rest: temperatures near the value at rest, without a gap, within a few kelvins."""
    near = np.unique(values[np.abs(values - rest) <= FEW_KELVINS])
    apart = np.flatnonzero(np.diff(near) > SET_ANEW)
    ends = np.concatenate([[rest - FEW_KELVINS], near[apart + 1], near[apart], [rest + FEW_KELVINS]])
    return float(ends[ends <= rest].max()), float(ends[ends >= rest].min())


def _clusters(warmer: Array) -> Array:
    """Return the number of the cluster of temperatures of each reading, (n,); a cluster lies within a few kelvins."""
    kelvins, place = np.unique(warmer, return_inverse=True)
    cluster = np.concatenate([[0], np.cumsum(np.diff(kelvins) > SCATTER_K)])[place.reshape(-1)]
    numbers = cluster + warmer.size * np.round(warmer / (2 * FEW_KELVINS))
    return np.asarray(np.where(np.isnan(warmer), np.nan, numbers))


CONDITION = Condition(
    name="temperature",
    place=4,
    columns=(
        Column(
            name="temperature_c",
            unit="°C",
            low=-50.0,
            high=150.0,
            meaning="degrees Celsius",
            blank=nan,
            usual=REFERENCE_C,
            unlogged=30.0,
            tried=(REFERENCE_C, 5.0, 18.0, 40.0),
            shown=35.0,
            axis=(5.0, 45.0),
            words="temperature, °C",
        ),
    ),
    cell="heat",
    span=_span,
    depends="temperature",
    in_words=lambda at: f"{at['temperature_c']:g} °C",
    label=lambda celsius: "unknown" if isnan(celsius) else f"{2 * round(celsius / 2):g} °C",
    sentence="at {}",
    heading="temperature",
    short="{:.0f} °C",
    before="at ",
    clusters=_clusters,
    signatures=_signatures,
    sketches={
        r".*\b(temperature|heat)": Sketch(
            "optics",
            ("temperature_c",),
            "share of the light per kelvin",
            "xyz * (1.0 + {size} * (scene.temperature_c - 25.0))",
            "0.005, (-0.05, 0.05)",
        )
    },
    varied=("in a room 8 K warmer", greys((1.0, 0.6), temperature_c=REFERENCE_C + 8.0)),
)
