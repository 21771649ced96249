"""A CSV of readings that is a string in a test, not a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.readings.formats import csv
from lutgen.readings.formats._source import FileText

if TYPE_CHECKING:
    from lutgen.readings import Measurements


def read(text: str, *, file: str, sha256: str) -> Measurements:
    """Return the readings in the CSV ``text``; error messages name ``file``."""
    return csv.read(FileText(text, file, sha256)).measurements()
