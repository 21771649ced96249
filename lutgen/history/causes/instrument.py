"""The instrument or its correction: everything it reads, black included, through another matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes._cause import Cause
from lutgen.history.lines import CLEAR

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.history.pair import Pair

#: By how much two meters in good order disagree about luminance, at most, in natural logarithms.
_GAUGE = 0.06


def _prior(pair: Pair) -> float:
    if pair.other_instrument:
        return 2.0
    same = pair.before.instrument and pair.before.instrument == pair.after.instrument
    return -1.0 if same else 0.0


def _seen(pair: Pair) -> str:
    shift = pair.lines
    if shift is None or abs(shift) < CLEAR:
        return ""
    return f"the spectra of red, green and blue are all shifted by {shift:+.1f} nm, which no display does"


def _sound(values: Mapping[str, Array], _pair: Pair) -> bool:
    return "gauge" not in values or bool(abs(values["gauge"][0]) <= _GAUGE)


CAUSE = Cause(
    name="instrument",
    meaning="the instrument or its correction was another",
    whose="instrument",
    test="read white, the primaries and black once more with a second instrument, or without a correction matrix",
    ways=(("gauge",), ("step", "matrix")),
    prior=_prior,
    sound=_sound,
    seen=_seen,
)
