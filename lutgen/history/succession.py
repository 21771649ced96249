"""What the other sessions of a campaign add to a verdict on two.

Light that came back was not lost, light that was lost at once after long steadiness did not age away, and a steady loss
over many sessions is no setting that somebody turned.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.causes import causes
from lutgen.history.verdicts import only, without

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.history.pair import SessionPair
    from lutgen.history.verdicts import SessionVerdict

#: A later session with this much more light shows that an earlier one's loss was no aging, natural logarithm.
CAME_BACK = 0.05

#: Share of a steady loss below which one that was read earlier had hardly begun.
LATE = 0.25

#: Sessions beside the reference that a steady loss takes; how well it must follow a straight line in time, natural
#: logarithm; and the least loss at its end.
FEWEST, STEADY, LEAST = 3, 0.02, 0.05


def in_succession(pairs: Sequence[SessionPair], verdicts: Sequence[SessionVerdict]) -> tuple[SessionVerdict, ...]:
    """Return the verdicts, those that name aging revised by what came after, and by how steadily light was lost."""
    revised = list(verdicts)
    still = [pair for pair, each in zip(pairs, verdicts, strict=True) if each.kind == "same"]
    for place, pair in enumerate(pairs):
        for name in _going("steady", revised[place]):
            if len(revised[place].names) > 1 and (later := _brighter_later(pair, pairs)):
                revised[place] = without(revised[place], name, f"light came back by {later:+.0%} in a later session")
            elif _going("step", revised[place]) and (days := _lost_within(pair, still)):
                revised[place] = without(
                    revised[place], name, f"hardly any of that was lost until {days:.0f} days before"
                )
    steady = [place for place, each in enumerate(revised) if {*each.sure} <= {*_going("steady", each)} != set()]
    calm = [place for place, each in enumerate(revised) if each.kind == "same" and pairs[place].days is not None]
    if len(steady) + len(calm) >= FEWEST and len(steady) > 1 and _is_steady([pairs[place] for place in steady + calm]):
        why = f"light was lost steadily over {len(steady) + len(calm) + 1} sessions, as no turned setting does"
        for place in steady:
            revised[place] = only(revised[place], _going("steady", revised[place])[0], why)
    return tuple(revised)


def _going(way: str, verdict: SessionVerdict) -> tuple[str, ...]:
    """Causes that a verdict names with which light goes so over many sessions."""
    return tuple(name for name in verdict.names if causes()[name].over_time == way)


def _light(pair: SessionPair) -> Array | None:
    """Logarithm of each channel's light over the reference's, (3,)."""
    if pair.seen is None:
        return None
    before, after = pair.seen
    return np.asarray(np.log(after.channels[:, 1] / before.channels[:, 1]))


def _brighter_later(pair: SessionPair, pairs: Sequence[SessionPair]) -> float:
    """By how much light came back after a session, as a share; 0 where it did not, or time is not known."""
    mine = _light(pair)
    if mine is None or pair.days is None:
        return 0.0
    later = [_light(each) for each in pairs if each.days is not None and each.days > pair.days]
    # A session brighter than the reference was turned up itself; of the others one may be: the middle one counts.
    gains = [float((each - mine).min()) for each in later if each is not None and each.max() <= CAME_BACK]
    gain = float(np.median(gains)) if gains else 0.0
    return float(np.expm1(gain)) if gain >= CAME_BACK else 0.0


def _lost_within(pair: SessionPair, still: Sequence[SessionPair]) -> float:
    """Days in which most of a session's loss came, where one without change is nearer to it than the reference is."""
    mine = _light(pair)
    if mine is None or pair.days is None or pair.days <= 0:
        return 0.0
    for each in still:
        light = _light(each)
        if light is not None and each.days is not None and pair.days / 2 <= each.days < pair.days:
            steady = float(mine.mean()) * each.days / pair.days
            if steady <= -CAME_BACK and float(light.mean()) > LATE * steady:
                return pair.days - each.days
    return 0.0


def _is_steady(pairs: Sequence[SessionPair]) -> bool:
    """Whether every channel's light follows a straight line through the reference, falling, in the logarithm."""
    days = np.array([pair.days if pair.days is not None else np.nan for pair in pairs])
    light = [_light(pair) for pair in pairs]
    if not np.isfinite(days).all() or np.ptp(np.append(days, 0.0)) <= 0 or any(each is None for each in light):
        return False
    loss = np.array(light)
    slope = days @ loss / (days @ days)
    left = loss - days[:, np.newaxis] * slope
    return bool(np.sqrt((left**2).mean(axis=0)).max() <= STEADY and (slope * np.abs(days).max()).mean() <= -LEAST)
