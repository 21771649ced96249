"""The readings of one display: measurements of patches at operating hours.

A session holds the readings of one run of a measuring program. A campaign holds the sessions of one display.
``Measurements`` is the table of all readings; the model and the criticism take this table. ``formats`` holds one file
for each measurement format, ``conditions`` one file for each condition of a reading. Every command reads all formats
through the functions of this module.
"""

from lutgen.readings.formats import read_campaign, read_measurements, read_session
from lutgen.readings.table import TIP_NAMES, Measurements

__all__ = ["TIP_NAMES", "Measurements", "read_campaign", "read_measurements", "read_session"]
