"""What every slide of a cohort is asked: the display, the tolerances and the hours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.version import __version__

if TYPE_CHECKING:
    from lutgen.display import DisplayModel


@dataclass(frozen=True)
class CohortTask:
    """Arguments for each slide's call of :func:`lutgen.pictures.lifetime.lifetime`."""

    model: DisplayModel
    tolerances: tuple[float, ...]
    modes: tuple[str, ...]
    hours: tuple[float, ...]
    tissue: bool
    source: str
    version: str = __version__

    def anywhere(self) -> CohortTask:
        """Return the same task with absolute paths of the user's own effects, for processes in other folders."""
        effects = tuple(
            replace(each, effect=replace(each.effect, origin=str(Path(each.effect.origin).resolve())))
            if each.effect.origin.endswith(".py")
            else each
            for each in self.model.effects
        )
        return replace(self, model=replace(self.model, effects=effects))
