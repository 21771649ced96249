"""``python -m tests.virtual_sessions``: how often ``lutgen sessions explain`` is right on simulated pairs of sessions.

A pair is right when the verdict names its cause, *alone* or *among rivals*; for ``same`` the verdict must be "same".
*Wrong* is a confident name of another cause; *unclear* is no name at all. The exit code is 1 when more than
``--most-wrong`` of the pairs are wrong.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from scipy.stats import binomtest

from lutgen.history.explain import explain
from lutgen.readings import read_campaign
from tests.virtual_sessions.campaigns import write
from tests.virtual_sessions.causes import SIZES, case

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.history.verdicts import SessionVerdict

OUTCOMES = ("alone", "among rivals", "unclear", "wrong")


def outcome(cause: str, size: float, seed: int) -> str:
    """Return one of ``OUTCOMES`` for one simulated pair."""
    sessions = case(cause, size, seed)
    with TemporaryDirectory() as folder:
        path = write(Path(folder), [sessions.before, sessions.after], [0, sessions.days])
        (verdict,) = explain(read_campaign(path), reference="0.txt").verdicts
    return judged(verdict, sessions.label)


def judged(verdict: SessionVerdict, label: str) -> str:
    """Compare a verdict with the simulated cause."""
    names = verdict.names if verdict.kind != "same" else ("same",)
    if not names:
        return "unclear"
    if label not in names:
        return "wrong"
    return "alone" if len(names) == 1 else "among rivals"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.virtual_sessions")
    parser.add_argument("--seed", type=int, required=True, help="the first; take one that was not used before")
    parser.add_argument("--repeats", type=int, default=12, help="pairs of each cause and size")
    parser.add_argument("--most-wrong", type=float, default=0.02, help="share of pairs")
    options = parser.parse_args(arguments)
    seeds = range(options.seed, options.seed + options.repeats)
    total: Counter[str] = Counter()
    print(f"| cause | size | {' | '.join(OUTCOMES)} |\n|---|---|{'---|' * len(OUTCOMES)}")
    for cause, sizes in SIZES.items():
        for size in sizes:
            counts = Counter(outcome(cause, size, seed) for seed in seeds)
            total += counts
            print(f"| {cause} | {size:g} | {' | '.join(str(counts[name]) for name in OUTCOMES)} |", flush=True)
    wrong = binomtest(total["wrong"], total.total()).proportion_ci(method="wilson")
    print(f"| all | | {' | '.join(str(total[name]) for name in OUTCOMES)} |")
    print(f"\nWrong: {total['wrong']} of {total.total()}, 95 % [{wrong.low:.3f}, {wrong.high:.3f}].")
    return int(total["wrong"] > options.most_wrong * total.total())


if __name__ == "__main__":
    sys.exit(main())
