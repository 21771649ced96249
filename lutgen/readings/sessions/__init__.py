"""Readers of sessions: what measuring programs write. One file per format in this folder, found by content.

A module has ``NAME``, for people; ``claims(text) -> bool``, whether a text looks like this format (no two do);
and ``read(source) -> Session``. Suffixes are not asked: ``.txt`` and ``.csv`` are everybody's. A module whose name
begins with an underscore is no format: the others build on it. An ICC profile is read for the session in it.

The readers are ours because no package was found that reads such sessions: colour-science takes spectra alone, from
X-Rite's files, and DisplayCAL's reader is part of a program.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.files import is_folder, read_at_most
from lutgen.icc_tags import is_profile
from lutgen.readings.sessions._profile import readings_in
from lutgen.readings.sessions._source import Source

if TYPE_CHECKING:
    from types import ModuleType

    from lutgen.readings.session import Session

__all__ = ["Source", "read_session", "session_formats"]

#: A session of 10 000 patches with spectra is 10 MB; a larger file is something else.
MAX_BYTES = 32_000_000

#: Files that people have beside the readings, and what to take instead: by how their bytes begin.
_BINARY = (
    (b"PK\x03\x04", "a zipped file (a spreadsheet?). Save the table as CSV, or unpack it"),
    (b"%PDF", "a PDF report. Take the table of readings itself: .ti3, CGATS or CSV"),
    (b"\x1f\x8b", "a gzip file. Unpack it first"),
)


def session_formats() -> dict[str, ModuleType]:
    """Name → module of every format in this folder."""
    modules = (
        import_module(f"{__name__}.{each.name}") for each in iter_modules(__path__) if not each.name.startswith("_")
    )
    return {module.NAME: module for module in sorted(modules, key=lambda each: each.NAME)}


def read_session(path: str | Path) -> Session:
    """Read a session.

    Raises
    ------
    LutgenError
        Unreadable, binary, of no known format, or wrong in any value: names file, line and what to do.

    """
    path = Path(path)
    if is_folder(path):
        raise LutgenError(f"{path}: is a folder. Name the files in it, such as {path}/*.ti3.")
    data = read_at_most(path, MAX_BYTES, what="the session", none="session")
    sha256 = hashlib.sha256(data).hexdigest()
    if is_profile(data):
        tag, text = readings_in(data, str(path))
        found = _session(Source(_text(text, path), f"{path}, tag {tag}", sha256))
        remark = f"Read from the tag {tag} of an ICC profile: the readings that it was made from."
        return replace(found, file=str(path), remarks=(remark, *found.remarks))
    return _session(Source(_text(data, path), str(path), sha256))


def _session(source: Source) -> Session:
    for module in session_formats().values():
        if module.claims(source.text):
            session: Session = module.read(source)
            return session
    message = (
        f"{source.file}: no format of sessions that is known: {source.text.lstrip()[:24]!r}. "
        f"Pick one of: {', '.join(session_formats())}."
    )
    raise LutgenError(message)


def _text(data: bytes, path: str | Path) -> str:
    """Decode what programs write: UTF-8, UTF-16 with its mark, or Latin-1, whose every byte is a letter."""
    for head, what in _BINARY:
        if data.startswith(head):
            message = f"{path}: is {what}."
            raise LutgenError(message)
    if Path(path).suffix.lower() == ".chc":
        message = f"{path}: is HCFR's own binary file. Export the measures from HCFR, and name columns R,G,B,X,Y,Z."
        raise LutgenError(message)
    try:
        text = data.decode("utf-16" if data[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        message = f"{path}: holds NUL bytes: a binary file? A session is text: .ti3, CGATS or CSV."
        raise LutgenError(message)
    if not text.strip():
        message = f"{path}: the file is empty. A session is text: .ti3, CGATS or CSV."
        raise LutgenError(message)
    return text
