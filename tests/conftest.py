"""What all tests share."""

from __future__ import annotations

import gc
import os
import random
from collections import defaultdict
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from lutgen.bindings import ocio, oiio

if TYPE_CHECKING:
    from collections.abc import Iterable

# As the command itself: one thread of BLAS, whose last bits depend on their number. numpy is not loaded yet.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A busy machine is no fault of the code, and a failure here must be the same failure elsewhere.
settings.register_profile("lutgen", deadline=None, derandomize=True)
settings.load_profile("lutgen")

# What is imported and collected stays to the end: to look through it for garbage is a fifth of collecting.
gc.disable()


#: Slow cases of one test that are run without ``--everything``.
SAMPLE = 1

#: All tests that were collected, those too that are left out.
COLLECTED: pytest.StashKey[tuple[pytest.Item, ...]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--everything``."""
    parser.addoption("--everything", action="store_true", help="all slow cases, not a seeded sample of each test's")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out, without ``--everything``, what :func:`left_out` says.

    Tests that draw with OpenGL come last: it leaves threads behind, beside which a forked process may wait for ever.
    """
    items.sort(key=lambda item: any(mark.args == ("renderer",) for mark in item.iter_markers("usefixtures")))
    config.stash[COLLECTED] = tuple(items)
    if config.getoption("everything"):
        return
    out = left_out(items)
    config.hook.pytest_deselected(items=[item for item in items if item in out])
    items[:] = [item for item in items if item not in out]


def left_out(items: Iterable[pytest.Item]) -> set[pytest.Item]:
    """Tests with the mark ``rare``, and all slow cases of a test but a sample; of ``slow(every=True)`` none."""
    rare = {item for item in items if item.get_closest_marker("rare")}
    slow = defaultdict(list)
    for item in items:
        mark = item.get_closest_marker("slow")
        if mark and item not in rare and not mark.kwargs.get("every"):
            slow[item.nodeid.partition("[")[0]].append(item)
    out = set(rare)
    for test, cases in slow.items():
        kept = random.Random(test).sample(cases, min(SAMPLE, len(cases)))  # noqa: S311 - no secret
        out.update(set(cases) - set(kept))
    return out


def pytest_collection_finish() -> None:
    """From here on garbage is collected, among what tests make."""
    gc.freeze()
    gc.enable()


def pytest_report_header() -> str:
    """Say which bindings are under test."""
    return f"OpenColorIO {ocio().__version__} from {ocio().__file__}, OpenImageIO {oiio().VERSION_STRING}"
