"""OpenColorIO's shaders for lutgen's views, drawn by Mesa or a graphics card, against the CPU and numpy."""

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lutgen.bake import gpu
from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.bake.check_config import viewer_values
from lutgen.bake.config import VIEWERS
from lutgen.bake.fidelity import Counts, certificate_colours
from lutgen.bake.lut import Sampler
from lutgen.bake.spaces import lattice
from lutgen.bindings import ocio
from lutgen.colorimetry import Array, code_to_linear
from lutgen.display import DisplayModel
from lutgen.errors import LutgenError
from tests.command import Done

HOURS = (10_000.0,)
CONFIG = "chroma/10000h/config.ocio"


@pytest.fixture(scope="module")
def renderer() -> None:
    """Find the renderer, or skip the test if there is none."""
    try:
        gpu.renderer_name()
    except LutgenError as error:
        pytest.skip(str(error))


def drawn(test: Callable[..., None]) -> Callable[..., None]:
    """Run a test only if shaders can be drawn. Drawing is slow without a graphics card."""
    marked: Callable[..., None] = pytest.mark.slow(pytest.mark.usefixtures("renderer")(test))
    return marked


@pytest.fixture(scope="module", params=["cube", "clf"])
def built(request: pytest.FixtureRequest, model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp(str(request.param)) / "aged"
    build(model, BuildPlan(HOURS, modes=("chroma",), formats=(str(request.param),)), folder, jobs=1)
    return folder


@pytest.fixture(scope="module")
def colours() -> Array:
    return np.concatenate([certificate_colours(Counts(12_500, 1_024, 8_000, 4_096)), lattice(2, "code")])


@drawn
def test_shaders_of_every_view_agree_with_the_cpu(built: Path, colours: Array) -> None:
    run = gpu.gpu_run(built / CONFIG, colours)
    assert set(run.views) == {f"{viewer}, {view}" for viewer in VIEWERS for view in ("Aged", "Un-aged")}
    # 2e-5 is the error of OpenColorIO 2.6's fast power. The largest error is Rec.1886 near black, where it is steep.
    for view in run.views.values():
        assert view.p99 < 2e-5
        assert view.max < 2e-4


@drawn
@pytest.mark.parametrize("viewer", VIEWERS)
def test_a_shader_draws_what_numpy_computes_from_the_table(
    viewer: str, model: DisplayModel, built: Path, colours: Array
) -> None:
    """Compute the tetrahedra, the matrices and the curves in double precision, without a renderer."""
    lib = ocio()
    config = lib.Config.CreateFromFile(str(built / CONFIG))
    shown = gpu.drawn_by_gpu(
        config.getProcessor(lib.DisplayViewTransform("Source signal", viewer, "Aged")), colours.astype(np.float32)
    )
    record = next(each for each in json.loads((built / "manifest.json").read_text())["files"] if each["kind"] == "lut")
    table = Sampler().lut(model.at("chroma", HOURS[0]), record["size"], record["space"], clip=record["clipped"])
    expected = viewer_values(code_to_linear(table.apply(colours)), viewer)
    away = np.abs(np.clip(shown, 0, 1) - np.clip(expected, 0, 1)).max(axis=1)
    assert np.quantile(away, 0.99) < 2e-5
    # Near black, float32 tables and Rec.1886's steep curve have larger errors. The CPU has the same errors.
    assert away.max() < 4e-4


@drawn
def test_trilinear_shaders_draw_something_else(model: DisplayModel, tmp_path: Path, colours: Array) -> None:
    """The interpolation matters: without `tetrahedral` the error of the same file exceeds every limit."""
    lib = ocio()
    build(model, BuildPlan(HOURS, modes=("chroma",), formats=("cube",), certify=False), tmp_path / "aged", jobs=1)
    lut, raw = tmp_path / "aged/chroma/10000h/aged.cube", lib.Config.CreateRaw()
    ways = [lib.INTERP_TETRAHEDRAL, lib.INTERP_LINEAR]
    tetrahedral, trilinear = (
        gpu.drawn_by_gpu(raw.getProcessor(lib.FileTransform(str(lut), interpolation=way)), colours.astype(np.float32))
        for way in ways
    )
    assert np.abs(tetrahedral - trilinear).max() > gpu.TOLERANCE


@drawn
def test_a_picture_of_any_length_is_drawn_whole(built: Path) -> None:
    lib = ocio()
    config = lib.Config.CreateFromFile(str(built / CONFIG))
    unaged = config.getProcessor(lib.DisplayViewTransform("Source signal", "sRGB", "Un-aged"))
    for count in (1, 511, 512, 513, 2000):
        code = np.random.default_rng(count).random((count, 3)).astype(np.float32)
        shown = gpu.drawn_by_gpu(unaged, code)
        assert shown.shape == (count, 3)
        np.testing.assert_allclose(shown, code, rtol=0, atol=2e-5)


@drawn
def test_build_records_what_the_shaders_did_and_check_repeats_it(model: DisplayModel, tmp_path: Path) -> None:
    plan = BuildPlan(HOURS, modes=("chroma", "chroma-luma"), formats=("clf",), gpu=True)
    built = build(model, plan, tmp_path / "aged", jobs=2)
    records = {record.path: record.gpu for record in built.manifest.files if record.gpu}
    assert set(records) == {CONFIG, CONFIG.replace("chroma", "chroma-luma")}
    checked = check(tmp_path / "aged", gpu=True, jobs=1)
    assert checked.passed
    assert checked.as_json()["gpu"] == records
    assert "gpu" not in check(tmp_path / "aged", jobs=1).as_json()


@drawn
def test_check_fails_where_the_graphics_card_draws_something_else(
    built: Path, lutgen: Callable[..., Done], monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = gpu.drawn_by_gpu

    def a_broken_driver(processor: Any, code: Any) -> Any:
        return honest(processor, code) + np.float32(0.01) * (code[:, :1] > 0.5)

    monkeypatch.setattr(gpu, "drawn_by_gpu", a_broken_driver)
    done = lutgen("check", "--gpu", "--jobs", "1", str(built))
    assert done.code == 1
    assert f"{CONFIG}: its shader differs from the CPU by up to 0.01 in code values (sRGB, Aged; " in done.out


@drawn
def test_the_command_says_how_far_the_shaders_are_off(built: Path, lutgen: Callable[..., Done]) -> None:
    done = lutgen("check", "--gpu", "--jobs", "1", str(built))
    assert done.code == 0
    assert f"Shaders of 1 config on {gpu.renderer_name()}: at most " in done.out


def test_without_moderngl_it_is_said_how_to_get_it(
    built: Path, lutgen: Callable[..., Done], monkeypatch: pytest.MonkeyPatch
) -> None:
    gpu._context_in.cache_clear()
    monkeypatch.setitem(sys.modules, "moderngl", None)
    done = lutgen("check", "--gpu", str(built))
    assert done.code == 2
    assert "pip install lutgen[gpu]" in done.err


def test_without_a_driver_it_is_said_what_to_install(
    model: DisplayModel, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def no_driver(**_settings: Any) -> Any:
        raise Exception("eglGetDisplay failed\n(0x3000)")  # noqa: TRY002 - as glcontext does

    moderngl = pytest.importorskip("moderngl", reason="moderngl is not installed (extra gpu)")
    gpu._context_in.cache_clear()
    monkeypatch.setattr(moderngl, "create_context", no_driver)
    with pytest.raises(LutgenError, match=r"no OpenGL 4\.0 through EGL here \(eglGetDisplay failed \(0x3000\)\)"):
        build(model, BuildPlan(HOURS, modes=("chroma",), gpu=True), tmp_path / "aged", jobs=1)
    assert not (tmp_path / "aged").exists()


def test_shaders_are_of_folders_not_of_single_files(built: Path, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    lut = next(path for path in (built / CONFIG).parent.iterdir() if path.stem == "aged")
    shutil.copyfile(lut, tmp_path / lut.name)
    done = lutgen("check", "--gpu", "--mode", "chroma", "--hours", "10000", str(tmp_path / lut.name))
    assert done.code == 2
    assert "--gpu is for folders" in done.err
