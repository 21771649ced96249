"""``Table``: a campaign as a CSV file has it, cell by cell as text, so that rewriting it rounds nothing.

Own code, independent of lutgen's reader, which is what the rewritings try.
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

#: The optional columns of numbers in which a blank cell means a number; blank in the others means "warm", "unknown".
BLANK = {"u": 0.5, "v": 0.5, "ambient_lx": 0.0, "window": 1.0, "surround": 0.0}

#: Columns that say under which condition a reading was taken.
CONDITIONS = (*BLANK, "warmup_min", "temperature_c")

#: Readings of one condition may differ by so many kelvins: a room's temperature hardly ever repeats.
KELVINS = 3.0

BOM = "\ufeff"


@dataclass(frozen=True)
class Table:
    """One file.

    Attributes
    ----------
    head
        The lines that begin with ``#``, first to last.
    columns
        Name → cells, in the file's order.
    separator, newline, bom
        How it is written.

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
        """The ``# key: value`` lines."""
        pairs = (line.lstrip("# ").partition(":") for line in self.head if ":" in line)
        return {key.strip().lower(): value.strip() for key, _, value in pairs}

    def numbers(self, name: str) -> NDArray[np.float64]:
        """One column as numbers (n,); where a cell is blank, or the column absent, the number that means, or NaN."""
        cells = self.columns.get(name, ("",) * len(self))
        return np.array([float(cell) if cell else BLANK.get(name, np.nan) for cell in cells])

    @property
    def drive(self) -> NDArray[np.float64]:
        """Code values (n, 3)."""
        return np.column_stack([self.numbers(name) for name in "RGB"])

    @property
    def xyz(self) -> NDArray[np.float64]:
        """Light in cd/m² (n, 3)."""
        if "X" in self.columns:
            return np.column_stack([self.numbers(name) for name in "XYZ"])
        x, y, luminance = (self.numbers(name) for name in ("x", "y", "Y"))
        return np.column_stack([x / y * luminance, luminance, (1.0 - x - y) / y * luminance])

    @property
    def session(self) -> tuple[str, ...]:
        """Name of each reading's session: its hour, where it has none."""
        hours = self.columns["hour"]
        names = self.columns.get("session", ("",) * len(self))
        return tuple(name or f"{float(hour):g}" for name, hour in zip(names, hours, strict=True))

    def at_rest(self) -> NDArray[np.bool_]:
        """Readings under the condition of the colour points, (n,)."""
        return at_rest(
            {name: self.numbers(name) for name in CONDITIONS if name in self.columns},
            self.drive,
            self.columns.get("note", ("",) * len(self)),
        )

    def rows(self, chosen: Iterable[int]) -> Table:
        """The table with these rows, in this order."""
        places = list(chosen)
        return replace(self, columns={name: tuple(cells[i] for i in places) for name, cells in self.columns.items()})

    def having(self, **columns: Sequence[str]) -> Table:
        """The table with these columns, new ones last."""
        return replace(self, columns={**self.columns, **{name: tuple(cells) for name, cells in columns.items()}})

    def lacking(self, *names: str) -> Table:
        """The table without these columns."""
        return replace(self, columns={name: cells for name, cells in self.columns.items() if name not in names})

    def text(self) -> str:
        """The file's text."""
        out = io.StringIO()
        writer = csv.writer(out, delimiter=self.separator, lineterminator=self.newline)
        writer.writerow(self.columns)
        writer.writerows(zip(*self.columns.values(), strict=True))
        return self.bom + "".join(line + self.newline for line in self.head) + out.getvalue()


def is_colour_point(drive: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Rows of ``drive`` (n, 3) that are white or a primary at full drive, (n,)."""
    return np.asarray((drive[:, np.newaxis] == np.array(COLOUR_POINTS)).all(axis=2).any(axis=1))


def at_rest(
    conditions: Mapping[str, NDArray[np.float64]], drive: NDArray[np.float64], note: Sequence[str]
) -> NDArray[np.bool_]:
    """Readings under the condition under which most colour points were read, with no note, (n,)."""
    rest = np.array([not text for text in note])
    points = is_colour_point(drive) & rest
    for name, values in conditions.items():
        if name == "temperature_c":
            warmer = np.abs(values - np.nanmedian(values)) if not np.isnan(values).all() else np.zeros(values.size)
            rest &= ~(warmer > KELVINS)
        else:
            known = np.nan_to_num(values, nan=BLANK.get(name, -1.0))
            found, counts = np.unique(known[points], return_counts=True)
            rest &= known == found[np.argmax(counts)]
    return rest


def parsed(text: str) -> Table:
    """Read a file's text, whatever its separator, line ends and byte order mark."""
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
    """Text of the file in which ``xyz`` (n, 3), cd/m², stands for the truth's light.

    Rows stand as the generator hands them over; ``order`` says whether the file tells the order of reading.
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
