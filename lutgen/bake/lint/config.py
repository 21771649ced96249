"""Reading anybody's OpenColorIO config: loaded, and every part of it instantiated.

``validate()`` passes when a LUT file is missing, so nothing less will do.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.bake.check_config import warnings_logged
from lutgen.bake.merge_files import endless_file, file_transforms
from lutgen.bake.merge_proof import all_parts
from lutgen.bindings import ocio, ocio_errors
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from pathlib import Path

#: The largest published config has 0.5 MB.
MAX_BYTES = 64 << 20


@dataclass(frozen=True)
class ConfigScan:
    """A config as it stands.

    Attributes
    ----------
    version
        Its profile version, (0, 0) where it states none.
    config
        OpenColorIO's object, None where it does not load.
    refusal
        Why the installed OpenColorIO does not load or validate it; empty where it does.
    warnings
        What OpenColorIO logs while loading it.
    broken
        Part → why it cannot be instantiated.

    """

    path: Path
    text: str
    version: tuple[int, int]
    config: Any
    refusal: str
    warnings: tuple[str, ...]
    broken: tuple[tuple[str, str], ...]

    def line_of(self, words: str) -> int:
        """The first line that holds the words, 0 without one."""
        place = self.text.find(words) if words else -1
        return self.text.count("\n", 0, place) + 1 if place >= 0 else 0

    @property
    def file_transforms(self) -> list[Any]:
        """Every FileTransform of the config."""
        return list(file_transforms(self.config)) if self.config else []


def scan_config(path: Path) -> ConfigScan:
    """Load a config and instantiate its parts.

    Raises
    ------
    LutgenError
        The file cannot be read, or is far larger than any config.

    """
    try:
        if path.stat().st_size > MAX_BYTES:
            message = f"{path}: has more than {MAX_BYTES >> 20} MiB, so it is no config."
            raise LutgenError(message)
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        message = f"{path}: cannot be read: {(error.strerror or str(error)).lower()}. Give the name of a config."
        raise LutgenError(message) from None
    found = re.search(r"^ocio_profile_version:\s*[\"']?([0-9]+)(?:\.([0-9]+))?", text, re.MULTILINE)
    version = (int(found[1][:6]), int((found[2] or "0")[:6])) if found else (0, 0)
    lib = ocio()
    lib.ClearAllCaches()
    broken: list[tuple[str, str]] = []
    config, refusal = None, ""
    with warnings_logged(lib) as warnings:
        try:
            config = lib.Config.CreateFromFile(str(path))
            config.validate()
        except ocio_errors() as error:
            refusal = " ".join(str(error).split())
        if config is not None:
            broken = _broken(config)
    return ConfigScan(path, text, version, config, refusal, tuple(dict.fromkeys(warnings)), tuple(broken))


def _broken(config: Any) -> list[tuple[str, str]]:
    endless = endless_file(config)
    if endless:
        return [("whatever reads it", f"{endless.name} opens its metadata and never closes them: no reader comes back")]
    works, fails = set(), {}
    try:
        for name, transform in all_parts(config):
            try:
                config.getProcessor(transform).getDefaultCPUProcessor()
                works.add(name)
            except ocio_errors() as error:
                fails[name] = " ".join(str(error).split())
    except LutgenError as error:
        fails["the whole"] = str(error)
    # A colour space that leads one way alone, as many for display do, is as it should be.
    return [(name, why) for name, why in fails.items() if name not in works]
