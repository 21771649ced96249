"""How fast lutgen is: one table of ratios, each pair measured in the same run.

    python -m examples.bench                     the whole table, a few minutes
    python -m examples.bench --only criticism    one part of it
    python -m examples.bench --quick             little work, few repetitions: checks that every row still runs
    python -m examples.bench --json              the same as JSON
    python -m examples.bench --processor-time    processor time, summed over all cores: for a shared machine

A ratio is the peer's time divided by lutgen's: above 1 lutgen is faster. lutgen and its peers run in turn. Each turn
gives a ratio. The table has the median ratio and, in brackets, the smallest and largest ratio. Times are medians.
Files are in the cache and on one file system. Each row states its goal.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import warnings
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from examples import bench_appearance, bench_explore
from examples.bench_criticism import Work, criticism
from examples.racing import (
    CLOCK,
    LUTGEN,
    Peer,
    Row,
    against_limit,
    peak_memory,
    processor_seconds,
    program,
    race,
    run,
    seconds_of,
)
from lutgen import DisplayModel, apply_to_image, read_measurements
from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Lut, Sampler
from lutgen.bake.spaces import lattice
from lutgen.bindings import ocio, oiio
from lutgen.display import MODES, default_display
from lutgen.files import write_atomically
from lutgen.names import AGING_MODES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from lutgen.colorimetry import Array

with warnings.catch_warnings():
    # colour-science warns about optional packages that nothing here needs.
    warnings.simplefilter("ignore")
    import colour

MODE, HOURS = "chroma", 10_000.0
MEMORY_LIMIT_MB, START_LIMIT_S, APPLY_LIMIT, CORRECTION_LIMIT = 300.0, 0.3, 1 / 1.3, 1 / 4
DISPLAY_A = Path(__file__).with_name("display-a.csv")
FOLDER = f"{MODE}/10000h"


@dataclass(frozen=True)
class Bench:
    """The amount of work: ``sizes`` of tables, ``hours`` of the build, timed ``bakes`` of its LUTs, repetitions.

    ``corrected``: the hours of the corrections.
    """

    sizes: tuple[int, ...] = (33, 65)
    hours: str = "0..18000"
    corrected: str = "5000,10000,18000"
    bakes: int = 12
    width: int = 6000
    height: int = 4000
    short: int = 21
    long: int = 3
    criticism: Work = field(default_factory=Work)
    appearance: bench_appearance.Work = field(default_factory=bench_appearance.Work)
    exploring: bench_explore.Work = field(default_factory=bench_explore.Work)

    @classmethod
    def quick(cls) -> Bench:
        """Return little work for every row."""
        small, picture = Work.quick(), bench_appearance.Work.quick()
        return cls(
            (17, 33),
            hours="0,10000",
            corrected="10000",
            bakes=1,
            width=300,
            height=200,
            short=3,
            long=1,
            criticism=small,
            appearance=picture,
            exploring=bench_explore.Work.quick(),
        )


# ---- evaluating the model


@dataclass(frozen=True)
class ColourScience:
    """The paper's model with colour-science's functions, vectorised as in its documentation."""

    matrices: Array

    def head(self, code: Array) -> tuple[Array, Any]:
        """Steps 4 and 5: linear light and the nearest colour point; they are the same at every hour."""
        linear = colour.cctf_decoding(code, function="sRGB")
        points = np.array([[1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        return linear, np.linalg.norm(linear[:, np.newaxis] - points, axis=-1).argmin(axis=-1)

    def tail(self, linear: Array, nearest: Any) -> Any:
        """Step 6: the aged XYZ, then a viewer's code values."""
        xyz = colour.algebra.vecmul(self.matrices[nearest], linear)
        aged = colour.XYZ_to_RGB(xyz, "sRGB", chromatic_adaptation_transform=None)
        return colour.cctf_encoding(np.clip(aged, 0, 1), function="sRGB")


def evaluation(bench: Bench, model: DisplayModel) -> Iterator[Row]:
    """Race the model on a lattice: all steps, and only the additional cost of one more hour of a build."""
    aged = model.at(MODE, HOURS)
    rival = ColourScience(model.matrices(MODE, HOURS).array)
    for size in bench.sizes:
        code, sampler = lattice(size, "code"), Sampler()
        head = rival.head(code)
        # Both give the same results, up to the rounding of four-decimal matrices and except on greys, where the paper's
        # nearest point is a tie.
        if np.median(np.abs(aged.code_to_code(code) - rival.tail(*head))) > 1e-4:
            raise SystemExit("bench: colour-science's way and lutgen's do not give the same colours")
        yield from race(
            f"evaluate {size}³",
            partial(aged.code_to_code, code),
            Peer("colour-science, vectorised", lambda code=code: rival.tail(*rival.head(code))),  # type: ignore[misc]
            times=bench.short,
        )
        yield from race(
            f"evaluate {size}³, a further hour of a build",
            partial(sampler.lut, aged, size, "code", clip=True),
            Peer("colour-science, vectorised", partial(rival.tail, *head)),
            times=bench.short,
        )


# ---- writing .cube


def writing(bench: Bench, model: DisplayModel, built: Path, folder: Path) -> Iterator[Row]:
    """Race writing a table in memory to a .cube file on disk."""
    lib, form, sampler = ocio(), format_named("cube"), Sampler()
    aged = model.at(MODE, HOURS)
    provenance = Provenance("bench", "bench", ("what an aged display shows",))
    source, scratch = folder / "source.cube", _new(folder / "cubes")
    own = scratch / "own.cube"
    for size in bench.sizes:
        lut = sampler.lut(aged, size, "code", clip=True)
        data = form.write(lut, provenance)
        rows = lut.table.reshape(-1, 3)
        table = colour.LUT3D(np.ascontiguousarray(lut.table.transpose(2, 1, 0, 3)), name="bench")
        source.write_bytes(data)

        def write(lut: Lut = lut) -> None:
            write_atomically(own, form.write(lut, provenance))

        def evaluate_and_write(size: int = size) -> None:
            write_atomically(own, form.write(sampler.lut(aged, size, "code", clip=True), provenance))

        baker = _baker(lib, built, size)
        bake = partial(baker.bake, str(scratch / "baker.cube"))
        first = size == bench.sizes[0]
        yield from race(
            f"write .cube {size}³ ({len(data) / 1e6:.1f} MB)",
            write,
            Peer("OpenColorIO Baker (it evaluates too)", bake),
            Peer(
                "colour.write_LUT",
                partial(colour.write_LUT, table, str(scratch / "colour.cube"), method="Iridas Cube"),
                60.0 if first else None,
            ),
            Peer("numpy.savetxt", partial(np.savetxt, scratch / "numpy.cube", rows, fmt="%.7f")),
            Peer("the limit: copying the same bytes", partial(shutil.copyfile, source, scratch / "copy.cube")),
            times=bench.short,
            scratch=scratch,
        )
        yield from race(
            f"evaluate + write .cube {size}³",
            evaluate_and_write,
            Peer("OpenColorIO Baker", bake, 10.0),
            times=bench.short,
            scratch=scratch,
        )


def _new(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _baker(lib: Any, built: Path, size: int) -> Any:
    baker = lib.Baker()
    baker.setConfig(lib.Config.CreateFromFile(str(built / FOLDER / "config.ocio")))
    baker.setFormat("resolve_cube" if size > 65 else "iridas_cube")
    baker.setInputSpace("Aged display")
    baker.setTargetSpace("Source signal")
    baker.setCubeSize(size)
    return baker


# ---- the whole build, as processes


def building(bench: Bench, built: Path, folder: Path) -> Iterator[Row]:
    """Race `lutgen build` against ociobakelut, which runs once per LUT on lutgen's config."""
    configs = sorted(path for path in built.glob("*/*/config.ocio"))
    bakes = [configs[i * len(configs) // bench.bakes] for i in range(bench.bakes)]
    baker = program("ociobakelut")

    def bake_all() -> None:
        for config in bakes:
            spaces = ("--inputspace", "Aged display", "--outputspace", "Source signal")
            shape = ("--format", "iridas_cube", "--cubesize", "33", str(folder / "baked.cube"))
            run([str(baker), "--iconfig", str(config), *spaces, *shape])

    name = f"ociobakelut × {len(configs)}, {len(bakes)} timed"
    for title, options, goal in (("no certificates", ("--no-certificates",), 10.0), ("certificates", (), 4.0)):
        yield from race(
            f"build {len(configs)} .cube and configs, {title}",
            partial(build, bench, folder / "build", *options),
            Peer(name, bake_all if baker else None, goal, len(configs) / len(bakes)),
            times=bench.long,
        )
    yield from race(
        "check that build",
        lambda: run([*LUTGEN, "check", str(folder / "build")]),
        Peer("lutgen build, the same", partial(build, bench, folder / "again"), 1.0),
        times=bench.long,
    )
    peaks = [peak_memory([*LUTGEN, *_build_arguments(bench, folder / "build")], folder) for _ in range(bench.long)]
    yield against_limit("peak memory of that build (PSS, parent and workers)", peaks, MEMORY_LIMIT_MB, "MB")


def build(bench: Bench, output: Path, *options: str) -> None:
    """Build into a new folder; removing the previous folder takes about a hundredth of the time."""
    shutil.rmtree(output, ignore_errors=True)
    run([*LUTGEN, *_build_arguments(bench, output, *options)])


def _build_arguments(bench: Bench, output: Path, *options: str) -> list[str]:
    what = ["--format", "cube", "--mode", "all", "--hours", bench.hours]
    return ["build", *what, "--force", *options, "-o", str(output)]


# ---- corrections


def compensating(bench: Bench, folder: Path) -> Iterator[Row]:
    """Race the corrections of a display with effects, found by search, against forward LUTs of these displays."""
    model, output = folder / "refined.toml", folder / "corrections"
    run([*LUTGEN, "refine", str(DISPLAY_A), "--auto", "-o", str(model)])
    what = ["build", "--model", str(model), "--hours", bench.corrected, "--force"]
    luts = 2 * len(AGING_MODES) * len(bench.corrected.split(","))

    def both(direction: str) -> None:
        shutil.rmtree(output, ignore_errors=True)
        run([*LUTGEN, *what, "--direction", direction, "-o", str(output)])

    forwards = Peer("lutgen, the same displays forwards", partial(both, "simulate"), CORRECTION_LIMIT)
    name = f"build {luts} corrections of a refined display, certificates"
    yield from race(name, partial(both, "compensate"), forwards, times=bench.long)


# ---- applying to images


def applying(bench: Bench, model: DisplayModel, built: Path, folder: Path) -> Iterator[Row]:
    """Race a large picture, file to file: the direct model and a built LUT, against OpenImageIO with OpenColorIO."""
    lib, aged, lut = oiio(), model.at(MODE, HOURS), built / FOLDER / "aged.cube"
    picture = tiled_tissue(bench.width, bench.height)
    megapixels = bench.width * bench.height / 1e6
    scratch = _new(folder / "images")
    size = f"{megapixels:.0f}" if megapixels >= 1 else f"{megapixels:.2f}"
    for name, suffix, depth in (
        ("PNG 8", "png", "uint8"),
        ("TIFF 8", "tif", "uint8"),
        ("TIFF 16", "tif", "uint16"),
        ("EXR half", "exr", "half"),
    ):
        source, output = folder / f"source.{suffix}", scratch / f"aged.{suffix}"
        _save(lib, picture, source, depth)
        theirs = OpenImageIO(lib, source, scratch / f"theirs.{suffix}", depth, built, linear=suffix == "exr")
        peers = [
            Peer("OpenImageIO + OpenColorIO (Python)", theirs.python, APPLY_LIMIT),
            Peer("oiiotool", theirs.oiiotool if shutil.which("oiiotool") else None, APPLY_LIMIT),
        ]
        for how, aging in (("model", aged), ("LUT", lut)):
            peers_here = [*peers, _colour_apply(lut, picture)] if name == "TIFF 8" else peers
            mine = partial(apply_to_image, source, output, aging, force=True)
            yield from race(f"apply {how} to {size} Mpx, {name}", mine, *peers_here, times=bench.long, scratch=scratch)


def tiled_tissue(width: int, height: int) -> Any:
    """Return real tissue (skimage's immunohistochemistry image), mirrored tile by tile to avoid seams."""
    from skimage.data import immunohistochemistry

    tile = immunohistochemistry()
    tile = np.concatenate([tile, tile[:, ::-1]], axis=1)
    tile = np.concatenate([tile, tile[::-1]], axis=0)
    repeats = (-(-height // tile.shape[0]), -(-width // tile.shape[1]), 1)
    return np.ascontiguousarray(np.tile(tile, repeats)[:height, :width])


def _save(lib: Any, picture: Any, path: Path, depth: str) -> None:
    values = picture / np.float32(255)
    if depth == "half":
        values = np.asarray(colour.cctf_decoding(values, function="sRGB"), np.float32)
    spec = lib.ImageSpec(picture.shape[1], picture.shape[0], 3, lib.FLOAT)
    buffer = lib.ImageBuf(spec)
    buffer.set_pixels(lib.ROI(), values)
    buffer.set_write_format(depth)
    buffer.specmod().attribute("compression", "zip")
    if not buffer.write(str(path)):
        raise SystemExit(f"bench: {path}: {buffer.geterror()}")


@dataclass(frozen=True)
class OpenImageIO:
    """The same picture, file to file, by OpenImageIO, which applies the LUT or the config's look with OpenColorIO."""

    lib: Any
    source: Path
    output: Path
    depth: str
    built: Path
    linear: bool

    def python(self) -> None:
        """Run its Python binding."""
        lib, aged = self.lib, self.lib.ImageBuf()
        read, config = lib.ImageBuf(str(self.source)), str(self.built / FOLDER / "config.ocio")
        if self.linear:
            look, space = "Aged display look", "Linear sRGB"
            done = lib.ImageBufAlgo.ociolook(aged, read, look, space, space, colorconfig=config)
        else:
            lut = str(self.built / FOLDER / "aged.cube")
            done = lib.ImageBufAlgo.ociofiletransform(aged, read, lut, colorconfig=config)
        aged.set_write_format(self.depth)
        if not (done and aged.write(str(self.output))):
            raise SystemExit(f"bench: OpenImageIO: {aged.geterror() or lib.geterror()}")

    def oiiotool(self) -> None:
        """Run its command."""
        step = ["--ociofiletransform", str(self.built / FOLDER / "aged.cube")]
        if self.linear:
            step = ["--ociolook:from=Linear sRGB:to=Linear sRGB", "Aged display look"]
        config = ["--colorconfig", str(self.built / FOLDER / "config.ocio")]
        run(["oiiotool", *config, str(self.source), *step, "-d", self.depth, "-o", str(self.output)])


def _colour_apply(lut: Path, picture: Any) -> Peer:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = colour.read_LUT(str(lut))
    crop = picture[:500, :500] / 255.0
    tetrahedral = colour.algebra.table_interpolation_tetrahedral
    scale = picture.shape[0] * picture.shape[1] / (crop.shape[0] * crop.shape[1])
    name = f"colour.LUT3D.apply (no files; {crop.shape[1]} × {crop.shape[0]} timed)"
    return Peer(name, partial(table.apply, crop, interpolator=tetrahedral), None, scale)


# ---- what becomes of pictures


def appearing(work: bench_appearance.Work, model: DisplayModel, folder: Path) -> Iterable[Row]:
    """Race colour differences and lifetimes of a large picture."""
    return bench_appearance.appearance(work, model, tiled_tissue(work.width, work.height), folder)


# ---- start-up, and the table


def starting(bench: Bench) -> Row:
    """Time `lutgen --help` as a process."""
    seconds = [seconds_of(partial(run, [*LUTGEN, "--help"])) for _ in range(bench.short)]
    return against_limit("lutgen --help", seconds, START_LIMIT_S, "s")


#: Parts of the table.
PARTS = (
    "evaluation", "writing", "building", "compensating", "applying", "criticism", "appearance", "exploring", "starting",
)  # fmt: skip


def all_rows(bench: Bench, folder: Path, parts: Sequence[str]) -> Iterator[Row]:
    """Run some parts; yield each row as soon as it is known."""
    model = DisplayModel(read_measurements(default_display()))
    built = folder / "built"
    if {"writing", "building", "applying"} & set(parts):
        build(bench, built)
    rows: dict[str, Callable[[], Iterable[Row]]] = {
        "evaluation": lambda: evaluation(bench, model),
        "writing": lambda: writing(bench, model, built, folder),
        "building": lambda: building(bench, built, folder),
        "compensating": lambda: compensating(bench, folder),
        "applying": lambda: applying(bench, model, built, folder),
        "criticism": lambda: criticism(bench.criticism, folder),
        "appearance": lambda: appearing(bench.appearance, model, folder),
        "exploring": lambda: bench_explore.exploring(bench.exploring, folder),
        "starting": lambda: [starting(bench)],
    }
    for part in parts:
        yield from rows[part]()


def print_table(rows: list[Row], bench: Bench) -> None:
    """Print the table for people."""
    from rich.console import Console
    from rich.table import Table

    table = Table("what", "lutgen", "peer", "", "ratio", "(spread)", "goal", "met?", box=None, pad_edge=False)
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
        spread = "" if row.low is None or row.high is None else f"({row.low:.3g} to {row.high:.3g})"
        goal = "" if row.goal is None else f"≥ {row.goal:.2g}"
        peer = "" if row.peer is None else _quantity(row.peer, row.unit)
        table.add_row(row.what, _quantity(row.lutgen, row.unit), peer, row.peer_name, ratio, spread, goal, row.met)
    console = Console(width=200)
    console.print(table, highlight=False)
    console.print(_footnotes(bench), highlight=False, soft_wrap=True)


def _quantity(value: float, unit: str) -> str:
    if unit == "s" and value < 1:
        return f"{value * 1e3:.3g} ms"
    return f"{value:.3g} {unit}"


def _footnotes(bench: Bench) -> str:
    return (
        "ratio: the peer's time over lutgen's, median of turns taken alternately "
        f"({bench.short} turns; builds and images {bench.long}).\n"
        f"ociobakelut: {bench.bakes} processes timed one after the other and scaled to all LUTs; lutgen uses "
        f"{os.cpu_count()} cores. apply: ≥ {APPLY_LIMIT:.2g} is at most 1.3 times their time; corrections: "
        f"≥ {CORRECTION_LIMIT:.2g} at most 4 times.\n"
        f"Python {sys.version.split()[0]}, numpy {np.__version__}, colour {colour.__version__}, "
        f"OpenColorIO {ocio().__version__}, OpenImageIO {oiio().__version__}; modes {', '.join(MODES)}."
    )


def main() -> None:
    """Measure, then print."""
    parser = argparse.ArgumentParser(description="How fast lutgen is, against other programs.")
    parser.add_argument("--quick", action="store_true", help="small work, few repetitions: does every row run?")
    parser.add_argument("--json", action="store_true", dest="as_json", help="print rows as JSON")
    parser.add_argument("--only", choices=PARTS, action="append", help="this part of the table; repeat for more")
    parser.add_argument("--processor-time", action="store_true", help="not the wall's clock: for a busy machine")
    arguments = parser.parse_args()
    if arguments.processor_time:
        CLOCK.read = processor_seconds
    bench = Bench.quick() if arguments.quick else Bench()
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        rows = []
        for row in all_rows(bench, Path(folder), arguments.only or PARTS):
            print(f"{row.what} · {row.peer_name}", file=sys.stderr)
            rows.append(row)
    if arguments.as_json:
        print(json.dumps([{**asdict(row), "met": row.met} for row in rows], indent=1, ensure_ascii=False))
    else:
        print_table(rows, bench)


if __name__ == "__main__":
    main()
