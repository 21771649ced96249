"""Make examples/campaign/, eight small sessions of one display over four years. Simulated, not measured.

    python -m examples.make_campaign            write it
    python -m examples.make_campaign --check    compare it with the output; exit 1 if it differs

The display is one of ``tests/virtual_sessions``, an independent simulator that shares nothing with lutgen. The
display ages: light decays exponentially, blue fastest. In one session the brightness is set lower; in another
session the room is lit.
"""

from __future__ import annotations

import argparse
import sys
from datetime import date
from pathlib import Path

import numpy as np

from examples.make_session import alike
from tests.virtual_sessions.display import State, chart, panel, read, ti3_text

FOLDER = Path(__file__).parent / "campaign"

#: Year and month of each session, and its deviations from the usual state.
SESSIONS: tuple[tuple[int, int, dict[str, object]], ...] = (
    (2021, 1, {}),
    (2021, 6, {}),
    (2022, 1, {"brightness": 0.7}),
    (2022, 6, {}),
    (2023, 1, {}),
    (2023, 6, {"ambient": np.array([0.57, 0.6, 0.5])}),
    (2024, 2, {}),
    (2024, 12, {}),
)

#: Hours of operation per day, and hours in which red, green and blue fall to 1/e.
HOURS_PER_DAY, LIFE = 10.0, np.array([60_000.0, 55_000.0, 40_000.0])

SEED = 5


def files() -> dict[str, str]:
    """Return name → text of every file, the same on every run."""
    rng = np.random.default_rng(SEED)
    display, code = panel(rng), chart(steps=6, mixed=3)
    start = date(SESSIONS[0][0], SESSIONS[0][1], 15)
    texts, lines = {}, [_HEAD]
    for year, month, unusual in SESSIONS:
        day = date(year, month, 15)
        aged = np.exp(-(day - start).days * HOURS_PER_DAY / LIFE)
        state = State(**{"aged": aged, **unusual})  # type: ignore[arg-type]
        xyz = read(display, state, code, rng, noise=0.001, floor=0.002)
        texts[f"{day:%Y-%m}.ti3"] = ti3_text(code, xyz, f"{day:%a %b %d} 10:12:00 {year}")
        lines += ["[[sessions]]", f'file = "{day:%Y-%m}.ti3"', f"date = {day}", ""]
    return {"campaign.toml": "\n".join(lines), **texts}


_HEAD = f"""# SIMULATED, not measured: tests/virtual_sessions of lutgen, written by examples/make_campaign.py
schema = 1

[display]
name = "simulated LCD"
hours_per_day = {HOURS_PER_DAY}
"""


def main() -> int:
    """Write, or compare. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m examples.make_campaign", description="Make a simulated campaign.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a file differs")
    check = parser.parse_args().check
    FOLDER.mkdir(exist_ok=True)
    for name, text in files().items():
        path = FOLDER / name
        if not check:
            path.write_text(text, encoding="utf-8")
        elif not path.is_file() or not alike(path.read_text(encoding="utf-8"), text):
            print(f"{path}: differs from what python -m examples.make_campaign writes")
            return 1
    print(f"{FOLDER}: {len(SESSIONS)} sessions{' as they should be' if check else ''}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
