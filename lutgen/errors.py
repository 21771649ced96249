"""The one error that lutgen raises for bad input.

Its text is one sentence for a person: what is wrong, where, what is allowed, what to do.
The command line prints it and exits with 2; the library never prints and never exits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable


class LutgenError(ValueError):
    """Bad input: says what is wrong, where, what is allowed and what to do."""


def reason_of(error: OSError) -> str:
    """Return the system's reason for an error on a file, such as ``file name too long``, as part of a sentence."""
    return (error.strerror or str(error)).lower()


def in_one_line(text: object) -> str:
    """Return what another program says, such as an exception of OpenColorIO's, with its line breaks made spaces."""
    return " ".join(str(text).split())


def pick_one(what: str, given: object, choices: Iterable[str]) -> LutgenError:
    """Return the error for a name that is not among ``choices``."""
    return LutgenError(f"unknown {what} {str(given)!r}. Pick one of: {', '.join(choices)}.")


def refuse_unknown(what: str, given: object, choices: Collection[object]) -> None:
    """Raise LutgenError as :func:`pick_one` words it, for what is not among ``choices``."""
    if given not in choices:
        raise pick_one(what, given, map(str, choices))
