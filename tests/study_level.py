"""``python -m tests.study_level``: how often the mixed model finds an effect of a condition that has no effect.

Readers read the same images under three conditions that change nothing on average. Each reader reacts differently to
each condition: log seconds change by normal random numbers with the standard deviation ``--own``. The table contains
the share of studies with p < 0.05 for the first aged condition, for two models. The first model has random effects of
readers under a condition and Satterthwaite's degrees of freedom. The second model has neither and assumes that
estimates are normal. The exit code is 1 if the share of the first model is above 5 % by more than twice its standard
error.
"""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

from lutgen.study.mixed import fit_crossed, mixed_models
from lutgen.study.protocol import StudyTrial
from lutgen.study.simulated import PAPER_DIFFERENCES, SimulatedReader, simulate
from tests.studies import paper_trials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.answers import Answer

READERS = (3, 5, 8)
CONDITIONS = tuple(PAPER_DIFFERENCES)


def study(seed: int, readers: int, own: float, images: int) -> tuple[Answer, ...]:
    """Return the answers of a study where only the readers' individual reactions to the conditions differ."""
    trials = [
        StudyTrial(reader, trial.session, trial.position, trial.image, trial.condition)
        for reader in range(1, readers + 1)
        for trial in paper_trials(seed, per_condition=images)
    ]
    answers = simulate(trials, {}, SimulatedReader(seed=seed))
    names = sorted({answer.reader for answer in answers})
    ways = np.random.default_rng([seed, readers]).normal(0.0, own, (len(names), len(CONDITIONS)))
    return tuple(
        replace(
            answer,
            seconds=answer.seconds * math.exp(ways[names.index(answer.reader), CONDITIONS.index(answer.condition)]),
        )
        for answer in answers
    )


def ways_apart(answers: Sequence[Answer]) -> tuple[float, float]:
    """Return p of the first aged condition, with and without random effects of readers under a condition."""
    model = mixed_models(CONDITIONS, answers, ())[0]
    sessions = sorted({answer.session for answer in answers})
    columns = [[each.condition == name for each in answers] for name in CONDITIONS[1:]]
    columns += [[each.session == session for each in answers] for session in sessions[1:]]
    fixed = np.column_stack([np.ones(len(answers)), *np.array(columns, np.float64)])
    groups = {"readers": [each.reader for each in answers], "images": [each.image for each in answers]}
    plain = fit_crossed(np.log([each.seconds for each in answers]), fixed, groups)
    return model.effects[0].p, 2.0 * float(ndtr(-abs(plain.coefficients[1] / plain.errors[1])))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.study_level")
    parser.add_argument("--seed", type=int, required=True, help="of the first study; take one that was not used before")
    parser.add_argument("--studies", type=int, default=165, help="studies of each number of readers")
    parser.add_argument("--images", type=int, default=12, help="images a condition")
    parser.add_argument("--own", type=float, default=0.15, help="SD of log seconds of a reader under a condition")
    options = parser.parse_args(arguments)
    wrong = 0
    print("| readers | found by the model | without readers under a condition |\n|---|---|---|")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for readers in READERS:
            seeds = range(options.seed, options.seed + options.studies)
            p_values = np.array([ways_apart(study(seed, readers, options.own, options.images)) for seed in seeds])
            model, plain = (p_values < 0.05).mean(axis=0)
            wrong += model > 0.05 + 2.0 * math.sqrt(0.05 * 0.95 / options.studies)
            print(f"| {readers} | {model:.3f} | {plain:.3f} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
