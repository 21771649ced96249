"""The list of generators: module, baseline of the diagnosis, and availability."""

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
    """Interface of a generator's package."""

    KINDS: tuple[str, ...]
    OUTSIDE: tuple[str, ...]

    def campaign(self, seed: int, hidden: Mapping[str, float], *, design: str, habits: int) -> Truth:
        """Return one campaign."""
        ...


@dataclass(frozen=True)
class Source:
    """A generator and the settings for its questions.

    Attributes
    ----------
    name, module
        Name of the generator, and the module to import.
    baseline
        The model against which its displays are diagnosed.
    discrepancy
        Error of that model on a healthy display, 1 σ of a reading: relative to the light, and in cd/m².
    needs
        Environment variable that leads to its data.
    only
        The only effect of the catalogue in its questions; empty means all.

    """

    name: str
    module: str
    baseline: str = "colour-points"
    discrepancy: tuple[float, float] = (0.0, 0.0)
    needs: str = ""
    only: str = ""

    @property
    def missing(self) -> str:
        """Return why the generator is not available here; empty if it is available."""
        if find_spec(self.module) is None:
            return f"there is no {self.module}"
        if self.needs and not os.environ.get(self.needs):
            return f"{self.needs} is not set"
        return ""

    def load(self) -> Generator:
        """Import the generator."""
        return cast("Generator", import_module(self.module))

    def kinds(self) -> tuple[str, ...]:
        """Return the effects that the generator can hide and that its questions use."""
        kinds = self.load().KINDS
        return tuple(name for name in kinds if name == self.only) if self.only in kinds else kinds

    def kin(self) -> Mapping[str, str]:
        """For effects outside the catalogue: the family of which each effect is a refined form, if any."""
        return cast("Mapping[str, str]", getattr(import_module(self.module), "KIN", {}))


#: The model of a real display has errors of about 1 % and 0.02 cd/m² (criticism.md, point 11 of the numerics).
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
