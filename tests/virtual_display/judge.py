"""Judge whether a reply is honest. Replies are lutgen's JSON; the answers list the honest replies (see ``sealed``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Verdicts that name the display's effects without reserve.
CONFIDENT = ("named", "form", "several")


@dataclass(frozen=True)
class Reply:
    """The reply of lutgen to one data set.

    Attributes
    ----------
    verdict, effects, rivals, unseen, sentence
        Output of ``diagnose``; ``unseen`` lists the effects that are not visible.
    seconds
        Duration of the diagnosis.
    before, after, floor
        RMS error in σ before and after refining by the named effects, and of noise alone; 0 if no effect is named.
    removed
        Share of the error beyond noise that the named effects remove; NaN if the error beyond noise is negligible.
    baked
        Mean ΔE2000 between the baked LUT and the display itself, in noise floors; NaN if no LUT was baked.

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
    def of(cls, document: dict[str, Any], *, seconds: float) -> Reply:
        """Read the JSON of ``diagnose``."""
        return cls(
            verdict=document["verdict"],
            effects=tuple(sorted(document["effects"])),
            rivals=tuple(tuple(group) for group in document.get("rivals", ())),
            unseen=tuple(row["effect"] for row in document.get("visibility", ()) if not row["visible"]),
            sentence=document.get("sentence", ""),
            seconds=seconds,
        )

    @property
    def answered(self) -> frozenset[str]:
        """Return all names that the verdict gives: for ``one-of`` the whole set."""
        if self.verdict != "one-of":
            return frozenset(self.effects)
        sets = [group for group in self.rivals if not self.effects or set(group) & set(self.effects)]
        return frozenset(self.effects).union(*sets)

    @property
    def short(self) -> str:
        """Return the reply in one or two words, for a matrix."""
        if self.verdict == "named":
            return " + ".join(self.effects)
        names = sorted(self.answered)
        return f"{self.verdict} ({', '.join(names)})" if names else self.verdict


def honest(reply: Reply, answer: dict[str, Any]) -> bool:
    """Return whether the answer lists the reply as honest."""
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
    """Return whether the sentence about a broken table names one of the wrong lines or hours."""
    places = [f"{place:g}" for place in (*answer.get("lines", ()), *answer.get("hours", ()))]
    words = reply.sentence.replace(",", " ").replace(".", " ").replace(":", " ").replace("\u202f", "").split()
    return any(place in words for place in places)
