"""Causes of a difference between two sessions, one file for each cause; a new cause needs only a new file.

A module defines one ``CAUSE``, which declares the facts that the cause may move, how the cause changes white, primaries
and black, its proof, and the changes with which it may be confused. Verdicts use only these declarations: no other file
names a cause.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from lutgen.colorimetry import Array
from lutgen.history.pair import SessionPair

#: Parameter of ``colour_points.PARAMETERS`` → its fitted numbers.
Values = Mapping[str, Array]

#: What a verdict with a single cause may say about the display itself.
ON_THE_DISPLAY = ("unchanged", "changed", "cannot tell")


@dataclass(frozen=True)
class Cause:
    """One cause."""

    #: Name in verdicts, and a clause on what happened, which follows "it looks as if".
    name: str
    meaning: str
    #: The measurement that would confirm or refute the cause.
    test: str
    #: What the cause means for the display itself, one of ``ON_THE_DISPLAY``.
    display: str
    #: Facts of ``pair.FACTS`` that the cause may move; it does not move the others.
    moves: frozenset[str]
    #: Whether the records of a pair allow the cause; used when only the moved facts suggest the cause.
    possible: Callable[[SessionPair], bool] = lambda _pair: True
    #: Sets of parameters of ``colour_points.PARAMETERS``, with which the cause may change white, primaries and black.
    ways: tuple[tuple[str, ...], ...] = ()
    #: Natural logarithm of the factor by which the records of a pair make the cause likelier; -inf: they exclude it.
    prior: Callable[[SessionPair], float] = lambda _pair: 0.0
    #: Whether the records of a pair say that the cause happened; beside another cause it is then not an assumption.
    recorded: Callable[[SessionPair], bool] = lambda _pair: False
    #: Whether the fitted parameters are possible for this cause.
    sound: Callable[[Values, SessionPair], bool] = lambda _values, _pair: True
    #: Further tolerance of white and primaries with this cause, as a share, 1 σ.
    loose: float = 0.0
    #: A sentence if other evidence than white, primaries and black proves the cause; otherwise "". Of several proofs
    #: the proof with the lowest rank counts. Unless ``alone``, other causes that can move the same facts stay rivals.
    proof: Callable[[SessionPair], str] = lambda _pair: ""
    rank: int = 9
    alone: bool = True
    #: A sentence if evidence supports the cause without a proof; otherwise "". The cause is then named if no other
    #: cause explains the pair.
    sign: Callable[[SessionPair], str] = lambda _pair: ""
    #: Whether the cause may have changed the transfer curves by the measured amount.
    bends: Callable[[SessionPair], bool] = lambda _pair: False
    #: A sentence if the cause happened in addition to other causes and was corrected (a reading was left out);
    #: otherwise "".
    beside: Callable[[SessionPair], str] = lambda _pair: ""
    #: A sentence if the readings of a pair cannot show the cause, which is then not named beside other causes;
    #: otherwise "".
    untold: Callable[[SessionPair], str] = lambda _pair: ""
    #: Names, fitted values and pair of another explanation → the parameter whose change this cause can also make; ""
    #: without such a parameter.
    rival: Callable[[tuple[str, ...], Values, SessionPair], str] = lambda _names, _values, _pair: ""
    #: Course of the light over many sessions with this cause: "steady", "step", or "" (unknown).
    over_time: str = ""
    #: Whether a session with this cause gives no information about the aging of the display.
    spoils: bool = True
    #: The cause in tables; "": its name.
    noun: str = ""

    @property
    def words(self) -> str:
        """The cause in tables."""
        return self.noun or self.name.replace("-", " ")


@cache
def causes() -> dict[str, Cause]:
    """Return name → cause, sorted by name."""
    declared: list[Cause] = [import_module(f"{__name__}.{each.name}").CAUSE for each in iter_modules(__path__)]
    return {cause.name: cause for cause in sorted(declared, key=lambda each: each.name)}
