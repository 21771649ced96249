"""``DisplayModel``: a measured display, and how its aging is told. Gives an ``AgedDisplay`` per mode and hour."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.display.chain import AgedDisplay, SrgbTransfer
from lutgen.display.modes import MODES, LuminanceLaw, luminance_law, scale_luminance
from lutgen.display.paper import SELECTIONS, Matrices, Selection, matrices_of
from lutgen.display.tips import REFERENCES, Tips
from lutgen.errors import LutgenError, pick_one
from lutgen.measurements import Measurements, read_measurements

if TYPE_CHECKING:
    from lutgen.display.chain import Link

#: The display that is used when none is given: reconstructed, see its first line.
DEFAULT_DISPLAY = "reconstructed-ccfl"


@dataclass(frozen=True)
class DisplayModel:
    """The paper's model of one display.

    Attributes
    ----------
    measurements
        The readings; their tips drive the model.
    reference, selection
        One of ``REFERENCES`` and of ``SELECTIONS``.
    luminance
        The law for ``chroma-luma``.

    """

    measurements: Measurements
    reference: str = "relative"
    selection: str = "nearest"
    luminance: LuminanceLaw = field(default_factory=lambda: luminance_law("paper"))

    def __post_init__(self) -> None:
        """Refuse unknown names and tips that make no history."""
        if self.reference not in REFERENCES:
            raise pick_one("reference", self.reference, REFERENCES)
        if self.selection not in SELECTIONS:
            raise pick_one("selection", self.selection, SELECTIONS)
        object.__setattr__(self, "_tips", Tips.of(self.measurements))

    @property
    def tips(self) -> Tips:
        """White and primaries over time."""
        tips: Tips = self.__dict__["_tips"]
        return tips

    def at(self, mode: str, hours: float) -> AgedDisplay:
        """Return the display of ``mode`` at ``hours``.

        Raises
        ------
        LutgenError
            Unknown mode, or hours outside the measured span or the luminance law's.

        """
        if mode not in MODES:
            raise pick_one("mode", mode, MODES)
        self.tips.check_span(hours)
        xyY = self.tips.referenced(0.0 if mode == "stable" else hours, self.reference)
        factor = self.luminance.factor(hours, self.tips) if mode == "chroma-luma" else 1.0
        emission = matrices_of(scale_luminance(xyY, factor), self.selection)
        head: tuple[Link, ...] = (SrgbTransfer(), Selection(self.selection))
        return AgedDisplay(mode, float(hours), head, (emission,))

    def matrices(self, mode: str, hours: float) -> Matrices:
        """The emission of ``mode`` at ``hours``: the four matrices that ``selection`` chooses from."""
        (emission,) = (link for link in self.at(mode, hours).tail if isinstance(link, Matrices))
        return emission


def hour_name(hours: float) -> str:
    """Name an hour as folders and context variables do: 10000h, 562.5h."""
    return f"{hours:.6f}".rstrip("0").rstrip(".") + "h"


def default_display() -> Path:
    """Path of the default display's measurements, in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "configs", package.parent / "configs"):
        path = folder / "displays" / f"{DEFAULT_DISPLAY}.csv"
        if path.is_file():
            return path
    message = f"the default display {DEFAULT_DISPLAY}.csv is missing here. Reinstall lutgen, or give --display FILE."
    raise LutgenError(message)


def load_model(path: str | Path) -> DisplayModel:
    """Load a model file (TOML).

    ``schema = 1``, then ``[display]`` with ``file`` (measurements, relative to the model file; absent: the
    default display), then optionally ``[model]`` with ``reference``, ``selection`` and ``luminance``.

    Raises
    ------
    LutgenError
        Unreadable, not TOML, or a key or value that is not allowed.

    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        message = f"{path}: cannot read the model: {(error.strerror or str(error)).lower()}."
        raise LutgenError(message) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        message = f"{path}: not a model file (TOML): {error}."
        raise LutgenError(message) from None
    if content.get("schema") != 1:
        message = f"{path}: schema is {content.get('schema')!r}; this version of lutgen reads `schema = 1`."
        raise LutgenError(message)
    _check_keys(path, content, ("schema", "display", "model"))
    display, model = _table(path, content, "display", ("file",)), _table(path, content, "model", _MODEL_KEYS)
    file = path.parent / display["file"] if "file" in display else default_display()
    options = {key: model[key] for key in ("reference", "selection") if key in model}
    law = _law(path, str(model.get("luminance", "paper")))
    return DisplayModel(read_measurements(file), luminance=law, **options)


_MODEL_KEYS = ("reference", "selection", "luminance")


def _law(path: Path, name: str) -> LuminanceLaw:
    return luminance_law(str(path.parent / name) if name.endswith(".csv") else name)


def _table(path: Path, content: dict[str, Any], name: str, allowed: tuple[str, ...]) -> dict[str, str]:
    table = content.get(name, {})
    if not isinstance(table, dict) or not all(isinstance(value, str) for value in table.values()):
        message = f"{path}: [{name}] is a table of texts. Allowed keys: {', '.join(allowed)}."
        raise LutgenError(message)
    _check_keys(path, table, allowed)
    return table


def _check_keys(path: Path, table: dict[str, Any], allowed: tuple[str, ...]) -> None:
    unknown = [key for key in table if key not in allowed]
    if unknown:
        message = f"{path}: unknown key {unknown[0]!r}. Pick one of: {', '.join(allowed)}."
        raise LutgenError(message)
