"""Minutes since the display was switched on."""

from math import inf, isfinite, nan

import numpy as np

from lutgen.readings.conditions import Array, Column, Condition, Sketch, Values, greys

#: Largest ratio of the minutes of neighbouring readings within one span of rest. The minutes of a normal session have
#: smaller ratios; the readings of a warm-up (2, 5, 10, 20, 40, 60) have larger ratios.
STEP = 1.25


def _span(values: Array, rest: float) -> tuple[float, float]:
    """Return the span of rest: all later minutes, and earlier ones while neighbouring ratios are at most ``STEP``."""
    low = rest
    for minutes in np.unique(values[np.isfinite(values) & (values <= rest)])[::-1]:
        if minutes * STEP < low:
            break
        low = float(minutes)
    return low - 1e-9, inf


def _signatures(values: Values, _rest: Values) -> dict[str, Array]:
    minutes = np.nan_to_num(values["warmup_min"], nan=np.inf)
    return {"minutes": np.exp(-minutes / 5.0), "minutes, slower": np.exp(-minutes / 25.0)}


CONDITION = Condition(
    name="minutes since power-on",
    place=3,
    columns=(
        Column(
            name="warmup_min",
            unit="min",
            high=1e6,
            meaning="minutes since power-on, from 0 on",
            blank=nan,
            usual=inf,
            unlogged=30.0,
            tried=(inf, 0.0, 3.0, 20.0, 90.0),
            shown=5.0,
            axis=(0.0, 120.0),
            words="minutes since power-on",
        ),
    ),
    cell="cold",
    span=_span,
    depends="the minutes since power-on",
    in_words=lambda at: f"{at['warmup_min']:g} min after power-on" if isfinite(at["warmup_min"]) else "warm",
    label=lambda minutes: f"{minutes:g} min" if isfinite(minutes) else "warm",
    sentence="{} after power-on",
    heading="after power-on",
    short="{:g} min",
    before="after ",
    signatures=_signatures,
    sketches={
        rf".*\b{words}": Sketch(
            "optics",
            ("warmup_min",),
            "share of the light at power-on",
            f"xyz * (1.0 + {{size}} * np.exp(-scene.warmup_min / {minutes}))",
        )
        for words, minutes in (("minutes, slower", 25.0), ("(minutes|cold)", 5.0))
    },
    varied=(
        "after power-on",
        [patch for minutes in (2.0, 5.0, 10.0, 20.0, 40.0) for patch in greys((1.0, 0.6), warmup_min=minutes)],
    ),
)
