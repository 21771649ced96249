"""``lutgen lint``: what each reader will do with a LUT or a config, of whoever's making.

A file is scanned in one pass (``cube``, ``clf``, ``table``), by its heads (``profile``, ``hald``), loaded (``config``)
or unpacked (``archive``); rules read the scan and say which readers refuse it or silently show something else; a trial
asks those that are installed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding, Linted
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.bake.lint.finding import Trial

#: What a suffix says of a file.
KINDS = {
    ".cube": "cube", ".clf": "clf", ".ctf": "clf", ".3dl": "3dl", ".spi3d": "lut", ".csp": "lut", ".ocio": "config",
    ".ocioz": "archive", ".icc": "profile", ".icm": "profile", ".png": "hald",
}  # fmt: skip


def lint(path: str | Path, *, ask_readers: bool = False) -> Linted:
    """Lint one file.

    Parameters
    ----------
    ask_readers
        Let the readers that are installed read the file, and say what they did.

    Raises
    ------
    LutgenError
        The file is not there, cannot be read, is no text, or is of no kind that is known.

    """
    path = Path(path)
    kind = KINDS.get(path.suffix.lower())
    if path.is_dir() or not path.exists():
        what = "is a folder" if path.is_dir() else "there is no such file"
        message = f"{path}: {what}. Give a file that ends in {', '.join(KINDS)}."
        raise LutgenError(message)
    if kind is None:
        message = f"{path}: ends in none of {', '.join(KINDS)}. Rename it to what it is."
        raise LutgenError(message)
    readers = {
        "cube": _cube, "clf": _clf, "lut": _table, "3dl": _table, "config": _config, "archive": _archive,
        "profile": _profile, "hald": _hald,
    }  # fmt: skip
    return readers[kind](path, ask_readers)


def _cube(path: Path, ask_readers: bool) -> Linted:
    from lutgen.bake.lint.cube import scan_cube
    from lutgen.bake.lint.rules import findings
    from lutgen.bake.lint.trial import try_cube

    scan = scan_cube(path, keep=ask_readers)
    trials: tuple[Trial, ...] = tuple(try_cube(scan)) if ask_readers else ()
    part = f", a 1D part of {scan.size_1d}" if scan.size_1d else ""
    facts = (f"{scan.size}³ points{part}, {scan.table.rows} rows, {scan.bytes} bytes",)
    return Linted(path, "cube", facts, tuple(findings("cube", scan)), trials)


def _clf(path: Path, _ask_readers: bool) -> Linted:
    from lutgen.bake.lint.clf import scan_clf
    from lutgen.bake.lint.rules import findings

    scan = scan_clf(path)
    names = ", ".join(node.name for node in scan.nodes if node.dim or node.name == "Exponent") or "no operators"
    return Linted(path, "clf", (f"{names}, {scan.bytes} bytes",), tuple(findings("clf", scan)))


def _table(path: Path, _ask_readers: bool) -> Linted:
    from lutgen.bake.lint.rules import findings
    from lutgen.bake.lint.table import scan_table

    scan = scan_table(path)
    size = " × ".join(map(str, scan.size)) + f" points, {scan.rows} rows, " if scan.size else ""
    kind = KINDS[path.suffix.lower()]
    return Linted(path, kind, (f"{size}{scan.bytes} bytes",), tuple(findings(kind, scan)))


def _config(path: Path, ask_readers: bool) -> Linted:
    from lutgen.bake.lint.config import scan_config
    from lutgen.bake.lint.rules import findings
    from lutgen.bake.lint.trial_config import try_config

    scan = scan_config(path)
    version = ".".join(map(str, scan.version))
    trials: tuple[Trial, ...] = tuple(try_config(path)) if ask_readers else ()
    return Linted(path, "config", (f"profile version {version}",), tuple(findings("config", scan)), trials)


def _profile(path: Path, _ask_readers: bool) -> Linted:
    from lutgen.bake.lint.profile import scan_profile
    from lutgen.bake.lint.rules import findings

    scan = scan_profile(path)
    version = ".".join(map(str, scan.version))
    tables = "".join(f", {table.tag.name} of {table.points}³ points" for table in scan.tables)
    facts = (f"version {version}, class {scan.word(12)!r}, {len(scan.tags)} tags{tables}, {scan.length} bytes",)
    kind = "link" if scan.link else "profile"
    return Linted(path, kind, facts, tuple(findings(kind, scan)))


def _hald(path: Path, _ask_readers: bool) -> Linted:
    from lutgen.bake.lint.hald import scan_hald
    from lutgen.bake.lint.rules import findings

    scan = scan_hald(path)
    level = f", level {scan.level}: {scan.level**2}³ points" if scan.level else ""
    facts = (f"{scan.width} × {scan.height} pixels of {scan.depth} bits{level}, {scan.bytes} bytes",)
    return Linted(path, "hald", facts, tuple(findings("hald", scan)))


def _archive(path: Path, _ask_readers: bool) -> Linted:
    from lutgen.bake.lint.archive import CONFIG, scan_archive
    from lutgen.bake.lint.rules import findings

    with scan_archive(path) as (scan, folder):
        luts = [name for name in scan.names if name.lower().endswith(_IN_ARCHIVES) and (folder / name).is_file()]
        of_luts = [finding for name in luts for finding in _inside(folder, name)]
        found = [*findings("archive", scan), *of_luts]
        if any(each.rule in _LARGE for each in of_luts):
            # Loading the config loads its LUTs, and one whose header lies would take all memory.
            found.append(Finding(f"{CONFIG} was not loaded, since a LUT may be too large", "Mend that first."))
        elif (folder / CONFIG).is_file():
            found += _inside(folder, CONFIG)
    return Linted(path, "archive", (f"{len(scan.names)} files, {scan.bytes} bytes",), tuple(found))


#: What an archive's config may name, and lint reads.
_IN_ARCHIVES = tuple(suffix for suffix, kind in KINDS.items() if kind in {"cube", "clf", "lut", "3dl"})


#: Rules that tell of a LUT whose header asks for more than OpenColorIO is given.
_LARGE = {"loads", "cube-size"}


def _inside(folder: Path, name: str) -> list[Finding]:
    """Lint a file of an archive: what is said of it names it."""
    try:
        found = lint(folder / name).findings
    except LutgenError as error:
        return [Finding(_named(str(error), folder), "Make it again.", rule="archive-form")]
    return [replace(each, what=_named(f"{name}: {each.what}", folder)) for each in found]


def _named(words: str, folder: Path) -> str:
    """Leave the folder out, and what cannot be printed: names in an archive may hold anything."""
    return "".join(letter if letter.isprintable() else " " for letter in words.replace(f"{folder}/", ""))
