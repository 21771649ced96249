"""Simulated campaigns on real displays: a measured session is hour 0, later hours are computed from it.

One real session (its curves, mixing and black) is aged by a linear change of its channels' light, which re-measured
white and primaries carry, and then by hidden effects. Nothing here but the session itself is measured: every later
hour, room light, position, window and minute is simulated. The sessions lie under ``$LUTGEN_REAL_DATA/real`` (by
Jamesits, CC BY 4.0, and ickc, BSD-3-Clause).
"""

from tests.generators.real.campaigns import KINDS, OUTSIDE, campaign
from tests.generators.real.noise import instrument_noise
from tests.generators.real.sessions import BASES, MissingSessionsError

__all__ = ["BASES", "KIN", "KINDS", "OUTSIDE", "MissingSessionsError", "campaign", "instrument_noise"]

#: A contrast that is set too high multiplies code values, which end at full drive: recalibration's gain.
KIN = {"highlight-clip": "recalibration"}
