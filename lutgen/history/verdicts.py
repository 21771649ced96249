"""What the evidence on two sessions allows to say: one cause, rivals that nothing tells apart, two at once, or none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.bend import DARKEST
from lutgen.history.causes import causes
from lutgen.history.causes.aging import LONG, may_have_dimmed
from lutgen.history.causes.hdr import NOT_ADDITIVE, hdr_signs
from lutgen.history.patches import CHANNELS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.history.pair import Pair
    from lutgen.history.separate import Explained

#: Verdict → what it means.
KINDS = {
    "same": "nothing beyond what two sessions of an unchanged display differ by",
    "named": "one cause",
    "one-of": "several causes that these sessions cannot tell apart",
    "several": "more than one cause at once",
    "unclear": "something changed that no known cause explains, or what would tell was not read",
}

#: Explanations whose weights differ by less, in natural logarithms, are rivals: odds of less than 20 to 1.
RIVAL = 3.0

#: χ² of the best explanation from which it explains nothing: fifteen numbers, less what is fitted.
MISFIT = 45.0

#: ΔL* of a curve at equal drive that is a change and not a chart's noise or its few levels.
BENT = 2.5

#: ... and one as strong as HDR's.
STRONGLY_BENT = 6.0

#: Change of all light, in natural logarithms, that a wrong correction alone hardly makes.
LEAP = 0.15

#: Δu'v' by which aging moves a primary at most: twice that of the paper's display.
AGING_COLOUR = 0.01

#: Change of white over the sum of the primaries that is worth telling.
SUM_MOVED = 0.02

#: What a calibration made anew may move and be no news: a channel's light, as a share.
RECALIBRATED = 0.04


@dataclass(frozen=True)
class Verdict:
    """A verdict on one session.

    Attributes
    ----------
    kind
        One of ``KINDS``.
    names
        The causes that are named; of ``one-of`` the likeliest first, of ``same`` none.
    sentence
        The finding in plain words.
    evidence
        What it rests on, a sentence or half of one each.
    tests
        Measurements that would tell, one a named cause where there is doubt.
    display
        Whether the display itself is another than it was: "unchanged" (no sign of it), "changed" or "cannot tell".
    sure
        Of ``one-of``: causes that are in every explanation, beside rivals that are not.

    """

    kind: str
    names: tuple[str, ...]
    sentence: str
    evidence: tuple[str, ...]
    tests: tuple[str, ...]
    display: str
    sure: tuple[str, ...] = ()


def without(said: Verdict, name: str, why: str) -> Verdict:
    """Return the verdict without a cause that something else refutes."""
    left = tuple(each for each in said.names if each != name)
    return _made("one-of" if len(left) > 1 else "named", left, (*said.evidence, why), said.sure)


def only(said: Verdict, name: str, why: str) -> Verdict:
    """Return the verdict with one cause alone, which something else proves."""
    return _made("named", (name,), (*said.evidence, why))


def pronounce(pair: Pair, found: Sequence[Explained]) -> Verdict:
    """Weigh what was seen beside the five colours, and then the explanations of these, the best first."""
    seen = {name: said for name, cause in causes().items() if (said := cause.seen(pair))}
    if not found:
        grounds = tuple(seen.values()) or ("white or a primary at full drive was not read in both, or not in cd/m²",)
        return _made("named" if len(seen) == 1 else "unclear", tuple(seen), grounds)
    return _seen_beside(pair, seen) or _weighed(pair, found, seen)


def _seen_beside(pair: Pair, seen: Mapping[str, str]) -> Verdict | None:
    """Return the verdict where something beside the five colours says it all: the gravest first."""
    if "drift" in seen:
        return _made("named", ("drift",), (seen["drift"], "levels of this pair are uncertain by as much"))
    if pair.other_display:
        return _made("named", ("another-display",), (seen["another-display"], *_facts(pair)))
    if "hdr" in seen:
        additive = abs(pair.additivity[1] - pair.additivity[0]) < NOT_ADDITIVE
        other = "another-display" in seen and additive and not _named_alike(pair)
        names = ("hdr", *(["another-display"] if other else []), *(["drift"] if _may_have_drifted(pair) else []))
        return _made("one-of" if len(names) > 1 else "named", names, (seen["hdr"], *_records(pair)))
    if "instrument" in seen:
        return _made("named", ("instrument",), (seen["instrument"], *_facts(pair)))
    return None


def _weighed(pair: Pair, found: Sequence[Explained], seen: Mapping[str, str]) -> Verdict:
    best = found[0]
    near = [each for each in found if best.weight - each.weight < RIVAL]
    simplest = min(len(each.names) for each in near)
    rivals = [each for each in near if len(each.names) == simplest]
    names = tuple(dict.fromkeys(name for each in rivals for name in each.names))
    if _dimmed_or_aged(pair, rivals):
        names = (*names, "aging")
    curves, facts = _curves(pair), (*_facts(pair), *_records(pair))
    if simplest and rivals[0].fit.chi2 > MISFIT:
        names = ("another-display", "instrument") if "another-display" in seen else ()
        return _made("one-of" if names else "unclear", names, (*seen.values(), *facts))
    if "instrument" in names and "another-display" in seen:
        facts = (seen["another-display"], *facts)
        names = (*names, "another-display") if simplest == 1 else ("another-display", *names)
        return _made("one-of", names, facts)
    if simplest < 2:
        likely = (*names, *(name for name in _beside_instrument(pair, rivals) if name not in names))
        return _joined(likely, curves, facts)
    return _at_once(pair, rivals, (*names, *(name for name in curves if name not in names)), facts)


def _beside_instrument(pair: Pair, rivals: Sequence[Explained]) -> tuple[str, ...]:
    """Name what else may be where an instrument would have changed all light: a setting; aging; another panel."""
    values = {name: float(value[0]) for each in rivals for name, value in each.fit.values.items()}
    if pair.other_instrument or not {"gauge", "step"} & {*values}:
        return ()
    if abs(values.get("step", 0.0)) >= LEAP:
        return ("brightness",) if _named_alike(pair) else ("brightness", "another-display")
    change = values.get("gauge")
    if change is None:
        return ()
    lost = change < 0 if pair.days is None or pair.days > 0 else change > 0
    return ("brightness", "aging") if lost and (pair.days is None or abs(pair.days) >= LONG) else ("brightness",)


def _at_once(pair: Pair, rivals: Sequence[Explained], names: tuple[str, ...], facts: tuple[str, ...]) -> Verdict:
    """Name two causes at once; where several pairs of causes do, those that are in all of them for certain."""
    if "instrument" in names and _may_age(pair):
        return _made("one-of", (*names, *({"aging"} - {*names})), facts)
    if "instrument" in names and not _named_alike(pair):
        return _made("one-of", (*names, "another-display"), facts)
    doubtful = {"brightness"} if _dimmed_or_aged(pair, rivals) else set()
    if len(rivals) == 1 and not doubtful:
        return _made("several", names, facts)
    sure = tuple(name for name in names if name not in doubtful and all(name in each.names for each in rivals))
    return _made("one-of", (*sure, *(name for name in names if name not in sure)), facts, sure)


def _dimmed_or_aged(pair: Pair, rivals: Sequence[Explained]) -> bool:
    """Whether all light fell by one factor as a turned setting makes it, and as a backlight's age does as well."""
    dimmed = [each.fit.values for each in rivals if "brightness" in each.names]
    if not dimmed or pair.other_settings or any("aging" in each.names for each in rivals):
        return False
    return all("gains" not in values and may_have_dimmed(float(values["scale"][0]), pair) for values in dimmed)


def _may_have_drifted(pair: Pair) -> bool:
    """Whether a sum of the primaries that is off may come of light that ran away unseen between their readings."""
    return len(hdr_signs(pair)) == 1 and pair.unwatched


def _joined(names: tuple[str, ...], curves: tuple[str, ...], facts: tuple[str, ...]) -> Verdict:
    """Put together what the five colours and what the curves name."""
    if not names and not curves:
        return _made("same", (), facts)
    if not names or not curves:
        names = names or curves
        return _made("one-of" if len(names) > 1 else "named", names, facts)
    if set(names) & set(curves):
        names = tuple(name for name in names if name in curves)
        return _made("one-of" if len(names) > 1 else "named", names, facts)
    return _made("several" if len(names) == len(curves) == 1 else "one-of", (*names, *curves), facts)


def _curves(pair: Pair) -> tuple[str, ...]:
    """Name what bends curves, or loads other ones, without touching the five colours more than they show."""
    if pair.curves_known and float(np.abs(pair.held_back - 1.0).max()) >= RECALIBRATED:
        return ("calibration",)
    if _curves_of_files(pair):
        return ("calibration",)
    if pair.bend is None or abs(pair.bend) < BENT:
        return ()
    other = ("hdr",) if abs(pair.bend) >= STRONGLY_BENT else ()
    return ("brightness", *other) if pair.curves_known else ("calibration", "brightness", *other)


def _curves_of_files(pair: Pair) -> bool:
    """Whether curves moved as they are seen, and the display's own, behind the files' calibrations, did not."""
    if not pair.curves_known or pair.bend is None or pair.bend_as_seen is None:
        return False
    return abs(pair.bend_as_seen) >= BENT > abs(pair.bend)


def _may_age(pair: Pair) -> bool:
    """Whether primaries moved over so long a time, and by so little, that the panel's own aging may have done it."""
    small = float(np.hypot(*pair.shift[:3].T).max()) < AGING_COLOUR
    return small and (pair.days is None or abs(pair.days) >= LONG)


def _named_alike(pair: Pair) -> bool:
    return bool(pair.before.session.display) and pair.before.session.display == pair.after.session.display


def _made(kind: str, names: tuple[str, ...], evidence: tuple[str, ...], sure: tuple[str, ...] = ()) -> Verdict:
    known = causes()
    whose = {known[name].whose for name in names}
    meanings = [known[name].meaning for name in names]
    if kind == "same":
        sentence = "Nothing changed beyond what two sessions of an unchanged display differ by."
    elif kind == "unclear":
        sentence = "Something changed that no known cause explains, or what would tell was not read."
    elif kind == "several":
        sentence = f"More than one thing at once: {' and '.join(meanings)}."
    elif sure and len(sure) < len(names):
        certain, rest = meanings[: len(sure)], meanings[len(sure) :]
        sentence = f"It looks as if {' and '.join(certain)}; and besides, {' or '.join(rest)}."
    else:
        sentence = f"It looks as if {' or '.join(meanings)}."
    if kind == "same" or (names and not whose & {"display", "campaign"} and "hdr" not in names):
        display = "unchanged"
    elif kind == "named" and names == ("aging",):
        display = "changed"
    else:
        display = "cannot tell"
    tests = tuple(known[name].test for name in names) if kind in {"one-of", "several"} or len(names) == 1 else ()
    return Verdict(kind, names, sentence, evidence, tests, display, sure)


def _facts(pair: Pair) -> tuple[str, ...]:
    """Say by how much the five colours and the curves moved."""
    if pair.seen is None:
        return ()
    before, after = pair.seen
    ratio = after.channels[:, 1] / before.channels[:, 1]
    size = np.hypot(*pair.shift.T)
    listed = ", ".join(f"{name} {value:.3f}" for name, value in zip((*CHANNELS, "white"), size, strict=True))
    facts = [
        f"light at full drive ×{ratio[0]:.3f} red, ×{ratio[1]:.3f} green, ×{ratio[2]:.3f} blue",
        f"Δu'v' {listed}",
    ]
    if before.has_black and after.has_black:
        facts.append(f"black {before.leak[1]:.3g} → {after.leak[1]:.3g} cd/m²")
    if pair.bend is not None:
        whose = "the display's own curves" if pair.curves_known else "curves"
        facts.append(f"{whose} within ΔL* {abs(pair.bend):.1f} above L* {DARKEST:g}")
    if _curves_of_files(pair):
        facts.append(f"with the calibrations in the files, which differ, curves moved by ΔL* {pair.bend_as_seen:+.1f}")
    if abs(pair.additivity[1] - pair.additivity[0]) >= SUM_MOVED:
        facts.append(f"white over red + green + blue {pair.additivity[0]:.3f} → {pair.additivity[1]:.3f}")
    if pair.curves_known and np.abs(pair.held_back - 1.0).max() >= 0.002:
        held = ", ".join(f"{name} ×{value:.3f}" for name, value in zip(CHANNELS, pair.held_back, strict=True))
        facts.append(f"the calibration curves in the files differ ({held}); what they do is taken off")
    return tuple(facts)


def _records(pair: Pair) -> tuple[str, ...]:
    light = pair.more_room_light
    said = f"the campaign says {light:+g} lx" if light else ""
    return tuple(part for part in (pair.other_instrument, pair.other_settings, said) if part)
