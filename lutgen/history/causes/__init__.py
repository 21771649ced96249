"""Causes of a difference between two sessions, one a file in this folder; adding a cause is adding a file.

A module has one ``CAUSE``, which declares what the cause moves and what it leaves, how it changes white, primaries and
black, what proves it, and with which changes it may be confused. Verdicts are weighed from these declarations alone: no
other file names a cause.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.history.pair import SessionPair

    #: Parameter of ``colour_points.PARAMETERS`` → its fitted numbers.
    Values = Mapping[str, Array]

#: What the verdict on the display itself is where a cause alone is named.
ON_THE_DISPLAY = ("unchanged", "changed", "cannot tell")


def _even(_pair: SessionPair) -> float:
    return 0.0


def _silent(_pair: SessionPair) -> str:
    return ""


def _always(_pair: SessionPair) -> bool:
    return True


def _never(_pair: SessionPair) -> bool:
    return False


def _sound(_values: Values, _pair: SessionPair) -> bool:
    return True


def _no_rival(_names: tuple[str, ...], _values: Values, _pair: SessionPair) -> str:
    return ""


@dataclass(frozen=True)
class Cause:
    """One cause.

    Attributes
    ----------
    name, meaning
        Its name in verdicts, and what happened, to be read after "it looks as if".
    test
        The measurement that would confirm or refute it.
    display
        What it says of the display itself, one of ``ON_THE_DISPLAY``.
    moves
        Facts of ``pair.FACTS`` that it may move; the others it leaves.
    possible
        Whether the records of a pair leave it open, where only the facts speak for it.
    ways
        Sets of parameters of ``colour_points.PARAMETERS`` by which it changes white, primaries and black.
    prior
        Natural logarithm of how much likelier than usual the records of a pair make it; -inf: they rule it out.
    sound
        Whether fitted parameters are ones that this cause can have.
    loose
        Share by which it may move the colour of a primary besides.
    proof, rank, alone
        A sentence where something beside white, primaries and black proves it; "" where nothing does. Of several
        proofs that of the lowest rank is believed; unless ``alone``, other causes that move as much stay rivals.
    sign
        A sentence where something speaks for it that is no proof: it is named where nothing else explains the pair.
    bends
        Whether it may have bent the transfer curves as they are seen to be bent.
    beside
        A sentence where it happened beside whatever else did, and was put right: a reading that was left out.
    rival
        Names, fitted values and pair of another explanation → the parameter whose change this cause may have made as
        well; "" where there is none.
    over_time
        How light goes with it over many sessions: "steady", "step", or "" where it does not say.
    spoils
        Whether a session with it tells nothing of the display's age.

    """

    name: str
    meaning: str
    test: str
    display: str
    moves: frozenset[str]
    possible: Callable[[SessionPair], bool] = _always
    ways: tuple[tuple[str, ...], ...] = ()
    prior: Callable[[SessionPair], float] = _even
    sound: Callable[[Values, SessionPair], bool] = _sound
    loose: float = 0.0
    proof: Callable[[SessionPair], str] = _silent
    rank: int = 9
    alone: bool = True
    sign: Callable[[SessionPair], str] = _silent
    bends: Callable[[SessionPair], bool] = _never
    beside: Callable[[SessionPair], str] = _silent
    rival: Callable[[tuple[str, ...], Values, SessionPair], str] = _no_rival
    over_time: str = ""
    spoils: bool = True


@cache
def causes() -> dict[str, Cause]:
    """Name → cause, by name."""
    found: list[Cause] = [import_module(f"{__name__}.{each.name}").CAUSE for each in iter_modules(__path__)]
    return {cause.name: cause for cause in sorted(found, key=lambda each: each.name)}
