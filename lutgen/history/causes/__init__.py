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

#: What may be said about the display itself where one cause alone is named.
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
        What the cause says about the display itself, one of ``ON_THE_DISPLAY``.
    moves
        Facts of ``pair.FACTS`` that the cause may move; it does not move the others.
    possible
        Whether the records of a pair allow the cause; asked where the facts alone speak for it.
    ways
        Sets of parameters of ``colour_points.PARAMETERS``: the ways in which the cause changes white, primaries, black.
    prior
        Natural logarithm of the factor by which the records of a pair make the cause likelier; -inf: they exclude it.
    sound
        Whether this cause can have the fitted parameters.
    loose
        Share by which the cause may move the colour of a primary in addition.
    proof, rank, alone
        A sentence where something other than white, primaries and black proves the cause, else "". Of several proofs
        the one with the lowest rank counts. Unless ``alone``, other causes that can move the same facts stay rivals.
    sign
        A sentence where something speaks for the cause without proving it: the cause is named if no other explains the
        pair.
    bends
        Whether the cause may have bent the transfer curves as far as they are bent.
    beside
        A sentence where the cause happened in addition to any other and was corrected: a reading was left out.
    rival
        Names, fitted values and pair of another explanation → the parameter whose change this cause can make as well;
        "" where there is none.
    over_time
        How light changes with the cause over many sessions: "steady", "step", or "" (unknown).
    spoils
        Whether a session with this cause says nothing about the age of the display.

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
    declared: list[Cause] = [import_module(f"{__name__}.{each.name}").CAUSE for each in iter_modules(__path__)]
    return {cause.name: cause for cause in sorted(declared, key=lambda each: each.name)}
