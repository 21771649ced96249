"""What all tests share."""

from __future__ import annotations

import gc
import os
import random
from collections import defaultdict
from typing import TYPE_CHECKING, TypeVar

import pytest
from hypothesis import settings

from lutgen.bindings import ocio, oiio
from tests.browser import browser
from tests.command import in_process
from tests.firefox import FIREFOX, firefox

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from lutgen import DisplayModel, Measurements
    from tests import browser as chromium_browser
    from tests import firefox as firefox_browser
    from tests.command import Done

T = TypeVar("T")

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
    """Add ``--everything`` and ``--draw``."""
    parser.addoption("--everything", action="store_true", help="all slow cases, not a seeded sample of each test's")
    parser.addoption("--draw", type=int, default=0, help="seed of that sample; the same one each time without it")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out, without ``--everything``, what :func:`left_out` says.

    Tests that draw with OpenGL come last: it leaves threads behind, beside which a forked process may wait for ever.
    """
    items.sort(key=lambda item: any(mark.args == ("renderer",) for mark in item.iter_markers("usefixtures")))
    config.stash[COLLECTED] = tuple(items)
    if config.getoption("everything"):
        return
    out = left_out(items, config.getoption("draw"))
    config.hook.pytest_deselected(items=[item for item in items if item in out])
    items[:] = [item for item in items if item not in out]


def left_out(items: Iterable[pytest.Item], seed: int = 0) -> set[pytest.Item]:
    """Tests with the mark ``rare``, and what no draw took of slow ones.

    Of the cases of a test one is drawn, of ``slow(cases=n)`` n, of ``slow(every=True)`` all; of a file's tests with
    ``slow(few=n)``, n.
    """
    rare = {item for item in items if item.get_closest_marker("rare")}
    slow: dict[str, list[pytest.Item]] = defaultdict(list)
    few: dict[str, int] = {}
    for item in items:
        mark = item.get_closest_marker("slow")
        if mark and item not in rare and not mark.kwargs.get("every"):
            test = item.nodeid.partition("[")[0]
            slow[test].append(item)
            few |= {test: mark.kwargs["few"]} if "few" in mark.kwargs else {}

    def drawn(name: str, among: Sequence[T], most: int) -> list[T]:
        key = f"{name} {seed}" if seed else name
        return random.Random(key).sample(among, min(most, len(among)))  # noqa: S311 - no secret

    of_file: dict[str, list[str]] = defaultdict(list)
    for test in few:
        of_file[test.partition("::")[0]].append(test)
    taken = {test for file, tests in of_file.items() for test in drawn(file, tests, few[tests[0]])}
    out = set(rare)
    for test, cases in slow.items():
        mark = cases[0].get_closest_marker("slow")
        most = mark.kwargs.get("cases", SAMPLE) if mark and (test in taken or test not in few) else 0
        out.update(set(cases) - set(drawn(test, cases, most)))
    return out


def pytest_collection_finish() -> None:
    """From here on garbage is collected, among what tests make."""
    gc.freeze()
    gc.enable()


def pytest_report_header() -> str:
    """Say which bindings are under test."""
    return f"OpenColorIO {ocio().__version__} from {ocio().__file__}, OpenImageIO {oiio().VERSION_STRING}"


@pytest.fixture
def lutgen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run ``lutgen`` in this process."""
    return in_process(monkeypatch, capsys)


@pytest.fixture
def run(lutgen: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Done]:
    """Run ``lutgen`` in this process, in an empty folder; files may put something into it."""
    monkeypatch.chdir(tmp_path)
    return lutgen


@pytest.fixture(scope="session")
def readings() -> Measurements:
    """The default display's."""
    from lutgen import default_display, read_measurements

    return read_measurements(default_display())


@pytest.fixture(scope="session")
def model(readings: Measurements) -> DisplayModel:
    """The default display."""
    from lutgen import DisplayModel

    return DisplayModel(readings)


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[chromium_browser.Page, Path]]:
    """Chromium, and the folder that takes its downloads: one for all tests of a process, since it starts slowly."""
    folder = tmp_path_factory.mktemp("chromium")
    with browser(folder / "profile") as page:
        page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
        yield page, folder


@pytest.fixture(scope="session")
def fox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[firefox_browser.Page, Path]]:
    """Firefox, and the folder that takes its downloads; as with Chromium."""
    if FIREFOX is None:
        pytest.skip("Firefox and a screen for it are not installed (Debian: firefox-esr, xvfb)")
    folder = tmp_path_factory.mktemp("firefox")
    with firefox(folder / "profile") as page:
        yield page, folder / "profile" / "downloads"
