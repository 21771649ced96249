"""Readers of measurements, one file for each format: ArgyllCMS' .ti3 and other CGATS, ICC, CSV, uniformity, campaign.

A reader has ``NAME``, the format's name for people; ``SUFFIXES``, the suffixes of files that the reader explains if no
reader recognises their content; ``claims(source) -> bool``, whether the content has this format (at most one reader
claims a file); and ``read(source)``, which returns a Session, or an object with ``measurements()``, one checked table
by operating hours, and ``campaign()``, the sessions. A module whose name begins with an underscore is not a reader;
readers use it.

lutgen has its own readers because no package was found that reads these files: colour-science reads only spectra, from
X-Rite's files, and DisplayCAL's reader is part of a program.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError, listed, reason_of
from lutgen.files import is_folder, read_at_most
from lutgen.icc_tags import is_profile
from lutgen.readings.campaign import Campaign, CampaignEntry, alone, campaign_of
from lutgen.readings.formats._source import FileText, Readable, decoded
from lutgen.readings.session import Session

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    from lutgen.readings.table import Measurements

#: Largest file size. A table of readings has at most some ten MB.
MAX_BYTES = 64_000_000


@cache
def readers() -> dict[str, ModuleType]:
    """Return name → module of every reader in this folder."""
    modules = (
        import_module(f"{__name__}.{each.name}") for each in iter_modules(__path__) if not each.name.startswith("_")
    )
    return {module.NAME: module for module in sorted(modules, key=lambda each: each.NAME)}


def read_measurements(path: str | Path) -> Measurements:
    """Read the readings of a display as one table by operating hours.

    Parameters
    ----------
    path
        A file of any format in this folder, or a folder of sessions, which stands for its campaign file if it holds
        one. A single session counts as hour 0.

    Raises
    ------
    LutgenError
        The file is unreadable, has no known format, is relative to white, or contains an invalid value. The message
        names file, line and remedy.

    """
    path = Path(path)
    if is_folder(path):
        return read_campaign(path).measurements()
    return read_readings(path).measurements()


def read_campaign(path: str | Path, *more: str | Path) -> Campaign:
    """Read the sessions of a display.

    ``path``, ``more``: files of any format in this folder, or folders of sessions. A folder with a campaign file stands
    for this file. Only a campaign file states the hours per day.

    Raises LutgenError: a file is unreadable, has no known format or contains an invalid value, or a session occurs
    twice.
    """
    files = [file for each in (path, *more) for file in (_files(Path(each)) if is_folder(Path(each)) else [Path(each)])]
    if not more and (len(files) == 1 or not is_folder(Path(path))):
        return read_readings(files[0]).campaign()
    entries: list[CampaignEntry] = []
    for file in files:
        entries += read_readings(file).campaign().entries
    return campaign_of(entries, file="the sessions given" if more else str(path))


def read_session(path: str | Path) -> Session:
    """Read one session.

    Raises
    ------
    LutgenError
        The file is unreadable, has no known format, contains an invalid value or several sessions. The message names
        file, line and remedy.

    """
    if is_folder(Path(path)):
        raise LutgenError(f"{path}: is a folder. Name the files in it, such as {path}/*.ti3.")
    entries = read_readings(path).campaign().entries
    if len(entries) > 1:
        raise LutgenError(f"{path}: holds {len(entries)} sessions, and one is needed here. Make a file of that one.")
    return entries[0].session


def read_readings(path: str | Path) -> Readable:
    """Read a file with the reader that claims its content, or with the reader of its suffix."""
    return read_source(open_source(path))


def read_source(source: FileText) -> Readable:
    """Read a file's content as :func:`read_readings`; a single session counts as hour 0."""
    readings: Session | Readable = reader_of(source).read(source)
    return alone(readings) if isinstance(readings, Session) else readings


def open_source(path: str | Path) -> FileText:
    """Read and decode a file. Raises LutgenError: the file is unreadable, too large, empty or binary."""
    path = Path(path)
    data = read_at_most(path, MAX_BYTES, what="the readings", none="file of readings")
    text = "" if is_profile(data) else decoded(data, str(path))
    return FileText(text, str(path), hashlib.sha256(data).hexdigest(), data)


def holds_readings(path: str | Path) -> bool:
    """Whether a reader claims the content of a file."""
    try:
        source = open_source(path)
    except LutgenError:
        return False
    return any(module.claims(source) for module in readers().values())


def reader_of(source: FileText) -> ModuleType:
    """Return the reader of a file. Raises LutgenError: neither its content nor its suffix is known."""
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
    """Return the campaign file of a folder; without one, the files with a suffix of a reader, sorted by name.

    A saved model beside a campaign file does not count. Raises LutgenError: several campaign files, or no readings.
    """
    suffixes = {suffix for module in readers().values() for suffix in module.SUFFIXES}
    try:
        files = sorted(each for each in folder.iterdir() if each.is_file() and not each.name.startswith("."))
    except OSError as error:
        raise LutgenError(f"{folder}: cannot read the folder: {reason_of(error)}.") from None
    readable = [each for each in files if each.suffix.lower() in suffixes]
    documents = [each for each in readable if each.suffix.lower() == ".toml"]
    listing = [each for each in documents if holds_readings(each)] or documents
    if len(listing) > 1:
        names = listed(each.name for each in listing)
        raise LutgenError(f"{folder}: the folder holds {names}. Name the one that lists the sessions: {listing[0]}.")
    if not readable:
        known = ", ".join(sorted(suffixes - {".toml"}))
        raise LutgenError(f"{folder}: the folder holds no readings. Put sessions into it ({known}), or name a file.")
    return listing or readable
