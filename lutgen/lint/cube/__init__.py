"""A ``.cube`` as numbers: its lines as they stand, the statistics of its table, and the colours that it means.

One more file here answers one more question about the numbers; what readers do with them is said in ``formats.cube``.
"""
