"""A CSV of readings that is text in a test, not a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.readings.formats import csv
from lutgen.readings.formats._source import FileText

if TYPE_CHECKING:
    from lutgen.readings import Measurements


def read(text: str, *, file: str, sha256: str) -> Measurements:
    """The table of readings that CSV ``text`` holds; ``file`` is named in errors."""
    return csv.read(FileText(text, file, sha256)).measurements()
