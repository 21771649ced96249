"""``lutgen lint``: what each reader will do with a LUT or a config, of whoever's making.

A file is scanned in one pass (``cube``, ``clf``, ``table``) or loaded (``config``); rules read the scan and say which
readers refuse it or silently show something else; a trial asks those that are installed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Linted
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.bake.lint.finding import Trial

#: What a suffix says of a file.
KINDS = {
    ".cube": "cube", ".clf": "clf", ".ctf": "clf", ".3dl": "lut", ".spi3d": "lut", ".csp": "lut", ".ocio": "config",
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
    return {"cube": _cube, "clf": _clf, "lut": _table, "config": _config}[kind](path, ask_readers)


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
    return Linted(path, "lut", (f"{size}{scan.bytes} bytes",), tuple(findings("lut", scan)))


def _config(path: Path, ask_readers: bool) -> Linted:
    from lutgen.bake.lint.config import scan_config
    from lutgen.bake.lint.rules import findings
    from lutgen.bake.lint.trial_config import try_config

    scan = scan_config(path)
    version = ".".join(map(str, scan.version))
    trials: tuple[Trial, ...] = tuple(try_config(path)) if ask_readers else ()
    return Linted(path, "config", (f"profile version {version}",), tuple(findings("config", scan)), trials)
