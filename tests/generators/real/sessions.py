"""Read the measured sessions: ArgyllCMS ``.ti3`` (CGATS text) and tables of comma-separated values.

This file returns measured data. Everything that other files of this folder compute from the data is simulated.
"""

from __future__ import annotations

import csv
import os
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The list excludes sessions in HDR, with a wrong instrument matrix, or with automatic brightness (according to notes of
# their authors). It also excludes two sessions with five levels per ramp, which are too few for a curve.
BASES: tuple[str, ...] = (
    "K2418U__1_2019-04-01_15-18",
    "K2418U__2_2021-02-09_09-11",
    "K2721UG__1_2022-08-20_16-50",
    "K2721UG__1_2022-08-20_17-47",
    "MacBook_Pro_13_2013_Late___1_2018-06-21_10-42",
    "MacBook_Pro_13_2013_Late___1_2018-12-06_10-26",
    "MacBook_Pro_13_2013_Late___1_2020-05-26_15-23",
    "P2417H__1_2020-05-26_14-41",
    "S2317HWi__2_2018-12-06_13-19",
    "Surface_Pro_2017__1_2020-05-26_09-42",
    "Surface_Pro_2017__1_2020-05-26_10-25",
    "ThinkBook_14p__NV140DRM-N62__1_2022-08-01_19-50",
    "ThinkPad_X61__N121X5-L06__1_2017-04-19_10-25",
    "ThinkPad_X61__N121X5-L06__1_2017-04-19_15-14",
    "ThinkPad_X61__N121X5-L06__1_2020-05-26_13-57",
    "ThinkPad_X61__N121X5-L06__1_2020-05-26_15-02",
    "U2718Q__1_2020-05-26_13-17",
    "U2718Q__2_2022-08-20_17-18",
    "DELL_P2715Q_14-05-2022",
    "DELL_P2715Q_20220226",
    "LG_ULTRAWIDE_14-05-2022",
    "LG_ULTRAWIDE_17-06-2022_D65_120_DisplayPort",
    "LG_ULTRAWIDE_17-06-2022_D65_120_HDMI",
    "LG_ULTRAWIDE_20220226",
)


class MissingSessionsError(LookupError):
    """The measured sessions are not on this machine."""


@dataclass(frozen=True)
class Session:
    """One measured session.

    Attributes
    ----------
    name
        First part of the file's name: display and date.
    drive, xyz_cd_m2
        Code values 0..1 and light in cd/m², each (n, 3), in the order of reading.
    calibration
        Calibration curves that were loaded: input and three outputs, (m, 4), 0..1; the identity if the file has
        none.

    """

    name: str
    drive: Array
    xyz_cd_m2: Array
    calibration: Array


def folder() -> Path:
    """Return the folder of the real sessions; raise MissingSessionsError if LUTGEN_REAL_DATA does not lead to it."""
    named = os.environ.get("LUTGEN_REAL_DATA")
    if not named:
        raise MissingSessionsError("LUTGEN_REAL_DATA is not set; set it to the folder that holds real/jamesits.")
    path = Path(named) / "real"
    if not (path / "jamesits").is_dir():
        raise MissingSessionsError(f"{path} holds no folder jamesits; set LUTGEN_REAL_DATA to the folder above real.")
    return path


@cache
def session(name: str) -> Session:
    """Return a session of BASES; raise MissingSessionsError if no file or several files have this name."""
    paths = [path for kind in ("jamesits/*.ti3", "ickc/*.csv") for path in folder().glob(kind) if _is(path, name)]
    if len(paths) != 1:
        raise MissingSessionsError(f"{name}: {len(paths)} sessions have this name; pick one of {', '.join(BASES)}.")
    return _read_ti3(paths[0], name) if paths[0].suffix == ".ti3" else _read_csv(paths[0], name)


def uniformity() -> Array:
    """Return the light of white at 3 x 3 places of one real K2721UG, relative to the centre: (row, column, XYZ)."""
    with (folder() / "jamesits" / "uniformity_K2721UG_2023-02-11.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["level_index"] == "0"]
    field = np.full((3, 3, 3), np.nan)
    for row in rows:
        field[int(row["row"]), int(row["col"])] = [float(row[axis]) for axis in "XYZ"]
    return np.asarray(field / field[1, 1])


def _is(path: Path, name: str) -> bool:
    return path.name == name or path.name.startswith((f"{name}_", f"{name}."))


def _read_ti3(path: Path, name: str) -> Session:
    text = path.read_text(encoding="utf-8", errors="replace")
    white = re.search(r'LUMINANCE_XYZ_CDM2 "([^"]*)"', text)
    if white is None:
        raise ValueError(f"{path}: has no LUMINANCE_XYZ_CDM2; only sessions in cd/m² are allowed.")
    tables = [_table(part) for part in re.split(r"^CAL\b", text, maxsplit=1, flags=re.MULTILINE)]
    measured = tables[0]
    drive = np.column_stack([measured[f"RGB_{channel}"] for channel in "RGB"]) / 100.0
    xyz = np.column_stack([measured[f"XYZ_{axis}"] for axis in "XYZ"]) * float(white[1].split()[1]) / 100.0
    curves = np.tile(np.linspace(0.0, 1.0, 256)[:, None], 4)
    if len(tables) > 1:
        curves = np.column_stack([tables[1][field] for field in ("RGB_I", "RGB_R", "RGB_G", "RGB_B")])
    return Session(name, drive, xyz, curves)


def _table(text: str) -> dict[str, Array]:
    fields = re.search(r"BEGIN_DATA_FORMAT\s(.*?)\sEND_DATA_FORMAT", text, re.DOTALL)
    data = re.search(r"BEGIN_DATA\s(.*?)\sEND_DATA\b", text, re.DOTALL)
    if fields is None or data is None:
        raise ValueError("A CGATS table needs BEGIN_DATA_FORMAT and BEGIN_DATA; this one lacks them.")
    names = fields[1].split()
    cells = [line.split() for line in data[1].strip().splitlines()]
    return {
        name: np.array([float(row[column]) for row in cells])
        for column, name in enumerate(names)
        if name.startswith(("RGB", "XYZ"))
    }


def _read_csv(path: Path, name: str) -> Session:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    drive = np.array([[float(row[channel]) for channel in "RGB"] for row in rows]) / 255.0
    xyz = np.array([[float(row[f"{axis}_cdm2"]) for axis in "XYZ"] for row in rows])
    return Session(name, drive, xyz, np.tile(np.linspace(0.0, 1.0, 256)[:, None], 4))
