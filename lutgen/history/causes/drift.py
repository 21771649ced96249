"""Warm-up or automatic brightness: the light ran away while the session was read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes._cause import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import Pair


def _seen(pair: Pair) -> str:
    said = [
        f"within {whose} luminance changed by {each.change:+.1%}, as "
        + (
            "patches that were read again show"
            if each.by == "repeats"
            else "patches of both sessions show by their order"
        )
        for each, whose in zip(pair.drifts, ("the reference", "the session"), strict=True)
        if each.ran_away
    ]
    return " and ".join(said)


CAUSE = Cause(
    name="drift",
    meaning="the display warmed up or dimmed itself while it was read",
    whose="display",
    test="switch automatic brightness off, let it warm up for half an hour, and read white every ten patches",
    seen=_seen,
)
