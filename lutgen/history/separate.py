"""Display, instrument, room or settings: why the sessions of a campaign differ from a reference session.

Each session is held against the reference: first what the five colours do not hold (drift while reading, HDR, another
display, shifted spectral lines, bent curves), then every cause and every two of them by the evidence of the five
colours. A verdict names one cause, or those that cannot be told apart and the measurement that would tell.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.history.causes import causes
from lutgen.history.course import course
from lutgen.history.evidence import BY_CONTENT, fit
from lutgen.history.five import five
from lutgen.history.pair import Pair
from lutgen.history.succession import in_succession
from lutgen.history.verdicts import Verdict, pronounce

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.history.evidence import Fit
    from lutgen.readings.campaign import Campaign, Entry

#: What a second cause costs before it explains anything, in natural logarithms: two changes at once are rarer.
SECOND = 3.0


@dataclass(frozen=True)
class Explained:
    """A set of causes and how well it explains the five colours.

    Attributes
    ----------
    names
        The causes; none: nothing changed.
    fit
        Their best fit.
    weight
        Natural logarithm of evidence times prior.

    """

    names: tuple[str, ...]
    fit: Fit
    weight: float


@dataclass(frozen=True)
class Separation:
    """Verdicts on a campaign.

    Attributes
    ----------
    campaign
        The sessions.
    reference
        Place of the session that the others are held against.
    pairs, verdicts
        Of every other session, in the campaign's order.

    """

    campaign: Campaign
    reference: int
    pairs: tuple[Pair, ...]
    verdicts: tuple[Verdict, ...]


def separate(
    campaign: Campaign, *, reference: str | None = None, progress: Callable[[int, int], None] | None = None
) -> Separation:
    """Say of every session of a campaign why it differs from the reference.

    ``reference`` names its file; without it, the earliest session that is whole and steady is taken.

    Raises
    ------
    LutgenError
        Fewer than two sessions, or the reference is none or several of them.

    """
    if len(campaign.entries) < 2:
        message = f"{campaign.file}: one session; causes are told from two or more. Add another [[sessions]]."
        raise LutgenError(message)
    place = _reference(campaign, reference)
    before = campaign.entries[place]
    others = [entry for entry in campaign.entries if entry is not before]
    pairs, verdicts = [], []
    for number, after in enumerate(others):
        if progress:
            progress(number, len(others))
        pair = Pair(before, after, _days(campaign, before, after))
        pairs.append(pair)
        verdicts.append(pronounce(pair, explanations(pair)))
    return Separation(campaign, place, tuple(pairs), in_succession(pairs, verdicts))


def explanations(pair: Pair) -> tuple[Explained, ...]:
    """Weigh nothing, every cause and every two, the best first; empty where the five colours were not read."""
    if pair.seen is None:
        return ()
    before, after = pair.seen
    known = [cause for cause in causes().values() if cause.ways]
    # Nothing may be as loose as any cause, lest one be named for its looseness alone.
    loosest = max(cause.loose for cause in known)
    found: list[Explained] = []
    for together in ((), *combinations(known, 1), *combinations(known, 2)):
        best: Explained | None = None
        prior = sum(cause.prior(pair) for cause in together) - SECOND * max(len(together) - 1, 0)
        looseness = (max(cause.loose for cause in together),) if together else (0.0, loosest)
        for ways, loose in product(product(*(cause.ways for cause in together)), looseness):
            free = [name for way in ways for name in way]
            if len(set(free)) < len(free):
                continue
            found_fit = fit(before, after.xyz(), free, noise=pair.noise, loose=loose)
            if not all(
                cause.sound({name: found_fit.values[name] for name in way}, pair)
                for cause, way in zip(together, ways, strict=True)
            ):
                continue
            here = Explained(tuple(cause.name for cause in together), found_fit, found_fit.evidence + prior)
            best = here if best is None or here.weight > best.weight else best
        if best is not None:
            found.append(best)
    return tuple(sorted(found, key=lambda each: -each.weight))


def _reference(campaign: Campaign, named: str | None) -> int:
    files = [entry.session.file for entry in campaign.entries]
    if named:
        found = [place for place, file in enumerate(files) if file == named or file.endswith(f"/{named}")]
        if len(found) != 1:
            names = ", ".join(file.rsplit("/", 1)[-1] for file in files)
            message = f"{campaign.file}: {named!r} names {len(found)} of its sessions. Pick one of: {names}."
            raise LutgenError(message)
        return found[0]
    return min(range(len(files)), key=lambda place: (_doubt(campaign.entries[place]), _age(campaign.entries[place])))


def _doubt(entry: Entry) -> float:
    """What speaks against a session as the reference: that it lacks patches, ran away, or is not additive."""
    found = five(entry.session)
    if found is None:
        return np.inf
    off = abs(float(found.extra[1] / found.channels[:, 1].sum()))
    return (10.0 if course(entry.session).ran_away else 0.0) + (off if off >= BY_CONTENT else 0.0)


def _age(entry: Entry) -> tuple[float, str]:
    """Sort key: hours where said, else the date, to the minute where the file says it."""
    if entry.hours is not None:
        return entry.hours, ""
    made = entry.session.created
    minute = made.isoformat() if made and entry.date == made.date() else ""
    return (float(entry.date.toordinal()) if entry.date else np.inf), minute


def _days(campaign: Campaign, before: Entry, after: Entry) -> float | None:
    """Days from one to the other: by operating hours where said (24 a day, or as the campaign says), or dates."""
    if before.hours is not None and after.hours is not None:
        return (after.hours - before.hours) / (campaign.hours_per_day or 24.0)
    if before.date and after.date:
        return float((after.date - before.date).days)
    return None
