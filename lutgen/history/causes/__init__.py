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

#: What a verdict with a single cause may say about the display itself.
ON_THE_DISPLAY = ("unchanged", "changed", "cannot tell")


@dataclass(frozen=True)
class Cause:
    """One cause."""

    #: Its name in verdicts, and what happened, to be read after "it looks as if".
    name: str
    meaning: str
    #: The measurement that would confirm or refute it.
    test: str
    #: What the cause means for the display itself, one of ``ON_THE_DISPLAY``.
    display: str
    #: Facts of ``pair.FACTS`` that the cause may move; it does not move the others.
    moves: frozenset[str]
    #: Whether the records of a pair allow the cause; asked where the facts alone speak for it.
    possible: Callable[[SessionPair], bool] = lambda _pair: True
    #: Sets of parameters of ``colour_points.PARAMETERS``: the ways in which the cause changes white, primaries, black.
    ways: tuple[tuple[str, ...], ...] = ()
    #: Natural logarithm of the factor by which the records of a pair make the cause likelier; -inf: they exclude it.
    prior: Callable[[SessionPair], float] = lambda _pair: 0.0
    #: Whether the records of a pair say that it happened: beside another cause it is then no further assumption.
    recorded: Callable[[SessionPair], bool] = lambda _pair: False
    #: Whether this cause can have the fitted parameters.
    sound: Callable[[Values, SessionPair], bool] = lambda _values, _pair: True
    #: Share by which the cause may move the colour of a primary in addition.
    loose: float = 0.0
    #: A sentence where something other than white, primaries and black proves the cause, else "". Of several proofs the
    #: one with the lowest rank counts. Unless ``alone``, other causes that can move the same facts stay rivals.
    proof: Callable[[SessionPair], str] = lambda _pair: ""
    rank: int = 9
    alone: bool = True
    #: A sentence where something speaks for the cause without proving it: the cause is named if no other explains the
    #: pair.
    sign: Callable[[SessionPair], str] = lambda _pair: ""
    #: Whether the cause may have bent the transfer curves as far as they are bent.
    bends: Callable[[SessionPair], bool] = lambda _pair: False
    #: A sentence where the cause happened in addition to any other and was corrected: a reading was left out.
    beside: Callable[[SessionPair], str] = lambda _pair: ""
    #: Names, fitted values and pair of another explanation → the parameter whose change this cause can make as well; ""
    #: where there is none.
    rival: Callable[[tuple[str, ...], Values, SessionPair], str] = lambda _names, _values, _pair: ""
    #: How light changes with the cause over many sessions: "steady", "step", or "" (unknown).
    over_time: str = ""
    #: Whether a session with this cause says nothing about the age of the display.
    spoils: bool = True


@cache
def causes() -> dict[str, Cause]:
    """Name → cause, by name."""
    declared: list[Cause] = [import_module(f"{__name__}.{each.name}").CAUSE for each in iter_modules(__path__)]
    return {cause.name: cause for cause in sorted(declared, key=lambda each: each.name)}
