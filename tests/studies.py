"""Small studies without the planning command: a protocol, PNGs of noise or of a picture, and a simulated reader."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from lutgen.study.design import UNAGED
from lutgen.study.protocol import (
    IMAGES,
    PAPER_CATEGORIES,
    Category,
    Protocol,
    Render,
    StudyCondition,
    StudyImage,
    StudyTrial,
    write_protocol,
)
from lutgen.study.reading import Decision
from lutgen.study.simulated import PAPER_DIFFERENCES

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.study.reading import ReadingSession

CONDITIONS = (
    UNAGED,
    StudyCondition("chroma@18000", "chroma", 18000.0),
    StudyCondition("chroma-luma@18000", "chroma-luma", 18000.0),
)


def small_protocol(
    *,
    images: int = 4,
    practice: int = 1,
    readers: int = 2,
    sessions: int = 2,
    size: tuple[int, int] = (64, 48),
    conditions: tuple[StudyCondition, ...] = CONDITIONS,
    washout_days: float = 24.0,
    categories: tuple[Category, ...] = PAPER_CATEGORIES,
    seed: int = 1,
) -> Protocol:
    """Plan session 1 with alternating conditions and later sessions un-aged, in any order; no pictures exist."""
    random = np.random.default_rng(seed)
    names = [f"case-{number:03}" for number in range(1, images + 1)]
    trying = [f"try-{number}" for number in range(1, practice + 1)]
    trials = [
        StudyTrial(reader, session, position, names[at], conditions[at % len(conditions) if session == 1 else 0].name)
        for reader in range(1, readers + 1)
        for session in range(1, sessions + 1)
        for position, at in enumerate(map(int, random.permutation(images)), start=1)
    ]
    shown = sorted({*((trial.image, trial.condition) for trial in trials), *((name, UNAGED.name) for name in trying)})
    by_name = {name: StudyImage(name, hashlib.sha256(name.encode()).hexdigest(), *size) for name in names + trying}
    return Protocol(
        title="Does an aged display change how slides are read?",
        conditions=conditions,
        images=tuple(by_name[name] for name in names),
        practice=tuple(by_name[name] for name in trying),
        categories=categories,
        ease=(1, 10),
        readers=readers,
        sessions=sessions,
        washout_days=washout_days,
        seed=seed,
        model={"name": "made for a test"},
        renders=tuple(Render(*each, f"{IMAGES}/{random.bytes(8).hex()}.png", "0" * 64) for each in shown),
        trials=tuple(trials),
        version="0",
    )


def make_study(folder: Path, *, picture: NDArray[np.uint8] | None = None, **wanted: Any) -> Protocol:
    """Make a study in ``folder``: a protocol planned by :func:`small_protocol`, and its pictures."""
    planned = small_protocol(**wanted) if picture is None else small_protocol(**wanted, size=picture.shape[1::-1])
    random = np.random.default_rng(planned.seed)
    (folder / IMAGES).mkdir(parents=True)
    renders = []
    shape = (planned.images[0].height, planned.images[0].width, 3)
    for render in planned.renders:
        data = png(random.integers(0, 256, shape).astype(np.uint8) if picture is None else picture)
        (folder / render.file).write_bytes(data)
        renders.append(replace(render, sha256=hashlib.sha256(data).hexdigest()))
    protocol = replace(planned, renders=tuple(renders))
    write_protocol(folder, protocol)
    return protocol


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return pixels (h, w, 3) as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "png")
    return buffer.getvalue()


@dataclass
class Clock:
    """A clock that tests set."""

    now: datetime = datetime(2026, 3, 2, 9, tzinfo=UTC)

    def __call__(self) -> datetime:
        """Return the time and advance the clock by a second."""
        self.now += timedelta(seconds=1)
        return self.now


def decision(number: int) -> Decision:
    """Return a reader's decision on the image with this number; every category and ease occurs."""
    names = [category.name for category in PAPER_CATEGORIES]
    seconds = 2.0 + number / 8
    return Decision(names[number % 4], number % 10 + 1, seconds, seconds, 0, 0.0, "animation-frame")


def read_on(reading: ReadingSession, count: int | None = None) -> None:
    """Read the remaining images, or ``count`` of them, with the decisions of :func:`said`."""
    while (task := reading.task()) is not None and count != 0:
        reading.show(task)
        reading.answer(task.number, decision(task.number), practice=task.practice)
        count = None if count is None else count - 1


def paper_trials(seed: int, *, per_condition: int = 40, readers: int = 1) -> tuple[StudyTrial, ...]:
    """Return trials of the paper's study (section 2.3): a session under three conditions, and one un-aged."""
    random = np.random.default_rng([seed, 4])
    names = [f"image-{number:03}" for number in range(1, 3 * per_condition + 1)]
    trials = []
    for reader in range(1, readers + 1):
        under = dict(zip(random.permutation(names), sorted([*PAPER_DIFFERENCES] * per_condition), strict=True))
        for session, shown in ((1, under), (2, dict.fromkeys(names, "none"))):
            order = map(str, random.permutation(names))
            trials += [
                StudyTrial(reader, session, place, name, shown[name]) for place, name in enumerate(order, start=1)
            ]
    return tuple(trials)
