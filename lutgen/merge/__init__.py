"""``lutgen merge``: aged displays into a user's own OpenColorIO config, which stays as it is for everything else.

``merging`` plans, writes and proves; the other modules hold what it needs of the files, the text, the colour spaces and
the pixels of a config. One more file here holds one more such part, and nothing that lint needs too: that is in
``lutgen.bindings``.
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
