"""The plan of a build: the options of ``lutgen build`` that decide the bytes of the files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.bake.formats import format_named, format_names
from lutgen.bake.lut import SIZES
from lutgen.display import compensated, hour_name
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import AGING_MODES, DIRECTIONS, MODES, UNREACHABLE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.littlecms import SourceProfile
    from lutgen.bake.manifest import Manifest
    from lutgen.display import AgedDisplay, DisplayModel


@dataclass(frozen=True)
class BuildPlan:
    """The plan of a build: the LUTs to bake from a model.

    Attributes
    ----------
    hours, modes, formats
        One LUT of each format is baked for each mode and hour. ``stable`` is baked only when it is named, since its
        LUTs are the identity.
    cubesize
        Points along an edge of the tables.
    tolerance
        Limit for the largest ``smooth`` error, in ΔE2000. The smallest of ``SIZES`` that meets the limit is used.
    direction
        One of ``DIRECTIONS``.
    unreachable
        For ``compensate``: one of ``UNREACHABLE``.
    source
        The profile of the picture. It is combined with the display in one profile. Only formats that store a profile's
        table allow it.
    gpu
        Also run each config's shaders, and record their differences from the CPU.
    certify
        Read every distinct table back, through OpenColorIO if it reads the format, and compare it with the model. Hours
        with the same display share a certificate. ``lutgen check`` reads every file.

    """

    hours: tuple[float, ...]
    modes: tuple[str, ...] = AGING_MODES
    formats: tuple[str, ...] = ("cube", "clf")
    cubesize: int = 33
    tolerance: float | None = None
    certify: bool = True
    direction: str = "simulate"
    unreachable: str = "clip"
    gpu: bool = False
    source: SourceProfile | None = None

    def __post_init__(self) -> None:
        """Raise LutgenError for options that cannot be baked."""
        for mode in self.modes:
            refuse_unknown("mode", mode, MODES)
        refuse_unknown("direction", self.direction, DIRECTIONS)
        self._check_formats()
        refuse_unknown("way with unreachable colours", self.unreachable, UNREACHABLE)
        if not (self.hours and self.modes and self.formats):
            raise LutgenError("nothing to build: give at least one hour, one mode and one format.")
        refuse_unknown("cube size", self.cubesize, SIZES)
        if self.tolerance is not None and not 0 < self.tolerance < 100:
            message = f"--tolerance {self.tolerance:g}: a colour difference ΔE2000 above 0 and below 100, such as 0.1."
            raise LutgenError(message)

    def _check_formats(self) -> None:
        for name in self.formats:
            if self.source and not format_named(name).takes_source:
                able = ", ".join(each for each in format_names() if format_named(each).takes_source)
                raise LutgenError(f"--source-profile and --format {name} do not go together. Pick from: {able}.")
            if not format_named(name).corrects and self.direction == "compensate":
                able = ", ".join(each for each in format_names() if format_named(each).corrects)
                raise LutgenError(f"--format {name}: describes a display and cannot correct one. Pick from: {able}.")

    def as_json(self) -> dict[str, Any]:
        """Return the options in the form of the manifest. Default direction, ``gpu`` and ``source`` are omitted."""
        content: dict[str, Any] = {name: list(getattr(self, name)) for name in ("hours", "modes", "formats")}
        content |= {"cubesize": self.cubesize, "tolerance": self.tolerance, "certify": self.certify}
        if self.direction != "simulate":
            content |= {"direction": self.direction, "unreachable": self.unreachable}
        content |= {"gpu": True} if self.gpu else {}
        return content | ({"source_profile": self.source.as_json()} if self.source else {})

    def folders(self) -> Iterator[tuple[str, float, str]]:
        """Yield the mode, the hour and the folder of each display. Folders are relative to the output folder."""
        for mode in self.modes:
            for hours in self.hours:
                yield mode, hours, f"{mode}/{hour_name(hours)}"

    def display(self, model: DisplayModel, mode: str, hours: float) -> AgedDisplay:
        """Return the aged display to bake, or its correction in the form of an aged display."""
        aged = display_to_bake(model, mode, hours, direction=self.direction, unreachable=self.unreachable)
        return self.source.before(aged) if self.source else aged


def display_to_bake(
    model: DisplayModel, mode: str, hours: float, *, direction: str, unreachable: str = "clip"
) -> AgedDisplay:
    """Return the display of a mode and hour in one of ``DIRECTIONS``. ``unreachable`` is one of ``UNREACHABLE``.

    Raises LutgenError: as ``DisplayModel.at`` and ``compensated`` do.
    """
    aged = model.at(mode, hours)
    if direction == "simulate":
        return aged
    return compensated(aged, model.at("stable", hours), unreachable=unreachable)


def direction_of(manifest: Manifest) -> str:
    """Return the direction of a manifest's build."""
    return str(manifest.recipe["options"].get("direction", "simulate"))
