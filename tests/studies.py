"""Small studies, made directly: a protocol and PNGs of noise, or of a picture given; and a reader for them."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from lutgen.study.protocol import (
    IMAGES,
    Category,
    Condition,
    Protocol,
    Render,
    StudyImage,
    Trial,
    write_protocol,
)
from lutgen.study.reading import Decision
from lutgen.study.scales import PAPER_CATEGORIES

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.study.reading import Reading

CONDITIONS = (
    Condition("none", "stable", 0.0),
    Condition("chroma@18000", "chroma", 18000.0),
    Condition("chroma-luma@18000", "chroma-luma", 18000.0),
)


def make_study(
    folder: Path,
    *,
    images: int = 4,
    practice: int = 1,
    readers: int = 2,
    sessions: int = 2,
    size: tuple[int, int] = (64, 48),
    washout_days: float = 24.0,
    categories: tuple[Category, ...] = PAPER_CATEGORIES,
    picture: NDArray[np.uint8] | None = None,
    seed: int = 1,
) -> Protocol:
    """Make a study in ``folder``: session 1 under conditions by turns, later ones un-aged, in any order."""
    random = np.random.default_rng(seed)
    names = [f"case-{number:03}" for number in range(1, images + 1)]
    trying = [f"try-{number}" for number in range(1, practice + 1)]
    shown = [(name, CONDITIONS[0].name) for name in (*trying, *names)]
    shown += [(name, each.name) for each in CONDITIONS[1:] for name in names]
    (folder / IMAGES).mkdir(parents=True)
    renders = []
    for image, condition in shown:
        width, height = size
        pixels = random.integers(0, 256, (height, width, 3)).astype(np.uint8) if picture is None else picture
        data = png(pixels)
        file = f"{IMAGES}/{random.bytes(8).hex()}.png"
        (folder / file).write_bytes(data)
        renders.append(Render(image, condition, file, hashlib.sha256(data).hexdigest()))
    trials = [
        Trial(reader, session, position, names[at], CONDITIONS[at % 3 if session == 1 else 0].name)
        for reader in range(1, readers + 1)
        for session in range(1, sessions + 1)
        for position, at in enumerate(map(int, random.permutation(images)), start=1)
    ]
    height, width = picture.shape[:2] if picture is not None else size[::-1]
    given = {
        name: StudyImage(name, hashlib.sha256(name.encode()).hexdigest(), width, height) for name in names + trying
    }
    protocol = Protocol(
        title="Does an aged display change how slides are read?",
        conditions=CONDITIONS,
        images=tuple(given[name] for name in names),
        practice=tuple(given[name] for name in trying),
        categories=categories,
        ease=(1, 10),
        readers=readers,
        sessions=sessions,
        washout_days=washout_days,
        seed=seed,
        model={"name": "made for a test"},
        renders=tuple(renders),
        trials=tuple(trials),
        version="0",
    )
    write_protocol(folder, protocol)
    return protocol


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return pixels (h, w, 3) as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "png")
    return buffer.getvalue()


@dataclass
class Clock:
    """A computer's clock that tests set."""

    now: datetime = datetime(2026, 3, 2, 9, tzinfo=UTC)

    def __call__(self) -> datetime:
        """Return the time, which goes on by a second."""
        self.now += timedelta(seconds=1)
        return self.now


def said(number: int) -> Decision:
    """What a reader says of the image of a number: every category and ease occurs."""
    names = [category.name for category in PAPER_CATEGORIES]
    seconds = 2.0 + number / 8
    return Decision(names[number % 4], number % 10 + 1, seconds, seconds, 0, 0.0, "animation-frame")


def read_on(reading: Reading, count: int | None = None) -> None:
    """Read images as :func:`said`, all that are left or some of them."""
    while (task := reading.task()) is not None and count != 0:
        reading.show(task)
        reading.answer(task.number, said(task.number), practice=task.practice)
        count = None if count is None else count - 1
