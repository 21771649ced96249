"""The readings of one display: what a meter measured, patch by patch and hour by hour.

A reading belongs to a session (one sitting with the instrument), a session to a campaign (the sessions of one
display), and the table of readings, ``Measurements``, is what the model and the criticism take. ``formats`` holds one
file a measurement format, ``conditions`` one file a condition of a reading; every command reads any of the formats
through the functions named here.
"""

from __future__ import annotations

from lutgen.readings.formats import read_campaign, read_measurements, read_session
from lutgen.readings.table import TIP_NAMES, Measurements

__all__ = ["TIP_NAMES", "Measurements", "read_campaign", "read_measurements", "read_session"]
