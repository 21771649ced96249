"""The one error that lutgen raises for bad input, and the exit code of an interrupted command.

The message is a text for a person: what is wrong, where, what is allowed, what to do.
The command line prints the message and exits with 2. The library never prints and never exits.
"""

from collections.abc import Collection, Iterable

#: Exit code of a program that SIGINT (Ctrl-C) has ended: 128 + the signal's number.
INTERRUPTED = 130


class LutgenError(ValueError):
    """Bad input. The message says what is wrong, where, what is allowed and what to do."""


def reason_of(error: OSError) -> str:
    """Return the system's reason for a file error in lower case, such as ``file name too long``, for a sentence."""
    return (error.strerror or str(error)).lower()


def in_one_line(text: object) -> str:
    """Return the text of a message, such as an exception of OpenColorIO, on one line: line breaks become spaces."""
    return " ".join(str(text).split())


def listed(names: Iterable[str], conjunction: str = "and") -> str:
    """Join names for a sentence: nothing, ``a``, ``a and b``, ``a, b and c``."""
    *before, last = tuple(names) or ("",)
    return f"{', '.join(before)} {conjunction} {last}" if before else last


def pick_one(what: str, given: object, choices: Iterable[str]) -> LutgenError:
    """Return the error for a name ``given`` that is not among ``choices``; the error names a similar choice."""
    names = list(choices)
    return LutgenError(f"unknown {what} {str(given)!r}. Pick one of: {', '.join(names)}.{guess(given, names)}")


def guess(given: object, names: Iterable[str]) -> str:
    """Return `` Did you mean NAME?`` with the name that is most similar to ``given``; "" if none is similar."""
    from difflib import get_close_matches

    similar = get_close_matches(str(given), list(names), n=1, cutoff=0.75)
    return f" Did you mean {similar[0]}?" if similar else ""


def refuse_unknown(what: str, given: object, choices: Collection[object]) -> None:
    """Raise the LutgenError of :func:`pick_one` when ``given`` is not among ``choices``."""
    if given not in choices:
        raise pick_one(what, given, map(str, choices))
