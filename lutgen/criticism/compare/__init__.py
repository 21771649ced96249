"""Comparison: where the model differs from the readings, by how much, and in which direction.

A file here works out one view of the residuals: slices, direction, drift within a session, panels of a plot. It
computes numbers and short phrases; tables, pages and plots are made in :mod:`lutgen.report`.
"""
