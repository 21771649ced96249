"""``lutgen lint``: what each reader does with a LUT, a profile or a config, whoever made it.

``formats`` holds one module for each kind of file. A further kind of file is one more module there: it reads the file
without trusting its header and ends in ``FORMAT``, which names its suffixes, its rules and the function that applies
them. ``programs`` holds the readers of ``.cube`` that ``--try`` runs and compares with our own reading.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.lint.formats import formats

if TYPE_CHECKING:
    from lutgen.lint.finding import Linted

_BY_SUFFIX = {suffix: form for form in formats() for suffix in form.suffixes}

#: The suffixes that lint reads.
KINDS = tuple(sorted(_BY_SUFFIX))


def lint(path: str | Path, *, ask_readers: bool = False) -> Linted:
    """Lint one file.

    Parameters
    ----------
    ask_readers
        Let the readers that are installed read the file, and say what they did.

    Raises
    ------
    LutgenError
        The file is not there, cannot be read, is no text, or is of no kind that is known.

    """
    path = Path(path)
    form = _BY_SUFFIX.get(path.suffix.lower())
    if path.is_dir() or not path.exists():
        reason = "is a folder" if path.is_dir() else "there is no such file"
        raise LutgenError(f"{path}: {reason}. Give a file that ends in {', '.join(KINDS)}.")
    if form is None:
        raise LutgenError(f"{path}: ends in none of {', '.join(KINDS)}. Rename it to the suffix of its format.")
    return form.lint(path, ask_readers)


class _Callable(ModuleType):
    """Keeps ``lutgen.lint(path)`` working: importing this package replaces the function of that name by the package."""

    __call__ = staticmethod(lint)


sys.modules[__name__].__class__ = _Callable
