"""``lutgen build``: certified LUTs and OpenColorIO configs for every aging mode and hour."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.config import CONFIG, config_text
from lutgen.bake.fidelity import Certificate, Judge
from lutgen.bake.folder import claim, locked_folder
from lutgen.bake.formats import format_named
from lutgen.bake.gpu import check_renderer, gpu_run
from lutgen.bake.lut import SIZES, Lut
from lutgen.bake.manifest import FileRecord, HeldFile, Manifest, model_as_json, recipe_of, sha256
from lutgen.bake.own_reading import checked_table, is_read_here, refuse_difference
from lutgen.bake.plan import BuildPlan
from lutgen.bake.provenance import config_of_all, config_of_display, provenance_of
from lutgen.bake.readback import TableKind, apply_lut
from lutgen.bindings import named_for_ocio, ocio
from lutgen.display.inverse import compensation_of
from lutgen.errors import LutgenError
from lutgen.files import is_unicode, replacing, scratch, under_its_name, write_atomically
from lutgen.processes import in_parallel
from lutgen.progress import Progress, unseen

if TYPE_CHECKING:
    from lutgen.bake.config import AgedConfig
    from lutgen.bake.figures import Figures
    from lutgen.bake.formats import Format, Provenance
    from lutgen.bake.lut import MatrixLut
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, DisplayModel

__all__ = ["BuildPlan", "Built", "build"]


@dataclass(frozen=True)
class Built:
    """The result of a build: its manifest, and for a resumed build the numbers of missing files and of all files."""

    manifest: Manifest
    unfinished: tuple[int, int] | None


def build(
    model: DisplayModel,
    plan: BuildPlan,
    output: str | Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    progress: Progress = unseen,
) -> Built:
    """Bake ``plan`` of ``model`` into the folder ``output``.

    Each file is replaced atomically, and the manifest is written last. The same model and plan give the same LUT bytes
    on every run and with every binding. The wording of configs, and of archives of configs, depends on the version of
    OpenColorIO.

    Parameters
    ----------
    jobs
        Processes; default: one per core.
    force
        Replace another build of lutgen's in ``output``. Files that lutgen did not write are never changed.
    progress
        Called with the number of displays done and of all displays.

    Raises
    ------
    LutgenError
        Bad options or hours, a folder that cannot be used, or a tolerance that no table size meets. A failed first
        build leaves no files.

    """
    ocio()
    if plan.gpu:
        check_renderer()
    output = Path(output)
    named_for_ocio(output.absolute())
    if not is_unicode(Path(model.measurements.file)):
        name = model.measurements.file
        raise LutgenError(f"{name!r}: is no name in UTF-8, as the manifest needs it. Rename it.")
    for mode, hours, _ in plan.folders():
        plan.display(model, mode, hours)
    with locked_folder(output), scratch() as beside:
        recipe = recipe_of(model_as_json(model, output), plan.as_json())
        paths = paths_of(plan)
        folder = claim(output, recipe, paths, force=force)
        work, parts = _BuildWork(model, plan, output, beside), _parts(plan)
        if plan.tolerance is not None:
            work = replace(work, sizes=dict(chain(*in_parallel(partial(_smallest_sizes, work), parts, jobs))))
        prepare(plan.display(model, plan.modes[-1], plan.hours[-1]), plan)
        try:
            folder.begin(recipe, paths)
            records: list[FileRecord] = []
            for records_of_part in in_parallel(partial(_bake, work), parts, jobs):
                records.extend(records_of_part)
                progress(len({(record.mode, record.hours) for record in records}), len(plan.modes) * len(plan.hours))
            if form := config_format(plan):
                records.append(_write_common_config(plan, output, form))
            order = {path: place for place, path in enumerate(paths)}
            manifest = Manifest(recipe, tuple(sorted(records, key=lambda record: order[record.path])))
            folder.finish(manifest)
        except LutgenError:
            folder.abandon(paths)
            raise
        return Built(manifest, folder.unfinished)


def paths_of(plan: BuildPlan) -> list[str]:
    """Return the paths of all files of a build except its manifest, relative to its folder."""
    configs = [CONFIG] if config_format(plan) else []
    names = [format_named(name).file_in(plan.direction) for name in plan.formats] + configs
    return configs + [f"{folder}/{name}" for _, _, folder in plan.folders() for name in names]


def _parts(plan: BuildPlan) -> list[tuple[tuple[str, float, str], ...]]:
    """Split the displays into small parts for the progress bar. One correction takes as long as four simulations."""
    displays, most = list(plan.folders()), 1 if plan.direction == "compensate" else 4
    return [tuple(displays[start : start + most]) for start in range(0, len(displays), most)]


@dataclass(frozen=True)
class _BuildWork:
    """The data that all workers share.

    ``scratch`` is the private folder of this build, for all workers. ``sizes`` are the table sizes by folder and
    format, when a tolerance chose them.
    """

    model: DisplayModel
    plan: BuildPlan
    output: Path
    scratch: Path
    sizes: dict[tuple[str, str], int] | None = None


#: The judge of this process.
JUDGE = Judge()
#: The certificates of the tables that this process has judged.
_CERTIFICATES: dict[object, Certificate] = {}
#: Kinds of tables of which OpenColorIO has read a whole file in this process.
_READ_WHOLE: set[TableKind] = set()
#: Format → its last table, with the key and the errors of this table. All hours of ``stable`` share one table.
_BAKED: dict[str, tuple[object, Lut | MatrixLut, Figures]] = {}
#: LUT path → OpenColorIO's code values from the config check, reused when the certificate is computed.
SHOWN_WHOLE: dict[Path, Array] = {}


def prepare(aged: AgedDisplay, plan: BuildPlan) -> None:
    """Compute the shared data of all displays before the workers are forked, so that the workers share its memory.

    Corrections share almost no data, so nothing is computed for them.
    """
    if compensation_of(aged):
        return
    JUDGE.prepare(aged, certify=plan.certify)
    for name in plan.formats:
        format_named(name).bake(JUDGE.sampler, aged, plan.cubesize)


def _bake(work: _BuildWork, displays: tuple[tuple[str, float, str], ...]) -> list[FileRecord]:
    records = []
    for mode, hours, folder in displays:
        aged = work.plan.display(work.model, mode, hours)
        for name in work.plan.formats:
            size = work.sizes[folder, name] if work.sizes else work.plan.cubesize
            form = format_named(name)
            records.append(_bake_lut(work, aged, f"{folder}/{form.file_in(work.plan.direction)}", form, size))
        if read := config_format(work.plan):
            config = config_of_display(aged, read.file_in(work.plan.direction), unclipped=read.unclipped)
            record = _put_config(work.output, f"{folder}/{CONFIG}", config, mode, hours)
            run = gpu_run(work.output / record.path, JUDGE.code).as_json() if work.plan.gpu else None
            records.append(replace(record, gpu=run))
    return records


def _smallest_sizes(
    work: _BuildWork, displays: tuple[tuple[str, float, str], ...]
) -> list[tuple[tuple[str, str], int]]:
    """Return for each display and format the smallest size whose largest smooth error meets the tolerance."""
    sizes = []
    for mode, hours, folder in displays:
        aged = work.plan.display(work.model, mode, hours)
        sizes += [((folder, name), _smallest_size(work, aged, format_named(name))) for name in work.plan.formats]
    return sizes


def _smallest_size(work: _BuildWork, aged: AgedDisplay, form: Format) -> int:
    tolerance, path = work.plan.tolerance or 0.0, work.scratch / f"{os.getpid()}-{form.file}"
    for size in SIZES:
        lut, provenance = best_candidate(work.model, aged, form, size)
        data = form.write(lut, provenance)
        path.write_bytes(data)
        reached = certified(HeldFile(path, data), aged, form, lut, work.scratch).smooth.max
        if reached <= tolerance:
            return size
    raise LutgenError(
        f"--tolerance {tolerance:g}: no table size meets it for {aged.mode} at {aged.hours:g} h as {form.name}; "
        f"{SIZES[-1]}³ reaches {reached:.3g}. Loosen the tolerance, or take --selection continuous --format clf."
    )


def _bake_lut(work: _BuildWork, aged: AgedDisplay, path: str, form: Format, size: int) -> FileRecord:
    lut, provenance = best_candidate(work.model, aged, form, size)
    data, certificate = form.write(lut, provenance), None
    with replacing(work.output / path) as staged:
        staged.write_bytes(data)
        file = HeldFile(staged, data)
        if work.plan.certify:
            if staged.read_bytes() != data:
                raise LutgenError(f"{work.output / path}: its bytes are not those that were written. Check the disk.")
            certificate = certified(file, aged, form, lut, work.scratch).as_json()
    return FileRecord(
        path=path,
        kind="lut",
        mode=aged.mode,
        hours=aged.hours,
        sha256=file.sha256,
        bytes=len(data),
        format=form.name,
        space=lut.space,
        size=lut.size,
        clipped=not form.unclipped,
        certificate=certificate,
    )


def certified(file: HeldFile, aged: AgedDisplay, form: Format, lut: Lut | MatrixLut, beside: Path) -> Certificate:
    """Read a file back and compare it with ``aged``. Equal tables share a certificate. ``beside``: a private folder."""
    key = (form.name, aged.head, aged.tail, lut.space, lut.size)
    if key not in _CERTIFICATES:
        kind = TableKind(lut.space, lut.size, not form.unclipped)
        _CERTIFICATES[key] = JUDGE.compare(_code_values(file, form, lut, kind, beside), aged, kind)
    return _CERTIFICATES[key]


def _code_values(file: HeldFile, form: Format, lut: Lut | MatrixLut, kind: TableKind, beside: Path) -> Array:
    """Return the code values that a file gives for the judge's colours, (n, 3)."""
    # lutgen parses the text of some formats itself. OpenColorIO still reads the first file of each kind completely.
    own = checked_table(file, lut, beside) if isinstance(lut, Lut) and is_read_here(lut, form.suffix) else None
    codes = JUDGE.shown(own) if own else None
    if codes is not None and kind in _READ_WHOLE:
        return codes
    shown = SHOWN_WHOLE.pop(file.path.resolve(), None)
    if shown is None:
        with under_its_name(file.path, form.suffix, beside) as named:
            shown = apply_lut(named, JUDGE.code)
    if codes is None:
        return shown
    refuse_difference(file.path, shown, codes)
    _READ_WHOLE.add(kind)
    # Return lutgen's own values for the first file too: certificates must not depend on which process gets which file.
    return codes


def best_candidate(
    model: DisplayModel, aged: AgedDisplay, form: Format, size: int
) -> tuple[Lut | MatrixLut, Provenance]:
    """Bake a format's candidate tables and return the most faithful.

    The errors are computed in double precision, so that the choice is the same with every binding.
    """
    links = (aged.head, aged.tail, size)
    if form.name not in _BAKED or _BAKED[form.name][0] != links:
        candidates = form.bake(JUDGE.sampler, aged, size)
        errors = [JUDGE.table_error(lut, aged) for lut in candidates]
        # Smooth colours decide. A display whose curves are staircases has no smooth colours; then all colours decide.
        lut, error = min(
            zip(candidates, errors, strict=True),
            key=lambda each: (each[1].smooth.p99, each[1].all.p99, each[1].all.mean),
        )
        _BAKED[form.name] = links, lut, error.all
    _, baked, figures = _BAKED[form.name]
    return baked, provenance_of(model, aged, baked, figures)


def _write_common_config(plan: BuildPlan, output: Path, form: Format) -> FileRecord:
    config = config_of_all(plan, form.file_in(plan.direction), unclipped=form.unclipped)
    return _put_config(output, CONFIG, config, None, None)


def config_format(plan: BuildPlan) -> Format | None:
    """Return the format that configs read: the first unclipped format, else the first format that OpenColorIO reads.

    Return None, for a build without configs, when OpenColorIO reads no format of the plan.
    """
    forms = [form for form in map(format_named, plan.formats) if form.reader is None]
    return next((form for form in forms if form.unclipped), forms[0] if forms else None)


def _put_config(output: Path, path: str, config: AgedConfig, mode: str | None, hours: float | None) -> FileRecord:
    data = config_text(config)
    write_atomically(output / path, data)
    return FileRecord(path, "config", mode, hours, sha256(data), len(data))
