"""A display's own model: a fit to its first session, selected from a ladder of models of increasing complexity.

The lowest rung is the paper's sRGB display with measured colour points. The next rungs have one curve for each channel,
curves of each channel for X, Y and Z, products of code values, and a smooth residual. The ladder takes a rung only if
the rung lowers the error of held-out readings. Each further file in this folder is a rung (a model), or a part that
rungs share.
"""

from lutgen.display.own_model.ladder import OwnModel, Rung, fit_own_model
from lutgen.display.own_model.sample import Sample

__all__ = ["OwnModel", "Rung", "Sample", "fit_own_model"]
