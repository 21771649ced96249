"""``lutgen check``: a check that files still agree with the model. It writes no file and trusts no file.

OpenColorIO reads every LUT again, and the result is compared with the model. Every number of a LUT's table is compared
with a new table, its certificate with a new certificate, and every config with a new config. Pixels are sent through
every display, view, look and named transform of each config that differs from its new config. The same is done for the
common config at the last hour of the last mode. For every other hour OpenColorIO reports which file the common config
uses.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.bake.build import JUDGE, SHOWN_WHOLE, best_candidate, certified, config_format, prepare
from lutgen.bake.check_config import check_config
from lutgen.bake.check_manifest import altered, foreign_files, plan_of, stale, strangers, unknown_values, unlisted
from lutgen.bake.expected import certificate_differences, differs_from
from lutgen.bake.fidelity import Budget, over_budget
from lutgen.bake.formats import format_named, lut_suffixes
from lutgen.bake.gpu import TOLERANCE as GPU_TOLERANCE
from lutgen.bake.gpu import GpuRun, check_renderer, gpu_run
from lutgen.bake.lut import SIZES, Lut
from lutgen.bake.manifest import (
    JOURNAL,
    MANIFEST,
    FileRecord,
    HeldFile,
    Manifest,
    model_from_json,
    read_manifest,
)
from lutgen.bake.own_reading import is_read_here, is_text_of
from lutgen.bake.provenance import config_of_all, config_of_display
from lutgen.bake.readback import apply_lut, table_kind
from lutgen.bindings import named_for_ocio, ocio, refuse_unlikely
from lutgen.errors import LutgenError
from lutgen.files import scratch
from lutgen.processes import in_parallel
from lutgen.progress import Progress, unseen
from lutgen.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.bake.fidelity import Certificate
    from lutgen.bake.formats import Format, Provenance
    from lutgen.bake.lut import MatrixLut
    from lutgen.bake.plan import BuildPlan
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, DisplayModel

#: Number of colours that are sent through each part of a config: the first, uniform colours of the certificate.
COLOURS = 500


@dataclass(frozen=True)
class Finding:
    """One fault of one file."""

    path: str
    problem: str


@dataclass(frozen=True)
class Checked:
    """The result of a check."""

    #: Number of files that were checked.
    files: int
    #: The faults. The check fails when there is a fault.
    findings: tuple[Finding, ...]
    #: LUT path → its newly measured certificate.
    certificates: Mapping[str, Certificate] = field(default_factory=dict)
    #: Things that could not be checked, and the reasons.
    remarks: tuple[str, ...] = ()
    #: Config path → the differences between its shaders and the CPU; empty without ``gpu``.
    gpu: Mapping[str, GpuRun] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the check found no fault."""
        return not self.findings

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON data."""
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
    progress: Progress = unseen,
) -> Checked:
    """Check a folder that ``lutgen build`` wrote.

    Parameters
    ----------
    model
        Compare with this model, under the conditions of the build, instead of the manifest's model.
    budget
        Maximum errors of smooth colours. A file must also keep the errors of its own certificate.
    gpu
        Also run the shaders of each display's config, and compare them with the CPU.
    jobs, progress
        As for ``build``.

    Raises
    ------
    LutgenError
        The folder or its manifest does not exist. Or ``gpu`` is true and this machine cannot run shaders.

    """
    ocio()
    if gpu:
        check_renderer()
    folder = Path(folder)
    named_for_ocio(folder.absolute())
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
        plan = plan_of(manifest)
        strange = strangers(folder, manifest)
        findings += [Finding(*each) for each in unlisted(manifest, strange)]
    except LutgenError as error:
        return Checked(1, (*findings, Finding(MANIFEST, str(error))))
    outdated, remarks = stale(folder, manifest, model, built_from)
    findings += [Finding(MANIFEST, text) for text in outdated]
    remarks += [*foreign_files(strange), *unknown_values(plan)]
    same = model is None and manifest.recipe.get("generator") == f"lutgen {__version__}"
    with scratch() as beside:
        work = _CheckWork(folder, manifest, model or built_from, plan, budget or Budget(), gpu, same, beside)
        with suppress(LutgenError):  # the check of each file reports the same error
            prepare(plan.display(model or built_from, plan.modes[-1], plan.hours[-1]), plan)
        certificates: dict[str, Certificate] = {}
        shaders: dict[str, GpuRun] = {}
        done = 0
        for part in in_parallel(partial(_check_part, work), _parts(manifest), jobs):
            findings += part.findings
            certificates.update(part.certificates)
            shaders.update(part.gpu)
            done += part.files
            progress(done, len(manifest.files))
    return Checked(len(manifest.files), tuple(findings), certificates, tuple(remarks), shaders)


def check_lut(path: str | Path, aged: AgedDisplay, *, budget: Budget | None = None) -> Checked:
    """Check one LUT file of any program against a display: OpenColorIO's formats, ICC profiles and Hald images."""
    path = Path(path)
    if not path.exists():
        raise LutgenError(f"{path}: there is no such file.")
    refuse_unlikely(path)
    findings, certificate = _check_lut(path, str(path), aged, None, budget or Budget())
    return Checked(1, tuple(findings), {str(path): certificate} if certificate else {})


@dataclass(frozen=True)
class _CheckWork:
    folder: Path
    manifest: Manifest
    model: DisplayModel
    plan: BuildPlan
    budget: Budget
    gpu: bool
    same_version: bool
    scratch: Path


def _parts(manifest: Manifest) -> list[tuple[FileRecord, ...]]:
    """Group the files by display, with LUTs before configs, and join four displays to one part for a worker.

    The common config comes first. The last display follows it, since the common config is run with that display's LUT.
    """
    groups: dict[tuple[str | None, float | None], list[FileRecord]] = {}
    for record in manifest.files:
        groups.setdefault((record.mode, record.hours), []).append(record)
    displays = list(groups.values())
    if (None, None) in groups:
        displays.insert(1, displays.pop())
    for display in displays:
        display.sort(key=lambda record: record.kind == "config")
    return [tuple(chain(*displays[start : start + 4])) for start in range(0, len(displays), 4)]


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


def _check_part(work: _CheckWork, records: tuple[FileRecord, ...]) -> Checked:
    findings: list[Finding] = []
    certificates: dict[str, Certificate] = {}
    shaders: dict[str, GpuRun] = {}
    # The display (or its correction) that the manifest names for a file. The cache serves a LUT and then its config.
    display_of = lru_cache(maxsize=1)(lambda mode, hours: work.plan.display(work.model, str(mode), float(hours or 0.0)))
    SHOWN_WHOLE.clear()
    for record in records:
        path = work.folder / record.path
        problem, file = altered(path, record)
        if problem:
            findings.append(Finding(record.path, problem))
        if file is None:
            continue
        try:
            if record.kind == "config":
                aged = None if record.mode is None else display_of(record.mode, record.hours)
                problems = _config_problems(path, record, aged, work)
                findings += [Finding(record.path, text) for text in problems]
                if work.gpu and record.mode is not None and not problems:
                    shaders[record.path] = gpu_run(path, JUDGE.code)
                    findings += _shader_findings(record.path, shaders[record.path])
            else:
                of_file, certificate = _check_built_lut(file, display_of(record.mode, record.hours), record, work)
                findings += of_file
                if certificate:
                    certificates[record.path] = certificate
        except LutgenError as error:  # the manifest describes this file as no build does
            findings.append(Finding(record.path, f"{MANIFEST}: {error}"))
    return Checked(len(records), tuple(findings), certificates, gpu=shaders)


def _shader_findings(path: str, run: GpuRun) -> list[Finding]:
    # `not (a <= b)` is also true for NaN.
    return [
        Finding(
            path,
            f"its shader differs from the CPU by up to {difference.max:.2g} in code values ({view}; {run.renderer})",
        )
        for view, difference in run.views.items()
        if not difference.max <= GPU_TOLERANCE
    ]


def _config_problems(path: Path, record: FileRecord, aged: AgedDisplay | None, work: _CheckWork) -> list[str]:
    try:
        refuse_unlikely(path)
    except LutgenError as error:
        return [str(error)]
    form = config_format(work.plan)
    if form is None:
        return ["the manifest names no LUT for it"]
    file = form.file_in(work.plan.direction)
    if aged is None:
        written = config_of_all(work.plan, file, unclipped=form.unclipped)
    else:
        written = config_of_display(aged, file, unclipped=form.unclipped)
    return check_config(path, work.folder, record, work.manifest, written, through=_through)


def _through(lut: Path) -> tuple[Array, Array]:
    """Return code values to send through a config, and OpenColorIO's results for them through its LUT, (n, 3) each."""
    SHOWN_WHOLE.clear()
    SHOWN_WHOLE[lut] = shown = apply_lut(lut, JUDGE.code)
    return JUDGE.code[:COLOURS], shown[:COLOURS]


def _check_built_lut(
    file: HeldFile, aged: AgedDisplay, record: FileRecord, work: _CheckWork
) -> tuple[list[Finding], Certificate | None]:
    """Compare a LUT with a newly baked LUT, and its certificate with a new certificate."""
    form = format_named(str(record.format))
    size = record.size if work.plan.tolerance is not None and record.size in SIZES else work.plan.cubesize
    lut, provenance = best_candidate(work.model, aged, form, int(size))
    path, name = file.path, record.path
    if _equals_new_file(file, form, lut, provenance):
        certificate = certified(file, aged, form, lut, work.scratch)
        findings = [Finding(name, problem) for problem in over_budget(certificate, record, work.budget)]
    else:
        findings, fresh = _check_lut(path, name, aged, record, work.budget)
        if fresh is None:
            return findings, None
        certificate = fresh
        expected = form.write(lut, provenance)
        if differs := differs_from(path, file.data, expected, lut, same_version=work.same_version):
            findings.append(Finding(name, differs))
    claims = _differing_fields(record, lut)
    if work.plan.certify:
        claims += certificate_differences(record.certificate, certificate.as_json())
    elif record.certificate is not None:
        claims.append("it has a certificate, and the options ask for none")
    return [*findings, *(Finding(name, f"{MANIFEST}: {claim}") for claim in claims)], certificate


def _equals_new_file(file: HeldFile, form: Format, lut: Lut | MatrixLut, provenance: Provenance) -> bool:
    """Whether a file equals the newly written file byte for byte."""
    if form.head and isinstance(lut, Lut) and is_read_here(lut, form.suffix):
        return is_text_of(file, form.head(lut, provenance), lut)
    return file.data == form.write(lut, provenance)


def _differing_fields(record: FileRecord, lut: Lut | MatrixLut) -> list[str]:
    return [
        f"{name} is {getattr(record, name)!r}, and the model gives {getattr(lut, name)!r}"
        for name in ("space", "size")
        if getattr(record, name) != getattr(lut, name)
    ]


def _check_lut(
    path: Path, name: str, aged: AgedDisplay, record: FileRecord | None, budget: Budget
) -> tuple[list[Finding], Certificate | None]:
    findings: list[Finding] = []
    try:
        refuse_unlikely(path)
        findings = [Finding(name, problem) for problem in _text_problems(path)]
        kind = table_kind(path, clipped=True if record is None else bool(record.clipped))
        certificate = JUDGE.compare(apply_lut(path, JUDGE.code), aged, kind)
    except LutgenError as error:
        return [*findings, Finding(name, str(error).removeprefix(f"{path}: "))], None
    findings += [Finding(name, problem) for problem in over_budget(certificate, record, budget)]
    return findings, certificate


#: Texts in a LUT's rows that OpenColorIO reads as 0 without a warning.
_NOT_A_NUMBER = re.compile(rb"(?im)^(?![#<]|TITLE)[^\n<]*?(\bnan\b|\binf\b|\d,\d)")
_TABLE_TAG = re.compile(rb"<LUT3D\b[^>]*>")


def _text_problems(path: Path) -> list[str]:
    """Return the faults that OpenColorIO accepts without a warning: NaN, decimal commas, and trilinear tables."""
    data = path.read_bytes()
    problems = []
    bad = _NOT_A_NUMBER.search(data)
    if bad and path.suffix.lower() in lut_suffixes():
        line = data.count(b"\n", 0, bad.start(1)) + 1
        problems.append(f"line {line} holds {bad[1].decode(errors='replace')!r}, which readers read as 0")
    if any(b'interpolation="tetrahedral"' not in tag for tag in _TABLE_TAG.findall(data)):
        problems.append("wrong interpolation: its LUT3D does not ask for tetrahedral")
    return problems
