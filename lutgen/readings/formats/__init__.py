"""Readers of measurements, one file a format: ArgyllCMS' .ti3 and other CGATS, ICC, CSV, uniformity, campaign.

A reader has ``NAME``, for people; ``SUFFIXES``, whose files it explains where their content fits no reader;
``claims(source) -> bool``, whether the content is this format (no two readers claim one file); and ``read(source)``,
which gives readings: an object with ``measurements()``, one checked table by operating hours, and ``campaign()``, the
sessions. A module whose name begins with an underscore is no format: the readers build on it.

The readers are ours because no package was found that reads such files: colour-science takes spectra alone, from
X-Rite's files, and DisplayCAL's reader is part of a program.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError, reason_of
from lutgen.files import is_folder, read_at_most
from lutgen.icc_tags import is_profile
from lutgen.readings.campaign import Campaign, CampaignEntry, campaign_of
from lutgen.readings.formats._source import FileText, Readable, decoded

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    from lutgen.readings.session import Session
    from lutgen.readings.table import Measurements

#: A table of readings is text of at most some ten MB; a larger file is something else.
MAX_BYTES = 64_000_000


@cache
def readers() -> dict[str, ModuleType]:
    """Name → module of every reader in this folder."""
    modules = (
        import_module(f"{__name__}.{each.name}") for each in iter_modules(__path__) if not each.name.startswith("_")
    )
    return {module.NAME: module for module in sorted(modules, key=lambda each: each.NAME)}


def read_measurements(path: str | Path) -> Measurements:
    """Read the readings of a display as one table by operating hours.

    Parameters
    ----------
    path
        A file of any format in this folder, or a folder of sessions. One session is the display at hour 0.

    Raises
    ------
    LutgenError
        Unreadable, of no known format, relative to white, or wrong in any value: names file, line and what to do.

    """
    path = Path(path)
    if is_folder(path):
        return read_campaign(path).measurements()
    return read_readings(path).measurements()


def read_campaign(path: str | Path, *more: str | Path) -> Campaign:
    """Read the sessions of a display.

    ``path``, ``more``: files of any format in this folder, or folders of sessions. Of these a campaign file alone says
    the hours a day.

    Raises LutgenError: unreadable, of no known format, wrong in any value, or the same session twice.
    """
    if not more and not is_folder(Path(path)):
        return read_readings(path).campaign()
    entries: list[CampaignEntry] = []
    for each in (path, *more):
        files = _files(Path(each)) if is_folder(Path(each)) else [Path(each)]
        entries += [entry for file in files for entry in read_readings(file).campaign().entries]
    return campaign_of(entries, file="the sessions given" if more else str(path))


def read_session(path: str | Path) -> Session:
    """Read one session.

    Raises
    ------
    LutgenError
        Unreadable, of no known format, wrong in any value, or several sessions: names file, line and what to do.

    """
    if is_folder(Path(path)):
        raise LutgenError(f"{path}: is a folder. Name the files in it, such as {path}/*.ti3.")
    entries = read_readings(path).campaign().entries
    if len(entries) > 1:
        raise LutgenError(f"{path}: holds {len(entries)} sessions, and one is needed here. Make a file of it.")
    return entries[0].session


def read_readings(path: str | Path) -> Readable:
    """Read a file by the reader that claims its content, else by the one whose suffix it has."""
    source = open_source(path)
    readings: Readable = reader_of(source).read(source)
    return readings


def open_source(path: str | Path) -> FileText:
    """Read and decode a file. Raises LutgenError where it is unreadable, too large, empty or binary."""
    path = Path(path)
    data = read_at_most(path, MAX_BYTES, what="the readings", none="file of readings")
    text = "" if is_profile(data) else decoded(data, str(path))
    return FileText(text, str(path), hashlib.sha256(data).hexdigest(), data)


def reader_of(source: FileText) -> ModuleType:
    """Return the reader of a file. Raises LutgenError where neither its content nor its suffix is known."""
    suffix = Path(source.file).suffix.lower()
    claiming = [module for module in readers().values() if module.claims(source)]
    named = [module for module in readers().values() if suffix in module.SUFFIXES]
    if not claiming and not named:
        raise LutgenError(
            f"{source.file}: no format of readings that is known: {source.text.lstrip()[:24]!r}. "
            f"Pick one of: {', '.join(readers())}."
        )
    return (claiming or named)[0]


def _files(folder: Path) -> Sequence[Path]:
    """Files of a folder that hold readings, by name: those with a suffix of a reader, which may still be refused."""
    suffixes = {suffix for module in readers().values() for suffix in module.SUFFIXES}
    try:
        files = sorted(each for each in folder.iterdir() if each.is_file() and not each.name.startswith("."))
    except OSError as error:
        raise LutgenError(f"{folder}: cannot read the folder: {reason_of(error)}.") from None
    readable = [each for each in files if each.suffix.lower() in suffixes]
    listing = next((each for each in readable if each.suffix.lower() == ".toml"), None)
    if listing is not None:
        raise LutgenError(f"{folder}: the folder holds a campaign file. Name it instead: {listing}.")
    if not readable:
        known = ", ".join(sorted(suffixes - {".toml"}))
        raise LutgenError(f"{folder}: the folder holds no readings. Put sessions into it ({known}), or name a file.")
    return readable
