"""Pages about LUT files: certificates of a build, who reads a foreign file, what a merge changed.

A page here belongs to a command that writes or reads LUTs or OpenColorIO configs. One more file holds the page of one
such command; it takes the records of :mod:`lutgen.bake` and measures nothing itself.
"""
