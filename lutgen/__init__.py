"""lutgen: see through an aged display.

The package turns measurements of an aging display into 3D LUTs and OpenColorIO configs.
The public Python API is small; each function is what a command of the same name calls:

``read_measurements`` · ``DisplayModel``, ``load_model``, ``save_model`` · ``BuildPlan`` and ``build`` · ``check`` ·
``apply_to_image`` · ``lifetime`` · ``cohort`` · ``nuclei`` · ``show`` · ``compare`` · ``diagnose`` · ``refine`` ·
``plan`` · ``lint`` · ``merge`` · ``read_session`` and ``inspect_session`` · ``plan_study``, ``read_answers`` and
``analyse_answers``. Effects: ``lutgen.effects``.

Names are imported when they are first used, so that ``import lutgen`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lutgen.version import __version__ as __version__

#: Public name → the module that defines it.
_HOME = {
    "LutgenError": "lutgen.errors",
    "Measurements": "lutgen.readings",
    "read_measurements": "lutgen.readings",
    "DisplayModel": "lutgen.display",
    "AppliedEffect": "lutgen.display",
    "default_display": "lutgen.display",
    "load_model": "lutgen.display",
    "save_model": "lutgen.display",
    "BuildPlan": "lutgen.bake.plan",
    "build": "lutgen.bake.build",
    "check": "lutgen.bake.check",
    "apply_to_image": "lutgen.pictures.apply",
    "lifetime": "lutgen.pictures.lifetime",
    "cohort": "lutgen.pictures.cohort",
    "nuclei": "lutgen.pictures.conspicuity",
    "show": "lutgen.display.aging",
    "compare": "lutgen.criticism.compare.comparison",
    "diagnose": "lutgen.criticism.diagnose",
    "refine": "lutgen.criticism.refine",
    "plan": "lutgen.criticism.plan",
    "read_session": "lutgen.readings",
    "inspect_session": "lutgen.history.inspect",
    "lint": "lutgen.lint",
    "merge": "lutgen.merge",
    "plan_study": "lutgen.study.plan",
    "read_answers": "lutgen.study.answers",
    "analyse_answers": "lutgen.study.analysis",
}

__all__ = [*_HOME, "__version__"]  # noqa: PLE0604 - the keys are texts

# For type checkers and editors; `as` marks names that the package exports.
if TYPE_CHECKING:
    from lutgen.bake.build import build as build
    from lutgen.bake.check import check as check
    from lutgen.bake.plan import BuildPlan as BuildPlan
    from lutgen.criticism.compare.comparison import compare as compare
    from lutgen.criticism.diagnose import diagnose as diagnose
    from lutgen.criticism.plan import plan as plan
    from lutgen.criticism.refine import refine as refine
    from lutgen.display import AppliedEffect as AppliedEffect
    from lutgen.display import DisplayModel as DisplayModel
    from lutgen.display import default_display as default_display
    from lutgen.display import load_model as load_model
    from lutgen.display import save_model as save_model
    from lutgen.display.aging import show as show
    from lutgen.errors import LutgenError as LutgenError
    from lutgen.history.inspect import inspect_session as inspect_session
    from lutgen.lint import lint as lint
    from lutgen.merge import merge as merge
    from lutgen.pictures.apply import apply_to_image as apply_to_image
    from lutgen.pictures.cohort import cohort as cohort
    from lutgen.pictures.conspicuity import nuclei as nuclei
    from lutgen.pictures.lifetime import lifetime as lifetime
    from lutgen.readings import Measurements as Measurements
    from lutgen.readings import read_measurements as read_measurements
    from lutgen.readings import read_session as read_session
    from lutgen.study.analysis import analyse_answers as analyse_answers
    from lutgen.study.answers import read_answers as read_answers
    from lutgen.study.plan import plan_study as plan_study


def __getattr__(name: str) -> Any:
    """Import a public name on first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'lutgen' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
