"""What the paper published of its simulation: Table 1, and what Figures 2 to 6 show.

Avanaki et al., "Aging display's effect on interpretation of digital pathology slides", Proc. SPIE 9420 (2015),
section 3.1. The images were never published; these numbers and the captions were.
"""

from __future__ import annotations

#: Columns of Table 1: tolerated ΔE2000, and the statistic of ``curve.STATISTICS`` that reaches it.
TABLE_1_COLUMNS = ((3.0, "max"), (3.0, "mean"), (5.0, "max"), (5.0, "mean"))

#: Table 1: aging mode → hours until each of ``TABLE_1_COLUMNS``.
TABLE_1 = {"chroma": (4500, 7800, 8100, 11_100), "chroma-luma": (2200, 3700, 4100, 5800)}

#: Figures 2 to 4: the aged pictures around the un-aged one, clockwise from the top.
AGES = (("chroma", 10_000.0), ("chroma", 18_000.0), ("chroma-luma", 10_000.0), ("chroma-luma", 18_000.0))

#: Figure 6: its maps from top to bottom, and the ΔE2000 at the ends of its colour bar.
MAPS = (("chroma", 8100.0), ("chroma-luma", 4100.0))
MAP_RANGE = (1.0, 8.0)
