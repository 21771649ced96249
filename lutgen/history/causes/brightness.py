"""Brightness or preset: all light by one factor, black too; a preset may set the channels' gains besides."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes._cause import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import Pair


def _prior(pair: Pair) -> float:
    return 2.0 if pair.other_settings else 0.0


CAUSE = Cause(
    name="brightness",
    meaning="the display's brightness or preset was changed",
    whose="settings",
    test="put brightness and preset back as they were and read white and black again",
    ways=(("scale",), ("gains",), ("scale", "gains")),
    prior=_prior,
    loose=0.006,
)
