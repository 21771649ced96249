"""Options, fixtures and settings of all tests."""

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
from tests.quick import DRAWS, FEWER_DRAWS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from lutgen import DisplayModel, Measurements
    from lutgen.display.own_model import OwnModel, Sample
    from tests import browser as chromium_browser
    from tests import firefox as firefox_browser
    from tests.command import Done

T = TypeVar("T")

# One thread of BLAS, as in the command itself: the last bits of results depend on the number of threads. numpy is not
# imported yet.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# No deadline, because a busy machine is not a fault of the code. Derandomised, so that failures are reproducible.
settings.register_profile("lutgen", deadline=None, derandomize=True, max_examples=FEWER_DRAWS)
settings.register_profile("everything", deadline=None, derandomize=True, max_examples=DRAWS)
settings.load_profile("lutgen")

# Imported modules and collected tests stay until the end. Garbage collection of them takes a fifth of the collecting.
gc.disable()


#: Number of slow tests of one file that run without ``--everything``, one case each; another ``--draw`` takes others.
FEW = 1

#: All collected tests, including those that are left out.
COLLECTED: pytest.StashKey[tuple[pytest.Item, ...]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--everything`` and ``--draw``."""
    parser.addoption("--everything", action="store_true", help="all slow cases, not a seeded sample of each test's")
    parser.addoption("--draw", type=int, default=0, help="seed of that sample; the same one each time without it")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """With ``--everything``, draw as many examples of a property as hypothesis does by itself, and wait longer."""
    if config.getoption("everything"):
        settings.load_profile("everything")
        config.option.timeout = config.option.timeout or 3600


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ``--everything``, leave out the tests that :func:`left_out` returns.

    Tests that draw with OpenGL run last: OpenGL leaves threads behind, and a process that is forked beside them may
    hang.
    """
    items.sort(key=lambda item: any(mark.args == ("renderer",) for mark in item.iter_markers("usefixtures")))
    config.stash[COLLECTED] = tuple(items)
    if config.getoption("everything"):
        return
    out = left_out(items, config.getoption("draw"))
    config.hook.pytest_deselected(items=[item for item in items if item in out])
    items[:] = [item for item in items if item not in out]


def left_out(items: Iterable[pytest.Item], seed: int = 0) -> set[pytest.Item]:
    """Return the tests with the mark ``rare``, and the slow tests that were not drawn.

    Of the slow tests of a file, ``FEW`` are drawn; tests that stand in for rare ones are drawn first, all of them. Of
    the cases of a drawn test, one is drawn, with ``slow(cases=n)`` n. All cases of a test with ``slow(every=True)``
    run.
    """
    rare = {item for item in items if item.get_closest_marker("rare")}
    instead = {substitute(item) for item in rare}
    slow: dict[str, dict[str, list[pytest.Item]]] = defaultdict(lambda: defaultdict(list))
    for item in items:
        mark = item.get_closest_marker("slow")
        if mark and item not in rare and not mark.kwargs.get("every"):
            slow[item.nodeid.partition("::")[0]][item.nodeid.partition("[")[0]].append(item)

    def drawn(name: str, among: Sequence[T], most: int) -> list[T]:
        key = f"{name} {seed}" if seed else name
        return random.Random(key).sample(among, max(0, min(most, len(among))))  # noqa: S311 - no secret

    out = set(rare)
    for file, tests in slow.items():
        first = [test for test in tests if test in instead]
        taken = [*first, *drawn(file, [test for test in tests if test not in instead], FEW - len(first))]
        for test, cases in tests.items():
            mark = cases[0].get_closest_marker("slow")
            most = mark.kwargs.get("cases", 1) if mark and test in taken else 0
            out.update(set(cases) - set(drawn(test, cases, most)))
    return out


def substitute(rare: pytest.Item) -> str:
    """Return the node of the test that a rare test's mark names: a test of the same file, or ``FILE::TEST``."""
    mark = rare.get_closest_marker("rare")
    file, _, name = mark.kwargs["instead"].rpartition("::") if mark else ("", "", "")
    here = rare.nodeid.partition("::")[0]
    return f"{here.rpartition('/')[0]}/{file}::{name}" if file else f"{here}::{name}"


def pytest_collection_finish() -> None:
    """Enable the garbage collector from here on, for the objects of the tests."""
    gc.freeze()
    gc.enable()


def pytest_report_header() -> str:
    """Return which bindings are under test."""
    return f"OpenColorIO {ocio().__version__} from {ocio().__file__}, OpenImageIO {oiio().VERSION_STRING}"


@pytest.fixture
def lutgen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run ``lutgen`` in this process."""
    return in_process(monkeypatch, capsys)


@pytest.fixture
def run(lutgen: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Done]:
    """Run ``lutgen`` in this process, in an empty folder; test files may override this fixture to add files."""
    monkeypatch.chdir(tmp_path)
    return lutgen


@pytest.fixture(scope="session")
def readings() -> Measurements:
    """The readings of the default display."""
    from lutgen import default_display, read_measurements

    return read_measurements(default_display())


@pytest.fixture(scope="session")
def model(readings: Measurements) -> DisplayModel:
    """The model of the default display."""
    from lutgen import DisplayModel

    return DisplayModel(readings)


@pytest.fixture(scope="module")
def fitted_once() -> Iterator[None]:
    """Fit an own model once for all tests of a file that read the same session. A fit is deterministic."""
    from lutgen.display.own_model import fit_own_model

    known: dict[tuple[object, ...], OwnModel] = {}

    def fit(sample: Sample) -> OwnModel:
        arrays = (sample.drive, sample.share, sample.white, sample.lines)
        curves = None if sample.calibration is None else sample.calibration.tobytes()
        key = (*(each.tobytes() for each in arrays), sample.file, curves)
        if key not in known:
            known[key] = fit_own_model(sample)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        for module in ("lutgen.display.native", "lutgen.criticism.first_session.baselines"):
            patch.setattr(f"{module}.fit_own_model", fit)
        yield


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[chromium_browser.Page, Path]]:
    """Chromium and its download folder, one for all tests of a process, because Chromium starts slowly."""
    folder = tmp_path_factory.mktemp("chromium")
    with browser(folder / "profile") as page:
        page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
        yield page, folder


@pytest.fixture(scope="session")
def fox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[firefox_browser.Page, Path]]:
    """Firefox and its download folder, one for all tests of a process."""
    if FIREFOX is None:
        pytest.skip("Firefox and a screen for it are not installed (Debian: firefox-esr, xvfb)")
    folder = tmp_path_factory.mktemp("firefox")
    with firefox(folder / "profile") as page:
        yield page, folder / "profile" / "downloads"
