"""CGATS of ArgyllCMS (.ti3) and of other programs: drive and XYZ, xyY or Lab of every patch, and Argyll's calibration.

The scales of an ArgyllCMS file are known: drive is in percent, ``NORMALIZED_TO_Y_100`` states whether Y of white is
100, and ``LUMINANCE_XYZ_CDM2`` is the XYZ of white in cd/m² (https://www.argyllcms.com/doc/ti3_format.html). The rows
are in the order of reading. A second table, CAL, holds the curves in the graphics card. For a file of another program
the reader assumes nothing that the file does not state.
"""

import itertools
import re
import shlex
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.cells import number
from lutgen.colorimetry import D65, Array, xyY_to_xyz
from lutgen.errors import LutgenError, listed
from lutgen.numerals import in_percent
from lutgen.readings.formats._cgats_tables import CgatsTable, tables
from lutgen.readings.formats._source import WHITE_CD_M2, FileText, date_of, full_drive, is_dark, whites
from lutgen.readings.session import Session

NAME = "CGATS"
SUFFIXES = (".ti3", ".cgats", ".cgt", ".txt")

_RGB = ("RGB_R", "RGB_G", "RGB_B")
_CAL = ("RGB_I", *_RGB)
_XYZ = ("XYZ_X", "XYZ_Y", "XYZ_Z")
_XYY = (("XYY_X", "XYY_Y", "XYY_CAPY"), ("XYY_X", "XYY_Y", "XYY_Y_CAP"))
_LAB = ("LAB_L", "LAB_A", "LAB_B")
_SPECTRUM = re.compile(r"(?:SPEC_|SPECTRAL_NM_?|SPECTRAL_|NM_?)([0-9]{3,4})")
_NAMES = ("SAMPLE_LOC", "SAMPLE_NAME", "SAMPLE_ID", "SAMPLEID", "STRING")

#: Reference whites of Lab by name, relative with Y = 1: D50 of ICC.1:2022 7.2.16, and sRGB's D65.
_LAB_WHITES = {"D50": np.array([0.9642, 1.0, 0.8249]), "D65": D65}

#: Smallest X, Y or Z from Lab, relative to white. Rounding and the noise of black do not give smaller values.
_LEAST_RATIO = -0.02

#: Allowed range of white in a file that is normalised to 100; white may drift during the session.
_NORMALISED = (50.0, 200.0)

#: In a file of another program a white counts as relative if it differs from 100 by at most this, or is at most 2.
_LOOKS_RELATIVE = 0.5


class _Light(NamedTuple):
    xyz: Array
    absolute: bool
    remarks: tuple[str, ...] = ()
    remedy: str = ""


def claims(source: FileText) -> bool:
    """Whether the file is CGATS: it begins with a known identifier, or contains BEGIN_DATA."""
    head = source.text.lstrip()[:8].upper()
    return head.startswith(("CTI", "CGATS", "CAL", "IT8", "NCLR")) or "BEGIN_DATA" in source.text


def read(source: FileText) -> Session:
    """Read a CGATS file. Raises LutgenError; the message names file, line and column."""
    if not claims(source):
        raise LutgenError(
            f"{source.file}: is no CGATS: no table in it begins with BEGIN_DATA: {source.text.lstrip()[:24]!r}. "
            f"lutgen reads .ti3, CGATS or CSV."
        )
    file_tables = tables(source)
    readings = _readings(source, file_tables)
    argyll = readings.kind.upper() == "CTI3"
    drive = _drive(source, readings, argyll=argyll)
    light = _light(source, readings, drive, argyll=argyll)
    keywords = dict(readings.keywords)
    created, date_remark = date_of(keywords.get("CREATED", ""))
    spectra, wavelengths = _spectra(source, readings)
    calibration = next((table for table in file_tables if set(_CAL) <= set(table.fields)), None)
    if calibration is not None:
        keywords |= {f"CAL_{name}": value for name, value in calibration.keywords.items()}
    names = next((name for name in _NAMES if name in readings.fields), None)
    return Session(
        drive=drive,
        xyz=light.xyz,
        absolute=light.absolute,
        names=tuple(row[readings.fields.index(names)] for row in readings.rows) if names else ("",) * len(drive),
        lines=np.array(readings.lines, dtype=np.int64),
        form="ArgyllCMS .ti3" if argyll else "CGATS",
        order=np.arange(len(drive), dtype=np.float64),
        spectra=spectra,
        wavelengths=wavelengths,
        calibration=_columns(source, calibration, _CAL) if calibration else None,
        created=created,
        instrument=keywords.get("TARGET_INSTRUMENT") or keywords.get("INSTRUMENTATION") or "",
        display=keywords.get("DISPLAY") or _named(keywords.get("ARGYLL_COLPROF_ARGS", "")) or "",
        remedy=light.remedy,
        remarks=(*light.remarks, *([date_remark] if date_remark else [])),
        date_remark=date_remark,
        metadata=keywords,
        file=source.file,
        sha256=source.sha256,
    )


def _named(arguments: str) -> str:
    """Return the display's name from the arguments of colprof: DisplayCAL writes the name after ``-M``."""
    try:
        words = shlex.split(arguments)
    except ValueError:
        return ""
    return next((value for word, value in itertools.pairwise(words) if word == "-M"), "")


def _readings(source: FileText, file_tables: list[CgatsTable]) -> CgatsTable:
    """Return the table with drive and colours. Raises LutgenError: there is not exactly one."""
    for table in file_tables:
        if any(name.startswith(("CMYK_", "CMY_")) for name in table.fields):
            raise LutgenError(
                f"{source.at(table.line)}: CMYK: a printer's file. lutgen reads displays: R, G, B and XYZ."
            )
    needed = [{*_RGB, *names} for names in (_XYZ, *_XYY, _LAB)]
    full = [table for table in file_tables if any(names <= {*table.fields} for names in needed)]
    if len(full) == 1:
        return full[0]
    if full:
        places = listed(str(table.line) for table in full)
        raise LutgenError(
            f"{source.file}: several sets of readings, in the tables of lines {places}. Make a file of each."
        )
    if any(set(_CAL) <= set(table.fields) for table in file_tables):
        raise LutgenError(
            f"{source.file}: calibration curves without readings. The .ti3 of the same session holds both."
        )
    columns = ", ".join(file_tables[0].fields[:12]) if file_tables else "none"
    raise LutgenError(
        f"{source.file}: no table has drive (RGB_R, RGB_G, RGB_B) and colour (XYZ_X, …, or XYY_X, XYY_Y, XYY_CAPY, or "
        f"LAB_L, …); columns: {columns}. A chart (.ti1, .ti2) has no readings, and spectra alone are not enough."
    )


def _columns(source: FileText, table: CgatsTable, names: tuple[str, ...]) -> Array:
    places = {name: table.fields.index(name) for name in names}
    numbers = [
        [source.number(row[place], line, name) for name, place in places.items()]
        for row, line in zip(table.rows, table.lines, strict=True)
    ]
    return np.array(numbers, dtype=np.float64).reshape(-1, len(names))


def _drive(source: FileText, table: CgatsTable, *, argyll: bool) -> Array:
    values = _columns(source, table, _RGB)
    if not argyll:
        return values / full_drive(values, source.file, table.lines)
    top = float(values.max(initial=0.0))
    if top > 100.0 + 1e-3:
        line = table.lines[int(values.max(axis=1).argmax())]
        if (values > 100.0 + 1e-3).any(axis=1).sum() == 1:
            raise LutgenError(f"{source.file}, line {line}: RGB reaches {top:g} there, more than 100 %. Correct it.")
        raise LutgenError(
            f"{source.file}: RGB reaches {top:g}, but an ArgyllCMS file has percent. Divide 8-bit drive by 2.55."
        )
    if 0.0 < top <= 1.0:
        raise LutgenError(
            f"{source.file}: RGB reaches only {top:g}, but an ArgyllCMS file has percent: multiply 0..1 by 100."
        )
    return np.minimum(values, 100.0) / 100.0


def _light(source: FileText, table: CgatsTable, drive: Array, *, argyll: bool) -> _Light:
    if set(_XYZ) <= set(table.fields):
        return _scaled(source, table, _columns(source, table, _XYZ), drive, argyll=argyll)
    for names in _XYY:
        if set(names) <= set(table.fields):
            xyY = _columns(source, table, names)
            bad = (xyY[:, 1] < 1e-3) | (xyY[:, 0] < 0) | (xyY[:, 0] + xyY[:, 1] > 1)
            why = ": x and y are no chromaticity: both above 0, and x + y at most 1. Delete the row, or export XYZ."
            source.refuse(bad & ~is_dark(xyY), table.lines, why)
            return _scaled(source, table, xyY_to_xyz(xyY), drive, argyll=argyll)
    return _from_lab(source, table, argyll=argyll)


def _from_lab(source: FileText, table: CgatsTable, *, argyll: bool) -> _Light:
    """Convert Lab to XYZ relative to its reference white (CIE 15:2018, 8.2.1)."""
    stating = ("ILLUMINANT", "ILLUMINATION_NAME", "WEIGHTING_FUNCTION", "WHITE_POINT")
    keywords = " ".join(table.keywords.get(name, "") for name in stating).upper()
    name = "D50" if argyll else next((name for name in _LAB_WHITES if name in keywords), None)
    if name is None:
        raise LutgenError(
            f"{source.file}: Lab without its reference white (keyword ILLUMINANT or WEIGHTING_FUNCTION with D50 or "
            "D65): XYZ cannot be computed from it. Export XYZ."
        )
    lab = _columns(source, table, _LAB)
    high = (lab[:, 0] < -1.0) | (lab[:, 0] > 150.0) | (np.abs(lab[:, 1:]) > 300.0).any(axis=1)
    source.refuse(high, table.lines, ": Lab is out of range: L* 0..100, a* and b* within ±128.")
    middle = (lab[:, 0] + 16.0) / 116.0
    f = np.column_stack([middle + lab[:, 1] / 500.0, middle, middle - lab[:, 2] / 200.0])
    ratio = np.where(f > 6.0 / 29.0, f**3, 3.0 * (6.0 / 29.0) ** 2 * (f - 4.0 / 29.0))
    why = ": no light has this Lab: X or Z would be negative. Are the columns XYZ? Name them so."
    source.refuse(ratio.min(axis=1) < _LEAST_RATIO, table.lines, why)
    remark = f"Its colours are Lab under {name}: relative to white, with no luminance in cd/m²."
    return _Light(ratio * _LAB_WHITES[name], absolute=False, remarks=(remark,), remedy=_REMEDY)


def _scaled(source: FileText, table: CgatsTable, xyz: Array, drive: Array, *, argyll: bool) -> _Light:
    """Scale XYZ to cd/m², or to Y = 1 for white if the luminance of white is unknown."""
    keywords = table.keywords
    luminance = _luminance(source, keywords["LUMINANCE_XYZ_CDM2"]) if "LUMINANCE_XYZ_CDM2" in keywords else None
    normalised = keywords.get("NORMALIZED_TO_Y_100", "").upper()
    if normalised not in {"", "YES", "NO"}:
        raise LutgenError(f"{source.file}: NORMALIZED_TO_Y_100 is {normalised[:20]!r}. Pick one of: YES, NO.")
    if normalised == "NO":
        return _Light(xyz, absolute=True)
    places = whites(drive)
    white = float(np.median(xyz[places, 1])) if places.size else None
    if places.size and xyz[places, 1].min() <= 0:
        line = table.lines[int(places[np.argmin(xyz[places, 1])])]
        raise LutgenError(
            f"{source.at(line)}: white has no light (Y = {xyz[places, 1].min():g}). Correct or delete the row."
        )
    if normalised == "YES" or luminance is not None:
        low, high = _NORMALISED
        if not low <= (white if white is not None else 100.0) <= high or xyz[:, 1].max(initial=0.0) > 2 * high:
            held = f"white is {white:g}" if white is not None else "Y is far above it"
            raise LutgenError(
                f"{source.file}: Y should be normalised to 100 for white, but {held}. Correct NORMALIZED_TO_Y_100."
            )
        if luminance is None:
            return _Light(xyz / 100.0, absolute=False, remarks=(_RELATIVE,), remedy=_REMEDY)
        return _Light(xyz * (luminance[1] / 100.0), absolute=True, remarks=_contradiction(luminance, xyz, places))
    return _undeclared(source, xyz, white, argyll=argyll)


_RELATIVE = "XYZ are relative to white, and the file does not give white's luminance in cd/m²: only ratios are known."

#: Remedy for a relative file, without a change to the file; and the remedy for a file that does not state the unit.
_REMEDY = "Say white_cd_m2 = 120.0, white's luminance, in a campaign file (lutgen sessions init drafts one)."
_IF_ABSOLUTE = (
    'White has Y = {0:.6g}: if that is in cd/m², add the line NORMALIZED_TO_Y_100 "NO", or say white_cd_m2 = {0:.6g} '
    "in a campaign file (lutgen sessions init drafts one); otherwise say there which luminance white had."
)


def _undeclared(source: FileText, xyz: Array, white: float | None, *, argyll: bool) -> _Light:
    """Treat XYZ of an unknown unit as relative: XYZ over white are correct for every unit."""
    if white is None:
        raise LutgenError(
            f"{source.file}: does not say whether XYZ are in cd/m², and has no white that shows it. Add a reading of "
            "white."
        )
    looks_relative = white <= 2.0 or abs(white - 100.0) <= _LOOKS_RELATIVE
    remark = _RELATIVE
    if not (argyll or looks_relative):
        remark = (
            f"White has Y = {white:g}, but the file does not say that this is in cd/m²: taken as relative. If it is, "
            'add the line NORMALIZED_TO_Y_100 "NO".'
        )
    remedy = _REMEDY if looks_relative else _IF_ABSOLUTE.format(white)
    return _Light(xyz / white, absolute=False, remarks=(remark,), remedy=remedy)


def _luminance(source: FileText, text: str) -> Array:
    words = text.split()
    if len(words) != 3:
        raise LutgenError(
            f"{source.file}: LUMINANCE_XYZ_CDM2 is {text[:40]!r}; it is three numbers, X, Y and Z of white in cd/m²."
        )
    values = [number(word) for word in words]
    if None in values:
        raise LutgenError(f"{source.file}: LUMINANCE_XYZ_CDM2 is {text[:40]!r}: not a finite number. Correct it.")
    xyz = np.array(values, dtype=np.float64)
    low, high = WHITE_CD_M2
    if not low <= xyz[1] <= high or xyz.min() <= 0:
        raise LutgenError(
            f"{source.file}: LUMINANCE_XYZ_CDM2 is {text[:40]!r}: no display's white in cd/m² ({low:g} to {high:g})."
        )
    return xyz


def _contradiction(luminance: Array, xyz: Array, places: NDArray[np.intp]) -> tuple[str, ...]:
    """Return a remark if the first white and LUMINANCE_XYZ_CDM2, which should be one reading, differ in colour."""
    if not places.size:
        return ()
    first = xyz[places[0]] / xyz[places[0], 1]
    off = float(np.abs(first * luminance[1] / luminance - 1.0).max())
    remark = f"LUMINANCE_XYZ_CDM2 and the first white differ in colour by {in_percent(off)}: one of them was edited."
    return (remark,) if off > 0.02 else ()


def _spectra(source: FileText, table: CgatsTable) -> tuple[Array | None, Array | None]:
    matches = [(name, match) for name in table.fields if (match := _SPECTRUM.fullmatch(name))]
    if not matches:
        return None, None
    wavelengths = np.array([float(match[1]) for _, match in matches])
    if wavelengths.size < 2 or np.any(np.diff(wavelengths) <= 0) or wavelengths[0] < 300 or wavelengths[-1] > 1100:
        raise LutgenError(
            f"{source.at(table.line)}: wavelengths of the spectral columns must rise, between 300 and 1100 nm."
        )
    return _columns(source, table, tuple(name for name, _ in matches)), wavelengths
