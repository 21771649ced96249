"""Is a reply honest? Replies are lutgen's JSON; what is honest stands in the answers (see ``sealed``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Verdicts that put names on the display's faults without reserve.
CONFIDENT = ("named", "form", "several")


@dataclass(frozen=True)
class Reply:
    """What lutgen said of one data set.

    Attributes
    ----------
    verdict, effects, rivals, unseen, sentence
        From ``diagnose``; ``unseen`` are the effects listed as not visible.
    seconds
        That it took.
    before, after, floor
        RMS error in σ before and after refining by the effects it named, and of noise alone; 0 where it named none.
    removed
        Share of the error beyond noise that what it named removes; NaN where there is none to speak of.
    baked
        Mean ΔE2000 of the baked LUT against the display itself, in noise floors; NaN where nothing was baked.

    """

    verdict: str
    effects: tuple[str, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    unseen: tuple[str, ...] = ()
    sentence: str = ""
    seconds: float = 0.0
    before: float = 0.0
    after: float = 0.0
    floor: float = 0.0
    removed: float = float("nan")
    baked: float = float("nan")

    @classmethod
    def of(cls, said: dict[str, Any], *, seconds: float) -> Reply:
        """Read the JSON of ``diagnose``."""
        return cls(
            verdict=said["verdict"],
            effects=tuple(sorted(said["effects"])),
            rivals=tuple(tuple(group) for group in said.get("rivals", ())),
            unseen=tuple(row["effect"] for row in said.get("visibility", ()) if not row["visible"]),
            sentence=said.get("sentence", ""),
            seconds=seconds,
        )

    @property
    def answered(self) -> frozenset[str]:
        """All names that the verdict puts forward: for ``one-of`` the whole set."""
        if self.verdict != "one-of":
            return frozenset(self.effects)
        sets = [group for group in self.rivals if not self.effects or set(group) & set(self.effects)]
        return frozenset(self.effects).union(*sets)

    @property
    def short(self) -> str:
        """The reply in a word or two, for a matrix."""
        if self.verdict == "named":
            return " + ".join(self.effects)
        names = sorted(self.answered)
        return f"{self.verdict} ({', '.join(names)})" if names else self.verdict


def honest(reply: Reply, answer: dict[str, Any]) -> bool:
    """Whether the reply is one of those that the answer calls honest."""
    return any(_fits(reply, wanted) for wanted in answer["honest"])


def _fits(reply: Reply, wanted: dict[str, Any]) -> bool:
    answered = reply.answered
    return (
        reply.verdict in wanted["verdict"]
        and ("effects" not in wanted or answered == set(wanted["effects"]))
        and answered >= set(wanted.get("contains", ()))
        and len(answered) <= wanted.get("at_most", len(answered))
        and ("any_two" not in wanted or len(answered & set(wanted["any_two"])) >= 2)
        and set(reply.unseen) >= set(wanted.get("unseen", ()))
    )


def names_the_place(reply: Reply, answer: dict[str, Any]) -> bool:
    """Whether the sentence about a broken table names one of the wrong lines or hours."""
    places = [f"{place:g}" for place in (*answer.get("lines", ()), *answer.get("hours", ()))]
    words = reply.sentence.replace(",", " ").replace(".", " ").replace(":", " ").replace("\u202f", "").split()
    return any(place in words for place in places)
