"""The noise of named instruments: one TOML file for each instrument in this folder (``--instrument cr-100``).

A user's own file has the same keys. Required: ``name``, ``source``, ``relative`` and ``floor_cd_m2`` (one number, or
one number each for X, Y and Z). Optional: ``decimals`` or ``significant`` (printed digits), ``dark_offset_cd_m2`` and
``gain_wander``. All sizes are 1 σ. A comment names the source of each figure: a data sheet, a paper or repeated
readings. A figure that nobody published is marked *Assumption*, or is left out; lutgen then uses the figure of an
ordinary colorimeter.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lutgen.cells import number, number_list
from lutgen.documents import from_toml
from lutgen.errors import LutgenError
from lutgen.files import read_at_most
from lutgen.names import INSTRUMENTS

#: Key of a size in an instrument file → largest allowed value; every size is above 0.
MOST = {"relative": 0.5, "floor_cd_m2": 100.0, "dark_offset_cd_m2": 100.0, "gain_wander": 0.3}

#: Key of a number of digits → smallest and largest allowed value.
DIGITS = {"decimals": (0, 9), "significant": (1, 9)}

MAX_BYTES = 100_000


@dataclass(frozen=True)
class Instrument:
    """The noise of an instrument (1 σ); None: not known."""

    #: Noise of X, Y, Z as a share of the light, and noise floor of X, Y, Z in cd/m², also in the dark.
    relative: tuple[float, float, float]
    floor_cd_m2: tuple[float, float, float]
    #: Name for people, and source of the figures; "" for an instrument given as two numbers.
    name: str = ""
    source: str = ""
    #: Printed digits: after the decimal point, or significant digits.
    decimals: int | None = None
    significant: int | None = None
    #: Variation of the zero between sessions.
    dark_offset_cd_m2: float | None = None
    #: Variation of the gain within a session, as a share of the light.
    gain_wander: float | None = None

    @property
    def ratios(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """σ of X, Y, Z over σ of Y: of the relative noise, and of the floor."""
        (x, y, z), (dark_x, dark_y, dark_z) = self.relative, self.floor_cd_m2
        return (x / y, 1.0, z / y), (dark_x / dark_y, 1.0, dark_z / dark_y)


def instrument_of(text: str) -> Instrument:
    """Return the instrument of ``--instrument``: two numbers, a name, or a TOML file.

    Raises LutgenError: the text is none of these, or the file is invalid. The message names file, key and allowed
    values.
    """
    if text.endswith(".toml"):
        return _read(Path(text))
    if text in INSTRUMENTS:
        return _read(Path(__file__).with_name(f"{text}.toml"))
    stated = number_list(text)
    if stated is None or len(stated) != 2 or not (0 < stated[0] < 1 and 0 < stated[1] < 100):
        raise LutgenError(
            f"instrument noise {text!r}: give two numbers above 0, the relative noise and the floor in cd/m², such as "
            f"0.002,0.003; or an instrument, one of {', '.join(INSTRUMENTS)}; or a file of your own (.toml)."
        )
    relative, floor = stated
    return Instrument((relative,) * 3, (floor,) * 3)


def stated_instrument(metadata: Mapping[str, str], text: str | None) -> Instrument | None:
    """Return the instrument of ``--instrument``, or of a table's metadata, or None. Raises as :func:`instrument_of`."""
    if text is None and {"noise_relative", "noise_floor_cd_m2"} <= set(metadata):
        text = f"{metadata['noise_relative']},{metadata['noise_floor_cd_m2']}"
    return None if text is None else instrument_of(text)


def session_gain(metadata: Mapping[str, str], file: str) -> float | None:
    """Return the 1 σ gain of a session from ``# session_gain:``, or None. Raises LutgenError: the value is invalid."""
    text = metadata.get("session_gain", "")
    if not text:
        return None
    gain = number(text)
    if gain is None or not 0 <= gain < 0.5:
        raise LutgenError(f"{file}: session_gain is {text!r}; it is the 1 σ gain of a session, 0..0.5, such as 0.003.")
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
    for key, meaning in {"name": "what people call it", "source": "where its figures come from"}.items():
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


def _triple(value: Any, key: str, path: Path) -> tuple[float, float, float]:
    given = value if isinstance(value, list) else [value] * 3
    if len(given) != 3 or value is None:
        raise LutgenError(f"{path}: needs {key}, 1 σ: one number, or three in a list for X, Y and Z.")
    x, y, z = (_size(each, key, path) for each in given)
    return x, y, z


def _size(value: Any, key: str, path: Path) -> float:
    # `0 < NaN` is False, so NaN is refused; bool is a subclass of int.
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= MOST[key]:
        raise LutgenError(f"{path}: {key} = {value!r} must be a number above 0, at most {MOST[key]:g}.")
    return float(value)
