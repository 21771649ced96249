"""What ``lutgen trend --json`` writes; its schema is ``lutgen/history/schema/trend.json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lutgen.history.trend import DRAWS, INTERVAL, SEED

if TYPE_CHECKING:
    from lutgen.history.trend import Followed, Passing, Trend


def trend_as_json(found: Trend) -> dict[str, Any]:
    """Return the content of the file."""
    seen = found.history
    campaign = seen.campaign
    return {
        "schema": 1,
        "campaign": {"file": campaign.file, "sha256": campaign.sha256, "display": campaign.display or None},
        "unit": seen.unit,
        "interval": {"percentiles": list(INTERVAL), "draws": DRAWS, "seed": SEED},
        "sessions": [
            {
                "file": campaign.entries[place].session.file,
                "time": float(seen.time[here]),
                "left_out": found.why.get(here),
                "figures": {name: float(values[here]) for name, values in seen.values.items()},
            }
            for here, place in enumerate(seen.places)
        ],
        "courses": {name: _course(course) for name, course in found.courses.items()},
        "limits": [_passing(each) for each in found.passings],
    }


def _course(course: Followed) -> dict[str, Any]:
    return {
        "law": course.fits[0].law.name if course.fits else None,
        "as_good": list(course.as_good),
        "aicc": {each.law.name: each.aicc for each in course.fits},
    }


def _passing(each: Passing) -> dict[str, Any]:
    return {
        "limit": each.limit.text,
        "quantity": each.limit.quantity,
        "bound": each.bound,
        "source": each.limit.source,
        "status": each.status,
        "time": each.time,
        "low": each.low,
        "high": each.high,
        "extrapolated": each.extrapolated,
    }
