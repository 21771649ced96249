"""``.ocioz``: reads its directory first, unpacks safe files into a temporary folder, and lints each of these files."""

import stat
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath

from lutgen.bake.config import CONFIG
from lutgen.cells import first_doubled
from lutgen.errors import LutgenError, reason_of
from lutgen.files import scratch
from lutgen.lint.finding import OCIO_26, Linted, LintFinding, refused
from lutgen.lint.formats import FileKind, clf, config, cube, findings, tables
from lutgen.lint.stream import readable

#: Maximum size in bytes of an archive and of its unpacked files, maximum number of files, and maximum size in bytes of
#: its directory. The largest published config has 30 MB in 90 files.
LARGEST, MOST_FILES, LARGEST_DIRECTORY = 200 << 20, 2000, 2 << 20

#: The record at the end of a ZIP (APPNOTE 4.3.16): its signature, and its maximum distance in bytes from the end.
_END, _FARTHEST = b"PK\x05\x06", 22 + 65_535

_BLOCK = 1 << 16

#: Suffix of LUT files in archives that lint reads → kind of file.
_LUTS = {suffix: each.FORMAT for each in (cube, clf, tables) for suffix in each.FORMAT.suffixes}


@dataclass(frozen=True)
class ArchiveScan:
    """The result of a scan of an archive."""

    bytes: int
    #: The reason why it cannot be unpacked; empty when it can be unpacked.
    broken: str
    #: Names of its files, from its directory.
    names: tuple[str, ...]
    #: Files that are not unpacked, each with the reason: a name that leads out of the folder, a link, encryption.
    unsafe: tuple[tuple[str, str], ...]


@contextmanager
def scan_archive(path: Path) -> Iterator[tuple[ArchiveScan, Path]]:
    """Yield the scan of an archive, and a folder with its safe files. Raises LutgenError: it cannot be read."""
    with scratch() as folder:
        with readable(path, "an archive"):
            size = path.stat().st_size
            try:
                broken = _too_much(path, size)
                scan = ArchiveScan(size, broken, (), ()) if broken else _unpack(path, size, folder)
            except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, ValueError, RuntimeError) as error:
                scan = ArchiveScan(size, f"cannot be unpacked: {error}", (), ())
        yield scan, folder


def _too_much(path: Path, size: int) -> str:
    """Return the reason why the directory must not be read; empty when it may be read."""
    if size > LARGEST:
        return f"has more than {LARGEST >> 20} MiB, which no config has"
    with path.open("rb") as file:
        file.seek(max(0, size - _FARTHEST))
        tail = file.read()
    place = tail.rfind(_END)
    if place < 0 or len(tail) < place + 22:
        return "is not an archive: it does not end in a directory of files"
    length = int.from_bytes(tail[place + 12 : place + 16], "little")
    return f"has a directory of {length >> 20} MiB" if length > LARGEST_DIRECTORY else ""


def _unpack(path: Path, size: int, folder: Path) -> ArchiveScan:
    with zipfile.ZipFile(path) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        names = tuple(entry.filename for entry in entries)
        unpacked = sum(entry.file_size for entry in entries)
        if len(entries) > MOST_FILES or unpacked > LARGEST:
            fact = f"unpacks to {len(entries)} files of {unpacked >> 20} MiB together, which no config has"
            return ArchiveScan(size, fact, names, ())
        if doubled := first_doubled(names):
            return ArchiveScan(size, f"holds {doubled!r} twice", names, ())
        unsafe, left = [], LARGEST
        for entry in entries:
            reason = _unsafe(entry)
            if reason:
                unsafe.append((entry.filename, reason))
            else:
                left -= _write(archive, entry, folder / entry.filename, left)
    return ArchiveScan(size, "", names, tuple(unsafe))


def _unsafe(entry: zipfile.ZipInfo) -> str:
    windows = PureWindowsPath(entry.filename)
    if windows.is_absolute() or windows.drive or entry.filename.startswith(("/", "\\")):
        return "is an absolute path"
    if ".." in windows.parts:
        return "leads out of the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, target: Path, left: int) -> int:
    """Unpack a file and return its size. The size is counted, since the directory may state a wrong size."""
    written = 0
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(entry) as source, target.open("xb") as file:
            while block := source.read(_BLOCK):
                written += len(block)
                if written > left:
                    raise ValueError(f"it has more than {LARGEST >> 20} MiB")
                file.write(block)
    except OSError as error:
        raise ValueError(f"{entry.filename!r}: {reason_of(error)}") from None
    return written


def archive_form(scan: ArchiveScan) -> Iterator[LintFinding]:
    """Find faults of the archive. A program that opens an archive unpacks it, so a malicious archive can do harm."""
    fates = refused(OCIO_26, how="opens no such archive")
    unsafe = [f"holds {name!r}, which {reason}" for name, reason in scan.unsafe[:3]]
    for fact in [scan.broken] if scan.broken else unsafe:
        yield LintFinding(fact, "Do not unpack it; create it again with ocioarchive.", 0, fates)
    if scan.broken:
        return
    if CONFIG not in scan.names:
        yield LintFinding(f"has no {CONFIG} at its root", "Create it again with ocioarchive.", 0, fates)
    yield LintFinding("is not read by OpenColorIO 2.1, which has no archives", "Unpack it for that.")


RULES = (archive_form,)


def lint_archive(path: Path, _ask_readers: bool) -> Linted:
    """Lint an archive, its config and its LUTs. Raises LutgenError when the archive cannot be read."""
    with scan_archive(path) as (scan, folder):
        of_luts = [
            finding
            for name in scan.names
            if (form := _LUTS.get(Path(name).suffix.lower())) and (folder / name).is_file()
            for finding in _inside(folder, name, form)
        ]
        all_findings = [*findings(RULES, scan), *of_luts]
        # These rules report a LUT that is too large for OpenColorIO.
        if any(each.rule in {"loads", "cube-size"} for each in of_luts):
            # Loading the config loads its LUTs. A LUT that states a huge size would fill the memory.
            fact = f"{CONFIG} was not loaded, since a LUT may be too large"
            all_findings.append(LintFinding(fact, "Correct that first."))
        elif (folder / CONFIG).is_file():
            all_findings += _inside(folder, CONFIG, config.FORMAT)
    return Linted(path, "archive", (f"{len(scan.names)} files, {scan.bytes} bytes",), tuple(all_findings))


def _inside(folder: Path, name: str, form: FileKind) -> list[LintFinding]:
    """Lint a file of an archive, and prefix each finding with the file's name."""
    try:
        of_file = form.lint(folder / name, False).findings  # noqa: FBT003 - no reader is tried
    except LutgenError as error:
        return [LintFinding(_named(str(error), folder), "Create it again.", rule="archive-form")]
    return [replace(each, what=_named(f"{name}: {each.what}", folder)) for each in of_file]


def _named(words: str, folder: Path) -> str:
    """Remove the folder and unprintable characters from a message. Names in an archive may hold any characters."""
    return "".join(letter if letter.isprintable() else " " for letter in words.replace(f"{folder}/", ""))


FORMAT = FileKind((".ocioz",), lint_archive, RULES)
