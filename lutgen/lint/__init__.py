"""``lutgen lint``: what each reader does with a LUT, a profile or a config of any program.

``formats`` holds one module for each kind of file. To support another kind of file, add a module there. The module
reads the file without trusting its header, and defines ``FORMAT``: the suffixes, the rules and the lint function.
``programs`` holds the readers of ``.cube`` that ``--try`` runs and compares with lutgen's own reading.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.callable_package import make_callable
from lutgen.errors import LutgenError
from lutgen.lint.formats import formats

if TYPE_CHECKING:
    from lutgen.lint.finding import Linted

_BY_SUFFIX = {suffix: form for form in formats() for suffix in form.suffixes}

#: The suffixes of files that lint can read.
KINDS = tuple(sorted(_BY_SUFFIX))


def lint(path: str | Path, *, ask_readers: bool = False) -> Linted:
    """Return what each reader does with a LUT, a profile or a config of any program.

    Parameters
    ----------
    ask_readers
        Also let the installed readers read the file, and report the result.

    Raises
    ------
    LutgenError
        The file does not exist, cannot be read, is no text, or is of an unknown kind.

    """
    path = Path(path)
    form = _BY_SUFFIX.get(path.suffix.lower())
    if path.is_dir() or not path.exists():
        reason = "is a folder" if path.is_dir() else "there is no such file"
        raise LutgenError(f"{path}: {reason}. Give a file that ends in {', '.join(KINDS)}.")
    if form is None:
        raise LutgenError(f"{path}: ends in none of {', '.join(KINDS)}. Give a LUT, a profile or a config.")
    return form.lint(path, ask_readers)


make_callable(__name__, lint)
