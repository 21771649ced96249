"""A verdict, and what each kind of verdict means."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


#: Verdict → what it means.
VERDICTS = {
    "consistent": "nothing above the noise",
    "named": "one effect, and what remains is noise",
    "form": "the family is right, its simple formula is not",
    "one-of": "one of a set that these data cannot split, or one effect of the catalogue or another like it",
    "several": "more than one effect, each with its share",
    "unexplained": "something is there that no known effect explains",
    "measurement-problem": "the measurement moved, not the display",
}


@dataclass(frozen=True)
class Verdict:
    """A verdict.

    Attributes
    ----------
    name
        One of ``VERDICTS``.
    sentence
        The finding in plain words.
    effects
        What the finding names; for ``unexplained`` nothing.
    rivals
        Sets of effects that these data cannot tell apart.
    shares
        Effect → share of the excess of χ² that goes with it.
    shares_delta_e
        Effect → share of the excess mean ΔE2000 that goes with it.
    remarks
        What else a reader must know.

    """

    name: str
    sentence: str
    effects: tuple[str, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    shares_delta_e: Mapping[str, float] = field(default_factory=dict)
