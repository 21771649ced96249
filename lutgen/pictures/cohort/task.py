"""The work on one slide: in this process, in another one, or on another machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen import __version__
from lutgen.errors import LutgenError, reason_of
from lutgen.pictures.lifetime import lifetime
from lutgen.pictures.threads import few_threads

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from lutgen.display import DisplayModel
    from lutgen.pictures.cohort.find import CohortSlide

    #: Slides with what became of each, in any order.
    Outcomes = Generator[tuple[CohortSlide, "Outcome"], None, None]


@dataclass(frozen=True)
class Asked:
    """What is asked of every slide; arguments as :func:`lutgen.pictures.lifetime.lifetime` takes them."""

    model: DisplayModel
    tolerances: tuple[float, ...]
    modes: tuple[str, ...]
    hours: tuple[float, ...]
    tissue: bool
    source: str
    version: str = __version__

    def anywhere(self) -> Asked:
        """Return the same, with the files of own effects named by their whole paths, as other folders see them."""
        effects = tuple(
            replace(each, effect=replace(each.effect, origin=str(Path(each.effect.origin).resolve())))
            if each.effect.origin.endswith(".py")
            else each
            for each in self.model.effects
        )
        return replace(self, model=replace(self.model, effects=effects))


@dataclass(frozen=True)
class Outcome:
    """What became of a slide: an image as ``lifetime --json`` writes it, or the reason why there is none."""

    image: dict[str, Any] | None
    reason: str = ""


def look_at(asked: Asked, slide: CohortSlide, threads: int = 0) -> Outcome:
    """Find one slide's lifetimes, with so many threads (0: one a core). What is wrong with it becomes the reason."""
    try:
        with few_threads(threads):
            lifetimes = lifetime(
                [slide.path],
                asked.model,
                tolerances=asked.tolerances,
                modes=asked.modes,
                hours=asked.hours,
                tissue=asked.tissue,
                source=asked.source,
            )
    except LutgenError as error:
        return Outcome(None, str(error).removeprefix(f"{slide.path}: "))
    except MemoryError:
        return Outcome(None, "there was not enough memory. Run again with fewer --jobs.")
    except OSError as error:
        return Outcome(None, f"cannot be read: {reason_of(error)}. Run again when it can.")
    return Outcome(lifetimes.as_json()["images"][0])


def outcomes(
    done: Callable[[Sequence[CohortSlide]], Iterator[tuple[CohortSlide, Outcome | None]]],
    slides: Sequence[CohortSlide],
    deadly: str,
) -> Outcomes:
    """Give each slide with its outcome; try those again, each alone, that were in hand when a process died.

    Parameters
    ----------
    done
        Does slides: each with its outcome, None where a process died that may have had the slide in hand.
    slides
        All slides.
    deadly
        The reason for a slide under which a process dies when the slide is tried alone.

    """
    suspects = []
    for slide, outcome in done(slides):
        if outcome:
            yield slide, outcome
        else:
            suspects.append(slide)
    for each in suspects:
        for slide, outcome in done([each]):
            yield slide, outcome or Outcome(None, deadly)
