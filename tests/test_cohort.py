"""Cohorts: figures over all slides, stored and resumed results, and processes and Dask workers that die early."""

from __future__ import annotations

import json
import multiprocessing
import os
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import LutgenError, cohort, lifetime
from lutgen.bindings import oiio
from lutgen.pictures import cohort_workers
from lutgen.pictures.blocks import few_threads, threads
from lutgen.pictures.cohort import bands_of, coverage, left_out, lives_of
from lutgen.pictures.cohort_slides import CohortTask, RunFolder, find_slides, image_from_json
from lutgen.pictures.cohort_workers import Outcome
from lutgen.pictures.difference import STATISTICS
from tests.cohort_slides import HOURS, break_slide, deadly_model, make_slides, model, seven_colours

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.display import DisplayModel
    from lutgen.pictures.cohort import Cohort
    from lutgen.pictures.cohort_slides import CohortSlide

pytestmark = pytest.mark.numbers

FEW: Any = {"hours": HOURS}


def text_of(result: Cohort) -> str:
    """Every number, to the last bit."""
    return json.dumps(result.as_json(), allow_nan=False)


def results(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in (folder / "slides").iterdir()}


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the slides whose results are written, in the order of writing."""
    names: list[str] = []
    keep = RunFolder.keep

    def noted(folder: RunFolder, slide: Any, image: Any) -> None:
        names.append(Path(slide.name).name)
        keep(folder, slide, image)

    monkeypatch.setattr(RunFolder, "keep", noted)
    return names


# Over all slides ------------------------------------------------------------------------------------------------------


def test_the_interval_of_a_median_holds_it_with_95_percent_as_scipy_counts() -> None:
    from scipy.stats import binom

    assert [left_out(size) for size in range(1, 6)] == [None] * 5
    for size in (*range(6, 80), 1000):
        outside = left_out(size)
        assert outside is not None
        assert 2 * binom.cdf(outside, size, 0.5) <= 0.05 < 2 * binom.cdf(outside + 1, size, 0.5)
        assert coverage(size) == pytest.approx(1 - 2 * binom.cdf(outside, size, 0.5))
    assert coverage(5) is None


def test_intervals_of_drawn_slides_hold_the_median_as_often_as_they_say() -> None:
    random = np.random.default_rng(5)
    hits = 0
    for _ in range(2000):
        interval = lives_of([None if life > 3 else float(life) for life in random.gamma(2.0, 1.0, 15)]).interval
        assert interval is not None
        low, high = (np.inf if end is None else end for end in interval)
        hits += low <= 1.6783469900166605 <= high
    assert hits / 2000 == pytest.approx(coverage(15), abs=0.012)


@pytest.mark.parametrize(
    ("lives", "median", "interval", "longest"),
    [
        ([5.0, 1.0, 3.0], 3.0, None, 5.0),
        ([5.0, 1.0, 3.0, 4.0], 3.5, None, 5.0),
        ([None, 1.0, 3.0], 3.0, None, None),
        ([None, 1.0], None, None, None),
        ([None, None, 3.0], None, None, None),
        ([2.0], 2.0, None, 2.0),
        ([6.0, 5.0, 4.0, 3.0, 2.0, 1.0], 3.5, (1.0, 6.0), 6.0),
        ([None, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0], 5.0, (2.0, 8.0), None),
        ([None, None, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0], 5.0, (2.0, None), None),
    ],
)
def test_what_is_never_reached_is_the_longest(
    lives: list[float | None], median: float | None, interval: Any, longest: float | None
) -> None:
    statistics = lives_of(lives)
    assert (statistics.median, statistics.interval, statistics.range[1]) == (median, interval, longest)
    assert statistics.range[0] == min(life for life in lives if life is not None)
    assert statistics.reached == sum(life is not None for life in lives)


@pytest.mark.slow
def test_a_cohort_is_its_slides_each_by_itself_and_their_medians(tmp_path: Path) -> None:
    files = make_slides(tmp_path / "in", 7)
    result = cohort(files, model(), tmp_path / "run", tolerances=(3, 12), jobs=1, **FEW)
    alone = lifetime(files, model(), tolerances=(3, 12), hours=HOURS)
    assert result.as_json()["slides"] == alone.as_json()["images"]
    assert (result.broken, result.kept) == ((), 0)
    bands = bands_of([image.curves["chroma"] for image in alone.images])
    over_all = result.as_json()["over_all"]
    assert over_all["slides"] == 7
    for mode in result.modes:
        for name in STATISTICS:
            lives = [image.curves[mode].hours_until(name, 3.0) for image in alone.images]
            here = over_all["modes"][mode]["lifetimes"]["3"][name]
            assert here["median"] == np.median([life for life in lives if life is not None])
            assert here["interval"] == here["range"] == (min(map(float, filter(None, lives))), here["range"][1])
    point = over_all["modes"]["chroma"]["curve"][2]
    means = [image.curves["chroma"].mean[2] for image in alone.images]
    assert point["mean"] == {"median": np.median(means), "low": min(means), "high": max(means)}
    assert point["mean_plus_2_sd"]["high"] == bands["max"]["high"][2]


@pytest.mark.slow
def test_a_slide_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    (file,) = make_slides(tmp_path, 1)
    uncertain = replace(deadly_model(tmp_path, order=False), fit={"noise_relative": 0.002, "noise_floor_cd_m2": 0.0})
    (leak,) = uncertain.effects
    estimates = {name: replace(each, stderr=0.0005) for name, each in leak.estimates.items()}
    uncertain = replace(uncertain, effects=(replace(leak, estimates=estimates, free=("glow",)),))
    for display in (model(), uncertain):
        alone = lifetime([file], display, hours=HOURS, tissue=True)
        said_of_it = json.loads(json.dumps(alone.as_json()["images"][0]))
        again = image_from_json(said_of_it, str(file), alone.tolerances)
        assert replace(alone, images=(again,)).as_json() == alone.as_json()
    assert again.intervals is not None


# Which slides ---------------------------------------------------------------------------------------------------------


def test_slides_are_files_folders_and_lists_each_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("b/x.png", "b/deep/y.SVS", "b/.hidden.png", "b/.trash/z.png", "b/notes.md", "c.tif", "other/d.exr"):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"1234")
    (tmp_path / "other/list.txt").write_text("\ufeff# ours\nd.exr\n\n ../c.tif \n../gone.png\n", encoding="utf-8")
    (tmp_path / "link.tif").symlink_to("c.tif")
    slides = find_slides(["c.tif", "b", "other/list.txt", "./b/x.png", tmp_path / "link.tif"])
    assert [slide.name for slide in slides] == ["c.tif", "b/deep/y.SVS", "b/x.png", "other/d.exr", "other/../gone.png"]
    assert [slide.bytes for slide in slides] == [4, 4, 4, 4, 0]
    assert slides[0].path == str(tmp_path.resolve() / "c.tif")


def test_what_lies_beside_a_mirax_slide_belongs_to_it(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a.mrxs").write_bytes(b"12")
    (before,) = find_slides([tmp_path / "a.mrxs"])
    (tmp_path / "a/Data0001.dat").write_bytes(b"123")
    (after,) = find_slides([tmp_path / "a.mrxs"])
    assert (before.bytes, after.bytes) == (2, 5)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], "no slide was given"),
        (["empty"], "empty: no slide in this folder or below. Looked for .png"),
        (["gone.txt"], "gone.txt: cannot read the list of slides: no such file"),
        (["n" * 300], f"{'n' * 300}: cannot be listed: file name too long"),
        (["blank.txt"], "blank.txt: names no slide"),
        (["latin.txt"], "latin.txt: cannot read the list of slides: it is not utf-8 text"),
    ],
)
def test_places_without_slides_are_refused(
    given: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    Path("blank.txt").write_text("# nothing\n")
    Path("latin.txt").write_bytes(b"Pr\xe4parat.png\n")
    with pytest.raises(LutgenError) as refused:
        cohort(given, model(), "run", **FEW)
    assert str(refused.value).startswith(message)
    assert not Path("run").exists()


def test_a_tiled_tiff_by_the_name_of_a_slide_is_read_as_one(tmp_path: Path) -> None:
    pytest.importorskip("openslide", reason="the extra `slides` is not installed")
    pixels = np.ascontiguousarray(immunohistochemistry()[:128, :128])
    lib = oiio()
    spec = lib.ImageSpec(128, 128, 3, "uint8")
    spec.tile_width = spec.tile_height = 64
    spec.attribute("compression", "none")
    output = lib.ImageOutput.create("tiff")
    assert output.open(str(tmp_path / "a.svs"), spec)
    assert output.write_image(pixels)
    assert output.close()
    imsave(tmp_path / "a.png", pixels, check_contrast=False)
    result = cohort([tmp_path], model(), tmp_path / "run", hours=[18_000], jobs=1)
    assert result.broken == ()
    picture, slide = result.slides.images
    assert (Path(picture.file).name, Path(slide.file).name) == ("a.png", "a.svs")
    assert slide.pixels == 128 * 128
    np.testing.assert_array_equal(slide.curves["chroma"].mean, picture.curves["chroma"].mean)


# Stored results -------------------------------------------------------------------------------------------------------


def test_a_second_run_does_only_what_is_missing(tmp_path: Path, written: list[str]) -> None:
    files = make_slides(tmp_path / "in", 4)
    broken = break_slide(files[2])
    calls: list[tuple[int, int]] = []
    first = cohort(files, model(), tmp_path / "run", jobs=1, progress=lambda *at: calls.append(at), **FEW)
    assert [each.file for each in first.broken] == [str(broken)]
    assert written == ["s00.png", "s01.png", "s03.png"]
    assert calls == [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4)]
    written.clear()
    make_slides(tmp_path / "in", 5)  # the broken slide is repaired and one is added; the other files get a new time
    again = cohort([tmp_path / "in"], model(), tmp_path / "run", jobs=1, **FEW)
    assert (again.broken, again.kept, len(written)) == ((), 0, 5)
    written.clear()
    third = cohort([tmp_path / "in"], model(), tmp_path / "run", jobs=1, **FEW)
    assert (third.kept, written, text_of(third)) == (5, [], text_of(again))
    files[1].write_bytes(files[0].read_bytes())
    (tmp_path / "run/slides" / next(iter(results(tmp_path / "run")))).write_text("{")
    fourth = cohort(files, model(), tmp_path / "run", jobs=1, **FEW)
    assert fourth.kept == len(files) - len(written)
    assert 1 <= len(written) <= 2
    assert "s01.png" in written
    assert len(fourth.slides.images) == 4


def test_results_are_written_as_they_are_found(tmp_path: Path) -> None:
    files = make_slides(tmp_path / "in", 3)

    def interrupted(done: int, _total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cohort(files, model(), tmp_path / "run", jobs=1, progress=interrupted, **FEW)
    assert len(results(tmp_path / "run")) == 2
    assert cohort(files, model(), tmp_path / "run", jobs=1, **FEW).kept == 2


def test_a_run_that_asked_something_else_is_refused_and_by_force_replaced(tmp_path: Path) -> None:
    files, run = make_slides(tmp_path / "in", 2), tmp_path / "run"
    cohort(files, model(), run, jobs=1, **FEW)
    before = results(run)
    other: dict[str, Any] = {
        "tolerances": {"tolerances": (1,), **FEW},
        "hours": {"hours": [9000]},
        "tissue": {"tissue": True, **FEW},
        "source": {"source": "signal", **FEW},
        "modes": {"modes": ("chroma",), **FEW},
    }
    for name, options in other.items():
        with pytest.raises(LutgenError, match=rf"run: holds a run with other settings \({name}\)\. Add --force"):
            cohort(files, model(), run, jobs=1, **options)
    with pytest.raises(LutgenError, match=r"other settings \(model\)"):
        cohort(files, replace(model(), selection="continuous"), run, jobs=1, **FEW)
    assert results(run) == before
    result = cohort(files[:1], model(), run, jobs=1, force=True, **other["modes"])
    assert (result.kept, result.modes, len(results(run))) == (0, ("chroma",), 1)


def test_a_folder_of_others_is_left_alone(tmp_path: Path) -> None:
    (file,) = make_slides(tmp_path / "in", 1)
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs/thesis.tex").touch()
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd/cohort.json").write_text("[]")
    (tmp_path / "huge").mkdir()
    with (tmp_path / "huge/cohort.json").open("wb") as sparse:
        sparse.truncate(10**9)
    for name, message in (
        ("theirs", "no run of lutgen's, such as thesis.tex"),
        ("odd", "does not describe a cohort"),
        ("huge", r"cohort\.json: larger than 64 MB, which no run is\. Was it edited\? Choose another folder with -o\."),
        ("in/s00.png/x", "is a file, and a run is a folder"),
    ):
        with pytest.raises(LutgenError, match=message):
            cohort([file], model(), tmp_path / name, jobs=1, force=True, **FEW)
    assert [path.name for path in (tmp_path / "theirs").iterdir()] == ["thesis.tex"]


# Processes ------------------------------------------------------------------------------------------------------------


def test_threads_are_shared_between_processes() -> None:
    with few_threads(3):
        assert threads() == 3
        with few_threads(1):
            assert threads() == 1
    assert threads() == (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count())


@pytest.mark.slow
def test_a_process_that_is_killed_loses_nothing_and_a_slide_that_kills_is_named(
    tmp_path: Path, written: list[str]
) -> None:
    files = make_slides(tmp_path / "in", 4)
    deadly = seven_colours(tmp_path / "in/deadly.png")
    broken = break_slide(make_slides(tmp_path / "more", 1)[0])
    display = deadly_model(tmp_path, order=True)
    assert (tmp_path / "order").exists()
    result = cohort([files[0], deadly, broken, *files[1:]], display, tmp_path / "run", jobs=2, **FEW)
    assert not (tmp_path / "order").exists()
    assert sorted(written) == [file.name for file in files]
    assert [each.file for each in result.broken] == [str(deadly), str(broken)]
    assert result.broken[0].reason.startswith("its worker process died twice")
    assert result.broken[1].reason.startswith("the image is truncated or damaged")
    alone = cohort(files, display, tmp_path / "alone", jobs=1, **FEW)
    assert result.as_json()["slides"] == alone.as_json()["slides"]


@pytest.mark.slow
def test_processes_that_cannot_start_are_told(tmp_path: Path) -> None:
    display = deadly_model(tmp_path, order=False)
    files = make_slides(tmp_path / "in", 2)
    crew = cohort_workers.on_this_machine  # a process looks for the effect when it starts
    (tmp_path / "deadly.py").unlink()
    with pytest.raises(LutgenError, match=r"a worker process cannot be started"):
        list(crew(_asked(display), find_slides(files), 2))


def test_a_script_that_does_not_guard_its_main_part_is_told(tmp_path: Path) -> None:
    make_slides(tmp_path / "in", 2)
    (tmp_path / "script.py").write_text(
        "from lutgen import DisplayModel, cohort, default_display, read_measurements\n"
        "cohort(['in'], DisplayModel(read_measurements(default_display())), 'run', jobs=2)\n"
    )
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 1
    # Python's resource tracker may write its own warning after the error.
    (told,) = [line for line in done.stderr.splitlines() if "cannot be started" in line]
    assert "needs `if __name__ == '__main__':`" in told


@pytest.mark.slow
def test_slides_in_hand_when_a_process_dies_are_tried_again_and_no_others(
    tmp_path: Path,
) -> None:
    files = make_slides(tmp_path / "in", 9)
    display = deadly_model(tmp_path, order=True)
    done = list(cohort_workers._done_here(_asked(display), 2, find_slides(files)))
    assert {slide.name for slide, _ in done} == {str(file) for file in files}
    assert len(done) == 9
    assert 1 <= sum(outcome is None for _, outcome in done) <= 2


def test_processes_end_when_nobody_waits_for_them_any_more(tmp_path: Path) -> None:
    files = find_slides(make_slides(tmp_path / "in", 6, side=100))
    outcomes = cohort_workers.on_this_machine(_asked(model()), files, 2)
    next(outcomes)
    working = multiprocessing.active_children()
    assert working
    outcomes.close()
    assert not {each.pid for each in working} & {each.pid for each in multiprocessing.active_children()}


def _asked(display: DisplayModel) -> CohortTask:
    return CohortTask(display, {"tolerances": [3.0], "modes": ["chroma"], "hours": HOURS})


# Dask -----------------------------------------------------------------------------------------------------------------


def dask_config() -> Any:
    return import_module("dask").config


@pytest.fixture(scope="module")
def dask() -> Iterator[Any]:
    """A cluster of two worker processes on this machine."""
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=":0"
    ) as cluster:
        yield cluster


@pytest.mark.slow
def test_a_cluster_whose_worker_is_killed_loses_nothing_and_counts_nothing_twice(
    dask: Any, tmp_path: Path, written: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = make_slides(tmp_path / "in", 6)
    broken = break_slide(make_slides(tmp_path / "more", 1)[0])
    monkeypatch.chdir(tmp_path)  # the workers have another working folder
    display = deadly_model(Path(), order=True)
    paths = [f"in/{file.name}" for file in files]
    result = cohort([*paths, broken], display, "run", scheduler=dask.scheduler_address, **FEW)
    assert not Path("order").exists()
    assert sorted(written) == [file.name for file in files]
    assert [each.file for each in result.broken] == [str(broken)]
    alone = cohort([*paths, broken], display, "alone", jobs=1, **FEW)
    assert text_of(result) == text_of(alone)
    assert results(tmp_path / "run") == results(tmp_path / "alone")
    again = cohort([*paths, broken], display, "run", scheduler=dask.scheduler_address, **FEW)
    assert (again.kept, text_of(again)) == (6, text_of(alone))


@pytest.mark.slow
def test_a_slide_under_which_dask_workers_die_is_named_and_the_others_finish(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    files = make_slides(tmp_path / "in", 3)
    deadly = seven_colours(tmp_path / "in/deadly.png")
    display = deadly_model(tmp_path, order=False)
    # Dask restarts the only worker each time, even if the worker dies before its start is known. By default a task
    # may kill three more workers, each a new process of some seconds. The first death is enough for the test.
    few = dask_config().set({"distributed.scheduler.allowed-failures": 0})
    with (
        few,
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0") as single,
    ):
        single.adapt(minimum=1, maximum=1, interval="200ms")
        result = cohort([deadly, *files], display, tmp_path / "run", scheduler=single.scheduler_address, **FEW)
    ((file, reason),) = ((each.file, each.reason) for each in result.broken)
    assert (file, reason[:34]) == (str(deadly), "the Dask workers that took it died")
    assert len(result.slides.images) == 3


def test_slides_that_dask_suspects_are_tried_again_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second, deadly = find_slides(make_slides(tmp_path / "in", 3))
    outcome, tried = Outcome({"found": 1}), []

    def done(
        _dask: Any, _client: Any, _asked: Any, slides: tuple[CohortSlide, ...]
    ) -> Iterator[tuple[CohortSlide, Outcome | None]]:
        tried.append(list(slides))
        for slide in slides:
            blamed = slide == deadly or (slide == second and len(slides) > 1)
            yield slide, None if blamed else outcome

    monkeypatch.setattr(cohort_workers, "_done_on_cluster", done)
    outcomes = list(cohort_workers._outcomes_on_cluster(None, None, _asked(model()), (second, deadly, first)))
    assert tried == [[second, deadly, first], [second], [deadly]]
    assert outcomes == [(first, outcome), (second, outcome), (deadly, Outcome(None, cohort_workers._DEADLY_WORKERS))]


@pytest.mark.slow
def test_what_a_worker_cannot_do_is_said(dask: Any, tmp_path: Path) -> None:
    slides = find_slides(make_slides(tmp_path / "in", 3))
    unseen, other = replace(slides[0], path="/elsewhere/s.png"), replace(_asked(model()), version="0.0.1")
    with cohort_workers.on_cluster(dask.scheduler_address) as crew:
        ((_, outcome),) = crew(_asked(model()), [unseen])
        assert outcome.reason.startswith("this machine sees it and its Dask worker does not, at /elsewhere/s.png.")
        ((_, outcome),) = crew(other, slides[:1])
        assert "on its Dask worker and 0.0.1 here" in outcome.reason
        display = deadly_model(tmp_path, order=False)
        (tmp_path / "deadly.py").rename(tmp_path / "moved.py")
        ((_, outcome),) = crew(_asked(display), slides[:1])
        assert outcome.reason.startswith("its Dask worker failed (LutgenError: ")
        assert "deadly.py: cannot read the effects" in outcome.reason


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:9", r"no Dask scheduler answers there \(timed out"),
        ("127.0.0.1:8786", "is no address of a Dask scheduler. Write it as tcp://host:8786."),
        ("tcp://somewhere", "is no address"),
        ("http://127.0.0.1:8787", "is no address"),
    ],
)
def test_a_scheduler_that_is_not_there(
    address: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr(cohort_workers, "PATIENCE_S", 0.5)
    with pytest.raises(LutgenError, match=message):
        cohort(make_slides(tmp_path / "in", 1), model(), tmp_path / "run", scheduler=address, **FEW)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_scheduler_without_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr(cohort_workers, "PATIENCE_S", 1.0)
    (file,) = make_slides(tmp_path / "in", 1)
    with (
        distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=":0") as empty,
        pytest.raises(LutgenError, match="the scheduler has no worker"),
    ):
        cohort([file], model(), tmp_path / "run", scheduler=empty.scheduler_address, **FEW)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_leaves_what_is_finished(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    files, run = make_slides(tmp_path / "in", 12, side=200), tmp_path / "run"
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0", silence_logs=50
    ) as leaving:

        def leave(done: int, _total: int) -> None:
            if done == 1:
                leaving.close()

        with pytest.raises(LutgenError, match=r"the Dask scheduler is gone\. The finished slides are kept"):
            cohort(files, model(), run, scheduler=leaving.scheduler_address, progress=leave)
    assert 1 <= len(results(run)) < 12
    assert "Traceback" not in capfd.readouterr().err


def test_a_cluster_without_dask_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(LutgenError, match=r"pip install lutgen\[cluster\]"):
        cohort(make_slides(tmp_path / "in", 1), model(), tmp_path / "run", scheduler="tcp://127.0.0.1:9", **FEW)
