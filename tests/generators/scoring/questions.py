"""``Question``: the generator, the hidden effects with their sizes, the design, and the meter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np

from tests.generators.meters import METERS
from tests.virtual_display.sealed import PAIRS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tests.generators.scoring.sources import Source

    #: Arguments: generator, index among the questions of this sort, random generator. Result: a question, or None if
    #: the generator has no such question.
    Draw = Callable[[Source, int, np.random.Generator], "Question | None"]

#: Effects that only a model of hour 0 shows (their ``baseline`` in the catalogue).
LAWS = (
    "backlight-decay",
    "burn-in-decay",
    "phosphor-wear",
    "yellowing",
    "stabilizer-headroom",
    "channel-decay",
    "meter-drift",
)

#: Multiples of the smallest detectable size.
FAINT, CLEAR = (1.0, 3.0), (3.0, 10.0)

#: Multiples of the typical size.
TYPICAL = (0.5, 1.5)

#: Pairs of a design and an effect that the design cannot show or cannot distinguish from another effect.
UNSEEN = (("colour", "edge-falloff"), ("colour", "warm-up"), ("colour", "veiling-glare"), ("grey", "temperature"))
TIED = (("grey", "crosstalk"), ("grey", "loading"), ("grey", "meter-offset"))

#: Effects that are visible without positions and without other conditions.
SHOWN_BY_COLOURS = frozenset(("black-level", "eotf-drift", "channel-gamma", "crosstalk", "primary-shift", "drive-loss"))

#: The meter for all campaigns except healthy displays.
GOOD = "gaussian"

#: Number of ways to write a campaign; the questions use them in turn.
HABITS = 6


@dataclass(frozen=True)
class Question:
    """One campaign to diagnose.

    Attributes
    ----------
    generator, sort, number, seed
        Name of the generator, one of ``SORTS``, the index within the sort, and the seed of display and meter.
    effects, sizes
        The hidden effects and their sizes: in typical sizes if ``typical``, else in smallest detectable sizes.
    design, habits, meter, order
        How the campaign is measured and written; ``order`` says whether the file has the column ``order``.
    baseline, without
        The baseline of the diagnosis, and the effects that are removed from lutgen's catalogue.

    """

    generator: str
    sort: str
    number: int
    seed: int
    effects: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()
    typical: bool = False
    design: str = "full"
    habits: int = 0
    meter: str = GOOD
    order: bool = False
    baseline: str = "colour-points"
    without: tuple[str, ...] = ()

    @property
    def truth(self) -> str:
        """Return the hidden effects, in words."""
        return " + ".join(self.effects) or "nothing"


@dataclass(frozen=True)
class Wanted:
    """The options of a scoring run.

    Attributes
    ----------
    seed, per_kind, rewritten
        The random seed, the number of questions of each sort (for healthy displays: for each meter), and the number
        of campaigns that are rewritten in all ways.
    only
        One of ``SORTS``, or an effect; empty means all.
    meters
        Names of the meters.
    baseline
        Replaces the generator's own baseline; empty keeps it.
    order
        Whether every second file has the order of reading.

    """

    seed: int = 1
    per_kind: int = 4
    rewritten: int = 4
    only: str = ""
    meters: tuple[str, ...] = tuple(METERS)
    baseline: str = ""
    order: bool = True


def questions(source: Source, wanted: Wanted) -> list[Question]:
    """Return all questions about one generator."""
    source = replace(source, only="" if wanted.only in SORTS else wanted.only)
    rows: list[Question] = []
    for sort, draw in SORTS.items():
        random = np.random.default_rng([wanted.seed, crc32(source.name.encode()), crc32(sort.encode())])
        meters = wanted.meters if sort == "healthy" else [GOOD if GOOD in wanted.meters else wanted.meters[0]]
        for number in range(wanted.rewritten if sort == "rewritten" else wanted.per_kind):
            drawn = draw(source, number, random)
            if drawn is None:
                continue
            rows += [_finished(drawn, source, wanted, meter) for meter in meters]
    return [one for one in rows if wanted.only in ("", one.sort, *one.effects)]


def _finished(drawn: Question, source: Source, wanted: Wanted, meter: str) -> Question:
    baseline = wanted.baseline or ("first-hour" if drawn.sort == "law" else source.baseline)
    order = wanted.order and drawn.number % 2 == 1
    return replace(drawn, meter=meter, order=order, baseline=baseline)


def _drawn(source: Source, sort: str, number: int, random: np.random.Generator, **more: object) -> Question:
    settings = {"habits": (_start(source, sort) + number) % HABITS, **more}
    return Question(source.name, sort, number, int(random.integers(1 << 31)), **settings)  # type: ignore[arg-type]


def _between(bounds: tuple[float, float], random: np.random.Generator) -> float:
    return float(np.exp(random.uniform(*np.log(bounds))))


def _turn(names: Sequence[str], number: int, start: int) -> str:
    """Return the name at this number in a cyclic sequence; the generator's name determines the start.

    So generators with few questions still cover different names.
    """
    return names[(start + number) % len(names)]


def _tips_kinds(source: Source) -> list[str]:
    return [name for name in source.kinds() if name not in LAWS]


def _start(source: Source, sort: str) -> int:
    return crc32(f"{source.name} {sort}".encode())


def _healthy(source: Source, number: int, random: np.random.Generator) -> Question:
    return _drawn(source, "healthy", number, random)


def _one(sort: str, bounds: tuple[float, float]) -> Draw:
    def draw(source: Source, number: int, random: np.random.Generator) -> Question | None:
        kinds = _tips_kinds(source)
        if not kinds:
            return None
        name = _turn(kinds, number, _start(source, sort))
        without = (name,) if sort == "removed" else ()
        size = _between(bounds, random)
        return _drawn(source, sort, number, random, effects=(name,), sizes=(size,), without=without)

    return draw


def _pair(source: Source, number: int, random: np.random.Generator) -> Question | None:
    pairs = [pair for pair in PAIRS if set(pair) <= set(source.load().KINDS) and set(pair) & set(_tips_kinds(source))]
    if not pairs:
        return None
    pair = pairs[(_start(source, "pair") + number) % len(pairs)]
    sizes = tuple(_between(CLEAR, random) for _ in pair)
    return _drawn(source, "pair", number, random, effects=pair, sizes=sizes)


def _law(source: Source, number: int, random: np.random.Generator) -> Question | None:
    laws = [name for name in source.kinds() if name in LAWS]
    if not laws or source.baseline == "native":
        # lutgen has no model that predicts the later hours of a display's own curves.
        return None
    name = _turn(laws, number, _start(source, "law"))
    size = float(random.uniform(*TYPICAL))
    return _drawn(source, "law", number, random, effects=(name,), sizes=(size,), typical=True)


def _outside(source: Source, number: int, random: np.random.Generator) -> Question:
    name = _turn(source.load().OUTSIDE, number, _start(source, "outside"))
    return _drawn(source, "outside", number, random, effects=(name,), sizes=(_between(CLEAR, random),))


def _blind(source: Source, number: int, random: np.random.Generator) -> Question | None:
    kinds = source.kinds()
    cases = [case for case in (*UNSEEN, *TIED) if case[1] in kinds]
    if not cases:
        return None
    design, name = cases[(_start(source, "blind") + number) % len(cases)]
    unseen = (design, name) in UNSEEN
    size = 1.0 if unseen else _between(CLEAR, random)
    return _drawn(source, "blind", number, random, effects=(name,), sizes=(size,), typical=unseen, design=design)


def _rewritten(source: Source, number: int, random: np.random.Generator) -> Question:
    """Return a question of the sort "rewritten": no effect, one, two, or one outside the catalogue, in turn.

    Full designs and designs without conditions alternate.
    """
    draws: tuple[Draw, ...] = (_healthy, _one("clear", CLEAR), _pair, _one("faint", FAINT), _outside)
    design = "full"
    if number % 2:
        shown = [name for name in _tips_kinds(source) if name in SHOWN_BY_COLOURS]
        draws = (_healthy, _one("clear", CLEAR), _one("faint", FAINT)) if shown else (_healthy,)
        source = replace(source, only=shown[int(random.integers(len(shown)))] if shown else "")
        design = "colour"
    drawn = draws[number // 2 % len(draws)](source, number, random) or _healthy(source, number, random)
    return replace(drawn, sort="rewritten", design=design)


SORTS: dict[str, Draw] = {
    "healthy": _healthy,
    "clear": _one("clear", CLEAR),
    "faint": _one("faint", FAINT),
    "pair": _pair,
    "law": _law,
    "outside": _outside,
    "removed": _one("removed", CLEAR),
    "blind": _blind,
    "rewritten": _rewritten,
}
