"""Images as aged displays show them, and the numbers that follow: ΔE2000, lifetimes, maps, contrast of nuclei.

``images``, ``blocks`` and ``encoding`` read pixels without holding an image in memory; ``distinct`` counts the colours
from which most numbers follow. One more file holds one more kind of number or picture that is computed from pixels: a
function that takes an image and a display model and returns a frozen result, without sentences for people.
"""
