"""The generators: where each one is, from which baseline it is diagnosed, and whether it can be had here."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Protocol, cast

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.generators.truth import Truth


class Generator(Protocol):
    """What a generator's package exposes."""

    KINDS: tuple[str, ...]
    OUTSIDE: tuple[str, ...]

    def campaign(self, seed: int, hidden: Mapping[str, float], *, design: str, habits: int) -> Truth:
        """One campaign."""
        ...


@dataclass(frozen=True)
class Source:
    """A generator and how it is asked about.

    Attributes
    ----------
    name, module
        Of the generator, and where it is imported from.
    baseline
        The model that its displays are held against.
    discrepancy
        Share of the light and cd/m² by which that model is wrong on a healthy display, 1 σ of a reading.
    needs
        Environment variable without which it has no data.
    only
        The one effect of the catalogue that is asked about; empty for all.

    """

    name: str
    module: str
    baseline: str = "colour-points"
    discrepancy: tuple[float, float] = (0.0, 0.0)
    needs: str = ""
    only: str = ""

    @property
    def missing(self) -> str:
        """Why it cannot be had here; empty when it can."""
        if find_spec(self.module) is None:
            return f"there is no {self.module}"
        if self.needs and not os.environ.get(self.needs):
            return f"{self.needs} is not set"
        return ""

    def load(self) -> Generator:
        """Import it."""
        return cast("Generator", import_module(self.module))

    def kinds(self) -> tuple[str, ...]:
        """The effects that it can hide, and that are asked about."""
        kinds = self.load().KINDS
        return tuple(name for name in kinds if name == self.only) if self.only in kinds else kinds

    def kin(self) -> Mapping[str, str]:
        """For things outside the catalogue: the family of which each is a refined form, where there is one."""
        return cast("Mapping[str, str]", getattr(import_module(self.module), "KIN", {}))


#: A model of a real display is wrong by some 1 % and 0.02 cd/m² (criticism.md, point 11 of the numerics).
SOURCES = {
    source.name: source
    for source in (
        Source("virtual_display", "tests.generators.ours"),
        Source("spectral", "tests.generators.spectral"),
        Source(
            "real",
            "tests.generators.real",
            baseline="native",
            discrepancy=(0.01, 0.02),
            needs="LUTGEN_REAL_DATA",
        ),
    )
}
