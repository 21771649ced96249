"""Simulated campaigns on real displays: hour 0 is a measured session; the later hours are computed from this session.

The input is one real session with its curves, mixing and black. A linear change of the light of the channels ages the
session; re-measured white and primaries follow this change. Hidden effects come on top. Only the session itself is
measured: every later hour, room light, position, window and minute is simulated. The sessions are in
``$LUTGEN_REAL_DATA/real`` (by Jamesits, CC BY 4.0, and ickc, BSD-3-Clause).
"""

from tests.generators.real.campaigns import KINDS, OUTSIDE, campaign
from tests.generators.real.noise import instrument_noise
from tests.generators.real.sessions import BASES, MissingSessionsError

__all__ = ["BASES", "KIN", "KINDS", "OUTSIDE", "MissingSessionsError", "campaign", "instrument_noise"]

#: ``highlight-clip``: a contrast setting that is too high multiplies the code values and clips at full drive. The
#: multiplication is the gain of ``recalibration``.
KIN = {"highlight-clip": "recalibration"}
