"""Room light on the screen: adds the same XYZ to every patch, which shows most in black."""

from lutgen.history.causes import Cause, Values
from lutgen.history.pair import SessionPair

#: Smallest recorded difference of the room's light that counts, in lux.
_LUX = 5.0

#: Smallest added light, in cd/m², that differs from a meter's dark reading.
_LEAST = 0.05


def _prior(pair: SessionPair) -> float:
    change = pair.room_light_change
    if change is None:
        return 0.0
    return 2.0 if abs(change) >= _LUX else -2.0


def _sound(values: Values, _pair: SessionPair) -> bool:
    tint = values.get("tint", (0.0, 0.0))
    added = abs(float(values["added"][0]))
    return bool(added >= _LEAST and abs(tint[0]) < 0.35 * added and abs(tint[1]) < 0.6 * added)


def _untold(pair: SessionPair) -> str:
    if abs(pair.room_light_change or 0.0) >= _LUX or not pair.seen or pair.seen[0].has_black:
        return ""
    return "black was not read in both sessions, so the readings cannot show a change of the room's light"


CAUSE = Cause(
    name="ambient",
    noun="room light",
    meaning="the room's light on the screen was different",
    test="read black with the lights off, and once with the instrument's lens capped",
    display="unchanged",
    moves=frozenset({"contrast"}),
    ways=(("added",), ("added", "tint")),
    prior=_prior,
    sound=_sound,
    untold=_untold,
)
