"""Time two ways to the same result against each other, or a figure against its limit.

The contestants run in turn; each turn gives a ratio. ``bench`` uses this module and prints the table.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from threading import Event, Thread
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LUTGEN = (sys.executable, "-m", "lutgen")

#: Programs run as installed: Python keeps compiled files, independent of the caller's shell.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def processor_seconds() -> float:
    """Return the processor seconds of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


@dataclass
class Clock:
    """The clock of a race: the wall clock, or ``processor_seconds`` for a busy machine."""

    read: Callable[[], float] = time.perf_counter


CLOCK = Clock()


@dataclass(frozen=True)
class Row:
    """One line of the table; ``lutgen`` and ``peer`` in ``unit``, None if the peer is missing."""

    what: str
    peer_name: str
    lutgen: float
    peer: float | None = None
    ratio: float | None = None
    low: float | None = None
    high: float | None = None
    goal: float | None = None
    unit: str = "s"

    @property
    def met(self) -> str:
        """Return whether the goal is met; empty if there is no goal or no peer."""
        if self.goal is None:
            return ""
        return "no peer" if self.ratio is None else "yes" if self.ratio >= self.goal else "NO"


@dataclass(frozen=True)
class Peer:
    """Another program's way to the same result.

    ``run`` does 1/``scale`` of the work, and is None if the program is not installed.
    """

    name: str
    run: Callable[[], object] | None
    goal: float | None = None
    scale: float = 1.0


def race(what: str, mine: Callable[[], object], *peers: Peer, times: int, scratch: Path | None = None) -> list[Row]:
    """Time ``mine`` and every peer in turn, ``times`` times after a warm-up each.

    The files in ``scratch`` are removed before each run: on some file systems, overwriting an old file blocks.
    """
    present = [peer for peer in peers if peer.run]
    runs = [mine, *(peer.run for peer in present if peer.run)]
    if times > 1:
        for run in runs:
            run()
    seconds = np.array([[seconds_of(run, scratch) for run in runs] for _ in range(times)])
    own = seconds[:, 0]
    rows = []
    for peer in peers:
        if peer not in present:
            rows.append(Row(what, f"{peer.name}: not here", median(own), goal=peer.goal))
            continue
        theirs = seconds[:, 1 + present.index(peer)] * peer.scale
        ratios = theirs / own
        low, high = float(ratios.min()), float(ratios.max())
        rows.append(Row(what, peer.name, median(own), median(theirs), median(ratios), low, high, peer.goal))
    return rows


def seconds_of(run: Callable[[], object], scratch: Path | None = None) -> float:
    """Run once and return the seconds; first remove the files in ``scratch``."""
    for old in scratch.iterdir() if scratch else ():
        old.unlink()
    start = CLOCK.read()
    run()
    return CLOCK.read() - start


def against_limit(what: str, figures: list[float], limit: float, unit: str) -> Row:
    """Return a row for a figure instead of a race: the ratio is the limit divided by the figure."""
    if not all(figures):
        return Row(what, "the limit: Linux's /proc is not here", 0.0, goal=1.0, unit=unit)
    ratios = [limit / figure for figure in figures]
    return Row(what, "the limit", median(figures), limit, median(ratios), min(ratios), max(ratios), 1.0, unit)


def program(name: str) -> str | None:
    """Find a program of OpenColorIO or OpenImageIO: the program of this Python's bindings, or else the system's.

    The wheels contain programs of their own version; Debian's programs belong to Debian's bindings.
    """
    beside = str(Path(sys.executable).parent)
    return shutil.which(name, path=beside) or shutil.which(name)


def run(command: list[str]) -> None:
    """Run a program to its end; show its output only if it fails."""
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=600)
    if done.returncode:
        raise SystemExit(f"bench: {' '.join(command)} failed:\n{done.stderr}")


def peak_memory(command: list[str], folder: Path) -> float:
    """Return the maximum of the summed proportional set sizes of a program and its children, in MB.

    The sizes are read every 10 ms.
    """
    peak = 0.0
    with (
        (folder / "out.txt").open("w") as out,
        subprocess.Popen(command, env=ENVIRONMENT, stdout=out, stderr=out) as program,
    ):
        while program.poll() is None:
            peak = max(peak, memory(program.pid))
            time.sleep(0.01)
    return peak


@contextmanager
def watched(pid: int) -> Iterator[list[float]]:
    """Yield a list; at the end of the block its only number is the peak of :func:`memory` inside the block."""
    peak, done = [0.0], Event()

    def watch() -> None:
        while not done.wait(0.01):
            peak[0] = max(peak[0], memory(pid))

    watching = Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield peak
    finally:
        done.set()
        watching.join()


def memory(pid: int) -> float:
    """Return the sum of the proportional set sizes of a process and its children, in MB."""
    return sum(map(_pss_mb, _family(pid)))


def processor_time(pid: int) -> float:
    """Return the seconds for which the threads of a process and its children have run; 0 without Linux's /proc."""
    return sum(map(_ran_ns, _family(pid))) * 1e-9


def _ran_ns(pid: int) -> int:
    waited = 0
    for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        with suppress(OSError):
            waited += int(thread.read_text().split()[0])
    return waited


def _family(pid: int) -> list[int]:
    pids = [pid]
    for parent in pids:
        try:
            pids += map(int, Path(f"/proc/{parent}/task/{parent}/children").read_text().split())
        except OSError:
            continue
    return pids


def _pss_mb(pid: int) -> float:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) * 1024e-6 for line in lines if line.startswith("Pss:"))
