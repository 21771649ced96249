"""``python -m tests.virtual_display``: make sealed data sets, diagnose them with lutgen, print the figures and gates.

``--quick`` is the seeded part that CI runs. It exits with 1 when a gate is clearly missed, that is, when the whole 95 %
interval lies on the wrong side of the gate. Without ``--quick``, the exit code is 1 when a figure for the good
instrument misses its gate.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import lutgen
from tests.virtual_display.figures import Scored, confusion, failures, results, table
from tests.virtual_display.instrument import NOISE
from tests.virtual_display.score import ask_lutgen, score
from tests.virtual_display.sealed import KINDS, make

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.virtual_display.score import Ask

RESULTS = Path(__file__).with_name("RESULTS.md")

#: CI: few sets of each kind, most of them of kinds with a short diagnosis, so that the run takes less than a minute.
QUICK_SEED = 20_150_318
QUICK = {
    "null": 6,
    "hard-null": 4,
    "same-form": 4,
    "other-form": 4,
    "pair": 1,
    "outside": 3,
    "blind": 4,
    "broken": 4,
}


#: Healthy displays need this multiple of ``--per-kind``: false alarms are rare, and a healthy display is diagnosed
#: quickly.
OFTENER = {"null": 3, "hard-null": 2}


def main(arguments: Sequence[str] | None = None, ask: Ask = ask_lutgen) -> int:
    """Run the scoring. Return the exit code."""
    options = _options(arguments)
    levels = ["good"] if options.quick else options.noise.split(",")
    seed = QUICK_SEED if options.quick else options.seed
    kinds = options.kinds.split(",")
    counts = QUICK if options.quick else {kind: options.per_kind * OFTENER.get(kind, 1) for kind in kinds}
    with TemporaryDirectory() as scratch:
        folder = options.folder or Path(scratch)
        for noise in levels:
            make(folder, seed=seed, counts=counts, noise=noise, design=options.design)
        scored = score(folder, ask, workers=options.workers)
    report = _report(scored, levels)
    print(report)
    if options.write:
        command = "python -m tests.virtual_display " + shlex.join(sys.argv[1:] if arguments is None else arguments)
        RESULTS.write_text(_birth(command, seed) + report + "\n", encoding="utf-8")
    good = results([one for one in scored if one.answer["noise"] == "good"])
    missed = [one for one in good if (one.clearly_missed if options.quick else not one.met)]
    return 1 if missed else 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.virtual_display", description=__doc__)
    parser.add_argument("--seed", type=int, default=1, help="tune on other seeds than you score with")
    parser.add_argument(
        "--per-kind", type=int, default=40, metavar="N", help="data sets of each kind and noise; 3 N healthy ones"
    )
    parser.add_argument("--noise", default=",".join(NOISE), help=f"of {', '.join(NOISE)}")
    parser.add_argument("--kinds", default=",".join(KINDS), help=f"of {', '.join(KINDS)}")
    parser.add_argument("--design", default="full", help="measurement design of all but the blind sets")
    parser.add_argument("--folder", type=Path, help="keep the data sets and answers here")
    parser.add_argument("--workers", type=int, default=2, help="processes; 0: this one")
    parser.add_argument("--quick", action="store_true", help="a few seeded sets; fails when a gate is clearly missed")
    parser.add_argument("--write", action="store_true", help=f"write {RESULTS.name}")
    return parser.parse_args(arguments)


def _report(scored: Sequence[Scored], levels: list[str]) -> str:
    seconds = sorted(one.reply.seconds for one in scored)
    parts = [
        "## Figures against gates\n",
        table(scored),
        "\nShares with Wilson's 95 % interval; medians with their 10 % and 90 % points.",
        "× is the smallest detectable size, a noise-whitened strength of 6.5.",
        f"\nTime of a diagnosis: median {seconds[len(seconds) // 2]:.1f} s, longest {seconds[-1]:.1f} s.",
    ]
    for noise in levels:
        parts += [f"\n## Truth and reply, {noise} instrument\n", confusion(scored, noise=noise)]
    return "\n".join([*parts, "\n## Not answered honestly\n", failures(scored)])


def _birth(command: str, seed: int) -> str:
    return (
        "# Hidden effects, found or not\n\n"
        f"lutgen {lutgen.__version__}, seed {seed}. Made by `{command}`; do not edit.\n\n"
    )


if __name__ == "__main__":
    sys.exit(main())
