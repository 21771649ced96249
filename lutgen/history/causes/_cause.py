"""``Cause``: why two sessions of a display differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.history.pair import Pair


def _nothing(_pair: Pair) -> float:
    return 0.0


def _silent(_pair: Pair) -> str:
    return ""


def _sound(_values: Mapping[str, Array], _pair: Pair) -> bool:
    return True


@dataclass(frozen=True)
class Cause:
    """One cause.

    Attributes
    ----------
    name, meaning
        Its name in verdicts, and what happened, to be read after "it looks as if".
    whose
        "display", "settings", "room", "instrument" or "campaign": to whom the change belongs.
    test
        The measurement that would confirm or refute it.
    ways
        Sets of parameters of ``five.PARAMETERS`` by which it changes the five colours; empty: it is told by ``seen``.
    prior
        Natural logarithm of how much likelier than usual the records of a pair make it.
    sound
        Whether fitted parameters are ones that this cause can have.
    loose
        Share by which it may move the colour of a primary besides.
    seen
        Says in a sentence why what the five colours do not hold shows it; "" where it does not.

    """

    name: str
    meaning: str
    whose: str
    test: str
    ways: tuple[tuple[str, ...], ...] = ()
    prior: Callable[[Pair], float] = _nothing
    sound: Callable[[Mapping[str, Array], Pair], bool] = _sound
    loose: float = 0.0
    seen: Callable[[Pair], str] = _silent
