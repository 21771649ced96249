"""``Protocol``: a reader study as it was frozen before the first answer.

A study is a folder::

    STUDY/protocol.json       everything that was decided, with hashes of images, renders and model; never changed
    STUDY/images/….png        what readers see: every image under every condition that it is read under, blind names
    STUDY/answers/….sqlite    one file a reader
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from lutgen.documents import from_json
from lutgen.errors import LutgenError
from lutgen.files import read_at_most, write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

PROTOCOL = "protocol.json"
IMAGES = "images"
ANSWERS = "answers"

SCHEMA = 1

#: A trial takes some hundred bytes: this is two million of them.
MAX_BYTES = 256_000_000


@dataclass(frozen=True)
class Condition:
    """A display that images are shown as: ``none`` is the un-aged one, ``chroma@18000`` a mode at an hour."""

    name: str
    mode: str
    hours: float


@dataclass(frozen=True)
class StudyImage:
    """An image as it was given: its name in the study, the hash of the file, its size in pixels."""

    name: str
    sha256: str
    width: int
    height: int


@dataclass(frozen=True)
class Category:
    """A diagnosis that a reader may give, the key that gives it, and which side it counts for."""

    name: str
    key: str
    positive: bool


@dataclass(frozen=True)
class Render:
    """What is shown of an image under a condition: a path in the study's folder, and its hash."""

    image: str
    condition: str
    file: str
    sha256: str


@dataclass(frozen=True)
class Trial:
    """One image in one session: ``reader`` is the number of a place that a reader takes, from 1, as all others."""

    reader: int
    session: int
    position: int
    image: str
    condition: str


@dataclass(frozen=True)
class Protocol:
    """All that was decided before the first answer.

    Attributes
    ----------
    title
        For people.
    conditions, images, practice
        What is compared, what is read, and what is shown first to practise on, un-aged and not analysed.
    categories
        Diagnoses to choose from.
    ease
        Smallest and largest ease of reading; larger is easier.
    readers, sessions
        How many of each.
    washout_days
        Least days from the end of a reader's session to the start of the next.
    seed
        Of the design.
    model
        The display model whose LUTs made the renders: name, hash, and per condition the hash of the LUT.
    renders, trials
        What is shown, and to whom, when.
    version
        Of the lutgen that planned it.

    """

    title: str
    conditions: tuple[Condition, ...]
    images: tuple[StudyImage, ...]
    practice: tuple[StudyImage, ...]
    categories: tuple[Category, ...]
    ease: tuple[int, int]
    readers: int
    sessions: int
    washout_days: float
    seed: int
    model: Mapping[str, Any]
    renders: tuple[Render, ...]
    trials: tuple[Trial, ...]
    version: str

    def session(self, reader: int, session: int) -> list[Trial]:
        """Return the trials of a reader's place in a session, in their order."""
        here = [trial for trial in self.trials if (trial.reader, trial.session) == (reader, session)]
        return sorted(here, key=lambda trial: trial.position)

    def render(self, image: str, condition: str) -> Render:
        """Return what is shown of an image under a condition. Raises KeyError when it is not in the study."""
        found = {(render.image, render.condition): render for render in self.renders}
        return found[image, condition]

    def as_json(self) -> dict[str, Any]:
        """Return what the file holds, its own hash last."""
        content = {"schema": SCHEMA, **asdict(self)}
        return {**content, "sha256": _hash(content)}

    @property
    def sha256(self) -> str:
        """The hash that the file carries: answers are tied to it."""
        return str(self.as_json()["sha256"])


def write_protocol(study: Path, protocol: Protocol) -> None:
    """Write ``protocol.json`` into the folder of a study. Raises LutgenError when that cannot be done."""
    text = json.dumps(protocol.as_json(), indent=1, ensure_ascii=False, allow_nan=False)
    write_atomically(study / PROTOCOL, f"{text}\n".encode())


def read_protocol(study: Path) -> Protocol:
    """Read a study's protocol.

    Raises
    ------
    LutgenError
        There is none, it is none of ours or too large for one, or it was altered after it was frozen.

    """
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
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


#: Attributes that hold items of a dataclass.
_ITEMS = {
    "conditions": Condition,
    "images": StudyImage,
    "practice": StudyImage,
    "categories": Category,
    "renders": Render,
    "trials": Trial,
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
