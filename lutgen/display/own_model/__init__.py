"""A display's own model: what its first session says of every colour, as a ladder of rungs.

The lowest rung is the paper's sRGB display with measured colour points. Then come a curve of each channel, curves of
each channel for X, Y and Z, products of code values, and a smooth residual. A rung is taken only where it lowers the
error on readings that were held out. One more file in this folder holds one more rung, or one part that rungs share.
"""

from lutgen.display.own_model.ladder import OwnModel, Rung, fit_own_model
from lutgen.display.own_model.sample import Sample

__all__ = ["OwnModel", "Rung", "Sample", "fit_own_model"]
