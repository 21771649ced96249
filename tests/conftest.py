"""What all tests share."""

from __future__ import annotations

import os

from hypothesis import settings

from lutgen.bindings import ocio, oiio

# As the command itself: one thread of BLAS, whose last bits depend on their number. numpy is not loaded yet.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A busy machine is no fault of the code, and a failure here must be the same failure elsewhere.
settings.register_profile("lutgen", deadline=None, derandomize=True)
settings.load_profile("lutgen")


def pytest_report_header() -> str:
    """Say which bindings are under test."""
    return f"OpenColorIO {ocio().__version__} from {ocio().__file__}, OpenImageIO {oiio().VERSION_STRING}"
