"""``lutgen merge``: aged displays into a user's own OpenColorIO config, which stays as it is for everything else.

``merging`` plans, writes and proves a merge, ``additions`` holds the new parts of a config, ``proof`` compares pixels.
One more file here serves merging alone: what lint needs too is in ``lutgen.bindings``.
"""

from __future__ import annotations

import sys
from types import ModuleType

from lutgen.merge.merging import Merged, Merging, merge

__all__ = ["Merged", "Merging", "merge"]


class _MergePackage(ModuleType):
    """Keeps ``lutgen.merge(…)`` working: importing this package replaces the function of that name by the package."""

    __call__ = staticmethod(merge)


sys.modules[__name__].__class__ = _MergePackage
