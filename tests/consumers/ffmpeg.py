"""ffmpeg's lut3d and haldclut at 16 bit; at 8 bit they truncate. It runs in the LUT's folder: the name needs no quotes.

From an 8-bit picture, ``format=rgb48le`` converts 255 to 65280, which is one code too dark at white; ``zscale`` gives
65535.
"""

import subprocess
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

import numpy as np

from lutgen.lint.finding import READS, REFUSES, WRONG
from lutgen.lint.programs import FFMPEG_LUT3D, Refusal, probe_colours
from tests.consumers import TIMEOUT, Claim, Consumer, Job, Picture, first_line, program, read_image, run, write_image
from tests.consumers._claims import cubes, unlike
from tests.hald_cases import HALDS
from tests.mesh_cases import BLUE, GREEN, MESHES


def tool() -> str:
    return program("ffmpeg", "ffmpeg")


@cache
def version() -> str:
    return first_line(run(tool(), "-version")).removeprefix("ffmpeg version ").partition(" ")[0]


def call(job: Job, source: Path, filters: str) -> Picture:
    result = job.scratch / "ffmpeg.tif"
    result.unlink(missing_ok=True)
    quiet = ("-nostdin", "-loglevel", "error", "-y")
    run(tool(), *quiet, "-i", source, "-vf", filters, "-pix_fmt", "rgb48le", result, cwd=job.cube.parent)
    return read_image(result)


def haldclut(job: Job) -> Picture:
    result = job.scratch / "ffmpeg.tif"
    result.unlink(missing_ok=True)
    deep = "[0]format=rgb48le[image];[1]format=rgb48le[table];[image][table]haldclut=interp=tetrahedral"
    inputs = ("-nostdin", "-loglevel", "error", "-y", "-i", job.png16, "-i", job.lut("hald"))
    run(tool(), *inputs, "-filter_complex", deep, "-frames:v", "1", "-pix_fmt", "rgb48le", result)
    return read_image(result)


def lut3d(job: Job, interpolation: str) -> Picture:
    return call(job, job.png16, f"format=rgb48le,lut3d=file={job.cube.name}:interp={interpolation}")


def zscale(job: Job) -> Picture:
    return call(job, job.png8, f"zscale=dither=none,format=gbrp16le,lut3d=file={job.cube.name}:interp=tetrahedral")


def faulty_halds(folder: Path) -> Iterator[str]:
    pixels = np.random.default_rng(51).integers(0, 256, (8, 8, 3), dtype=np.uint8)
    write_image(folder / "in.png", pixels)
    result = folder / "out.png"
    for name, (data, statement, _) in HALDS.items():
        (folder / "table.png").write_bytes(data())
        result.unlink(missing_ok=True)
        command = [tool(), "-nostdin", "-loglevel", "quiet", "-i", "in.png", "-i", "table.png"]
        command += ["-filter_complex", "haldclut", "-frames:v", "1", "out.png"]
        done = subprocess.run(command, cwd=folder, check=False, capture_output=True, timeout=TIMEOUT)
        if done.returncode:
            # Later versions of ffmpeg refuse some files that earlier versions show wrongly.
            if statement == READS:
                yield from unlike(name, REFUSES, statement)
        elif statement == REFUSES:
            yield from unlike(name, "shows something", statement)
        # The file "ours" shows an aged display; excess rows do not change the first rows.
        elif name not in {"ours", "rows more"}:
            right = np.abs(read_image(result).astype(int) - pixels * [1, 0.8, 1]).max() <= 2
            yield from unlike(name, READS if right else WRONG, statement)


def meshes(folder: Path) -> Iterator[str]:
    path, code = folder / "lut.3dl", probe_colours()
    for name, (text, _, statement) in MESHES.items():
        path.write_text(text(), newline="")
        try:
            shown = FFMPEG_LUT3D.apply(path, code)
        except Refusal:
            yield from unlike(name, REFUSES, statement)
        else:
            # ffmpeg divides by 4096.
            right = np.abs(shown - code / 255 * [1, GREEN, BLUE]).max() < 5e-4
            yield from unlike(name, READS if right else WRONG, statement)


CLAIMS = [
    cubes(FFMPEG_LUT3D),
    Claim("ffmpeg haldclut", version, f"reads {len(HALDS)} Hald images as lint says", faulty_halds),
    Claim("ffmpeg lut3d", version, f"reads {len(MESHES)} forms of .3dl as lint says", meshes),
]

CONSUMERS = [
    *(
        Consumer("ffmpeg lut3d", version, "aged.cube", how, partial(lut3d, interpolation=how))
        for how in ("tetrahedral", "trilinear")
    ),
    Consumer("ffmpeg haldclut", version, "aged-hald.png", "tetrahedral", haldclut),
    Consumer("ffmpeg zscale, lut3d", version, "aged.cube", "tetrahedral", zscale),
]
