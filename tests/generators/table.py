"""``Table``: the text of every cell of a campaign's CSV file. A rewriting of text rounds no number.

The code is independent of lutgen's reader, because the rewritings test that reader.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from tests.generators.truth import Truth

#: The colour points: white and the primaries at full drive.
COLOUR_POINTS = ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

#: The optional numeric columns where a blank cell stands for a number. In the other optional columns a blank cell means
#: "warm" or "unknown".
BLANK = {"u": 0.5, "v": 0.5, "ambient_lx": 0.0, "window": 1.0, "surround": 0.0}

#: Columns of the conditions of a reading.
CONDITIONS = (*BLANK, "warmup_min", "temperature_c")

#: Maximum difference in kelvins between readings of one condition: the temperature of a room hardly ever repeats.
KELVINS = 3.0

BOM = "\ufeff"


@dataclass(frozen=True)
class Table:
    """One file.

    Attributes
    ----------
    head
        The lines that begin with ``#``, in the file's order.
    columns
        Name → cells, in the file's order.
    separator, newline, bom
        The field separator, the line end, and whether a byte order mark comes first.

    """

    head: tuple[str, ...]
    columns: Mapping[str, tuple[str, ...]]
    separator: str = ","
    newline: str = "\n"
    bom: str = field(default="", repr=False)

    def __len__(self) -> int:
        return len(self.columns["hour"])

    @property
    def metadata(self) -> dict[str, str]:
        """Return the ``# key: value`` lines."""
        pairs = (line.lstrip("# ").partition(":") for line in self.head if ":" in line)
        return {key.strip().lower(): value.strip() for key, _, value in pairs}

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return one column as numbers (n,).

        A blank cell and an absent column give the number that a blank stands for, or NaN.
        """
        cells = self.columns.get(name, ("",) * len(self))
        return np.array([float(cell) if cell else BLANK.get(name, np.nan) for cell in cells])

    @property
    def drive(self) -> NDArray[np.float64]:
        """Return the code values (n, 3)."""
        return np.column_stack([self.numbers(name) for name in "RGB"])

    @property
    def xyz(self) -> NDArray[np.float64]:
        """Return the light in cd/m² (n, 3)."""
        if "X" in self.columns:
            return np.column_stack([self.numbers(name) for name in "XYZ"])
        x, y, luminance = (self.numbers(name) for name in ("x", "y", "Y"))
        return np.column_stack([x / y * luminance, luminance, (1.0 - x - y) / y * luminance])

    @property
    def session(self) -> tuple[str, ...]:
        """Return the session name of each reading; a reading without a session is named by its hour."""
        hours = self.columns["hour"]
        names = self.columns.get("session", ("",) * len(self))
        return tuple(name or f"{float(hour):g}" for name, hour in zip(names, hours, strict=True))

    def at_rest(self) -> NDArray[np.bool_]:
        """Return which readings have the condition of the colour points, (n,)."""
        return at_rest(
            {name: self.numbers(name) for name in CONDITIONS if name in self.columns},
            self.drive,
            self.columns.get("note", ("",) * len(self)),
        )

    def rows(self, chosen: Iterable[int]) -> Table:
        """Return the table with only these rows, in this order."""
        places = list(chosen)
        return replace(self, columns={name: tuple(cells[i] for i in places) for name, cells in self.columns.items()})

    def having(self, **columns: Sequence[str]) -> Table:
        """Return the table with these columns replaced or added; new columns come last."""
        return replace(self, columns={**self.columns, **{name: tuple(cells) for name, cells in columns.items()}})

    def lacking(self, *names: str) -> Table:
        """Return the table without these columns."""
        return replace(self, columns={name: cells for name, cells in self.columns.items() if name not in names})

    def text(self) -> str:
        """Return the text of the file."""
        out = io.StringIO()
        writer = csv.writer(out, delimiter=self.separator, lineterminator=self.newline)
        writer.writerow(self.columns)
        writer.writerows(zip(*self.columns.values(), strict=True))
        return self.bom + "".join(line + self.newline for line in self.head) + out.getvalue()


def is_colour_point(drive: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows of ``drive`` (n, 3) are white or a primary at full drive, (n,)."""
    return np.asarray((drive[:, np.newaxis] == np.array(COLOUR_POINTS)).all(axis=2).any(axis=1))


def at_rest(
    conditions: Mapping[str, NDArray[np.float64]], drive: NDArray[np.float64], note: Sequence[str]
) -> NDArray[np.bool_]:
    """Return which readings have the most common condition of the colour points and no note, (n,)."""
    rest = np.array([not text for text in note])
    points = is_colour_point(drive) & rest
    for name, values in conditions.items():
        if name == "temperature_c":
            warmer = np.abs(values - np.nanmedian(values)) if not np.isnan(values).all() else np.zeros(values.size)
            rest &= ~(warmer > KELVINS)
        else:
            known = np.nan_to_num(values, nan=BLANK.get(name, -1.0))
            levels, counts = np.unique(known[points], return_counts=True)
            rest &= known == levels[np.argmax(counts)]
    return rest


def parsed(text: str) -> Table:
    """Read a file's text with any separator and line ends, with or without a byte order mark."""
    bom = BOM if text.startswith(BOM) else ""
    newline = "\r\n" if "\r\n" in text else "\n"
    lines = [line for line in text.removeprefix(BOM).splitlines() if line.strip()]
    head = tuple(line for line in lines if line.startswith("#"))
    body = [line for line in lines if not line.startswith("#")]
    separator = ";" if ";" in body[0] else ","
    names, *rows = csv.reader(body, delimiter=separator)
    columns = dict(zip(names, map(tuple, zip(*rows, strict=True)), strict=True))
    return Table(head, columns, separator, newline, bom)


def table(truth: Truth, xyz: NDArray[np.float64], *, order: bool = True, digits: int = 6) -> str:
    """Return the text of a file with the truth's readings, where ``xyz`` (n, 3), cd/m², replaces the truth's light.

    The rows keep the generator's order. ``order`` decides whether the file has a column with the order of reading.
    """
    names = [name for name in CONDITIONS if name in truth.conditions]
    columns = {"hour": _cells(truth.hours)}
    columns |= {name: _cells(values) for name, values in zip("RGB", truth.drive.T, strict=True)}
    columns |= {name: _cells(truth.conditions[name]) for name in names}
    columns |= {name: _cells(values, digits) for name, values in zip("XYZ", xyz.T, strict=True)}
    columns["session"] = truth.session
    if order:
        columns["order"] = _cells(truth.order)
    if any(truth.note):
        columns["note"] = truth.note
    head = ["# SIMULATED: not measured; a generator of tests/generators of lutgen wrote this file"]
    head += [f"# {key}: {value}" for key, value in truth.metadata.items()]
    return Table(tuple(head), columns).text()


def _cells(values: NDArray[np.float64], digits: int = 10) -> tuple[str, ...]:
    return tuple("" if np.isnan(value) else f"{value:.{digits}g}" for value in values)
