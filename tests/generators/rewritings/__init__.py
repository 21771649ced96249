"""The same campaign written down otherwise: functions from the text of a CSV file to the text of another one.

``NOTHING_LOST``: verdict, effects, shares and errors may not change at all. ``SOMETHING_LOST``: information goes or
comes, so that the verdict on a healthy display and on a clear effect may not change. ``OF_TRUTH``: new readings, which
need the light itself: functions from a ``Truth`` and a seed to a ``Truth``, which an instrument has still to read.

A rewriting that a file does not allow raises ``CannotRewrite``. Random choices follow from the text alone.
"""

from __future__ import annotations

from tests.generators.rewritings.new_readings import OF_TRUTH
from tests.generators.rewritings.nothing_lost import NOTHING_LOST
from tests.generators.rewritings.rewriting import CannotRewrite
from tests.generators.rewritings.something_lost import SOMETHING_LOST

__all__ = ["NOTHING_LOST", "OF_TRUTH", "SOMETHING_LOST", "CannotRewrite"]
