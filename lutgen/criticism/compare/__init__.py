"""Comparison: where the model differs from the readings, by how much, and in which direction.

Each file here computes one view of the residuals: slices, direction, drift within a session, panels of a plot. The
results are numbers and short phrases; :mod:`lutgen.report` makes tables, pages and plots of them.
"""
