"""Say why the sessions of a campaign differ from a reference session: display, instrument, room or settings.

Each session is compared with the reference, without misread readings. Some causes have a direct proof: drift during the
session, HDR, the name of another display, shifted spectral lines. Otherwise every cause, and every pair of causes, is
weighed by the evidence of white, primaries and black. A verdict names one cause, or several causes that fit equally
well and the measurements that would separate them.
"""

from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.history.causes import causes
from lutgen.history.colour_points import BY_CONTENT, COLOURS, colour_points, fit
from lutgen.history.pair import SessionPair
from lutgen.history.patches import CHANNELS
from lutgen.history.steadiness import left_out, steadiness
from lutgen.history.verdicts import Hypothesis, SessionVerdict, in_succession, pronounce
from lutgen.progress import Progress, unseen
from lutgen.readings.campaign import Campaign, CampaignEntry
from lutgen.readings.steadiness import drift_by_repeats

#: Prior odds of one cause against two at once, which are rarer, as a natural logarithm. Recorded causes do not count.
SECOND = 3.0


@dataclass(frozen=True)
class Explanations:
    """Verdicts on a campaign."""

    #: The sessions.
    campaign: Campaign
    #: Index of the reference session in the campaign.
    reference: int
    #: One for every other session, in the order of the campaign.
    pairs: tuple[SessionPair, ...]
    verdicts: tuple[SessionVerdict, ...]


def explain(campaign: Campaign, *, reference: str | int | None = None, progress: Progress = unseen) -> Explanations:
    """Say why sessions differ from ``reference``, a file or an index; default: the first sound session.

    Raises LutgenError: fewer than two sessions, or no session of this name.
    """
    campaign.check_several("a comparison")
    place = reference if isinstance(reference, int) else _reference(campaign, reference)
    cleaned = [left_out(entry.session) for entry in campaign.entries]
    entries = [replace(entry, session=each) for entry, (each, _) in zip(campaign.entries, cleaned, strict=True)]
    others = [number for number in range(len(entries)) if number != place]
    pairs, verdicts = [], []
    for number, other in enumerate(others):
        progress(number, len(others))
        days = _days(campaign, entries[place], entries[other])
        pair = SessionPair(entries[place], entries[other], days, (*cleaned[place][1], *cleaned[other][1]))
        pairs.append(pair)
        verdicts.append(pronounce(pair, explanations(pair)))
    return Explanations(campaign, place, tuple(pairs), in_succession(pairs, verdicts))


def explanations(pair: SessionPair) -> tuple[Hypothesis, ...]:
    """Weigh no cause, every cause and every pair of causes; best first. Empty if white or a primary is missing."""
    if pair.seen is None:
        return ()
    before, after = pair.seen
    known = [cause for cause in causes().values() if cause.ways and cause.prior(pair) > -np.inf]
    # Give "no change" the largest tolerance of all causes, so that no cause is preferred for its tolerance alone.
    loosest = max(cause.loose for cause in known)
    hypotheses: list[Hypothesis] = []
    for together in ((), *combinations(known, 1), *combinations(known, 2)):
        assumed = sum(not cause.recorded(pair) for cause in together)
        prior = sum(cause.prior(pair) for cause in together) - SECOND * max(assumed - 1, 0)
        looseness = (max(cause.loose for cause in together),) if together else (0.0, loosest)
        fits = []
        for ways, loose in product(product(*(cause.ways for cause in together)), looseness):
            free = [name for way in ways for name in way]
            if len(set(free)) < len(free):
                continue
            best_fit = fit(before, after.xyz(), free, noise=pair.noise, loose=loose)
            values = [{name: best_fit.values[name] for name in way} for way in ways]
            if all(cause.sound(each, pair) for cause, each in zip(together, values, strict=True)):
                fits.append(best_fit)
        if fits:
            best = max(fits, key=lambda each: each.evidence)
            names = tuple(cause.name for cause in together)
            hypotheses.append(Hypothesis(names, best, best.evidence + prior, assumed))
    return tuple(sorted(hypotheses, key=lambda each: -each.weight))


def _reference(campaign: Campaign, named: str | None) -> int:
    files = [entry.session.file for entry in campaign.entries]
    if named:
        places = [place for place, file in enumerate(files) if file == named or file.endswith(f"/{named}")]
        if len(places) != 1:
            names = ", ".join(file.rsplit("/", 1)[-1] for file in files)
            raise LutgenError(f"{campaign.file}: {named!r} names {len(places)} of its sessions. Pick one of: {names}.")
        return places[0]
    return references(campaign)[0]


def references(campaign: Campaign) -> list[int]:
    """Return the indices of sessions with white and primaries, sound ones first, then by age; otherwise the first."""
    ordered = sorted((_penalty(entry), _age(entry), place) for place, entry in enumerate(campaign.entries))
    return [place for penalty, _, place in ordered if penalty < np.inf] or [ordered[0][2]]


def _penalty(entry: CampaignEntry) -> float:
    """Return the penalty of a session as the reference: for missing patches, a drift, or light that is not additive."""
    points = colour_points(entry.session)
    if points is None:
        return np.inf
    off = abs(points.excess)
    return (10.0 if drift_by_repeats(steadiness(entry.session)).drifted else 0.0) + (off if off >= BY_CONTENT else 0.0)


def _age(entry: CampaignEntry) -> tuple[float, str]:
    """Return a sort key: hours if known, otherwise the date, with the time of day if the file holds it."""
    if entry.hours is not None:
        return entry.hours, ""
    created = entry.session.created
    minute = created.isoformat() if created and entry.date == created.date() else ""
    return (float(entry.date.toordinal()) if entry.date else np.inf), minute


def _days(campaign: Campaign, before: CampaignEntry, after: CampaignEntry) -> float | None:
    """Return days between two sessions: from operating hours (24 a day without ``hours_per_day``), or from dates."""
    if before.hours is not None and after.hours is not None:
        return (after.hours - before.hours) / (campaign.hours_per_day or 24.0)
    if before.date and after.date:
        return float((after.date - before.date).days)
    return None


def explanations_as_json(explanations: Explanations) -> dict[str, Any]:
    """Return the content of ``sessions explain --json``."""
    campaign = explanations.campaign
    return {
        "schema": 1,
        "campaign": {"file": campaign.file, "sha256": campaign.sha256, "display": campaign.display or None},
        "reference": campaign.entries[explanations.reference].session.file,
        "sessions": [*map(_session_json, explanations.pairs, explanations.verdicts)],
    }


def _session_json(pair: SessionPair, verdict: SessionVerdict) -> dict[str, Any]:
    return {
        "file": pair.after.session.file,
        "days": pair.days,
        "verdict": verdict.kind,
        "causes": list(verdict.names),
        "certain": list(verdict.sure),
        "display": verdict.display,
        "sentence": verdict.sentence,
        "evidence": list(verdict.evidence),
        "tests": list(verdict.tests),
        "figures": _figures_json(pair),
    }


def _figures_json(pair: SessionPair) -> dict[str, Any] | None:
    if pair.seen is None:
        return None
    return {
        "light": dict(zip(CHANNELS, pair.light_ratio.tolist(), strict=True)),
        "calibration": dict(zip(CHANNELS, pair.calibration_gain.tolist(), strict=True)),
        "shift_uv": dict(zip(COLOURS[:-1], pair.shift.tolist(), strict=True)),
        "black": [float(each.leak[1]) if each.has_black else None for each in pair.seen],
        "additivity": list(pair.additivity),
        "curve_lightness": pair.bend,
        "drift": [each.change for each in pair.drifts],
    }
