"""The noise of named instruments: one TOML file each in this folder, found by its name (``--instrument cr-100``).

A user's own file has the same keys: ``name``, ``source``, ``relative`` and ``floor_cd_m2`` (one number, or one each for
X, Y and Z), and where they are known ``decimals`` or ``significant`` (digits that it prints), ``dark_offset_cd_m2`` and
``gain_wander``. All sizes are 1 σ. A comment says where each figure comes from: a data sheet, a paper or repeated
readings; what nobody published says *Assumption*, or is left out and taken as an ordinary colorimeter's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.cells import number, number_list
from lutgen.documents import from_toml
from lutgen.errors import LutgenError
from lutgen.files import read_at_most
from lutgen.names import INSTRUMENTS

if TYPE_CHECKING:
    from collections.abc import Mapping

#: What an instrument says, and how large it may be at most; each is above 0.
MOST = {"relative": 0.5, "floor_cd_m2": 100.0, "dark_offset_cd_m2": 100.0, "gain_wander": 0.3}

#: Digits that an instrument prints, at least and at most.
DIGITS = {"decimals": (0, 9), "significant": (1, 9)}

MAX_BYTES = 100_000


@dataclass(frozen=True)
class Instrument:
    """The noise of an instrument, 1 σ each; None: not known."""

    #: Of X, Y, Z: share of the light, and cd/m² that are there in the dark too.
    relative: tuple[float, float, float]
    floor_cd_m2: tuple[float, float, float]
    #: As people call it, and where its figures come from; "" for bare numbers.
    name: str = ""
    source: str = ""
    #: Digits that it prints: after the point, or in all.
    decimals: int | None = None
    significant: int | None = None
    #: By how much its zero differs from session to session.
    dark_offset_cd_m2: float | None = None
    #: By how much its gain wanders within a session, a share of the light.
    gain_wander: float | None = None

    @property
    def ratios(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """σ of X, Y, Z over that of Y: of the share, and of the floor."""
        (x, y, z), (dark_x, dark_y, dark_z) = self.relative, self.floor_cd_m2
        return (x / y, 1.0, z / y), (dark_x / dark_y, 1.0, dark_z / dark_y)


def instrument_of(text: str) -> Instrument:
    """Return the instrument of ``--instrument``: two numbers, a name, or a TOML file.

    Raises LutgenError: none of these, or a file that describes no instrument; names file, key and what is allowed.
    """
    if text.endswith(".toml"):
        return _read(Path(text))
    if text in INSTRUMENTS:
        return _read(Path(__file__).with_name(f"{text}.toml"))
    stated = number_list(text)
    if stated is None or len(stated) != 2 or not (0 < stated[0] < 1 and 0 < stated[1] < 100):
        message = (
            f"instrument noise {text!r}: give two numbers above 0, the relative noise and the floor in cd/m², such as "
            f"0.002,0.003; or an instrument, one of {', '.join(INSTRUMENTS)}; or a file of your own (.toml)."
        )
        raise LutgenError(message)
    relative, floor = stated
    return Instrument((relative,) * 3, (floor,) * 3)


def stated_instrument(metadata: Mapping[str, str], text: str | None) -> Instrument | None:
    """Return the instrument of ``--instrument``, or of a table's metadata; None where neither states one.

    Raises LutgenError as :func:`instrument_of`.
    """
    if text is None and {"noise_relative", "noise_floor_cd_m2"} <= set(metadata):
        text = f"{metadata['noise_relative']},{metadata['noise_floor_cd_m2']}"
    return None if text is None else instrument_of(text)


def session_gain(metadata: Mapping[str, str], file: str) -> float | None:
    """Return the 1 σ gain of a session that a table states (``# session_gain:``). Raises LutgenError for none."""
    text = metadata.get("session_gain", "")
    if not text:
        return None
    gain = number(text)
    if gain is None or not 0 <= gain < 0.5:
        message = f"{file}: session_gain is {text!r}; it is the 1 σ gain of a session, 0..0.5, such as 0.003."
        raise LutgenError(message)
    return gain


def _read(path: Path) -> Instrument:
    data = read_at_most(path, MAX_BYTES, what="the instrument", none="instrument")
    try:
        content = from_toml(data.decode("utf-8"))
    except ValueError as error:
        raise LutgenError(f"{path}: not an instrument file (TOML): {error}.") from None
    if unknown := [key for key in content if key not in Instrument.__dataclass_fields__]:
        known = ", ".join(sorted(Instrument.__dataclass_fields__))
        raise LutgenError(f"{path}: unknown key {unknown[0]!r}. Pick one of: {known}.")
    for key, meaning in _MEANING.items():
        if not isinstance(content.get(key), str) or not content[key].strip():
            raise LutgenError(f'{path}: needs {key} = "…", text: {meaning}.')
    content |= {key: _triple(content.get(key), key, path) for key in ("relative", "floor_cd_m2")}
    content |= {key: _size(content[key], key, path) for key in ("dark_offset_cd_m2", "gain_wander") if key in content}
    for key, (least, most) in DIGITS.items():
        if key in content and (type(content[key]) is not int or not least <= content[key] <= most):
            raise LutgenError(f"{path}: {key} = {content[key]!r} must be a whole number, {least} to {most}.")
    if all(key in content for key in DIGITS):
        raise LutgenError(f"{path}: give decimals or significant, not both: an instrument prints by one rule.")
    return Instrument(**content)


_MEANING = {"name": "what people call it", "source": "where its figures come from"}


def _triple(value: Any, key: str, path: Path) -> tuple[float, float, float]:
    if isinstance(value, list) and len(value) == 3:
        x, y, z = (_size(each, key, path) for each in value)
        return x, y, z
    if isinstance(value, list) or value is None:
        raise LutgenError(f"{path}: needs {key}, 1 σ: one number, or three in a list for X, Y and Z.")
    return (_size(value, key, path),) * 3


def _size(value: Any, key: str, path: Path) -> float:
    # NaN is above nothing; true and false are numbers to Python.
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= MOST[key]:
        raise LutgenError(f"{path}: {key} = {value!r} must be a number above 0, at most {MOST[key]:g}.")
    return float(value)
