"""The slides of a cohort, and the folder of its run: one file for each finished slide, so that a run can be resumed."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from lutgen.cells import is_comment
from lutgen.display import DisplayModel
from lutgen.display.model_file import model_text
from lutgen.documents import from_json
from lutgen.errors import LutgenError
from lutgen.files import PARTIAL, bytes_at_most, files_below, read_at_most, write_atomically
from lutgen.pictures import blocks, images
from lutgen.pictures.difference import IN_JSON, DifferenceCurve, Intervals
from lutgen.pictures.distinct import Tissue
from lutgen.pictures.lifetime import ImageLifetime
from lutgen.version import __version__

#: Suffixes of the files in a folder that count as slides.
SUFFIXES = (*images.SUFFIXES, *blocks.SUFFIXES)

#: Suffix of a list of slides.
LIST = ".txt"

#: Most bytes of a list: a hundred thousand slides with a path of some hundred bytes each.
MAX_BYTES = 64_000_000


@dataclass(frozen=True)
class CohortSlide:
    """One slide of a cohort."""

    #: Path as given.
    name: str
    #: Absolute path.
    path: str
    #: Size, and time of the last change in nanoseconds since 1970; 0 where there is no such file.
    bytes: int
    changed_ns: int


@dataclass(frozen=True)
class CohortTask:
    """Arguments for each slide's call of :func:`lutgen.pictures.lifetime.lifetime`."""

    model: DisplayModel
    #: The other arguments by name, as JSON holds them.
    options: Mapping[str, Any]
    version: str = __version__

    def anywhere(self) -> Self:
        """Return the same task with absolute paths of the user's own effects, for processes in other folders."""
        effects = tuple(
            replace(each, effect=replace(each.effect, origin=str(Path(each.effect.origin).resolve())))
            if each.effect.origin.endswith(".py")
            else each
            for each in self.model.effects
        )
        return replace(self, model=replace(self.model, effects=effects))


def find_slides(given: Sequence[str | Path]) -> tuple[CohortSlide, ...]:
    """Return the slides that files, folders and lists (.txt) name, in order. Raises LutgenError: none, or no such path.

    In a list a path that does not exist is a slide that cannot be read.
    """
    if not given:
        raise LutgenError("no slide was given. Give slides, a folder of them, or a list (.txt) with one path per line.")
    slides: dict[str, CohortSlide] = {}
    for each in given:
        for path in _named(Path(each)):
            slide = _slide(path)
            slides.setdefault(slide.path, slide)
    return tuple(slides.values())


def _named(given: Path) -> Iterable[Path]:
    files = files_below(given, SUFFIXES)
    if files is None:
        if given.suffix.lower() == LIST:
            return _in_list(given)
        if not given.exists():
            raise LutgenError(f"{given}: no such file or folder. Give slides, a folder of them, or a list (.txt).")
        return [given]
    if not files:
        raise LutgenError(f"{given}: no slide in this folder or below. Looked for {', '.join(SUFFIXES)}.")
    return files


def _in_list(file: Path) -> list[Path]:
    advice = "A list holds the path of one slide per line."
    data = read_at_most(file, MAX_BYTES, what="the list of slides", none="list of slides", advice=advice)
    try:
        lines = [line.strip() for line in data.decode("utf-8-sig").splitlines()]
    except UnicodeDecodeError:
        raise LutgenError(f"{file}: cannot read the list of slides: it is not utf-8 text. {advice}") from None
    files = [file.parent / line for line in lines if line and not is_comment(line)]
    if not files:
        raise LutgenError(f"{file}: names no slide. {advice}")
    return files


def _slide(path: Path) -> CohortSlide:
    absolute = path.resolve()
    files, parts = [absolute], []
    # A .mrxs file is an index; a folder of the same name beside it holds the pixels.
    if absolute.suffix.lower() == ".mrxs":
        files += sorted(part for part in absolute.with_suffix("").rglob("*") if part.is_file())
    for file in files:
        with suppress(OSError):
            parts.append(file.stat())
    changed = max((part.st_mtime_ns for part in parts), default=0)
    return CohortSlide(str(path), str(absolute), sum(part.st_size for part in parts), changed)


SCHEMA = 1

#: File of a run that holds the recipe: the model and options that set the results.
OPTIONS = "cohort.json"

#: The folder of results.
SLIDES = "slides"

#: Most bytes of a result, which holds a few numbers for each hour and mode.
MAX_RESULT_BYTES = 64_000_000


@dataclass(frozen=True)
class RunFolder:
    """The folder of a run. :func:`claim` checks the folder before anything is written."""

    path: Path
    #: The model and options that set the results. Written before the first result.
    recipe: Mapping[str, Any]
    #: Whether the folder holds results of another recipe, which are removed when the run begins.
    other: bool

    def begin(self) -> None:
        """Write the recipe. Remove the results of another recipe, or else unfinished files of a killed run."""
        for old in (self.path / SLIDES).glob("*.json" if self.other else f".*{PARTIAL}"):
            old.unlink()
        write_atomically(self.path / OPTIONS, _text(self.recipe))

    def keep(self, slide: CohortSlide, image: Mapping[str, Any]) -> None:
        """Write the result of a slide."""
        write_atomically(self._file(slide), _text({"schema": SCHEMA, "slide": asdict(slide), "image": image}))

    def kept(self, slide: CohortSlide, tolerances: Sequence[float]) -> ImageLifetime | None:
        """Return a slide's result; None if there is no result, the file is damaged, or the slide has changed since."""
        if self.other:
            return None
        try:
            content = from_json(bytes_at_most(self._file(slide), MAX_RESULT_BYTES, none="result"))
            same = content["schema"] == SCHEMA and content["slide"] | {"name": slide.name} == asdict(slide)
            return image_from_json(content["image"], slide.name, tolerances) if same else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _file(self, slide: CohortSlide) -> Path:
        # Slides in several folders may have the same name.
        place = hashlib.sha256(slide.path.encode(errors="surrogateescape")).hexdigest()[:12]
        return self.path / SLIDES / f"{Path(slide.path).name[:40]}-{place}.json"


def claim(path: Path, task: CohortTask, *, force: bool) -> RunFolder:
    """Check that a run may use ``path``.

    Raises LutgenError: no folder, foreign files, a model without files, or another run unless forced.
    """
    in_the_way = next((place for place in (path, *path.parents) if place.exists()), path)
    if in_the_way.exists() and not in_the_way.is_dir():
        raise LutgenError(f"{in_the_way}: is a file, and a run is a folder. Choose another with -o.")
    model = hashlib.sha256(model_text(task.model, path.resolve())).hexdigest()
    recipe = {"schema": SCHEMA, "version": task.version, "model": model, **task.options}
    before = _read(path)
    if before is None:
        return RunFolder(path, recipe, other=False)
    changed = [name for name in recipe if before.get(name) != recipe[name]]
    if changed and not force:
        raise LutgenError(
            f"{path}: holds a run with other settings ({', '.join(changed)}). Add --force to delete its results, or "
            "choose another folder with -o."
        )
    return RunFolder(path, recipe, other=bool(changed))


def _read(path: Path) -> dict[str, Any] | None:
    """Return the recipe of the run in a folder; None for an empty or missing folder."""
    advice = "Was it edited? Choose another folder with -o."
    try:
        content = from_json(bytes_at_most(path / OPTIONS, MAX_RESULT_BYTES, none="run", advice=advice))
    except FileNotFoundError:
        stranger = min((each.name for each in path.iterdir()), default="") if path.is_dir() else ""
        if not stranger or stranger.endswith(PARTIAL):
            return None
        raise LutgenError(
            f"{path}: holds files that are no run of lutgen's, such as {stranger}. Choose an empty or new folder "
            "with -o."
        ) from None
    except LutgenError:  # which is a ValueError too
        raise
    except (OSError, ValueError) as error:
        raise LutgenError(f"{path / OPTIONS}: cannot be read ({error}). {advice}") from None
    if not isinstance(content, dict) or "tolerances" not in content:
        raise LutgenError(f"{path / OPTIONS}: does not describe a cohort. Choose another folder with -o.")
    return content


def _text(content: Mapping[str, Any]) -> bytes:
    return (json.dumps(content, indent=1, allow_nan=False) + "\n").encode()


def image_from_json(content: Mapping[str, Any], file: str, tolerances: Sequence[float]) -> ImageLifetime:
    """Return the result that ``lifetime --json`` wrote. Raises KeyError, TypeError or ValueError for other content."""
    tissue, modes = content["tissue"], content["modes"]
    return ImageLifetime(
        file=file,
        pixels=int(content["pixels"]),
        colours=int(content["colours"]),
        bits=int(content["bits"]),
        binning_error=float(content["binning_error"]),
        tissue=tissue and Tissue(tissue["threshold_L"], tissue["left_out_share"]),
        curves={mode: _curve(each["curve"]) for mode, each in modes.items()},
        intervals=_intervals(modes, tolerances),
    )


def _curve(points: Sequence[Mapping[str, float]]) -> DifferenceCurve:
    names = [each.name for each in fields(DifferenceCurve)]
    return DifferenceCurve(**{name: np.array([float(point[IN_JSON[name]]) for point in points]) for name in names})


def _intervals(modes: Mapping[str, Any], tolerances: Sequence[float]) -> Intervals | None:
    intervals: Intervals = {}
    for mode, each in modes.items():
        intervals[mode] = {}
        for tolerance in tolerances:
            interval = each["lifetimes"][f"{tolerance:g}"]["interval"]
            if interval is None:
                return None
            intervals[mode][tolerance] = {name: (ends[0], ends[1]) for name, ends in interval.items()}
    return intervals
