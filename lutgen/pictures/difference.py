"""By how much aged displays change colours: ΔE2000 between what they show and what the un-aged display shows.

Both pictures are seen on the same un-aged sRGB display, as ``lutgen apply`` shows the aged one: the aged light is
clipped to that display's gamut, and not rounded to 8 bits. Lab is taken under that display's white, D65 with Y = 1, for
both, since the paper's observer is not adapted to the aged white.

The un-aged display is the mode ``stable``, under the same conditions: a leak or a room light that was there from the
first hour is no aging. With the paper's model and the reference ``relative`` it shows the picture as it is.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import CHUNK, delta_e_2000, linear_to_lab, xyz_to_linear

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay
    from lutgen.display.chain import Link

#: Threads that the work in hand may use; 0: one a core.
_FEW = ContextVar("lutgen_threads", default=0)


def differences(
    code: Callable[[slice], Array],
    size: int,
    unaged: AgedDisplay,
    aged: Sequence[AgedDisplay],
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Array:
    """ΔE2000 of ``size`` colours on each aged display, against the un-aged one: shape (len(aged), size).

    Parameters
    ----------
    code
        Slice of 0..size → the code values of these colours, (n, 3) in 0..1; called from several threads.
    size
        How many colours there are.
    unaged, aged
        The displays. What their chains have in common is computed once.
    progress
        Called with the colours done and the colours in all.

    """
    result = np.empty((len(aged), size))

    def fill(start: int) -> int:
        part = slice(start, min(start + CHUNK, size))
        _fill(result[:, part], code(part), unaged, aged)
        return part.stop

    with ThreadPoolExecutor(threads()) as workers:
        for done in workers.map(fill, range(0, size, CHUNK)):
            progress(done, size)
    return result


def _fill(result: Array, code: Array, unaged: AgedDisplay, aged: Sequence[AgedDisplay]) -> None:
    heads: dict[tuple[Link, ...], Array] = {}

    def seen(display: AgedDisplay) -> Array:
        signal = heads.get(display.head)
        if signal is None:
            signal = heads[display.head] = display.head_signal(code)
        return shown_lab(display.xyz(signal))

    before = seen(unaged)
    for row, display in zip(result, aged, strict=True):
        row[:] = delta_e_2000(before, seen(display))


def shown_lab(xyz: Array) -> Array:
    """XYZ of a display, relative to the un-aged white, to the Lab that an un-aged sRGB viewer shows: (n, 3) both."""
    linear = xyz_to_linear(xyz)
    return linear_to_lab(np.clip(linear, 0.0, 1.0, out=linear))


def threads() -> int:
    """Return the threads to use: those of :func:`few_threads`, else the cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return _FEW.get() or cores


@contextmanager
def few_threads(count: int) -> Iterator[None]:
    """Use so many threads inside, since others share the cores; 0: one a core."""
    before = _FEW.set(count)
    try:
        yield
    finally:
        _FEW.reset(before)
