"""``lutgen build``: LUTs and OpenColorIO configs for every aging mode and hour, each certified."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen import __version__
from lutgen.bake.config import AgedConfig, config_text
from lutgen.bake.fidelity import Certificate, Figures, Judge
from lutgen.bake.folder import claim
from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import SIZES
from lutgen.bake.manifest import FileRecord, Manifest, Recipe, model_as_json, sha256
from lutgen.bake.parallel import in_parallel
from lutgen.bake.readback import TableKind
from lutgen.bindings import ocio
from lutgen.display import MODES, hour_name
from lutgen.errors import LutgenError, pick_one
from lutgen.files import replacing, under_its_name, write_atomically

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lutgen.bake.formats import Format
    from lutgen.bake.lut import Lut, MatrixLut
    from lutgen.display import AgedDisplay, DisplayModel

CONFIG = "config.ocio"


@dataclass(frozen=True)
class Plan:
    """What to bake of a model.

    Attributes
    ----------
    hours, modes, formats
        One LUT of each format for each mode and hour.
    cubesize
        Points along an edge of the tables.
    tolerance
        ΔE2000 that the largest ``smooth`` error may reach; the smallest of ``SIZES`` that keeps it is taken.
    certify
        Read every different table back, through OpenColorIO where it can, and compare it with the model; hours that
        show the same display share a certificate. ``lutgen check`` reads every file.

    """

    hours: tuple[float, ...]
    modes: tuple[str, ...] = tuple(MODES)
    formats: tuple[str, ...] = ("cube", "clf")
    cubesize: int = 33
    tolerance: float | None = None
    certify: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot be baked."""
        for mode in self.modes:
            if mode not in MODES:
                raise pick_one("mode", mode, MODES)
        for name in self.formats:
            format_named(name)
        if not (self.hours and self.modes and self.formats):
            message = "nothing to build: give at least one hour, one mode and one format."
            raise LutgenError(message)
        if self.cubesize not in SIZES:
            raise pick_one("cube size", self.cubesize, map(str, SIZES))
        if self.tolerance is not None and not 0 < self.tolerance < 100:
            message = f"--tolerance {self.tolerance:g}: a colour difference ΔE2000 above 0 and below 100, such as 0.1."
            raise LutgenError(message)

    def as_json(self) -> dict[str, Any]:
        """Return the options as the manifest has them."""
        return {
            "hours": list(self.hours),
            "modes": list(self.modes),
            "formats": list(self.formats),
            "cubesize": self.cubesize,
            "tolerance": self.tolerance,
            "certify": self.certify,
        }

    def folders(self) -> Iterator[tuple[str, float, str]]:
        """Give mode, hour and the folder of each display, relative to the output folder."""
        for mode in self.modes:
            for hours in self.hours:
                yield mode, hours, f"{mode}/{hour_name(hours)}"


@dataclass(frozen=True)
class Built:
    """What a build did: its manifest, and what of an interrupted one was missing (missing, all)."""

    manifest: Manifest
    unfinished: tuple[int, int] | None


def build(
    model: DisplayModel,
    plan: Plan,
    output: str | Path,
    *,
    jobs: int | None = None,
    force: bool = False,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Built:
    """Bake ``plan`` of ``model`` into the folder ``output``.

    Files are replaced one by one, each whole; the manifest comes last. The same model and plan give the same LUT bytes
    on every run and with every binding; how configs, and archives of them, are worded differs with OpenColorIO's
    version.

    Parameters
    ----------
    jobs
        Processes; default: one per core.
    force
        Replace another build of lutgen's in ``output``. What lutgen did not write is never touched.
    progress
        Called with the number of displays done and of all displays.

    Raises
    ------
    LutgenError
        Bad options or hours, a folder that cannot be used, or a tolerance that no size keeps.

    """
    ocio()
    output = Path(output)
    for mode, hours, _ in plan.folders():
        model.at(mode, hours)
    recipe = Recipe(model_as_json(model, output), plan.as_json())
    paths = _paths(plan)
    folder = claim(output, recipe, paths, force=force)
    work = [_Work(model, plan, output, part) for part in _parts(plan)]
    sizes = [None] * len(work) if plan.tolerance is None else list(in_parallel(_smallest_sizes, work, jobs))
    work = [replace(part, sizes=chosen) for part, chosen in zip(work, sizes, strict=True)]
    folder.begin(recipe, paths)
    _prepare(model.at(plan.modes[-1], plan.hours[-1]), plan)
    records: list[FileRecord] = []
    for made in in_parallel(_bake, work, jobs):
        records.extend(made)
        progress(len({(record.mode, record.hours) for record in records}), len(plan.modes) * len(plan.hours))
    form = config_format(plan)
    if form:
        records.append(_write_common_config(plan, output, form))
    order = {path: place for place, path in enumerate(paths)}
    manifest = Manifest(recipe.as_json(), tuple(sorted(records, key=lambda record: order[record.path])))
    folder.finish(manifest)
    return Built(manifest, folder.unfinished)


def _paths(plan: Plan) -> list[str]:
    configs = [CONFIG] if config_format(plan) else []
    names = [format_named(name).file for name in plan.formats] + configs
    return configs + [f"{folder}/{name}" for _, _, folder in plan.folders() for name in names]


def _parts(plan: Plan) -> list[tuple[tuple[str, float, str], ...]]:
    """Cut the displays into parts small enough for progress to move."""
    displays = list(plan.folders())
    return [tuple(displays[start : start + 4]) for start in range(0, len(displays), 4)]


@dataclass(frozen=True)
class _Work:
    """What one worker is handed: some displays, and the table sizes where a tolerance chose them."""

    model: DisplayModel
    plan: Plan
    output: Path
    displays: tuple[tuple[str, float, str], ...]
    sizes: dict[tuple[str, str], int] | None = None


#: One process's judge, the certificates of tables that it has met, and each format's last table: ``stable`` has one
#: for all hours.
_JUDGE = Judge()
_CERTIFICATES: dict[object, Certificate] = {}
_BAKED: dict[str, tuple[object, Lut | MatrixLut, Figures]] = {}


def _prepare(aged: AgedDisplay, plan: Plan) -> None:
    """Compute what all displays share before workers are forked: they then share its memory too."""
    _JUDGE.prepare(aged, certify=plan.certify)
    for name in plan.formats:
        format_named(name).bake(_JUDGE.sampler, aged, plan.cubesize)


def _bake(work: _Work) -> list[FileRecord]:
    records = []
    for mode, hours, folder in work.displays:
        aged = work.model.at(mode, hours)
        for name in work.plan.formats:
            size = work.sizes[folder, name] if work.sizes else work.plan.cubesize
            form = format_named(name)
            records.append(_bake_lut(work, aged, f"{folder}/{form.file}", form, size))
        form_of_config = config_format(work.plan)
        if form_of_config:
            records.append(_write_config(work, aged, folder, form_of_config))
    return records


def _smallest_sizes(work: _Work) -> dict[tuple[str, str], int]:
    """Find the smallest size whose largest smooth error keeps the tolerance, for each display and format."""
    sizes = {}
    with tempfile.TemporaryDirectory(prefix="lutgen-") as scratch:
        for mode, hours, folder in work.displays:
            for name in work.plan.formats:
                aged, form = work.model.at(mode, hours), format_named(name)
                sizes[folder, name] = _smallest_size(work, aged, form, Path(scratch) / form.file)
    return sizes


def _smallest_size(work: _Work, aged: AgedDisplay, form: Format, path: Path) -> int:
    tolerance = work.plan.tolerance or 0.0
    for size in SIZES:
        lut, data = _best_candidate(work.model, aged, form, size)
        path.write_bytes(data)
        reached = _certify(path, aged, form, lut).smooth.max
        if reached <= tolerance:
            return size
    message = (
        f"--tolerance {tolerance:g}: no size certifies for {aged.mode} at {aged.hours:g} h as {form.name}; "
        f"{SIZES[-1]}³ reaches {reached:.3g}. Loosen the tolerance, or take --selection continuous --format clf."
    )
    raise LutgenError(message)


def _bake_lut(work: _Work, aged: AgedDisplay, path: str, form: Format, size: int) -> FileRecord:
    lut, data = _best_candidate(work.model, aged, form, size)
    certificate = None
    with replacing(work.output / path) as staged:
        staged.write_bytes(data)
        if work.plan.certify:
            with under_its_name(staged, form.suffix) as named:
                certificate = _certify(named, aged, form, lut).as_json()
    return FileRecord(
        path=path,
        kind="lut",
        mode=aged.mode,
        hours=aged.hours,
        sha256=sha256(data),
        bytes=len(data),
        format=form.name,
        space=lut.space,
        size=lut.size,
        clipped=not form.unclipped,
        certificate=certificate,
    )


def _certify(path: Path, aged: AgedDisplay, form: Format, lut: Lut | MatrixLut) -> Certificate:
    key = (form.name, aged.head, aged.tail, lut.space, lut.size)
    if key not in _CERTIFICATES:
        _CERTIFICATES[key] = _JUDGE.certify(path, aged, TableKind(lut.space, lut.size, not form.unclipped))
    return _CERTIFICATES[key]


def _best_candidate(model: DisplayModel, aged: AgedDisplay, form: Format, size: int) -> tuple[Lut | MatrixLut, bytes]:
    """Bake a format's candidates and write the most faithful, judged in double precision: alike on every binding."""
    made_of = (aged.head, aged.tail, size)
    if form.name not in _BAKED or _BAKED[form.name][0] != made_of:
        candidates = form.bake(_JUDGE.sampler, aged, size)
        errors = [_JUDGE.table_error(lut, aged) for lut in candidates]
        # Where colours are smooth; the display that is nothing but stairs is judged on all.
        lut, error = min(
            zip(candidates, errors, strict=True),
            key=lambda each: (each[1].smooth.p99, each[1].all.p99, each[1].all.mean),
        )
        _BAKED[form.name] = made_of, lut, error.all
    _, baked, figures = _BAKED[form.name]
    return baked, form.write(baked, _provenance(model, aged, baked, figures))


def _provenance(model: DisplayModel, aged: AgedDisplay, lut: Lut | MatrixLut, error: Figures) -> Provenance:
    readings = model.measurements
    grid = f"{lut.size}^3 in {lut.space} values, tetrahedral" if lut.size else "one matrix in linear light"
    figures = f"dE2000 of the table mean {error.mean:.4f}, 99 % {error.p99:.4f}, max {error.max:.4f}"
    lines = (
        f"lutgen {__version__}: what an aged display shows, for an un-aged sRGB viewer",
        f"display: {Path(readings.file).name}, SHA-256 {readings.sha256}",
        *(f"source: {text}" for key, text in readings.metadata.items() if key == "source"),
        f"model: reference {model.reference}, selection {model.selection}, luminance {model.luminance.name}",
        *_refinements(model),
        f"mode: {aged.mode}",
        f"hours: {aged.hours:g}",
        f"grid: {grid}",
        f"fidelity: {figures} over {error.colours} colours, borders included; certificate in manifest.json",
    )
    hour = hour_name(aged.hours)
    return Provenance(f"Aged display, {aged.mode}, {hour}", f"lutgen-{aged.mode}-{hour}-{readings.sha256[:12]}", lines)


def _refinements(model: DisplayModel) -> list[str]:
    """What a model has beyond the paper's, one line each; in ASCII, since that is what a .cube is."""
    lines = [] if model.baseline == "tips" else ["baseline: tips of hour 0 alone, the effects do the aging"]
    for each in model.baked:
        values = ", ".join(f"{name} {value:.6g}" for name, value in each.values.items())
        lines.append(f"effect: {each.effect.name}{f' ({values})' if values else ''}")
    stated = ", ".join(f"{name} = {value:g}" for name, value in model.conditions.stated().items())
    return lines + ([f"at: {stated}"] if stated else [])


def _write_config(work: _Work, aged: AgedDisplay, folder: str, form: Format) -> FileRecord:
    hour = hour_name(aged.hours)
    text = f"An aged display: mode {aged.mode} ({MODES[aged.mode]}), {hour}. {_reach(form)}"
    config = AgedConfig(f"{aged.mode}_{hour}", text, form.file)
    return _put_config(work.output, f"{folder}/{CONFIG}", config, aged.mode, aged.hours)


def _write_common_config(plan: Plan, output: Path, form: Format) -> FileRecord:
    last = max(plan.hours)
    mode = "chroma" if "chroma" in plan.modes else plan.modes[0]
    text = (
        f"Aged displays: choose by the context variables AGING_MODE ({', '.join(plan.modes)}) and AGING_HOURS "
        f"({min(plan.hours):g} to {last:g}). {_reach(form)}"
    )
    default = {"AGING_HOURS": hour_name(last).removesuffix("h"), "AGING_MODE": mode}
    config = AgedConfig("aged_displays", text, f"${{AGING_MODE}}/${{AGING_HOURS}}h/{form.file}", default)
    return _put_config(output, CONFIG, config, None, None)


def config_format(plan: Plan) -> Format | None:
    """Return the format that configs read: one that keeps colours outside sRGB, where there is one.

    None, and no configs, where OpenColorIO reads none of the plan's.
    """
    forms = [form for form in map(format_named, plan.formats) if form.reader is None]
    return next((form for form in forms if form.unclipped), forms[0] if forms else None)


def _reach(form: Format) -> str:
    if form.unclipped:
        return "Aged colours outside sRGB reach wider viewers."
    return "Aged colours are clipped to sRGB, on wider viewers too."


def _put_config(output: Path, path: str, config: AgedConfig, mode: str | None, hours: float | None) -> FileRecord:
    data = config_text(config)
    write_atomically(output / path, data)
    return FileRecord(path, "config", mode, hours, sha256(data), len(data))
