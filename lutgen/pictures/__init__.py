"""Images as aged displays show them, and the numbers that follow: ΔE2000, lifetimes, maps, contrast of nuclei.

A module reads images in blocks or computes one kind of number from them. One more file holds one more kind of number;
it knows no command line and writes no sentences for people.
"""
