"""Images as aged displays show them, and numbers computed from images: ΔE2000, lifetimes, maps, contrast of nuclei.

``images``, ``blocks`` and ``encoding`` read pixels in blocks, so that no image is held in memory. ``distinct`` counts
the distinct colours of an image; most numbers are computed from these counts. Each other file computes one kind of
number or picture. Its main function takes an image and a display model, and returns a frozen result. The result holds
no sentences for readers; ``lutgen/report`` writes these.
"""
