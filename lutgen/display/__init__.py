"""The display: white and primaries over time, aging modes, the paper's matrices, the chain from code value to light.

A ``DisplayModel`` (``model``) returns an ``AgedDisplay`` (``chain``) for each mode and hour, which converts code values
to XYZ. ``inverse`` and ``search`` compute the inverse. ``aging`` computes the output of ``lutgen show``, ``signature``
the size of an effect, and ``carried`` says what LUTs leave out. Each further file is a part of the chain or of a model
file.
"""

from lutgen.display.carried import not_measured, seen_on, what_luts_carry, what_pictures_carry
from lutgen.display.chain import STAGES, AgedDisplay, Link
from lutgen.display.conditions import REFERENCE, Conditions, parse_at
from lutgen.display.fitted import AppliedEffect, Estimate, LatentTips
from lutgen.display.inverse import Compensation, compensated, compensation_of
from lutgen.display.model import DisplayModel, default_display, hour_name
from lutgen.display.model_file import load_model, save_model
from lutgen.display.tips import Tips
from lutgen.names import BASELINES, MODES, REFERENCES, SELECTIONS, UNREACHABLE

__all__ = [
    "BASELINES",
    "MODES",
    "REFERENCE",
    "REFERENCES",
    "SELECTIONS",
    "STAGES",
    "UNREACHABLE",
    "AgedDisplay",
    "AppliedEffect",
    "Compensation",
    "Conditions",
    "DisplayModel",
    "Estimate",
    "LatentTips",
    "Link",
    "Tips",
    "compensated",
    "compensation_of",
    "default_display",
    "hour_name",
    "load_model",
    "not_measured",
    "parse_at",
    "save_model",
    "seen_on",
    "what_luts_carry",
    "what_pictures_carry",
]
