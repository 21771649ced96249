"""``make consumers``: a table of how real programs render our files, against the direct model, in 8-bit codes."""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path

# colour-science warns at import of optional packages that nothing here needs.
warnings.filterwarnings("ignore", module="colour")

from tests.consumers import Consumer, Unavailable, consumers  # noqa: E402 - after the filter
from tests.consumers._gallery import CASES, GATES, Case, Gallery  # noqa: E402

COLUMNS = "{:<37} {:<18} {:<18} {:<12} {:<10} {:<12} {:>6} {:>7} {:>7} {:>7}  {}"
HEAD = ("consumer", "version", "file", "interpolates", "selection", "mode", "hours", "mean", "99 %", "max", "gate")


def main() -> int:
    """Print the table. Returns 1 when a gate does not hold."""
    with tempfile.TemporaryDirectory(prefix="lutgen-consumers-") as folder:
        gallery = Gallery(Path(folder))
        print(COLUMNS.format(*HEAD))
        held = [row(gallery, consumer, case) for consumer in consumers() for case in CASES]
    gates = ", ".join(f"{limit:g} where {interpolation}" for interpolation, limit in GATES.items())
    print(f"Errors in 8-bit codes, over all pixels and channels. Gate: 99 % of them at most {gates}.")
    return 0 if all(held) else 1


def row(gallery: Gallery, consumer: Consumer, case: Case) -> bool:
    """Print one row; what cannot be had fails no gate."""
    try:
        error = gallery.errors(gallery.render(consumer, case), case)
    except Unavailable as reason:
        if case == CASES[0]:
            print(f"{consumer.name:<37} not tested: {reason}")
        return True
    passes = error.passes(consumer.interpolation)
    numbers = (f"{value:.4f}" for value in (error.mean, error.p99, error.max))
    about = (consumer.name, consumer.version(), consumer.file, consumer.interpolation)
    print(COLUMNS.format(*about, case.selection, case.mode, f"{case.hours:g}", *numbers, "ok" if passes else "FAILS"))
    return passes


if __name__ == "__main__":
    sys.exit(main())
