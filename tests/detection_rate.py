"""``python -m tests.detection_rate``: how often the whole rule finds an effect of the printed smallest detectable size.

``diagnose`` prints for every effect the size that nine of ten campaigns like this one would show. Here each effect of
the catalogue is put at this size into healthy displays of two generators, by lutgen's own chain, with seeded noise of
the readings' covariance. ``diagnose`` reads the result as any file: it estimates the noise again, and may name another
effect. The exit code is 1 if the share is outside ``GOAL`` by more than twice its standard error.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np
from scipy.stats import binomtest

from lutgen.criticism.diagnose import candidates, diagnose
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import Term
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.rehearse import with_readings_of
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.criticism.verdict.visibility import visibility
from tests.generators.meters import METERS
from tests.generators.scoring.questions import GOOD
from tests.generators.scoring.sources import SOURCES
from tests.generators.table import table
from tests.readings_text import read

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

#: Required range of the share.
GOAL = (0.85, 0.95)

GENERATORS = ("spectral", "virtual_display")

#: Verdicts that name no effect.
NAMELESS = ("consistent", "unexplained", "measurement-problem")


def healthy(seed: int, number: int) -> Measurements:
    """Return readings of a display without a hidden effect; generators and habits of writing take turns."""
    make = SOURCES[GENERATORS[number % len(GENERATORS)]].load().campaign
    truth, meter = make(1000 * seed + number, {}, design="full", habits=number), METERS[GOOD]
    return read(
        table(meter.stated(truth), meter.read(truth, seed), order=bool(number % 2)), file="healthy.csv", sha256=""
    )


def at_smallest_size(base: Fit, effects: Sequence[Effect]) -> Iterator[Term]:
    """Yield each effect that the readings can show at its smallest detectable size, if it has a continuous one."""
    hours = base.problem.hours
    gaps = (hours[1:] + hours[:-1]) / 2
    for effect, seen in zip(effects, visibility(base, effects), strict=True):
        name, size = seen.parameter, seen.smallest_detectable
        if not seen.visible or size is None or name not in effect.neutral or effect.parameters[name].grid:
            continue
        low, high = effect.parameters[name].bounds
        rest = effect.neutral[name]
        signed = rest + size * (1.0 if effect.parameters[name].value >= rest else -1.0)
        # An event between two sessions happens in the middle of the campaign.
        grids = {
            other: float(gaps[gaps.size // 2]) if isinstance(parameter.grid, str) else parameter.value
            for other, parameter in effect.parameters.items()
            if parameter.grid
        }
        if low <= signed <= high:
            yield Term.at_rest(effect, (), **(grids | {name: signed}))


def names_it(verdict: Verdict, name: str) -> bool:
    """Whether a verdict names an effect, alone or in a set."""
    named = {*verdict.effects, *(rival for group in verdict.rivals for rival in group)}
    return verdict.name not in NAMELESS and name in named


def trials(seed: int, number: int) -> Iterator[tuple[str, Verdict]]:
    """Yield each hidden effect and the verdict on its campaign, for one healthy display."""
    readings = healthy(seed, number)
    base = fit(with_shared_errors(Problem.of(readings)))
    for term in at_smallest_size(base, candidates(None, "colour-points", ())):
        rng = np.random.default_rng([seed, number, crc32(term.effect.name.encode())])
        yield term.effect.name, diagnose(with_readings_of(base, term, rng).readings).verdict


def report(by_effect: Mapping[str, Sequence[Verdict]]) -> tuple[str, bool]:
    """Return the table of shares, and whether the share over all effects agrees with ``GOAL``."""
    lines, hits, count = [], 0, 0
    for name, verdicts in sorted(by_effect.items()):
        right = sum(names_it(verdict, name) for verdict in verdicts)
        hits, count = hits + right, count + len(verdicts)
        wrong = [
            f"{verdict.name} {' '.join(verdict.effects)}".strip() for verdict in verdicts if not names_it(verdict, name)
        ]
        lines.append(f"{name:20} {right:3} of {len(verdicts):3}  {'; '.join(wrong)}".rstrip())
    interval = binomtest(hits, count).proportion_ci(method="wilson")
    share = hits / count
    lines.append(f"found: {hits} of {count} = {share:.3f} [{interval.low:.3f}, {interval.high:.3f}], goal {GOAL}")
    tolerance = 2.0 * float(np.sqrt(share * (1.0 - share) / count))
    return "\n".join(lines), GOAL[0] - tolerance <= share <= GOAL[1] + tolerance


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials and print the shares. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.detection_rate", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--displays", type=int, default=13, help="healthy displays; about sixteen effects in each")
    options = parser.parse_args(arguments)
    by_effect = defaultdict[str, list[Verdict]](list)
    for number in range(options.displays):
        for name, verdict in trials(options.seed, number):
            by_effect[name].append(verdict)
    text, is_right = report(by_effect)
    print(text)
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
