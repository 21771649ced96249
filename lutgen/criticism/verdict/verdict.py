"""The verdict, and the meaning of each name of a verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


#: Name of a verdict → its meaning.
VERDICTS = {
    "consistent": "nothing above the noise",
    "named": "one effect, and what remains is noise",
    "form": "one effect, but not with its simple formula",
    "one-of": "one of several effects that these readings cannot distinguish, or an effect like it that has no name",
    "several": "more than one effect, each with its share",
    "unexplained": "the readings hold an error that no known effect explains",
    "measurement-problem": "the fault is in the measurement, not in the display",
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
        Names of the effects that the finding names; empty for ``unexplained``.
    rivals
        Sets of effects that these readings cannot distinguish.
    shares
        Effect → share of the excess χ² that it explains.
    shares_delta_e
        Effect → share of the excess mean ΔE2000 that it explains.
    remarks
        Further sentences that a reader must know.
    signatures
        Names of the free term's signatures that the sentence of ``unexplained`` describes.

    """

    name: str
    sentence: str
    effects: tuple[str, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    shares_delta_e: Mapping[str, float] = field(default_factory=dict)
    signatures: tuple[str, ...] = ()
