"""The display: measured tips, aging modes, the paper's matrices, and the chain from code value to light."""

from lutgen.display.chain import STAGES, AgedDisplay, Link
from lutgen.display.model import DisplayModel, default_display, hour_name, load_model
from lutgen.display.modes import MODES
from lutgen.display.paper import SELECTIONS
from lutgen.display.tips import REFERENCES, Tips

__all__ = [
    "MODES",
    "REFERENCES",
    "SELECTIONS",
    "STAGES",
    "AgedDisplay",
    "DisplayModel",
    "Link",
    "Tips",
    "default_display",
    "hour_name",
    "load_model",
]
