"""Make the two data sets of the walk-through, each of a display with hidden effects. Simulated, not measured.

    python -m examples.make_displays            write examples/display-a.csv and display-b.csv
    python -m examples.make_displays --check    compare them with the output; exit 1 if they differ

The displays are those of ``tests/virtual_display``, an independent spectral simulator that shares nothing with
lutgen. Stop reading here to find the hidden effects on your own.

Display A is an LCD lit by white LEDs whose black leaks light: 0.06 % of white when new and three times as much at
the end, in a form that lutgen's catalogue does not have (light of closed sub-pixels alone, violet, growing in an
S-curve). Its mid-tones drift too: the exponent of its transfer curve changes by 0.15 in 18 000 h. Display B is a TN
panel seen from above and below: its exponent changes by 0.15 from the middle of the screen to either edge, which
lutgen's catalogue does not have. Sizes are assumptions, near those that the catalogue names as typical.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.virtual_display.campaign import Campaign, csv_text

FOLDER = Path(__file__).parent

#: The first display of the simulator.
SEED = 1

#: The sessions at 1700 and 5200 h, where the simulator's full design reads no tips, keep the tables short.
DISPLAYS = {
    "display-a.csv": Campaign(
        display="white LED LCD",
        hours=(0.0, 1700.0, 5200.0, 11_500.0, 18_000.0),
        hidden=(("black-level", 0.0006, "other"), ("eotf-drift", 0.15, "same")),
        seed=SEED,
    ),
    "display-b.csv": Campaign(
        display="CCFL LCD",
        hours=(0.0, 1000.0, 1700.0, 5200.0, 11_500.0, 18_000.0),
        hidden=(("viewing-gamma", 0.15, "outside"),),
        seed=SEED,
    ),
}


def main() -> int:
    """Write, or compare. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m examples.make_displays", description="Make simulated displays.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a file differs")
    check = parser.parse_args().check
    differing = 0
    for name, campaign in DISPLAYS.items():
        path, text = FOLDER / name, csv_text(campaign)
        if not check:
            path.write_text(text, encoding="utf-8")
            print(f"{path}: {len(text.splitlines())} lines")
        elif not path.is_file() or not same(path.read_text(encoding="utf-8"), text):
            differing += 1
            print(f"{path}: differs from what python -m examples.make_displays writes")
    return 1 if differing else 0


def same(one: str, other: str) -> bool:
    """Return whether two tables are equal except for the last of six digits: platforms differ in rounding."""
    lines = list(zip(one.splitlines(), other.splitlines(), strict=False))
    cells = [pair for mine, theirs in lines for pair in zip(mine.split(","), theirs.split(","), strict=False)]
    alike = one.count("\n") == other.count("\n") and one.count(",") == other.count(",")
    return alike and all(mine == theirs or _near(mine, theirs) for mine, theirs in cells)


def _near(one: str, other: str) -> bool:
    try:
        return abs(float(one) - float(other)) <= 2e-5 * abs(float(one))
    except ValueError:
        return False


if __name__ == "__main__":
    sys.exit(main())
