"""``plan_study``: freeze all decisions before the first answer, and render the pictures that readers will see."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from collections import Counter
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.bake.manifest import model_as_json, without_paths
from lutgen.display import DisplayModel, what_luts_carry
from lutgen.errors import LutgenError, reason_of
from lutgen.files import PARTIAL, file_sha256, scratch
from lutgen.progress import Progress, unseen
from lutgen.study.design import UNAGED, Design
from lutgen.study.pictures import BakedLut, Picture, bake_conditions, find_images, look_at, render_images
from lutgen.study.power import MOST, Power, study_power
from lutgen.study.protocol import ANSWERS, IMAGES, PAPER_CATEGORIES, PAPER_SCALE, PROTOCOL, Protocol, write_protocol
from lutgen.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from lutgen.study.protocol import Category

#: A longer washout is treated as a typing error.
MAX_WASHOUT_DAYS = 3650.0

#: The entries of a study's folder. A folder with other entries is not replaced.
_OURS = {PROTOCOL, IMAGES, ANSWERS}


@dataclass(frozen=True)
class Planned:
    """A planned study."""

    #: Folder of the study.
    study: Path
    #: The frozen protocol.
    protocol: Protocol
    #: Names of given images that nobody reads.
    left_out: tuple[str, ...]
    #: Names of images with 16 bits per channel, which are shown rounded to 8 bits.
    rounded: tuple[str, ...]
    #: Sentences on conditions of the display that the LUTs fix, or cannot represent.
    remarks: tuple[str, ...]

    @property
    def per_condition(self) -> dict[str, int]:
        """Number of images that the first reader reads under each condition of session 1."""
        return dict(Counter(trial.condition for trial in self.protocol.session(1, 1)))

    @property
    def power(self) -> Power | None:
        """Power of the study, from the fewest answers of a condition of session 1; None: it cannot be computed."""
        answers = Counter(trial.condition for trial in self.protocol.trials if trial.session == 1)
        readers = self.protocol.readers
        fewest = min(answers.values()) // readers
        worked_out = len(answers) > 1 and 1 <= fewest <= MOST // readers
        return study_power(fewest, readers) if worked_out else None

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes. The protocol itself is in the study's folder."""
        protocol, images, luts = self.protocol, self.per_condition, self.protocol.model["luts"]
        return {
            "schema": 1,
            "study": str(self.study),
            "protocol_sha256": protocol.sha256,
            "title": protocol.title,
            "seed": protocol.seed,
            "display": {"file": protocol.model["file"], "sha256": protocol.model["sha256"]},
            "model": protocol.model["model"],
            "conditions": [
                {**asdict(each), "images_a_reader": images.get(each.name, 0), "lut": luts.get(each.name)}
                for each in protocol.conditions
            ],
            "readers": protocol.readers,
            "sessions": protocol.sessions,
            "washout_days": protocol.washout_days,
            "images": [each.name for each in protocol.images],
            "practice": [each.name for each in protocol.practice],
            "left_out": list(self.left_out),
            "rounded": list(self.rounded),
            "trials": len(protocol.trials),
            "renders": len(protocol.renders),
            "remarks": list(self.remarks),
            "power": self.power.as_json() if self.power else None,
        }


def plan_study(
    images: Sequence[str | Path],
    study: str | Path,
    model: DisplayModel,
    design_of: Callable[[Sequence[str]], Design],
    *,
    seed: int,
    practice: Sequence[str | Path] = (),
    washout_days: float,
    title: str,
    categories: tuple[Category, ...] = PAPER_CATEGORIES,
    ease: tuple[int, int] = PAPER_SCALE,
    force: bool = False,
    progress: Progress = unseen,
) -> Planned:
    """Plan a study and render the pictures for its readers. On an error nothing is written.

    Parameters
    ----------
    images, practice
        Files and folders of images to read, and of images to practise on first.
    study
        The folder to create. An existing folder is replaced only with ``force``, and never if it holds answers or files
        that lutgen did not write.
    model
        The display that ages the pictures.
    design_of
        Draws or reads the design, given the names of the images.
    seed
        Seed of the design and of the blind names.
    categories, ease
        The diagnoses that a reader may give, and the smallest and largest ease of reading.
    progress
        Called with the number of images and renders done, and of all.

    Raises
    ------
    LutgenError
        An image cannot be shown or is given twice, the images do not fit the design, hours are outside the measured
        span, or the folder cannot be created.

    """
    study = Path(study)
    check_new_study(study, force=force)
    _check(washout_days, seed, title)
    pictures, practised = _pictures(images, practice, progress)
    design = design_of([picture.name for picture in pictures])
    for condition in design.conditions:
        model.at(condition.mode, condition.hours)
    read = {trial.image for trial in design.trials}
    pictures = tuple(picture for picture in pictures if picture.name in read)
    pairs = _renders(pictures, practised, design)
    with _new_study(study, force=force) as new, scratch() as folder:
        luts = bake_conditions(design.conditions, model, Path(folder))
        # Blind names can be computed only from the seed, every image and every LUT.
        hashes = [*(each.sha256 for each in (*pictures, *practised)), *(lut.sha256 for lut in luts.values())]
        key = hashlib.sha256(json.dumps([seed, *hashes]).encode()).digest()
        renders = render_images(pairs, luts, new, key, lambda done: progress(done, len(pairs)))
        for picture in (*pictures, *practised):
            if file_sha256(picture.path) != picture.sha256:
                raise LutgenError(f"{picture.path}: was changed while the study was planned. Plan it again.")
        protocol = Protocol(
            title=title,
            conditions=design.conditions,
            images=tuple(picture.frozen for picture in pictures),
            practice=tuple(picture.frozen for picture in practised),
            categories=categories,
            ease=ease,
            readers=design.readers,
            sessions=design.sessions,
            washout_days=washout_days,
            seed=seed,
            model=_model(model, luts),
            renders=renders,
            trials=design.trials,
            version=__version__,
        )
        write_protocol(new, protocol)
    rounded = tuple(picture.name for picture in (*pictures, *practised) if picture.rounded)
    return Planned(study, protocol, design.left_out, rounded, tuple(what_luts_carry(model)))


def check_new_study(study: Path, *, force: bool) -> None:
    """Raise LutgenError if no study may be created in this folder."""
    try:
        if study.exists() and not study.is_dir():
            raise LutgenError(f"{study}: is a file. Give the name of a new folder for the study.")
        entries = {path.name for path in study.iterdir()} if study.exists() else set()
        answered = ANSWERS in entries and any((study / ANSWERS).iterdir())
    except OSError as error:
        reason = reason_of(error)
        raise LutgenError(f"{study}: cannot make the study: {reason}. Choose another place with -o.") from None
    if not entries:
        return
    if answered:
        message = f"{study}: holds readers' answers, which --force does not delete either. Choose another folder."
        raise LutgenError(message)
    if PROTOCOL not in entries or entries - _OURS:
        raise LutgenError(f"{study}: holds what lutgen study plan did not make. Choose another folder with -o.")
    if not force:
        message = f"{study}: holds a study already. Choose another folder, or add --force: it has no answers yet."
        raise LutgenError(message)


def _check(washout_days: float, seed: int, title: str) -> None:
    if not (math.isfinite(washout_days) and 0 <= washout_days <= MAX_WASHOUT_DAYS):
        raise LutgenError(f"--washout-days {washout_days:g}: give days from 0 to {MAX_WASHOUT_DAYS:g}.")
    if seed < 0:
        raise LutgenError(f"--seed {seed}: give a whole number from 0 on.")
    if not title.isprintable():
        raise LutgenError(f"--title {title[:80]!a}: give one line of letters that can all be seen.")


def _pictures(
    images: Sequence[str | Path], practice: Sequence[str | Path], progress: Progress
) -> tuple[tuple[Picture, ...], tuple[Picture, ...]]:
    """Read and check all images together, since a practice image must not be equal to an image of the sessions."""
    read = find_images(images)
    paths = find_images([*read, *find_images(practice)])
    pictures = look_at(paths, lambda done: progress(done, len(paths)))
    return pictures[: len(read)], pictures[len(read) :]


def _renders(pictures: Sequence[Picture], practised: Sequence[Picture], design: Design) -> list[tuple[Picture, str]]:
    """Return each (image, condition) that any reader sees; practice images are shown un-aged."""
    needed = {(trial.image, trial.condition) for trial in design.trials}
    pairs = [
        (picture, condition.name)
        for picture in pictures
        for condition in design.conditions
        if (picture.name, condition.name) in needed
    ]
    return [*pairs, *((picture, UNAGED.name) for picture in practised)]


def _model(model: DisplayModel, luts: dict[str, BakedLut]) -> dict[str, Any]:
    """Describe the display: name and hash of its file, the model behind the LUTs, and each LUT's error."""
    readings = model.measurements
    content = {
        "file": Path(readings.file).name,
        "model": Path(model.file).name if model.file else None,
        "sha256": readings.sha256,
        "description": without_paths(model_as_json(model, Path.cwd())),
        "luts": {name: lut.as_json() for name, lut in luts.items()},
    }
    # Lists instead of tuples, as in a protocol read from its file.
    plain: dict[str, Any] = json.loads(json.dumps(content))
    return plain


@contextmanager
def _new_study(study: Path, *, force: bool) -> Iterator[Path]:
    """Yield a new folder that becomes ``study`` at the end; until then a replaced folder stays."""
    final = study.resolve()
    temporary = final.with_name(f".{final.name}{PARTIAL}")
    new, old = temporary / "new", temporary / "old"
    try:
        shutil.rmtree(temporary, ignore_errors=True)
        new.mkdir(parents=True)
        yield new
        # A reader may have answered during rendering.
        check_new_study(study, force=force)
        if final.exists():
            final.rename(old)
        new.rename(final)
    except OSError as error:
        reason = reason_of(error)
        message = f"{study}: cannot make the study: {reason}. Make room, or choose another place with -o."
        raise LutgenError(message) from None
    finally:
        if old.exists() and not final.exists():
            old.rename(final)
        shutil.rmtree(temporary, ignore_errors=True)
