"""The verdict on two sessions: one cause, several causes that fit equally well, several causes at once, or no cause.

This module names no cause: it uses the declarations in the files of ``causes``. :func:`in_succession` revises a verdict
by the other sessions of the campaign: a loss of light is not aging if the light came back later, or if the loss was
sudden after a long time without loss; a steady loss over many sessions is not a changed setting.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from lutgen.errors import listed
from lutgen.history.causes import causes
from lutgen.history.colour_points import COLOURS, ColourFit
from lutgen.history.pair import SessionPair
from lutgen.history.patches import CHANNELS
from lutgen.history.transfer import DARKEST
from lutgen.numerals import in_percent, spaced

#: Verdict → what it means.
KINDS = {
    "same": "no difference larger than between two sessions of an unchanged display",
    "named": "one cause",
    "one-of": "several causes that these sessions cannot distinguish",
    "several": "more than one cause at once",
    "unclear": "a change that no known cause explains, or the patches that would show the cause were not read",
}

#: Two explanations are rivals if their weights differ by less than this, in natural logarithms: odds below 20 to 1.
RIVAL = 3.0

#: If the best explanation has a larger χ² (of fifteen numbers minus the fitted parameters), it is rejected.
MISFIT = 45.0

#: Smallest change of white over the sum of the primaries that is reported.
SUM_REPORTED = 0.02

_NOT_READ = "white or a primary at full drive was not read in both sessions, or not in cd/m²"


@dataclass(frozen=True)
class Hypothesis:
    """A set of causes, and how well the set explains white, primaries and black."""

    #: The causes; none: nothing changed.
    names: tuple[str, ...]
    #: The best fit of the causes.
    fit: ColourFit
    #: Natural logarithm of evidence times prior.
    weight: float
    #: Number of causes that are not recorded.
    assumed: int


@dataclass(frozen=True)
class SessionVerdict:
    """A verdict on one session."""

    #: One of ``KINDS``.
    kind: str
    #: The named causes; the likeliest first for ``one-of``, none for ``same``.
    names: tuple[str, ...]
    #: The verdict as a sentence.
    sentence: str
    #: The facts that support the verdict, each a sentence or a clause.
    evidence: tuple[str, ...]
    #: Measurements that would decide between the named causes, one for each cause.
    tests: tuple[str, ...]
    #: Whether the display itself has changed: "unchanged" (no sign of a change), "changed" or "cannot tell".
    display: str
    #: For ``one-of``: the causes that every explanation contains.
    sure: tuple[str, ...] = ()

    @property
    def causes_in_words(self) -> str:
        """The named causes for a table: "a and b", "a or b", or "a and (b or c)"; "" for none."""
        words = {name: causes()[name].words for name in self.names}
        if self.kind == "several":
            return listed(words.values())
        rest = [each for name, each in words.items() if name not in self.sure]
        if not self.sure or not rest:
            return listed(words.values(), "or")
        return listed((*(words[name] for name in self.sure), f"({listed(rest, 'or')})" if len(rest) > 1 else rest[0]))


def without(verdict: SessionVerdict, name: str, why: str) -> SessionVerdict:
    """Return the verdict without the cause ``name``; ``why`` is the evidence against that cause."""
    others = tuple(each for each in verdict.names if each != name)
    sure = tuple(each for each in verdict.sure if each != name)
    return _one_of(others, (*verdict.evidence, why), sure)


def pronounce(pair: SessionPair, hypotheses: Sequence[Hypothesis]) -> SessionVerdict:
    """Return the verdict on a pair: from proofs, or from ``hypotheses`` (best first), or from signs."""
    verdict = _proven(pair) or (_weighed(pair, hypotheses) if hypotheses else _by_signs(pair))
    for name, cause in causes().items():
        if happened := cause.beside(pair):
            verdict = _with(verdict, name, happened)
    return verdict


def _proven(pair: SessionPair) -> SessionVerdict | None:
    """Return the verdict if a cause is proven, with other causes that could make the same changes; or None."""
    proofs = {name: proof for name, cause in causes().items() if (proof := cause.proof(pair))}
    if not proofs:
        return None
    first = min(proofs, key=lambda name: causes()[name].rank)
    rivals = () if causes()[first].alone else tuple(name for name in _able(pair) if name != first)
    facts = (proofs[first], *_facts(pair), *_records(pair))
    # A display is not called unchanged if its curves moved, which the proven cause cannot do.
    unexplained = causes()[first].display == "unchanged" and "curve" in pair.moved - causes()[first].moves
    bends = tuple(name for name, cause in causes().items() if cause.bends(pair) and "curve" in cause.moves)
    if unexplained and bends:
        return _verdict("several" if len(bends) == 1 else "one-of", (first, *bends), facts, (first,))
    return _one_of((first, *rivals), facts)


def _able(pair: SessionPair) -> list[str]:
    """Return the causes that can move all moved facts, and that the records do not exclude."""
    known = causes().items() if pair.moved else ()
    return [name for name, cause in known if cause.moves >= pair.moved and cause.possible(pair)]


def _by_signs(pair: SessionPair) -> SessionVerdict:
    """Return the verdict from signs alone, for a pair of sessions without white and primaries."""
    signs = _signs(pair)
    return _verdict("named" if len(signs) == 1 else "unclear", tuple(signs), tuple(signs.values()) or (_NOT_READ,))


def _signs(pair: SessionPair) -> dict[str, str]:
    return {name: sign for name, cause in causes().items() if (sign := cause.sign(pair))}


def _weighed(pair: SessionPair, hypotheses: Sequence[Hypothesis]) -> SessionVerdict:
    near = [each for each in hypotheses if hypotheses[0].weight - each.weight < RIVAL]
    untold = {name: why for name, cause in causes().items() if (why := cause.untold(pair))}
    unsaid = [why for name, why in untold.items() if any(name in each.names for each in near)]
    # A cause that the readings cannot show is named only if it explains the pair alone.
    told = [tuple(name for name in each.names if name not in untold) for each in near]
    near = [replace(each, names=names or each.names) for each, names in zip(near, told, strict=True)]
    fewest = min(each.assumed for each in near)
    simple = [each for each in near if not any(set(other.names) < set(each.names) for other in near)]
    rivals = [each for each in simple if each.assumed == fewest]
    simplest = min(len(each.names) for each in rivals)
    signs = _signs(pair)
    facts = (*signs.values(), *_facts(pair), *_records(pair), *unsaid)
    if simplest and rivals[0].fit.chi2 > MISFIT:
        names = tuple(dict.fromkeys((*signs, *(_able(pair) if signs else _unweighed(pair)))))
        return _one_of(names, facts) if names else _verdict("unclear", (), facts)
    names = tuple(dict.fromkeys(name for each in rivals for name in each.names))
    mistaken = _mistaken(pair, rivals, names)
    bends = tuple(name for name, cause in causes().items() if cause.bends(pair))
    if simplest < 2 and set(mistaken) & set(signs):
        return _one_of((*names, *mistaken), facts)
    if simplest < 2:
        return _joined((*names, *mistaken), bends, facts)
    doubtful = {name for name in names if {*mistaken.values()} & {*chain.from_iterable(causes()[name].ways)}}
    sure = tuple(name for name in names if name not in doubtful and all(name in each.names for each in rivals))
    names = (*names, *(name for name in (*mistaken, *bends) if name not in names))
    if len(rivals) == 1 and not mistaken:
        return _verdict("several", names, facts)
    return _verdict("one-of", (*sure, *(name for name in names if name not in sure)), facts, sure)


def _unweighed(pair: SessionPair) -> list[str]:
    """Return the causes without parameters that can move all moved facts and bend the curves, if no fit is good."""
    known = causes().items()
    return [name for name, cause in known if not cause.ways and cause.moves >= pair.moved and cause.bends(pair)]


def _mistaken(pair: SessionPair, rivals: Sequence[Hypothesis], names: tuple[str, ...]) -> dict[str, str]:
    """Return unnamed causes that can make the same change as a hypothesis → the parameter of that change."""
    mistaken = {}
    for name, cause in causes().items():
        parameters = [cause.rival(each.names, each.fit.values, pair) for each in rivals]
        if name not in names and any(parameters):
            mistaken[name] = next(filter(None, parameters))
    return mistaken


def _one_of(names: tuple[str, ...], evidence: tuple[str, ...], sure: tuple[str, ...] = ()) -> SessionVerdict:
    return _verdict("one-of" if len(names) > 1 else "named", names, evidence, sure)


def _with(verdict: SessionVerdict, name: str, happened: str) -> SessionVerdict:
    """Return the verdict with one more cause, which is certain; ``happened`` is its evidence."""
    evidence = (happened, *verdict.evidence)
    if verdict.kind == "same":
        return _verdict("named", (name,), evidence)
    if not verdict.names:
        # If white is missing because it was misread, nothing else can be said.
        misread = _NOT_READ in verdict.evidence
        return _verdict("named", (name,), evidence) if misread else replace(verdict, evidence=evidence)
    certain = verdict.names if verdict.kind in {"named", "several"} else verdict.sure
    sure = (name, *certain)
    names = (*sure, *(each for each in verdict.names if each not in sure))
    return _verdict("several", names, evidence) if names == sure else _verdict("one-of", names, evidence, sure)


def _joined(names: tuple[str, ...], curves: tuple[str, ...], facts: tuple[str, ...]) -> SessionVerdict:
    """Return the verdict from ``names``, causes of changed colour points, and ``curves``, causes of bent curves."""
    if not names and not curves:
        return _verdict("same", (), facts)
    both = tuple(name for name in names if name in curves)
    if both or not names or not curves:
        return _one_of(both or names or curves, facts)
    return _verdict("several" if len(names) == len(curves) == 1 else "one-of", (*names, *curves), facts)


def _verdict(
    kind: str, names: tuple[str, ...], evidence: tuple[str, ...], sure: tuple[str, ...] = ()
) -> SessionVerdict:
    meanings = [causes()[name].meaning for name in names]
    if kind == "same":
        sentence = "The sessions differ by no more than two sessions of an unchanged display."
    elif kind == "unclear":
        sentence = "No known cause explains the change, or the patches that would show the cause were not read."
    elif kind == "several":
        sentence = f"More than one thing at once: {_clauses(meanings, 'and')}."
    elif sure and len(sure) < len(names):
        certain, rest = meanings[: len(sure)], meanings[len(sure) :]
        sentence = f"It looks as if {_clauses(certain, 'and')}; and in addition, {_clauses(rest, 'or')}."
    else:
        sentence = f"It looks as if {_clauses(meanings, 'or')}."
    tests = tuple(causes()[name].test for name in names) if kind in {"one-of", "several"} or len(names) == 1 else ()
    return SessionVerdict(kind, names, sentence, evidence, tests, _display(kind, names, sure), sure)


def _clauses(clauses: Sequence[str], conjunction: str) -> str:
    """Join clauses of a sentence: ``a``, ``a, or b``, ``a, b, or c``."""
    return ", ".join([*clauses[:-1], f"{conjunction} {clauses[-1]}"]) if len(clauses) > 1 else "".join(clauses)


def _display(kind: str, names: tuple[str, ...], sure: tuple[str, ...]) -> str:
    """Return whether the display itself has changed: "changed" if a certain cause changes the display."""
    state = {name: cause.display for name, cause in causes().items()}
    if "changed" in {state[name] for name in (names if kind in {"named", "several"} else sure)}:
        return "changed"
    unchanged = kind != "unclear" and all(state[name] == "unchanged" for name in names)
    return "unchanged" if unchanged else "cannot tell"


def _facts(pair: SessionPair) -> tuple[str, ...]:
    if pair.seen is None:
        return ()
    before, after = pair.seen
    light = ", ".join(f"×{ratio:.3f} {name}" for name, ratio in zip(CHANNELS, pair.light_ratio, strict=True))
    moved = ", ".join(f"{name} {value:.3f}" for name, value in zip(COLOURS[:-1], pair.shift, strict=True))
    facts = [f"light at full drive {light}", f"Δu'v' {moved}"]
    if before.has_black and after.has_black:
        facts.append(f"black {before.leak[1]:.3g} → {after.leak[1]:.3g} cd/m²")
    if pair.bend is not None:
        whose = "the display's own curves" if pair.curves_known else "curves"
        facts.append(f"{whose} within ΔL* {abs(pair.bend):.1f} above L* {DARKEST:g}")
    if pair.curves_of_files:
        change = f"{pair.bend_with_calibration:+.1f}"
        facts.append(f"with the calibrations in the files, which differ, curves moved by ΔL* {change}")
    if abs(pair.additivity[1] - pair.additivity[0]) >= SUM_REPORTED:
        facts.append(f"white over red + green + blue {pair.additivity[0]:.3f} → {pair.additivity[1]:.3f}")
    if pair.curves_known and np.abs(pair.calibration_gain - 1.0).max() >= 0.002:
        held = ", ".join(f"{name} ×{value:.3f}" for name, value in zip(CHANNELS, pair.calibration_gain, strict=True))
        facts.append(f"the calibration curves in the files differ ({held}); their effect is removed")
    return tuple(facts)


def _records(pair: SessionPair) -> tuple[str, ...]:
    light = pair.room_light_change
    room_light = f"the campaign says {light:+g} lx" if light else ""
    return tuple(part for part in (pair.other_instrument, pair.other_settings, room_light) if part)


#: If a later session has this much more light (natural logarithm), the loss in an earlier session was not aging.
CAME_BACK = 0.05

#: If an earlier session has less than this share of the loss that a steady decay predicts, the loss was sudden.
LATE = 0.25

#: Fewest sessions for a steady loss, without the reference; largest residual from a straight line in time, and smallest
#: loss at its end, as natural logarithms.
FEWEST_SESSIONS, STEADY, LEAST = 3, 0.02, 0.05


def in_succession(pairs: Sequence[SessionPair], verdicts: Sequence[SessionVerdict]) -> tuple[SessionVerdict, ...]:
    """Revise verdicts that name a steady cause: whether light came back later, and whether the loss was steady."""
    revised = list(verdicts)
    still = [pair for pair, each in zip(pairs, verdicts, strict=True) if each.kind == "same"]
    for place, pair in enumerate(pairs):
        for name in _with_course("steady", verdicts[place]):
            each = revised[place]
            if len(each.names) > 1 and (later := _brighter_later(pair, pairs)):
                why = f"light came back by {in_percent(later, signed=True)} in a later session"
                revised[place] = without(each, name, why)
            elif _with_course("step", each) and (within := _lost_within(pair, still)):
                revised[place] = without(each, name, f"hardly any of this light was lost until {within} before")
    steady = [place for place, each in enumerate(revised) if {*each.sure} <= {*_with_course("steady", each)} != set()]
    calm = [place for place, each in enumerate(revised) if each.kind == "same" and pairs[place].days is not None]
    enough = len(steady) + len(calm) >= FEWEST_SESSIONS and len(steady) > 1
    if enough and _is_steady([pairs[place] for place in steady + calm]):
        why = f"light was lost steadily over {len(steady) + len(calm) + 1} sessions, which no changed setting does"
        for place in steady:
            each = revised[place]
            revised[place] = _verdict("named", _with_course("steady", each)[:1], (*each.evidence, why))
    return tuple(revised)


def _with_course(way: str, verdict: SessionVerdict) -> tuple[str, ...]:
    """Return the named causes whose ``over_time`` is ``way``."""
    return tuple(name for name in verdict.names if causes()[name].over_time == way)


def _brighter_later(pair: SessionPair, pairs: Sequence[SessionPair]) -> float:
    """Return the share of light that came back after a session; 0 if none came back, or if dates are missing."""
    mine = pair.light_change
    if mine is None or pair.days is None:
        return 0.0
    later = [each.light_change for each in pairs if each.days is not None and each.days > pair.days]
    # In sessions brighter than the reference, somebody raised the brightness. Other sessions may also have a raised
    # brightness: use the median.
    gains = [float((each - mine).min()) for each in later if each is not None and each.max() <= CAME_BACK]
    gain = float(np.median(gains)) if gains else 0.0
    return float(np.expm1(gain)) if gain >= CAME_BACK else 0.0


def _lost_within(pair: SessionPair, still: Sequence[SessionPair]) -> str:
    """Return the time within which most of the loss came; "" without an unchanged session in the later half."""
    mine = pair.light_change
    if mine is None or pair.days is None or pair.days <= 0:
        return ""
    for each in still:
        light = each.light_change
        if light is not None and each.days is not None and pair.days / 2 <= each.days < pair.days:
            steady = float(mine.mean()) * each.days / pair.days
            if steady <= -CAME_BACK and float(light.mean()) > LATE * steady:
                if pair.hours is not None and each.hours is not None:
                    return f"{spaced(pair.hours - each.hours)} hours"
                return f"{pair.days - each.days:.0f} days"
    return ""


def _is_steady(pairs: Sequence[SessionPair]) -> bool:
    """Whether the logarithm of every channel's light falls along a straight line in time through the reference."""
    days = np.array([pair.days if pair.days is not None else np.nan for pair in pairs])
    light = [pair.light_change for pair in pairs]
    if not np.isfinite(days).all() or np.ptp(np.append(days, 0.0)) <= 0 or any(each is None for each in light):
        return False
    loss = np.array(light)
    slope = days @ loss / (days @ days)
    residual = loss - days[:, np.newaxis] * slope
    return bool(np.sqrt((residual**2).mean(axis=0)).max() <= STEADY and (slope * np.abs(days).max()).mean() <= -LEAST)
