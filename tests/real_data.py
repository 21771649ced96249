"""Real sessions and fields, which are not published here; ``LUTGEN_REAL_DATA`` names their folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

#: For tests of code that reads the folder itself.
needs_sessions = pytest.mark.skipif(
    "LUTGEN_REAL_DATA" not in os.environ, reason="LUTGEN_REAL_DATA is not set: the real sessions are not published here"
)


def real_data() -> Path:
    """Return the folder, or skip the test."""
    folder = os.environ.get("LUTGEN_REAL_DATA")
    if not folder:
        pytest.skip("LUTGEN_REAL_DATA does not name the folder of shared measurements")
    return Path(folder)
