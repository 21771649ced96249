"""``Protocol``: all decisions of a reader study, frozen before the first answer.

A study is a folder::

    STUDY/protocol.json       all decisions, with hashes of images, renders and model; never changed
    STUDY/images/….png        the renders that readers see: each image under each of its conditions, with blind names
    STUDY/answers/….sqlite    one file for each reader
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from lutgen.cells import first_doubled, whole
from lutgen.documents import canonical_json, from_json
from lutgen.errors import LutgenError
from lutgen.files import read_at_most, write_atomically

PROTOCOL = "protocol.json"
IMAGES = "images"
ANSWERS = "answers"

SCHEMA = 1

#: Most bytes of a protocol: two million trials of some hundred bytes each.
MAX_BYTES = 256_000_000


@dataclass(frozen=True)
class StudyCondition:
    """A display that shows images: ``none`` is the un-aged display, ``chroma@18000`` is a mode at an hour."""

    name: str
    mode: str
    hours: float


@dataclass(frozen=True)
class StudyImage:
    """A given image: its name in the study, the hash of its file, and its size in pixels."""

    name: str
    sha256: str
    width: int
    height: int


@dataclass(frozen=True)
class Category:
    """A diagnosis that a reader may give, its key on the keyboard, and its side."""

    name: str
    key: str
    positive: bool


@dataclass(frozen=True)
class Render:
    """The render of an image under a condition: a path in the study's folder, and its hash."""

    image: str
    condition: str
    file: str
    sha256: str


@dataclass(frozen=True)
class StudyTrial:
    """One image in one session; ``reader`` is the number of a reader's place. All numbers count from 1."""

    reader: int
    session: int
    position: int
    image: str
    condition: str


@dataclass(frozen=True)
class Protocol:
    """All decisions before the first answer."""

    #: Title to display.
    title: str
    #: The conditions, the images to read, and the images to practise on first, un-aged and not analysed.
    conditions: tuple[StudyCondition, ...]
    images: tuple[StudyImage, ...]
    practice: tuple[StudyImage, ...]
    #: Diagnoses to choose from.
    categories: tuple[Category, ...]
    #: Smallest and largest ease of reading; larger is easier.
    ease: tuple[int, int]
    #: Number of readers and of sessions.
    readers: int
    sessions: int
    #: Least days from the end of a reader's session to the start of the next.
    washout_days: float
    #: Seed of the design.
    seed: int
    #: The display model: name, hash, and for each condition the hash of the LUT of its renders.
    model: Mapping[str, Any]
    #: The renders, and the trials: which reader sees which render when.
    renders: tuple[Render, ...]
    trials: tuple[StudyTrial, ...]
    #: Version of lutgen that planned the study.
    version: str

    def session(self, reader: int, session: int) -> list[StudyTrial]:
        """Return the trials of a reader's place in a session, in their order."""
        trials = [trial for trial in self.trials if (trial.reader, trial.session) == (reader, session)]
        return sorted(trials, key=lambda trial: trial.position)

    def render(self, image: str, condition: str) -> Render:
        """Return the render of an image under a condition. Raises KeyError if the study has no such render."""
        return self._renders[image, condition]

    @cached_property
    def _renders(self) -> dict[tuple[str, str], Render]:
        return {(render.image, render.condition): render for render in self.renders}

    def as_json(self) -> dict[str, Any]:
        """Return what the file holds, its own hash last."""
        content = {"schema": SCHEMA, **asdict(self)}
        return {**content, "sha256": _hash(content)}

    @property
    def sha256(self) -> str:
        """The hash in the file. Every file of answers refers to this hash."""
        return str(self.as_json()["sha256"])


def write_protocol(study: Path, protocol: Protocol) -> None:
    """Write ``protocol.json`` into the folder of a study. Raises LutgenError when the file cannot be written."""
    text = json.dumps(protocol.as_json(), indent=1, ensure_ascii=False, allow_nan=False)
    write_atomically(study / PROTOCOL, f"{text}\n".encode())


def read_protocol(study: Path) -> Protocol:
    """Return a study's protocol. Raises LutgenError: missing, no protocol, too large, or altered."""
    path = study / PROTOCOL
    advice = "Give the folder that lutgen study plan made."
    data = read_at_most(path, MAX_BYTES, what="the protocol", none="protocol", advice=advice)
    try:
        content = from_json(data)
    except ValueError:
        raise LutgenError(f"{path}: is no JSON, or cut off. Restore it, or plan the study again.") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise LutgenError(f"{path}: is no protocol of schema {SCHEMA}. {advice}")
    claimed = content.pop("sha256", None)
    if claimed != _hash(content):
        message = f"{path}: was altered after it was frozen (its hash does not fit). Restore it, or plan a new study."
        raise LutgenError(message)
    return _protocol(content, path)


def _hash(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(canonical_json(content).encode()).hexdigest()


#: Attribute → the dataclass of its items.
_ITEMS = {
    "conditions": StudyCondition,
    "images": StudyImage,
    "practice": StudyImage,
    "categories": Category,
    "renders": Render,
    "trials": StudyTrial,
}


def _protocol(content: Mapping[str, Any], path: Path) -> Protocol:
    values = {field.name: content.get(field.name) for field in fields(Protocol)}
    try:
        for name, kind in _ITEMS.items():
            values[name] = tuple(kind(**item) for item in content[name])
        values["ease"] = tuple(content["ease"])
        return Protocol(**values)  # type: ignore[arg-type]
    except (KeyError, TypeError) as error:
        message = f"{path}: another version of lutgen planned this study ({error}). Run it with that version."
        raise LutgenError(message) from None


#: The paper's scales: negative 0 and 1+, positive 2+ and 3+; ease from 1 (hard) to 10 (easy).
PAPER_NEGATIVE, PAPER_POSITIVE, PAPER_EASE = "0,1+", "2+,3+", "1..10"

#: Most diagnoses: one for each digit key except 0.
MOST_CATEGORIES = 9

#: Most letters of a diagnosis, so that it fits on a key of the reading page.
MAX_LETTERS = 40


def categories_of(negative: str, positive: str) -> tuple[Category, ...]:
    """Return the diagnoses of lists such as ``0,1+`` and ``2+,3+``, with keys. Raises LutgenError: invalid lists."""
    sides = [(name.strip(), side) for text, side in ((negative, False), (positive, True)) for name in text.split(",")]
    names = [name for name, _ in sides]
    wrong = next((name for name in names if not (name.isprintable() and 0 < len(name) <= MAX_LETTERS)), None)
    if wrong is not None:
        allowed = f"names of 1 to {MAX_LETTERS} printable letters in a list, at least one a side"
        raise LutgenError(f"diagnosis {wrong!r}: give --negative and --positive {allowed}, such as 0,1+.")
    twice = first_doubled(names)
    if twice is not None:
        raise LutgenError(f"diagnosis {twice!r} is given twice. Name each diagnosis once, on one side.")
    if len(names) > MOST_CATEGORIES:
        raise LutgenError(f"{len(names)} diagnoses, and {MOST_CATEGORIES} keys for them. Leave some out.")
    digits = [name[0] for name in names]
    own = all(digit in "0123456789" for digit in digits) and len(set(digits)) == len(digits)
    keys = digits if own else [str(number) for number in range(1, len(names) + 1)]
    return tuple(Category(name, key, side) for (name, side), key in zip(sides, keys, strict=True))


def ease_of(text: str) -> tuple[int, int]:
    """Return the smallest and largest ease of a text such as ``1..10``. Raises LutgenError: no such scale."""
    first, dots, last = text.partition("..")
    lowest = whole(first, least=0, most=1)
    highest = None if lowest is None else whole(last, least=lowest + 1, most=10 if lowest else 9)
    if dots and lowest is not None and highest is not None:
        return lowest, highest
    allowed = "give a scale such as 1..10, from 0 or 1 to at most 10 (9 from 0); more is easier"
    raise LutgenError(f"--ease {text}: {allowed}.")


PAPER_CATEGORIES, PAPER_SCALE = categories_of(PAPER_NEGATIVE, PAPER_POSITIVE), ease_of(PAPER_EASE)
