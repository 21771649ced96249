"""DisplayCAL's uniformity check as a table (CSV): four greys on a grid, ``position,row,col,level_index,X,Y,Z``.

The table does not state the levels of grey. The reader takes 100, 75, 50 and 25 %: with these levels the luminances of
a real table follow γ 2.14 within 2 %. X, Y and Z are in cd/m².
"""

import numpy as np

from lutgen.errors import LutgenError
from lutgen.readings.conditions.position import PLACE
from lutgen.readings.formats._source import FileText
from lutgen.readings.session import Session

NAME = "DisplayCAL uniformity table"
SUFFIXES: tuple[str, ...] = ()

#: Drive of level_index 0, 1, 2 and 3.
_LEVELS = (1.0, 0.75, 0.5, 0.25)
_COLUMNS = ("row", "col", "level_index", "X", "Y", "Z")

#: Largest row and column. DisplayCAL's finest grid is 9 × 9.
_MOST = 64


def claims(source: FileText) -> bool:
    """Whether the first line names the columns of a uniformity grid."""
    first = source.text.lstrip().partition("\n")[0]
    return {"row", "col", "level_index"} <= {cell.strip() for cell in first.split(",")}


def read(source: FileText) -> Session:
    """Read a uniformity table. Raises LutgenError; the message names file, line and column."""
    (top, header), *rest = [(at, line) for at, line in enumerate(source.text.splitlines(), start=1) if line.strip()]
    names = source.row(header, top)
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        raise LutgenError(f"{source.at(top)}: the header lacks {', '.join(missing)}. Required: {', '.join(_COLUMNS)}.")
    values, lines = [], []
    for at, line in rest:
        row = source.row(line, at)
        if len(row) != len(names):
            raise LutgenError(f"{source.at(at)}: {len(row)} fields for {len(names)} columns: is the file cut off?")
        values.append([source.number(row[names.index(name)], at, f"column {name}") for name in _COLUMNS])
        lines.append(at)
    table = np.array(values).reshape(-1, len(_COLUMNS))
    grid, levels = table[:, :2], table[:, 2]
    for bad, what in (
        (((grid < 0) | (grid > _MOST) | (grid % 1 != 0)).any(axis=1), f"row and col count from 0, at most {_MOST}"),
        (~np.isin(levels, range(len(_LEVELS))), "level_index is 0, 1, 2 or 3: 100, 75, 50 and 25 %"),
    ):
        source.refuse(bad, lines, f": {what}.")
    drive = np.array([_LEVELS[int(level)] for level in levels])
    return Session(
        drive=np.repeat(drive[:, np.newaxis], 3, axis=1),
        xyz=table[:, 3:],
        absolute=True,
        names=tuple(f"row {int(row)}, column {int(col)}" for row, col in grid),
        lines=np.array(lines, dtype=np.int64),
        form=NAME,
        conditions=dict(zip(PLACE, ((grid + 0.5) / (grid.max(axis=0, initial=0.0) + 1.0)).T[::-1], strict=True)),
        file=source.file,
        sha256=source.sha256,
    )
