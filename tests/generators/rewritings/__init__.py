"""Rewritings: functions from the text of a campaign's CSV file to another text of the same campaign.

``NOTHING_LOST``: verdict, effects, shares and errors must not change at all. ``SOMETHING_LOST``: the file loses or
gains information; the verdict on a healthy display and on a clear effect must not change. ``OF_TRUTH``: rewritings with
new readings. These need the noise-free light: they are functions from a ``Truth`` and a seed to a ``Truth``, which an
instrument then reads.

A rewriting that a file does not allow raises ``CannotRewrite``. Random choices depend on the text alone.
"""

from __future__ import annotations

from tests.generators.rewritings.new_readings import OF_TRUTH
from tests.generators.rewritings.nothing_lost import NOTHING_LOST
from tests.generators.rewritings.rewriting import CannotRewrite
from tests.generators.rewritings.something_lost import SOMETHING_LOST

__all__ = ["NOTHING_LOST", "OF_TRUTH", "SOMETHING_LOST", "CannotRewrite"]
