"""The instrument or its correction: another matrix applies to all readings, including black."""

from lutgen.history.causes import Cause, Values
from lutgen.history.pair import CLEAR_SHIFT, SessionPair, line_shift

#: Largest disagreement of two good meters about luminance, as a natural logarithm.
_GAUGE = 0.06

#: Largest Δu'v' of a primary by a wrong correction of one instrument: in a public session of a Dell U2718Q red
#: moved by 0.030.
_COLOUR = 0.04


def _prior(pair: SessionPair) -> float:
    if pair.other_instrument:
        return 2.0
    return -1.0 if pair.same_instrument else 0.0


def _proof(pair: SessionPair) -> str:
    shift = line_shift(*pair.sessions)
    if shift is None or abs(shift) < CLEAR_SHIFT:
        return ""
    return f"the spectra of red, green and blue are all shifted by {shift:+.1f} nm, which no display does"


def _is_possible(pair: SessionPair) -> bool:
    """Whether wrong corrections, of one session or of two instruments, can move the primaries by the measured shift."""
    is_one = pair.before.instrument and not pair.other_instrument
    return pair.largest_shift <= (_COLOUR if is_one else 2.0 * _COLOUR)


def _sound(values: Values, pair: SessionPair) -> bool:
    if "gauge" in values:
        return bool(abs(values["gauge"][0]) <= _GAUGE)
    return _is_possible(pair)


CAUSE = Cause(
    name="instrument",
    meaning="another instrument or another correction was used",
    test="read white, the primaries and black once more with a second instrument, or without a correction matrix",
    display="unchanged",
    moves=frozenset({"blue", "colour", "contrast"}),
    possible=_is_possible,
    ways=(("gauge",), ("step", "matrix")),
    prior=_prior,
    recorded=lambda pair: bool(pair.other_instrument),
    sound=_sound,
    proof=_proof,
    rank=2,
)
