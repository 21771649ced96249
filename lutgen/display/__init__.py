"""The display: its white and primaries over time, aging modes, the paper's matrices, and the chain from code to light.

A model (``model``) gives for each mode and hour an aged display (``chain``), which turns code values into XYZ;
``inverse`` and ``search`` go back. One more file here holds one more part of that chain, or one more thing that a model
file keeps.
"""

from lutgen.display.chain import STAGES, AgedDisplay, Link
from lutgen.display.conditions import REFERENCE, Conditions, parse_at, seen_on, what_luts_carry, what_pictures_carry
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
    "parse_at",
    "save_model",
    "seen_on",
    "what_luts_carry",
    "what_pictures_carry",
]
