"""Compare the own models of real sessions with sRGB's curves and with the slow reference.

``python -m tests.own_model_table FILE...`` prints the held-out mean ΔE2000 on mixtures of each session, with five folds
by patch, the same folds for all three models. The exit code is 1 if the own model is worse than sRGB's curves, or worse
than the reference by more than the factor ``NEAR``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.display.own_model import Sample, fit_own_model
from lutgen.readings import read_session
from tests.own_model_twin import on_mixtures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.readings.session import Session

#: Largest allowed ratio of the own model's error to that of the slow reference.
NEAR = 1.1


def sample_of(read: Session) -> Sample:
    """Return the readings nearest to the middle of the screen."""
    here = read.central
    return Sample.of(
        read.drive[here], read.xyz[here], lines=read.lines[here], file=read.file, calibration=read.calibration
    )


def main(files: Sequence[str]) -> int:
    """Print the table. Return the exit code."""
    wrong = 0
    print("| session | readings | sRGB's curves | own model | reference | own ÷ reference |\n|---|---|---|---|---|---|")
    for file in files:
        session = read_session(file)
        model, reference = fit_own_model(sample_of(session)), on_mixtures(session)
        srgb, ratio = model.rungs[0].error, model.error / reference
        wrong += model.error > srgb or ratio > NEAR
        figures = f"{srgb:.3f} | {model.error:.3f} | {reference:.3f} | {ratio:.2f}"
        print(f"| {Path(file).stem} | {len(session.drive)} | {figures} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
