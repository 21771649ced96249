"""What the page shows when it is given nothing: a simulated campaign with two hidden effects, and stained tissue."""

from __future__ import annotations

from pathlib import Path

from lutgen.errors import LutgenError


def example_readings() -> Path:
    """Path of the simulated campaign; its first line says that nobody measured it."""
    return _example("display-a.csv")


def tissue() -> Path:
    """Path of the picture of tissue: scikit-image's ``immunohistochemistry()``, 512 × 512."""
    return _example("tissue.jpg")


def _example(name: str) -> Path:
    """Find a file in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "examples", package.parent / "examples"):
        if (folder / name).is_file():
            return folder / name
    raise LutgenError(f"the example {name} is missing here. Reinstall lutgen, or give DATA and --image.")
