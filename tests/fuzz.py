"""``make fuzz``: seeded mutations of every reader, faults in builds, and builds that are killed.

    python -m tests.fuzz --count 100000 --seed 1     the nightly run
    python -m tests.fuzz --only readers --seed 7     only one kind

Every kind draws its cases from the seed. A failure is printed with the kind, the file and the number of its case;
``--case`` runs this case again. The requirements are:

``readers``  a mutated file of any reader is read, or refused with one sentence; OpenColorIO reads a .cube
             that lint calls clean as it is meant (one in ``ASKED``)
``rows``     the strict reader refuses a mutated .cube of a build, or OpenColorIO reads the table that was baked
``builds``   a build has one fault, and its manifest agrees with the fault: ``check`` names the fault
``kills``    a build that is killed leaves no incomplete file, and the next build succeeds
"""

import argparse
import io
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from unittest import mock

import numpy as np

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.bake.formats import Provenance, format_named, format_names
from lutgen.bake.lut import Lut, Sampler, table_of
from lutgen.bake.manifest import MANIFEST, HeldFile, sha256
from lutgen.bake.own_reading import SINGLE, checked_table
from lutgen.bake.readback import apply_lut
from lutgen.display import DisplayModel, default_display, load_model
from lutgen.errors import LutgenError
from lutgen.lint import lint, programs
from lutgen.lint.finding import READS
from lutgen.lint.programs import OPENCOLORIO
from lutgen.readings import read_campaign, read_measurements, read_session

ROOT = Path(__file__).resolve().parents[1]

#: Number of mutations per case of each kind. A fault in a build is slow because of the check, a kill because of the
#: process.
SHARES = {"readers": 1, "rows": 2, "builds": 400, "kills": 1000}

#: One clean .cube out of this number is read by OpenColorIO too.
ASKED = 2

#: Text that programs and people leave in files.
TOKENS = (
    b"nan", b"-inf", b"1e999", b"1e-46", b"0x10", b"1_000", b"1,5", b"1;2", b"1'000", b"1/2", b"1e", b"1.2.3", b"#N/A",
    b"\xef\xbc\x91", b"\xd9\xa1", b"\0", b"\r", b"\xff\xfe", b"\xef\xbb\xbf", b"\n\n", b"\t", b'"', b"9" * 5000, b"-1",
    b"LUT_3D_SIZE 99999999999\n", b"LUT_1D_SIZE 2\n", b"DOMAIN_MAX 2 2 2\n", b"<!ENTITY a 'b'>", b"[" * 2000, b"{}",
    b"END METADATA\n", b"BEGIN_DATA\n", b"../../etc", b"\xc3\x28",
)  # fmt: skip


@dataclass(frozen=True)
class Failure:
    """A violated requirement, and the information to reproduce it."""

    kind: str
    case: int
    what: str


def mutated(data: bytes, chance: random.Random) -> bytes:
    """Make one to three edits: bytes changed, cut, doubled, moved or inserted, numbers changed, the end cut off."""
    for _ in range(chance.choice((1, 1, 2, 3))):
        place, length = chance.randrange(len(data) + 1), chance.choice((1, 1, 4, 40, 400))
        part = data[place : place + length]
        match chance.randrange(8):
            case 0:
                data = data[:place] + bytes(chance.randrange(256) for _ in part) + data[place + length :]
            case 1:
                data = data[:place] + data[place + length :]
            case 2:
                data = data[:place] + part + data[place:]
            case 3:
                to = chance.randrange(len(data) + 1)
                data = data[:to] + part + data[to:]
            case 4:
                data = data[:place]
            case 5:
                data = data[:place] + chance.choice(TOKENS) + data[place:]
            case _:
                data = _number_changed(data, place, chance)
        if not data:
            return b"\n"
    return data


def _number_changed(data: bytes, place: int, chance: random.Random) -> bytes:
    number = re.compile(rb"\d+(?:\.\d*)?").search(data, place)
    if number is None:
        return data[:place] + chance.choice(TOKENS) + data[place:]
    new = chance.choice((*TOKENS, b"%.7f" % chance.random(), b"%d" % chance.randrange(1000)))
    return data[: number.start()] + new + data[number.end() :]


# ---- readers


@cache
def seeds() -> dict[str, tuple[bytes, Callable[[Path], object]]]:
    """Return a valid file of each kind by its name, and the function that reads it."""
    examples, default = ROOT / "examples", ROOT / "configs/default/chroma/10000h"
    files: dict[str, tuple[bytes, Callable[[Path], object]]] = {
        "a.csv": (_head(examples / "display-a.csv"), read_measurements),
        "session.ti3": ((examples / "session.ti3").read_bytes(), read_session),
        "campaign.toml": ((examples / "campaign/campaign.toml").read_bytes(), read_campaign),
        "model.toml": (
            b'schema = 1\n[display]\nfile = "%s"\n[model]\nreference = "relative"\nselection = "nearest"\n'
            % str(default_display()).encode(),
            load_model,
        ),
        "config.ocio": ((default / "config.ocio").read_bytes(), lint),
        "plain.clf": ((default / "aged.clf").read_bytes(), lint),
        "a.ocioz": (_zipped(default / "config.ocio", default / "aged.clf"), lint),
    }
    aged = _model().at("chroma", 9000.0)
    for name in format_names():
        form = format_named(name)
        if name not in {"ocioz", "obs"}:  # the archive is handled above; the picture's size is fixed
            lut = form.bake(Sampler(), aged, 17)[0]
            small = Lut(lut.space, table_of(lut)[:5, :5, :5]) if isinstance(lut, Lut) and name != "hald" else lut
            files[form.file] = form.write(small, Provenance("Aged display", "lutgen", ("display: Büro",))), lint
    return files


def _head(path: Path) -> bytes:
    return b"".join(path.read_bytes().splitlines(keepends=True)[:80])


def _zipped(*paths: Path) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for path in paths:
            archive.writestr(path.name, path.read_bytes())
    return buffer.getvalue()


@cache
def _model() -> DisplayModel:
    return DisplayModel(read_measurements(default_display()))


def readers(case: int, chance: random.Random, folder: Path) -> str:
    """Mutate one reader's file."""
    name = chance.choice(sorted(seeds()))
    data, read = seeds()[name]
    path = folder / name
    path.write_bytes(mutated(data, chance))
    try:
        result = read(path)
        asked = path.suffix == ".cube" and case % ASKED == 0 and lint(path).clean
        with mock.patch.object(programs, "PROGRAMS", (OPENCOLORIO,)):
            trials = lint(path, ask_readers=True).trials if asked else ()
    except LutgenError as error:
        return f"{name}: more than one line: {error}" if "\n" in str(error) else ""
    wrong = [each for each in trials if each.outcome != READS]
    if read is lint:
        json.dumps(result.as_json(), allow_nan=False)  # type: ignore[attr-defined]
    return f"{name}: called clean, and {wrong[0]}" if wrong else ""


# ---- rows of a .cube


@cache
def _small_cube() -> tuple[Lut, bytes, np.ndarray]:
    form = format_named("cube")
    lut = form.bake(Sampler(), _model().at("chroma", 9000.0), 17)[0]
    small = Lut("code", table_of(lut)[-5:, -5:, -5:])
    code = np.random.default_rng(3).random((200, 3)).astype(np.float32).astype(np.float64)
    return small, form.write(small, Provenance("Aged display", "lutgen", ("display: Büro",))), code


def _retyped(data: bytes, chance: random.Random) -> bytes:
    """Change one to three letters without changing the length, because a changed length reveals most faults."""
    letters = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 3))):
        letters[chance.randrange(len(data))] = chance.choice(b"0123456789 .-\n\te+,n")
    return bytes(letters)


def rows(_case: int, chance: random.Random, folder: Path) -> str:
    """Mutate a .cube; the strict reader must refuse it, or OpenColorIO must read the table that was baked."""
    lut, data, code = _small_cube()
    path = folder / "rows.cube"
    file = HeldFile(path, mutated(data, chance) if chance.random() < 0.2 else _retyped(data, chance))
    path.write_bytes(file.data)
    try:
        checked_table(file, lut, folder)
    except LutgenError:
        return ""
    away = float(np.abs(apply_lut(path, code) - lut.apply(code)).max())
    return "" if away <= SINGLE else f"rows.cube: accepted, and OpenColorIO is {away:.2g} off"


# ---- builds


@cache
def _built() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="fuzz-")) / "built"
    build(
        _model(),
        BuildPlan((0.0, 9000.0), modes=("chroma",), formats=("cube", "clf", "3dl"), cubesize=17),
        folder,
        jobs=1,
    )
    return folder


def builds(_case: int, chance: random.Random, folder: Path) -> str:
    """Put one fault into a file of a build, or into its manifest, and make the manifest agree with the fault."""
    here = folder / "built"
    shutil.rmtree(here, ignore_errors=True)
    shutil.copytree(_built(), here)
    manifest = json.loads((here / MANIFEST).read_text(encoding="utf-8"))
    record = chance.choice(manifest["files"])
    path = here / record["path"]
    before = path.read_bytes()
    path.write_bytes(after := _one_number(before, chance))
    record |= {"sha256": sha256(after), "bytes": len(after)}
    (here / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")
    if check(here, jobs=1).passed:
        return f"{record['path']}: not told: {_difference(before, after)}"
    return ""


#: A number without an exponent; numbers with an exponent are close to zero.
_PLAIN = re.compile(rb"(?<![\w.-])\d+(\.\d+)?(?![\w.])")


def _one_number(data: bytes, chance: random.Random) -> bytes:
    """Change one number of a file, outside comments and texts, by 0.002 or more."""
    lines = data.split(b"\n")
    telling = [
        place
        for place, line in enumerate(lines)
        if _PLAIN.search(line) and not re.match(rb"\s*(#|TITLE|<[?PD]|description|name:)", line)
    ]
    place = chance.choice(telling)
    number = chance.choice(list(_PLAIN.finditer(lines[place])))
    new = (
        b"%.7f" % (float(number[0]) + 0.002 * chance.choice((1, 10, 400)))
        if number[1]
        else b"%d" % (int(number[0]) + 9)
    )
    lines[place] = lines[place][: number.start()] + new + lines[place][number.end() :]
    return b"\n".join(lines)


def _difference(before: bytes, after: bytes) -> str:
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    return next((f"{old!r} → {new!r}" for old, new in pairs if old != new), "the length")


# ---- kills


def kills(_case: int, chance: random.Random, folder: Path) -> str:
    """Kill a build at a random moment. Existing files must be complete, and the next build must succeed and leave no
    others.
    """
    here = folder / "killed"
    shutil.rmtree(here, ignore_errors=True)
    what = ("build", "--hours", "0,9000", "--mode", "chroma", "--cubesize", "17", "--force", "-o", str(here))
    command = [sys.executable, "-m", "lutgen", *what]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as running:
        time.sleep(chance.uniform(0.2, 2.5))
        running.kill()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return f"the next build ended with {done.returncode}: {done.stderr.strip()}"
    partial_files = [path.name for path in here.rglob("*") if "partial" in path.name]
    return (
        f"left {partial_files}"
        if partial_files
        else ""
        if check(here, jobs=1).passed
        else "the next build fails its check"
    )


KINDS: dict[str, Callable[[int, random.Random, Path], str]] = {
    "readers": readers, "rows": rows, "builds": builds, "kills": kills,
}  # fmt: skip


def one(kind: str, seed: int, case: int, folder: Path) -> Failure | None:
    """Run one case. An exception other than ``LutgenError`` is a failure too."""
    try:
        what = KINDS[kind](case, random.Random(f"{seed} {kind} {case}"), folder)  # noqa: S311 - cases, not keys
    except Exception as error:  # noqa: BLE001 - that is what is looked for
        what = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return Failure(kind, case, what) if what else None


def fuzz(count: int, seed: int, kinds: tuple[str, ...] = tuple(KINDS), *, say: Callable[[str], object] = print) -> int:
    """Run ``count`` mutations, divided among the kinds; return the number of failures."""
    failures = 0
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for kind in kinds:
            cases = max(1, count // SHARES[kind])
            faults = [each for case in range(cases) if (each := one(kind, seed, case, Path(folder)))]
            say(f"{kind}: {cases} cases, {len(faults)} failures")
            for failure in faults:
                say(f"  --only {kind} --seed {seed} --case {failure.case}: {failure.what}")
            failures += len(faults)
    return failures


def main() -> int:
    """Run the cases that the arguments select; return 1 if any case failed."""
    parser = argparse.ArgumentParser(description="Seeded mutations of readers and builds.")
    parser.add_argument("--count", type=int, default=2000, help="mutations (default 2000; nightly 100000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=tuple(KINDS), action="append", help="this kind; repeat for more")
    parser.add_argument("--case", type=int, help="this case alone, with --only")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    kinds = tuple(arguments.only or KINDS)
    if arguments.case is None:
        return 1 if fuzz(arguments.count, arguments.seed, kinds, say=partial(print, flush=True)) else 0
    with tempfile.TemporaryDirectory() as folder:
        failure = one(kinds[0], arguments.seed, arguments.case, Path(folder))
    print(failure)
    return 1 if failure else 0


if __name__ == "__main__":
    sys.exit(main())
