"""``lutgen check``: do these files still do what the model says? Rebuilds nothing and trusts nothing.

Every LUT is read again through OpenColorIO and compared with the model; every display, view, look, named transform
and context value of every config is instantiated and pixels are sent through it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.bake.check_config import check_config
from lutgen.bake.fidelity import Certificate, Judge
from lutgen.bake.formats import format_named, lut_suffixes
from lutgen.bake.gpu import TOLERANCE as GPU_TOLERANCE
from lutgen.bake.gpu import GpuRun, check_renderer, gpu_run
from lutgen.bake.inventory import altered, unlisted
from lutgen.bake.manifest import (
    JOURNAL,
    MANIFEST,
    FileRecord,
    Manifest,
    model_as_json,
    model_from_json,
    read_manifest,
    same_model,
)
from lutgen.bake.parallel import in_parallel
from lutgen.bake.plan import direction_of, display_to_bake
from lutgen.bake.readback import apply_lut, table_kind
from lutgen.bindings import ocio, refuse_unlikely
from lutgen.display import default_display, load_model
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.display import AgedDisplay, DisplayModel

#: Where a file has no certificate to be held to: what a .cube of 33³ keeps on any plausible display.
MAX_DELTA_E, P99 = 1.0, 0.2

#: A file may exceed its own certificate by this much: OpenColorIO 2.1 and 2.6 differ by up to 0.003 on one file.
SLACK = 0.005


@dataclass(frozen=True)
class Budget:
    """Largest ΔE2000 allowed over the smooth colours, and its 99 % quantile.

    None: ``MAX_DELTA_E`` and ``P99``, but no limit for a certified file of a format that cannot follow every display.
    """

    max_delta_e: float | None = None
    p99: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no file could fail, or pass."""
        for option, limit in (("--max-delta-e", self.max_delta_e), ("--p99", self.p99)):
            if limit is not None and not 0 <= limit < inf:
                raise LutgenError(f"{option} {limit:g}: a colour difference ΔE2000 from 0 on, such as 0.1.")

    def limits(self, record: FileRecord | None) -> tuple[float, float]:
        """Return both for a file."""
        simple = record is not None and record.certificate and not format_named(str(record.format)).follows
        usual = (inf, inf) if simple else (MAX_DELTA_E, P99)
        return (
            usual[0] if self.max_delta_e is None else self.max_delta_e,
            usual[1] if self.p99 is None else self.p99,
        )


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with one file."""

    path: str
    problem: str


@dataclass(frozen=True)
class Checked:
    """What a check found.

    Attributes
    ----------
    files
        Number of files that were checked.
    findings
        What is wrong; the check failed when there is any.
    certificates
        LUT path → what it does now.
    remarks
        What could not be checked, and why.
    gpu
        Config path → what its shaders do, where that was asked.

    """

    files: int
    findings: tuple[Finding, ...]
    certificates: Mapping[str, Certificate] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    gpu: Mapping[str, GpuRun] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.findings

    def as_json(self) -> dict[str, Any]:
        """Return the result for a program to read."""
        shaders = {"gpu": {path: run.as_json() for path, run in self.gpu.items()}} if self.gpu else {}
        return {
            "schema": 1,
            "passed": self.passed,
            "files": self.files,
            "findings": [{"file": finding.path, "problem": finding.problem} for finding in self.findings],
            "certificates": {path: certificate.as_json() for path, certificate in self.certificates.items()},
            "remarks": list(self.remarks),
            **shaders,
        }


def check(
    folder: str | Path,
    *,
    model: DisplayModel | None = None,
    budget: Budget | None = None,
    gpu: bool = False,
    jobs: int | None = None,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Checked:
    """Check a folder that ``lutgen build`` made.

    Parameters
    ----------
    model
        Compare with this model instead of the manifest's; under the conditions of the build.
    budget
        What the smooth colours may err; a file is also held to its own certificate.
    gpu
        Run the shaders of each display's config too, and compare them with the CPU.
    jobs, progress
        As for ``build``.

    Raises
    ------
    LutgenError
        The folder or its manifest is not there: nothing to check. Or ``gpu``, and no shader can be run here.

    """
    ocio()
    if gpu:
        check_renderer()
    folder = Path(folder)
    manifest, findings = _manifest(folder)
    if manifest is None:
        return Checked(1, tuple(findings))
    try:
        built_from = model_from_json(manifest.recipe["model"], where=str(folder / MANIFEST))
    except (LutgenError, KeyError) as error:
        return Checked(1, (*findings, Finding(MANIFEST, f"its model cannot be used: {error}")))
    if model is not None:
        model = replace(model, conditions=built_from.conditions)
    try:
        findings += [Finding(*each) for each in unlisted(folder, manifest)]
    except LutgenError as error:
        return Checked(1, (*findings, Finding(MANIFEST, str(error))))
    stale, remarks = _stale(folder, manifest, model)
    findings += stale
    work = [_Work(folder, manifest, model or built_from, part, budget or Budget(), gpu) for part in _parts(manifest)]
    certificates: dict[str, Certificate] = {}
    shaders: dict[str, GpuRun] = {}
    done = 0
    for part in in_parallel(_check_part, work, jobs):
        findings += part.findings
        certificates.update(part.certificates)
        shaders.update(part.gpu)
        done += part.files
        progress(done, len(manifest.files))
    return Checked(len(manifest.files), tuple(findings), certificates, tuple(remarks), shaders)


def check_lut(path: str | Path, aged: AgedDisplay, *, budget: Budget | None = None) -> Checked:
    """Check one LUT file, of whoever's making, against a display: what OpenColorIO reads, ICC profiles, Hald images."""
    path = Path(path)
    if not path.is_file():
        raise LutgenError(f"{path}: there is no such file.")
    findings, certificate = _check_lut(path, str(path), aged, None, budget or Budget())
    return Checked(1, tuple(findings), {str(path): certificate} if certificate else {})


@dataclass(frozen=True)
class _Work:
    folder: Path
    manifest: Manifest
    model: DisplayModel
    records: tuple[FileRecord, ...]
    budget: Budget
    gpu: bool


def _parts(manifest: Manifest) -> list[tuple[FileRecord, ...]]:
    """Group the files by display, so that one worker has a display's LUTs and config together."""
    groups: dict[tuple[str | None, float | None], list[FileRecord]] = {}
    for record in manifest.files:
        groups.setdefault((record.mode, record.hours), []).append(record)
    return [tuple(group) for group in groups.values()]


def _manifest(folder: Path) -> tuple[Manifest | None, list[Finding]]:
    findings = []
    if (folder / JOURNAL).exists():
        findings.append(Finding(JOURNAL, "a build into this folder was interrupted; run `lutgen build` again"))
    try:
        manifest = read_manifest(folder / MANIFEST)
    except LutgenError as error:
        return None, [*findings, Finding(MANIFEST, str(error))]
    if manifest is None and not findings:
        raise LutgenError(f"{folder}: has no {MANIFEST}, so it is no folder that `lutgen build` made.")
    return manifest, findings


def _stale(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[Finding], list[str]]:
    """Whether the measurements, and a refined model, are still those that the build was made from."""
    findings, remarks = _stale_readings(folder, manifest, model)
    if not findings:
        found, more = _stale_model(folder, manifest, model)
        findings, remarks = findings + found, remarks + more
    return findings, remarks


def _stale_readings(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[Finding], list[str]]:
    display = manifest.recipe["model"]["display"]
    if model is not None:
        current, name = model.measurements.sha256, model.measurements.file
    else:
        source = default_display() if display["path"] is None else folder / display["path"]
        name = display["file"]
        if not source.is_file():
            return [], [f"the measurements {name} were not found; their copy in the manifest was used"]
        try:
            current = read_measurements(source).sha256
        except LutgenError as error:
            return [Finding(MANIFEST, f"stale: the measurements have changed and cannot be read: {error}")], []
    if current != display["sha256"]:
        why = f"the measurements {name} have changed since the build"
        if model is not None:
            why = f"built from other measurements ({display['file']}) than {name}"
        return [Finding(MANIFEST, f"stale: {why}; build again")], []
    return [], []


def _stale_model(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[Finding], list[str]]:
    built_from = manifest.recipe["model"]
    name, current = built_from.get("file", ""), model
    if model is None:
        if not name:
            return [], []
        if not (folder / name).is_file():
            return [], [f"the model file {Path(name).name} was not found; its copy in the manifest was used"]
        try:
            current = load_model(folder / name)
        except LutgenError as error:
            return [Finding(MANIFEST, f"stale: the model has changed and cannot be read: {error}")], []
    elif not (model.effects or "effects" in built_from):
        return [], []  # the files themselves tell: any model that says the same as they will do
    if current is None or same_model(built_from, model_as_json(current, folder)):
        return [], []
    which = Path(current.file or name or "given").name
    return [Finding(MANIFEST, f"stale: the model {which} is not the one that was built from; build again")], []


_JUDGE = Judge()


def _check_part(work: _Work) -> Checked:
    findings: list[Finding] = []
    certificates: dict[str, Certificate] = {}
    shaders: dict[str, GpuRun] = {}
    for record in sorted(work.records, key=lambda record: record.kind == "config"):
        path = work.folder / record.path
        problem, readable = altered(path, record)
        if problem:
            findings.append(Finding(record.path, problem))
        if not readable:
            continue
        try:
            if record.kind == "config":
                problems = _config_problems(path, record, work)
                findings += [Finding(record.path, text) for text in problems]
                if work.gpu and record.mode is not None and not problems:
                    shaders[record.path] = gpu_run(path, _JUDGE.code)
                    findings += _shader_findings(record.path, shaders[record.path])
            else:
                aged = _claimed(work, record)
                found, certificate = _check_lut(path, record.path, aged, record, work.budget)
                findings += found
                if certificate:
                    certificates[record.path] = certificate
        except LutgenError as error:  # what the manifest says of the file is no build's
            findings.append(Finding(record.path, f"{MANIFEST}: {error}"))
    return Checked(len(work.records), tuple(findings), certificates, gpu=shaders)


def _shader_findings(path: str, run: GpuRun) -> list[Finding]:
    # NaN fails the comparison too.
    return [
        Finding(
            path, f"its shader differs from the CPU by up to {found.max:.2g} in code values ({view}; {run.renderer})"
        )
        for view, found in run.views.items()
        if not found.max <= GPU_TOLERANCE
    ]


def _claimed(work: _Work, record: FileRecord) -> AgedDisplay:
    """Return the display, or the correction for it, that a LUT of the build says it is."""
    return display_to_bake(
        work.model,
        str(record.mode),
        float(record.hours or 0.0),
        direction=direction_of(work.manifest),
        unreachable=str(work.manifest.recipe["options"].get("unreachable", "clip")),
    )


def _config_problems(path: Path, record: FileRecord, work: _Work) -> list[str]:
    try:
        refuse_unlikely(path)
    except LutgenError as error:
        return [str(error)]
    return check_config(path, work.folder, record, work.manifest)


def _check_lut(
    path: Path, name: str, aged: AgedDisplay, record: FileRecord | None, budget: Budget
) -> tuple[list[Finding], Certificate | None]:
    findings: list[Finding] = []
    try:
        refuse_unlikely(path)
        findings = [Finding(name, problem) for problem in _text_problems(path)]
        kind = table_kind(path, clipped=True if record is None else bool(record.clipped))
        certificate = _JUDGE.compare(apply_lut(path, _JUDGE.code), aged, kind)
    except LutgenError as error:
        return [*findings, Finding(name, str(error))], None
    findings += [Finding(name, problem) for problem in _over_budget(certificate, record, budget)]
    return findings, certificate


def _over_budget(certificate: Certificate, record: FileRecord | None, budget: Budget) -> list[str]:
    problems = []
    max_delta_e, p99 = budget.limits(record)
    for figure, limit, option in (("max", max_delta_e, "--max-delta-e"), ("p99", p99, "--p99")):
        value = getattr(certificate.smooth, figure)
        if value > limit:
            problems.append(f"fidelity: smooth ΔE2000 {figure} is {value:.4f}, over the budget of {limit:g} ({option})")
    for group, certified in ((record.certificate if record else None) or {}).items():
        now = certificate.groups().get(group)
        if isinstance(certified, dict) and now is not None:
            figures = [(name, getattr(now, name), certified[name]) for name in ("mean", "p99", "max")]
            if any(value > limit + SLACK for _, value, limit in figures):
                texts = [f"{name} {value:.4f} (certified {limit:.4f})" for name, value, limit in figures]
                problems.append(f"fidelity: {group} ΔE2000 is worse than certified: {', '.join(texts)}")
    return problems


#: In a LUT's rows: what OpenColorIO would silently read as 0.
_NOT_A_NUMBER = re.compile(rb"(?im)^(?![#<]|TITLE)[^\n<]*?(\bnan\b|\binf\b|\d,\d)")
_TABLE_TAG = re.compile(rb"<LUT3D\b[^>]*>")


def _text_problems(path: Path) -> list[str]:
    """Faults that OpenColorIO reads without a word: NaN and decimal commas, and trilinear tables."""
    data = path.read_bytes()
    problems = []
    bad = _NOT_A_NUMBER.search(data)
    if bad and path.suffix.lower() in lut_suffixes():
        line = data.count(b"\n", 0, bad.start(1)) + 1
        problems.append(f"line {line} holds {bad[1].decode(errors='replace')!r}, which readers take for 0")
    if any(b'interpolation="tetrahedral"' not in tag for tag in _TABLE_TAG.findall(data)):
        problems.append("wrong interpolation: its LUT3D does not ask for tetrahedral")
    return problems
