"""``python -m tests.trend_coverage``: how often the 90 % interval of a limit's time contains the true time.

Four decays are known exactly, and none uses lutgen's laws: an exponential; a stretched exponential near the one that
fits the paper's 67 and 40 %; the line through the paper's two luminances; a loss of a few percent that settles,
followed by an exponential. Spans are 5000 to 11 000 h, limits 50 to 75 % of the first luminance, and sessions scatter
by 0.5 to 1.5 %. The limit lies beyond the last session. The exit code is 1 if a share is outside ``GOAL`` by more than
twice its standard error.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.decay import decay_of
from lutgen.history.trend import DRAWS, HORIZON, INTERVAL, first_beyond, shortest

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SESSIONS = (5, 8, 12)

#: Required range of the share.
GOAL = (0.87, 0.93)

#: Resolution of hours as a share of the span.
_FINE = 1000


def truths(rng: np.random.Generator) -> dict[str, Callable[[Array], Array]]:
    """Return relative luminance as a function of hours, for one draw of the parameters of each decay."""
    tau, stretched, beta = rng.uniform(15e3, 30e3), rng.uniform(15e3, 25e3), rng.uniform(1.2, 1.6)
    slope = 3.3e-5 * rng.uniform(0.8, 1.2)
    settling, settled = rng.uniform(0.02, 0.08), rng.uniform(300.0, 1500.0)
    return {
        "exponential": lambda hours: np.exp(-hours / tau),
        "stretched": lambda hours: np.exp(-((hours / stretched) ** beta)),
        "the paper's line": lambda hours: 1.0 - slope * hours,
        "settling, then decay": lambda hours: (
            (np.exp(-hours / tau) + settling * np.exp(-hours / settled)) / (1.0 + settling)
        ),
    }


def held(name: str, sessions: int, seed: Sequence[int]) -> tuple[bool, bool]:
    """Return whether the true time lies before the interval of one simulated history, and whether it lies after it."""
    rng = np.random.default_rng([*seed, sessions])
    time, span, limit, light = _ahead(name, rng)
    at = np.linspace(0.0, span, sessions)
    figures = 250.0 * light(at) * (1.0 + rng.uniform(0.005, 0.015) * rng.standard_normal(sessions))
    ahead = np.linspace(0.0, 1.0 + HORIZON, _FINE + 1)
    curves = decay_of(at / span, figures, 0.01 * figures, ahead, draws=DRAWS, seed=[270]).curves
    times = span * first_beyond(curves, limit * curves[:, :1], ahead, above=True)
    low, high = shortest(times, INTERVAL, span * float(ahead[-1]))
    return bool(time < low), bool(time > high)


def _ahead(name: str, rng: np.random.Generator) -> tuple[float, float, float, Callable[[Array], Array]]:
    """Draw a decay, a span and a limit until the limit lies beyond the span; return its true time and the draw."""
    while True:
        light, span, limit = truths(rng)[name], rng.uniform(5e3, 11e3), rng.uniform(0.5, 0.75)
        hours = np.linspace(0.0, (1.0 + HORIZON) * span, 6001)
        beyond = light(hours) < limit
        time = float(hours[np.argmax(beyond)])
        if beyond.any() and time > 1.05 * span:
            return time, span, limit, light


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.trend_coverage")
    parser.add_argument("--seed", type=int, required=True, help="the first; take one that was not used before")
    parser.add_argument("--repeats", type=int, default=400, help="histories of each decay and number of sessions")
    options = parser.parse_args(arguments)
    wrong = 0
    print("| decay | sessions | held | too late | too early |\n|---|---|---|---|---|")
    for name in truths(np.random.default_rng(0)):
        for sessions in SESSIONS:
            missed = np.array([held(name, sessions, (options.seed, n)) for n in range(options.repeats)]).mean(axis=0)
            share = 1.0 - float(missed.sum())
            slack = 2.0 * float(np.sqrt(share * (1.0 - share) / options.repeats))
            wrong += not GOAL[0] - slack <= share <= GOAL[1] + slack
            print(f"| {name} | {sessions} | {share:.3f} | {missed[0]:.3f} | {missed[1]:.3f} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
