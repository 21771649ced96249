"""``lutgen merge``: adds aged displays to a user's own OpenColorIO config. Other parts of the config do not change.

``merging`` plans, writes and proves a merge. ``additions`` creates the new parts. ``proof`` compares pixels.
Functions that lint also needs are in ``lutgen.bindings``.
"""

from __future__ import annotations

import sys
from types import ModuleType

from lutgen.merge.merging import Merged, Merging, merge

__all__ = ["Merged", "Merging", "merge"]


class _MergePackage(ModuleType):
    """A callable package, for ``lutgen.merge(…)``: the import of this package replaces the function of that name."""

    __call__ = staticmethod(merge)


sys.modules[__name__].__class__ = _MergePackage
