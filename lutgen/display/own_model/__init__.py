"""A display's own model: a fit of its first session, chosen from a ladder of models, each richer than the one before.

The lowest rung is the paper's sRGB display with measured colour points. Then come a curve of each channel, curves of
each channel for X, Y and Z, products of code values, and a smooth residual. A rung is taken only where it lowers the
error on readings that were held out. One more file in this folder holds one more rung (one model), or one part that
rungs share.
"""

from lutgen.display.own_model.ladder import OwnModel, Rung, fit_own_model
from lutgen.display.own_model.sample import Sample

__all__ = ["OwnModel", "Rung", "Sample", "fit_own_model"]
