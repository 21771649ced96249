"""Shared code of the claims about several programs: files that are made once, and common checks."""

import subprocess
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay, DisplayModel, default_display
from lutgen.lint import lint
from lutgen.lint.finding import Linted, Trial
from lutgen.lint.programs import Program
from lutgen.readings import read_measurements
from tests.consumers import TIMEOUT, Claim, Unavailable
from tests.lint_cases import BAD, GOOD, PLAIN

#: Rendering intents by their numbers: perceptual, relative, saturation, absolute.
INTENTS = (0, 1, 2, 3)


@cache
def aged() -> AgedDisplay:
    """The display whose profiles are tested."""
    return DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma-luma", 18_000)


@cache
def profile(name: str) -> bytes:
    """The display's ``icc``, ``icc-matrix`` or ``devicelink``."""
    form = format_named(name)
    return form.write(form.bake(Sampler(), aged(), 33)[0], Provenance("Aged display", "lutgen", ("lutgen: invented",)))


def profile_in(folder: Path, name: str) -> Path:
    path = folder / format_named(name).file
    path.write_bytes(profile(name))
    return path


@cache
def colours() -> Array:
    """Code values for the tests, shape (n, 3): the corners, and random values."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    return np.concatenate([corners, np.random.default_rng(21).random((40, 3))])


def converted(tool: str, *options: str | Path, code: Array) -> Array:
    """Return the output of a program that converts numbers; shape (n, 3)."""
    lines = "".join(" ".join(f"{value:.6f}" for value in row) + "\n" for row in code)
    done = subprocess.run([tool, *options], input=lines, capture_output=True, text=True, check=True, timeout=TIMEOUT)
    rows = [line.split("-> ")[-1].partition("[")[0].split() for line in done.stdout.splitlines()]
    return np.array([row for row in rows if len(row) == 3 and row[0].lstrip("-")[0].isdigit()], dtype=float)


def beyond(what: str, shown: Array, meant: Array, limit: float) -> Iterator[str]:
    """Yield a line if the output differs from the expected values by the limit or more, or is NaN."""
    if shown.shape != meant.shape:
        yield f"{what}: {len(shown)} answers to {len(meant)} questions"
    elif not (error := float(np.abs(shown - meant).max())) < limit:
        yield f"{what}: {error:.2g} off, and {limit:g} is allowed"


def unlike(name: str, outcome: str, statement: str) -> Iterator[str]:
    """Yield a line if the outcome of a case differs from lint's statement."""
    if outcome != statement:
        yield f"{name}: {outcome}, and lint says: {statement}"


def cubes(program: Program) -> Claim:
    """Claim that a reader treats every form of ``.cube`` as lint says."""
    reader = program.reader()

    def version() -> str:
        trial = _trial(next(iter(tried().values())), reader)
        if not trial.version:
            raise Unavailable(trial.message)
        return trial.version

    def differences(_folder: Path) -> Iterator[str]:
        for name, report in tried().items():
            if (trial := _trial(report, reader)) in report.disagreements():
                yield from unlike(name, trial.outcome, report.fate(reader)[0].outcome)

    return Claim(
        reader, version, f"reads {len(GOOD) + len(BAD)} forms of .cube, and mutations, as lint says", differences
    )


@cache
def tried() -> dict[str, Linted]:
    """Return each form of ``.cube``, and those of 60 mutations that lint calls clean; all readers get these files."""
    reports = {}
    with tempfile.TemporaryDirectory(prefix="cubes-") as folder:
        path = Path(folder, "lut.cube")
        for name, data in [*GOOD.items(), *((name, data) for name, (_, data) in BAD.items())]:
            path.write_bytes(data)
            reports[name] = lint(path, ask_readers=True)
        for seed in range(60):
            path.write_bytes(mutation(seed))
            if lint(path).clean:
                reports[f"mutation {seed}"] = lint(path, ask_readers=True)
    return reports


def mutation(seed: int) -> bytes:
    """Return the plain form with a few bytes replaced."""
    rng = np.random.default_rng(seed)
    data = bytearray(PLAIN)
    for place in rng.integers(0, len(data), rng.integers(1, 4)):
        data[place : place + rng.integers(0, 3)] = bytes(
            rng.choice([*b"0123456789 .-#\n"], rng.integers(0, 3)).tolist()
        )
    return bytes(data)


def _trial(report: Linted, reader: str) -> Trial:
    return next(trial for trial in report.trials if trial.reader == reader)
