"""Trials of installed readers of ``.cube``. All use trilinear interpolation, which every reader supports.

``PROGRAMS`` lists the readers. To add a reader, add a :class:`Program`: its name, its version, and a function that
applies a file to code values. ``lutgen lint --try`` compares the colours of a reader with lutgen's own reading,
:func:`read_as_meant`. :func:`refusal` and :func:`loading` try OpenColorIO on the other formats too.
"""

import shutil
import subprocess
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lutgen.bindings import named_for_ocio, ocio, ocio_errors, unclosed_metadata, warnings_logged
from lutgen.colorimetry import Array
from lutgen.errors import in_one_line
from lutgen.files import under_its_name
from lutgen.lint import finding
from lutgen.lint.cube_scan import CubeScan
from lutgen.lint.stream import MAX_KEPT

#: Seconds after which a program counts as hung. Each program needs less than 2 s for the largest tried table.
TIMEOUT = 60

#: Number of colours that are sent through a file, and their seed. With 8 bits, each reader gets exactly the same ones.
COLOURS, SEED = 400, 20250611

#: Maximum size of a file for trials, in bytes: readers that trust its header may fill the memory or run for hours.
MAX_BYTES = 200 << 20

#: Exceptions of colour-science for files that it cannot read.
_RAISED = (
    ValueError, IndexError, KeyError, AttributeError, TypeError, NameError, AssertionError, MemoryError, OverflowError,
)  # fmt: skip


class Refusal(Exception):  # noqa: N818 - not an error of lutgen: the answer of a reader
    """The reader refuses the file. The text is the reader's message."""


class Absent(Exception):  # noqa: N818 - not an error: a state of this machine
    """The reader is not installed. The text says how to install it."""


@dataclass(frozen=True)
class Program:
    """A reader."""

    #: Returns its name in ``finding.READERS``.
    reader: Callable[[], str]
    #: Returns its version, or raises ``Absent``.
    version: Callable[[], str]
    #: Applies the file to 8-bit code values (n, 3), or raises ``Refusal``.
    apply: Callable[[Path, NDArray[np.uint8]], Array]
    #: Maximum difference from lutgen's own reading, in code values 0..1.
    tolerance: float
    #: Whether it writes integers and so clips values outside 0..1.
    clips: bool


def probe_colours() -> NDArray[np.uint8]:
    """Return the colours of the trials, uint8 (n, 3): the cube's corners, greys and random colours."""
    corners = np.array(np.meshgrid([0, 255], [0, 255], [0, 255])).reshape(3, -1).T
    greys = np.repeat(np.arange(0, 256, 15)[:, np.newaxis], 3, axis=1)
    random = np.random.default_rng(SEED).integers(0, 256, (COLOURS - len(corners) - len(greys), 3))
    return np.concatenate([corners, greys, random]).astype(np.uint8)


def _through_colour(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file with colour-science's ``read_LUT``, in double precision."""
    import colour

    trilinear = colour.algebra.table_interpolation_trilinear
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            lut = colour.read_LUT(str(path))
            shown = code / 255
            for part in lut if isinstance(lut, colour.LUTSequence) else [lut]:
                options = {"interpolator": trilinear} if isinstance(part, colour.LUT3D) else {}
                shown = part.apply(shown, **options)
    # Users of the reader see these exceptions too, so they count as a refusal.
    except _RAISED as error:
        raise Refusal(f"{type(error).__name__}: {error}") from None
    return np.asarray(shown, dtype=np.float64)


@cache
def _ffmpeg_version() -> str:
    program = shutil.which("ffmpeg")
    if program is None:
        raise Absent("ffmpeg is not on the PATH (Debian: apt install ffmpeg)")
    output = subprocess.run([program, "-version"], capture_output=True, check=False, timeout=TIMEOUT).stdout  # noqa: S603 - no shell
    words = output.decode(errors="replace").split()
    return words[2] if len(words) > 2 else "of no version"


def _through_ffmpeg(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file with ffmpeg's ``lut3d`` to 16-bit pixels, in the file's folder, so that its path needs no quotes."""
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb48le")
    command = [
        "ffmpeg", "-nostdin", "-loglevel", "error", *raw, "-s", f"{len(code)}x1", "-i", "pipe:0",
        "-vf", f"lut3d=file={path.name}:interp=trilinear", *raw, "pipe:1",
    ]  # fmt: skip
    pixels = (code.astype("<u2") * 257).tobytes()
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            command, input=pixels, capture_output=True, cwd=path.parent, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        raise Refusal(f"gives no answer in {TIMEOUT} s") from None
    if done.returncode or len(done.stdout) != len(pixels):
        first, _, _ = done.stderr.decode(errors="replace").partition("\n")
        raise Refusal(first.partition("] ")[2] or "ends with an error")
    return np.frombuffer(done.stdout, "<u2").reshape(-1, 3) / 65535


def opencolorio_reader() -> str:
    """Return the name in ``finding.READERS`` of the installed OpenColorIO."""
    return finding.OCIO_21 if _opencolorio_version().startswith("2.1.") else finding.OCIO_26


def _opencolorio_version() -> str:
    return str(ocio().__version__)


def through_opencolorio(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file with OpenColorIO's CPU renderer, in float32. Raises Refusal when OpenColorIO refuses the file."""
    lib = ocio()
    if unclosed_metadata(path):
        raise Refusal("was not tried, since it would search for the end of the metadata for ever")
    # The caches of OpenColorIO use the path as their key, and would return the old content of a rewritten file.
    lib.ClearAllCaches()
    transform = lib.FileTransform(src=named_for_ocio(path), interpolation=lib.INTERP_LINEAR)
    with warnings_logged(lib):
        try:
            processor = lib.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor()
        except ocio_errors() as error:
            raise Refusal(str(error)) from None
    result = (code / 255).astype(np.float32)
    processor.applyRGB(result)
    return result.astype(np.float64)


def _pillow_version() -> str:
    try:
        return version_of("pillow_lut")
    except PackageNotFoundError:
        raise Absent("pillow_lut is not installed (pip install pillow_lut)") from None


def _through_pillow(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file with pillow_lut and Pillow's colour table: 8 bit in, 8 bit out."""
    try:
        table = import_module("pillow_lut").load_cube_file(str(path))
    # Users of the reader see these exceptions too, so they count as a refusal.
    except (ValueError, IndexError, OverflowError, MemoryError) as error:
        raise Refusal(f"{type(error).__name__}: {error}") from None
    shown = import_module("PIL.Image").fromarray(code[np.newaxis]).filter(table)
    return np.asarray(np.asarray(shown)[0] / 255)


_colour_version = partial(version_of, "colour-science")  # which lutgen requires

COLOUR_SCIENCE = Program(lambda: finding.COLOUR, _colour_version, _through_colour, tolerance=1e-5, clips=False)
FFMPEG_LUT3D = Program(lambda: finding.FFMPEG, _ffmpeg_version, _through_ffmpeg, tolerance=4 / 65535, clips=True)
OPENCOLORIO = Program(opencolorio_reader, _opencolorio_version, through_opencolorio, tolerance=1e-5, clips=False)
PILLOW_LUT = Program(lambda: finding.PILLOW, _pillow_version, _through_pillow, tolerance=1.5 / 255, clips=True)

#: The readers, in the order of the trials.
PROGRAMS = (COLOUR_SCIENCE, FFMPEG_LUT3D, OPENCOLORIO, PILLOW_LUT)


def refusal(path: Path) -> str:
    """Return the reason why the installed OpenColorIO refuses a file; empty when it reads the file."""
    try:
        through_opencolorio(path, probe_colours())
    except Refusal as error:
        reason = in_one_line(error)
        return reason.rpartition("failed with: ")[2].replace(str(path), path.name)[:300] or "it gives no reason"
    return ""


def loading(why: str | None, *readers: str) -> Iterator[finding.LintFinding]:
    """Yield the finding for a result of :func:`refusal` (None: not tried). OpenColorIO 2.1 and 2.6 agree."""
    if why:
        fates = finding.refused(*readers, how=f"OpenColorIO {_opencolorio_version()} was tried")
        yield finding.LintFinding(f"is not read: {why}", "Export it again.", 0, fates)
    elif why is None:
        fates = finding.refused(*finding.OCIO, how="takes 129 points per axis at most")
        yield finding.LintFinding("is too large to be given to OpenColorIO", "Resample it to 65 or 33.", 0, fates)


#: Irregularities that leave the colours of a table undefined.
MEANINGLESS = {"nan", "infinite", "overflow", "columns", "text", "NUL"}


def read_as_meant(scan: CubeScan, code: Array) -> Array | None:
    """Return the intended colours for code values, (n, 3), of a scan that stored its rows; None: it defines none."""
    if MEANINGLESS & set(scan.oddities) or len(scan.named("LUT_3D_SIZE")) > 1 or not (scan.size or scan.size_1d):
        return None
    shown = _through_curves(scan, code) if scan.size_1d else code
    return _through_table(scan, shown) if scan.size and shown is not None else shown


def _through_curves(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_1D_INPUT_RANGE")
    surplus = scan.table.rows and not scan.size
    if place is None or surplus or len(scan.shaper) != scan.size_1d or scan.size_1d < 2:
        return None
    index = np.linspace(0, 1, scan.size_1d)
    return np.column_stack([np.interp(place[:, i], index, scan.shaper[:, i]) for i in range(3)])


def _through_table(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_3D_INPUT_RANGE")
    table = scan.table.table
    if place is None or table is None or len(table) != scan.size**3:
        return None
    from scipy.interpolate import interpn

    # A table of one point is constant: `resize` repeats its row.
    size = max(scan.size, 2)
    values = np.resize(table, (size, size, size, 3))
    return np.asarray(interpn((np.linspace(0, 1, size),) * 3, values, place[:, ::-1]))


def _place(scan: CubeScan, code: Array, keyword: str) -> Array | None:
    """Return the position of code values in the input range of a part, 0..1; None for an empty range."""
    low, high = np.zeros(3), np.ones(3)
    if keyword == "LUT_3D_INPUT_RANGE" or not scan.size:
        low, high = scan.domain
    for entry in scan.named(keyword):
        if ends := entry.numbers(2):
            low, high = np.full(3, ends[0]), np.full(3, ends[1])
    return np.clip((code - low) / (high - low), 0, 1) if (high > low).all() else None


def try_cube(scan: CubeScan) -> Iterator[finding.Trial]:
    """Yield the trial of each reader on a file that was scanned with ``keep``."""
    code = probe_colours()
    meant = read_as_meant(scan, code / 255)
    for program in PROGRAMS:
        try:
            version = program.version()
        except Absent as absent:
            yield finding.Trial(program.reader(), "", "", str(absent))
            continue
        if max(scan.size, scan.size_1d >> 8) > MAX_KEPT or scan.length > MAX_BYTES:
            why = f"not tried: more than {MAX_KEPT} points per axis, or 200 MiB"
            yield finding.Trial(program.reader(), version, "", why)
            continue
        yield finding.Trial(program.reader(), version, *_outcome(program, scan.path, code, meant))


def _outcome(program: Program, path: Path, code: NDArray[np.uint8], meant: Array | None) -> tuple[str, str]:
    with under_its_name(path, ".cube") as link:
        try:
            shown = program.apply(link, code)
        except Refusal as refusal:
            return finding.REFUSES, in_one_line(str(refusal).replace(str(link), path.name))[:300]
    if meant is None:
        return finding.WRONG, "shows colours, though the file defines none"
    if program.clips:
        shown, meant = np.clip(shown, 0, 1), np.clip(meant, 0, 1)
    difference = float(np.abs(shown - meant).max())
    # With NaN the comparison is false.
    agrees = difference <= program.tolerance * max(1.0, float(np.abs(meant).max()))
    return finding.READS if agrees else finding.WRONG, f"differs from our reading by {difference:.2g} at most"


def try_config(path: Path) -> finding.Trial:
    """Return the trial of ``ociocheck``, which loads and validates a config but opens no LUT file."""
    trial, program = partial(finding.Trial, finding.OCIOCHECK), shutil.which(finding.OCIOCHECK)
    if program is None:
        return trial("", "", "ociocheck is not on the PATH (Debian: apt install opencolorio-tools)")
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            [program, "--iconfig", str(path)], capture_output=True, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        return trial("", finding.REFUSES, f"gives no answer in {TIMEOUT} s")
    output = [line for line in done.stdout.decode(errors="replace").splitlines() if line.strip()]
    stated = [line.split(":")[1].strip() for line in output if line.startswith("OpenColorIO Library Version")]
    version = stated[0] if stated else ""
    if done.returncode:
        return trial(version, finding.REFUSES, output[-1] if output else "ends with an error, without a message")
    return trial(version, finding.READS, "loads and validates")
