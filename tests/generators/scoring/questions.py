"""``Question``: which generator hides what, how strongly, in which design, read by which meter."""

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

    #: Generator, place among the questions of this sort, random numbers → a question, where the generator has one.
    Draw = Callable[[Source, int, np.random.Generator], "Question | None"]

#: Effects that only a model of hour 0 shows (effects.md's second table).
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

#: Design and effect that it cannot show, or cannot tell from another.
UNSEEN = (("colour", "edge-falloff"), ("colour", "warm-up"), ("colour", "veiling-glare"), ("grey", "temperature"))
TIED = (("grey", "crosstalk"), ("grey", "loading"), ("grey", "meter-offset"))

#: Effects that need neither positions nor other conditions to be seen.
SHOWN_BY_COLOURS = frozenset(("black-level", "eotf-drift", "channel-gamma", "crosstalk", "primary-shift", "drive-loss"))

#: The meter that all but healthy displays are read by.
GOOD = "gaussian"

#: Ways of writing a campaign down that are tried in turn.
HABITS = 6


@dataclass(frozen=True)
class Question:
    """One campaign to diagnose.

    Attributes
    ----------
    generator, sort, number, seed
        Whose it is, one of ``SORTS``, its place among them, and the seed of display and meter.
    effects, sizes
        What is hidden: in typical sizes where ``typical``, else in smallest detectable ones.
    design, habits, meter, order
        How it is measured and written down; ``order`` says whether the file has that column.
    baseline, without
        What lutgen is asked, and effects that its catalogue has to do without.

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
        """What is hidden, in words."""
        return " + ".join(self.effects) or "nothing"


@dataclass(frozen=True)
class Wanted:
    """What shall be asked.

    Attributes
    ----------
    seed, per_kind, rewritten
        Of the drawing, how many questions of each sort (healthy displays: so many for each meter), and how many
        campaigns are written down in all ways.
    only
        One of ``SORTS``, or an effect; empty for all.
    meters
        Names of meters.
    baseline
        Instead of the generator's own; empty for that.
    order
        Whether every other file tells the order of reading.

    """

    seed: int = 1
    per_kind: int = 4
    rewritten: int = 4
    only: str = ""
    meters: tuple[str, ...] = tuple(METERS)
    baseline: str = ""
    order: bool = True


def questions(source: Source, wanted: Wanted) -> list[Question]:
    """All questions about one generator."""
    source = replace(source, only="" if wanted.only in SORTS else wanted.only)
    found: list[Question] = []
    for sort, draw in SORTS.items():
        random = np.random.default_rng([wanted.seed, crc32(source.name.encode()), crc32(sort.encode())])
        meters = wanted.meters if sort == "healthy" else [GOOD if GOOD in wanted.meters else wanted.meters[0]]
        for number in range(wanted.rewritten if sort == "rewritten" else wanted.per_kind):
            drawn = draw(source, number, random)
            if drawn is None:
                continue
            found += [_finished(drawn, source, wanted, meter) for meter in meters]
    return [one for one in found if wanted.only in ("", one.sort, *one.effects)]


def _finished(drawn: Question, source: Source, wanted: Wanted, meter: str) -> Question:
    baseline = wanted.baseline or ("first-hour" if drawn.sort == "law" else source.baseline)
    order = wanted.order and drawn.number % 2 == 1
    return replace(drawn, meter=meter, order=order, baseline=baseline)


def _drawn(source: Source, sort: str, number: int, random: np.random.Generator, **more: object) -> Question:
    given = {"habits": (_start(source, sort) + number) % HABITS, **more}
    return Question(source.name, sort, number, int(random.integers(1 << 31)), **given)  # type: ignore[arg-type]


def _between(bounds: tuple[float, float], random: np.random.Generator) -> float:
    return float(np.exp(random.uniform(*np.log(bounds))))


def _turn(names: Sequence[str], number: int, start: int) -> str:
    """The names in turn, from a start that the generator's name decides, so that few questions differ in theirs."""
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
        # lutgen has no model that foretells the later hours of a display's own curves.
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
    """Nothing, one effect, two, one that the catalogue lacks; in turn full designs, and those without conditions."""
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
