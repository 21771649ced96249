"""The scales that readers answer on: diagnoses, each with its side and its key, and ease of reading."""

from __future__ import annotations

from lutgen.cells import whole
from lutgen.errors import LutgenError
from lutgen.study.protocol import Category

#: The paper's: negative 0 and 1+, positive 2+ and 3+; ease from 1, hard, to 10, easy.
PAPER_NEGATIVE, PAPER_POSITIVE, PAPER_EASE = "0,1+", "2+,3+", "1..10"

#: As many as there are digits to press.
MOST_CATEGORIES = 9

#: What fits on a key of the reading page.
MAX_LETTERS = 40


def categories_of(negative: str, positive: str) -> tuple[Category, ...]:
    """Return the diagnoses of two lists such as ``0,1+`` and ``2+,3+``.

    The key of each is the digit that its name begins with, where all begin with different ones, else its number.

    Raises
    ------
    LutgenError
        A side without diagnoses, one that is named twice, too many, or a name that no key can carry.

    """
    sides = [(name.strip(), side) for text, side in ((negative, False), (positive, True)) for name in text.split(",")]
    names = [name for name, _ in sides]
    wrong = next((name for name in names if not (name.isprintable() and 0 < len(name) <= MAX_LETTERS)), None)
    if wrong is not None:
        allowed = f"names of 1 to {MAX_LETTERS} printable letters in a list, at least one a side"
        raise LutgenError(f"diagnosis {wrong!r}: give --negative and --positive {allowed}, such as 0,1+.")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise LutgenError(f"diagnosis {twice!r} is given twice. Name each diagnosis once, on one side.")
    if len(names) > MOST_CATEGORIES:
        raise LutgenError(f"{len(names)} diagnoses, and {MOST_CATEGORIES} keys for them. Leave some out.")
    digits = [name[0] for name in names]
    own = all(digit in "0123456789" for digit in digits) and len(set(digits)) == len(digits)
    keys = digits if own else [str(number) for number in range(1, len(names) + 1)]
    return tuple(Category(name, key, side) for (name, side), key in zip(sides, keys, strict=True))


def ease_of(text: str) -> tuple[int, int]:
    """Return smallest and largest ease of reading of text such as ``1..10``; every step has its digit, 10 has 0.

    Raises
    ------
    LutgenError
        No such scale.

    """
    first, dots, last = text.partition("..")
    lowest = whole(first, least=0, most=1)
    highest = None if lowest is None else whole(last, least=lowest + 1, most=10 if lowest else 9)
    if dots and lowest is not None and highest is not None:
        return lowest, highest
    raise LutgenError(
        f"--ease {text}: give a scale such as 1..10, from 0 or 1 to at most 10 (9 from 0); more is easier."
    )


PAPER_CATEGORIES, PAPER_SCALE = categories_of(PAPER_NEGATIVE, PAPER_POSITIVE), ease_of(PAPER_EASE)
