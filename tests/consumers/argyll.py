"""Argyll: ``cctiff``, a colour engine other than LittleCMS, at 16 bit; ``xicclu``, ``iccdump`` and ``colprof``."""

import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.formats import format_named
from lutgen.bake.lut import MatrixLut, Sampler
from lutgen.colorimetry import D65, Array, code_to_linear, linear_to_xyz
from lutgen.lint.finding import ARGYLL, REFUSES
from lutgen.readings import read_session
from tests.consumers import TIMEOUT, Claim, Consumer, Job, Picture, Unavailable, first_line, program, read_image, run
from tests.consumers._claims import aged, beyond, colours, converted, profile_in, unlike
from tests.profile_cases import CASES
from tests.session_files import DRIVE, WHITE_CD_M2, light, ti3

#: Path of the sRGB profile in Debian's argyll.
SRGB = Path("/usr/share/color/argyll/ref/sRGB.icm")


def tool(name: str = "cctiff") -> str:
    return program(name, "argyll")


@cache
def version() -> str:
    # The program has no version option. It prints the version with its help text and exits with an error.
    line = first_line(run("sh", "-c", '"$0" "-?" 2>&1 || true', tool()))
    return line.rpartition(", V")[2]


def cctiff(job: Job, *profiles: str | Path) -> Picture:
    result = job.scratch / "cctiff.tif"
    result.unlink(missing_ok=True)
    run(tool(), "-p", *profiles, job.tif16, result)
    return read_image(result)


def profile(job: Job) -> Picture:
    if not SRGB.is_file():
        raise Unavailable(f"{SRGB} is missing; Debian has it in the package argyll")
    return cctiff(job, "-ir", job.lut("icc-v2"), "-ir", SRGB)


def link(job: Job) -> Picture:
    return cctiff(job, job.lut("devicelink"))


def faulty_profiles(folder: Path) -> Iterator[str]:
    for name, case in CASES.items():
        (folder / "display.icc").write_bytes(case.data)
        done = subprocess.run(
            [tool("xicclu"), "-ff", "-ir", "-px", "display.icc"],
            input=b"0.2 0.4 0.6\n", cwd=folder, capture_output=True, check=False, timeout=TIMEOUT,
        )  # fmt: skip
        answers = re.search(rb"-> \w+ -> [\d.]+ ", done.stdout)
        statement = case.outcomes[ARGYLL]
        # The program answers with numbers; this claim does not check whether they are right.
        if bool(answers) == (statement == REFUSES):
            yield from unlike(name, "answers" if answers else REFUSES, statement)


def adapted(xyz: Array) -> Array:
    """Adapt XYZ from D65 to D50."""
    import colour

    d50 = np.array([0.9642, 1.0, 0.8249])
    return np.asarray(colour.adaptation.chromatic_adaptation_VonKries(xyz, D65, d50, transform="Bradford"))


def numbers(folder: Path) -> Iterator[str]:
    code, xicclu = colours(), tool("xicclu")
    to_xyz = ("-ff", "-ir", "-px")
    answers = converted(xicclu, *to_xyz, profile_in(folder, "icc-v2"), code=code)
    yield from beyond("XYZ of icc-v2", answers, adapted(linear_to_xyz(aged().code_to_linear(code))), 5e-4)
    (lut,) = format_named("icc-matrix").bake(Sampler(), aged(), 33)
    assert isinstance(lut, MatrixLut)
    answers = converted(xicclu, *to_xyz, profile_in(folder, "icc-matrix"), code=code)
    yield from beyond("XYZ of icc-matrix", answers, adapted(linear_to_xyz(code_to_linear(code) @ lut.matrix.T)), 5e-4)
    # A table that is clipped at the gamut's edge has a kink between its points.
    answers = converted(xicclu, "-ff", profile_in(folder, "devicelink"), code=code)
    yield from beyond("code values of devicelink", answers, aged().code_to_code(code), 4e-3)


def tags(folder: Path) -> Iterator[str]:
    for name in ("icc-v2", "icc-matrix", "devicelink"):
        dump = run(tool("iccdump"), "-v3", profile_in(folder, name))
        if dump.count("tag ") < 5 or "rror" in dump or "lutgen: invented" not in dump.replace("\n", ""):
            yield f"{name}: {dump[-200:]!r}"


def own_profile(folder: Path) -> Iterator[str]:
    text = ti3().replace("CTI3", 'CTI3\nDEVICE_CLASS "DISPLAY"\nCOLOR_REP "RGB_XYZ"', 1)
    (folder / "display.ti3").write_text(text)
    run(tool("colprof"), "-as", "-ql", "display", cwd=folder)
    (profile_path,) = {*folder.glob("display.ic*")}
    session = read_session(profile_path)
    yield from beyond("code values", session.drive, DRIVE, 1e-6)
    yield from beyond("cd/m²", session.xyz_cd_m2, WHITE_CD_M2 * light(), 1e-4)


CLAIMS = [
    Claim("xicclu", version, f"reads {len(CASES)} profiles with faults as lint says", faulty_profiles),
    Claim("xicclu", version, "reads the model's XYZ and code values from our profiles", numbers),
    Claim("iccdump", version, "finds nothing wrong with our profiles", tags),
    Claim("colprof", version, "keeps the readings in its profile as we read them", own_profile),
]

CONSUMERS = [
    Consumer("cctiff", version, "aged-v2.icc", "trilinear", profile),
    Consumer("cctiff, link", version, "aged-link.icc", "trilinear", link),
]
