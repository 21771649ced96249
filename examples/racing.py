"""How two ways to the same result are timed against one another, and a figure against its limit.

Contestants take turns; ratios are formed turn by turn. Used by ``bench``, which prints the table.
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

#: Programs run as they are installed: Python keeps what it has compiled, whatever the caller's shell says.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def processor_seconds() -> float:
    """Seconds that processors have worked for this process and for its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


@dataclass
class Clock:
    """What a race is timed by: the clock on the wall, unless a busy machine asks for ``processor_seconds``."""

    read: Callable[[], float] = time.perf_counter


CLOCK = Clock()


@dataclass(frozen=True)
class Row:
    """One line of the table; ``lutgen`` and ``peer`` in ``unit``, None where the peer is missing."""

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
        """Whether the goal is met; nothing where there is none, or no peer."""
        if self.goal is None:
            return ""
        return "no peer" if self.ratio is None else "yes" if self.ratio >= self.goal else "NO"


@dataclass(frozen=True)
class Peer:
    """Somebody else's way to the same result.

    ``run`` does 1/``scale`` of the work, and is None where it is not installed.
    """

    name: str
    run: Callable[[], object] | None
    goal: float | None = None
    scale: float = 1.0


def race(what: str, mine: Callable[[], object], *peers: Peer, times: int, scratch: Path | None = None) -> list[Row]:
    """Time ``mine`` and every peer in turn, ``times`` times after a warm-up each.

    The files in ``scratch`` are removed before each run: writing over an old file makes some file systems wait.
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
    """Run once; the files in ``scratch`` are removed before."""
    for old in scratch.iterdir() if scratch else ():
        old.unlink()
    start = CLOCK.read()
    run()
    return CLOCK.read() - start


def against_limit(what: str, figures: list[float], limit: float, unit: str) -> Row:
    """A figure rather than a race: the ratio is how many times it fits into its limit."""
    if not all(figures):
        return Row(what, "the limit: Linux's /proc is not here", 0.0, goal=1.0, unit=unit)
    ratios = [limit / figure for figure in figures]
    return Row(what, "the limit", median(figures), limit, median(ratios), min(ratios), max(ratios), 1.0, unit)


def program(name: str) -> str | None:
    """Find a program of OpenColorIO or OpenImageIO: the one that came with this Python's bindings, else the system's.

    The wheels bring programs of their own version; Debian's belong to Debian's bindings.
    """
    beside = str(Path(sys.executable).parent)
    return shutil.which(name, path=beside) or shutil.which(name)


def run(command: list[str]) -> None:
    """Run a program to its end; what it says is only shown when it fails."""
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=600)
    if done.returncode:
        raise SystemExit(f"bench: {' '.join(command)} failed:\n{done.stderr}")


def peak_memory(command: list[str], folder: Path) -> float:
    """Largest sum of the proportional set sizes of a program and its children, in MB, looked at every 10 ms."""
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
    """Give a list whose only number, at the end of the block, is the peak of :func:`memory` inside it."""
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
    """Sum of the proportional set sizes of a process and its children, in MB."""
    return sum(map(_pss_mb, _family(pid)))


def processor_time(pid: int) -> float:
    """Seconds for which the threads of a process and its children have run; 0 without Linux's /proc."""
    return sum(map(_ran_ns, _family(pid))) * 1e-9


def _ran_ns(pid: int) -> int:
    found = 0
    for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        with suppress(OSError):
            found += int(thread.read_text().split()[0])
    return found


def _family(pid: int) -> list[int]:
    found = [pid]
    for parent in found:
        try:
            found += map(int, Path(f"/proc/{parent}/task/{parent}/children").read_text().split())
        except OSError:
            continue
    return found


def _pss_mb(pid: int) -> float:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) * 1024e-6 for line in lines if line.startswith("Pss:"))
