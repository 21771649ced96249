"""What ``lutgen sessions explain --json`` writes; its schema is ``lutgen/history/schema/explain.json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lutgen.history.patches import CHANNELS

if TYPE_CHECKING:
    from lutgen.history.pair import Pair
    from lutgen.history.separate import Separation
    from lutgen.history.verdicts import Verdict


def separation_as_json(found: Separation) -> dict[str, Any]:
    """Return the content of the file."""
    campaign = found.campaign
    return {
        "schema": 1,
        "campaign": {"file": campaign.file, "sha256": campaign.sha256, "display": campaign.display or None},
        "reference": campaign.entries[found.reference].session.file,
        "sessions": [_session(pair, said) for pair, said in zip(found.pairs, found.verdicts, strict=True)],
    }


def _session(pair: Pair, said: Verdict) -> dict[str, Any]:
    return {
        "file": pair.after.session.file,
        "days": pair.days,
        "verdict": said.kind,
        "causes": list(said.names),
        "certain": list(said.sure),
        "display": said.display,
        "sentence": said.sentence,
        "evidence": list(said.evidence),
        "tests": list(said.tests),
        "figures": _figures(pair),
    }


def _figures(pair: Pair) -> dict[str, Any] | None:
    if pair.seen is None:
        return None
    before, after = pair.seen
    ratio = after.channels[:, 1] / before.channels[:, 1]
    return {
        "light": dict(zip(CHANNELS, ratio.tolist(), strict=True)),
        "calibration": dict(zip(CHANNELS, pair.held_back.tolist(), strict=True)),
        "shift_uv": dict(zip((*CHANNELS, "white"), (pair.shift**2).sum(axis=1) ** 0.5, strict=True)),
        "black": [float(each.leak[1]) if each.has_black else None for each in (before, after)],
        "additivity": list(pair.additivity),
        "curve_lightness": pair.bend,
        "drift": [each.change for each in pair.drifts],
    }
