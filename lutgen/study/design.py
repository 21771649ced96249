"""The balanced, random design of a study: who reads which image under which condition, and when.

Session 1, as in section 2.3 of Avanaki et al. (Proc. SPIE 9420, 2015), shows the same number of images under each
condition. The condition of each image is drawn at random. The next reader reads the same images with the conditions
shifted by one (a Latin square), so that a group of as many readers as conditions reads every image under every
condition. Every later session shows the same images un-aged.

Orders are random, and stratified in time. The session is divided into as many equal stretches as a condition has
images, and each stretch holds one of these images. With equal numbers the stretches are blocks that hold every
condition once. In a purely random order a condition may come late by chance, and then a tired reader is slow on this
condition. Here the mean positions of two conditions differ by less than one block in every session, not only on
average.

Each reader's session is drawn from its own random stream: another reader changes nothing for the other readers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lutgen.cells import BLANKS, number
from lutgen.display import MODES, hour_name
from lutgen.errors import LutgenError
from lutgen.numerals import listed
from lutgen.study.protocol import StudyCondition, StudyTrial
from lutgen.study.tables import Row, read_rows

#: The un-aged display, which shows the picture unchanged.
UNAGED = StudyCondition("none", "stable", 0.0)

#: The paper's conditions of session 1, images under each, and sessions. The 18 000 h are lutgen's choice.
PAPER_CONDITIONS = "none,chroma@18000,chroma-luma@18000"
PAPER_PER_CONDITION, PAPER_SESSIONS = 40, 2

#: A larger number of readers or sessions is treated as a typing error.
MOST = 1000

#: Most readings over all readers and sessions: a larger protocol takes minutes and gigabytes.
MOST_READINGS = 200_000


@dataclass(frozen=True)
class Design:
    """Which reader reads which image, under which condition, in which session."""

    #: All conditions of the trials, in the order given; ``none`` is last if only later sessions show it.
    conditions: tuple[StudyCondition, ...]
    #: Trials by reader, session and position.
    trials: tuple[StudyTrial, ...]
    #: Names of given images that nobody reads.
    left_out: tuple[str, ...]

    @property
    def readers(self) -> int:
        """Number of places for readers."""
        return max(trial.reader for trial in self.trials)

    @property
    def sessions(self) -> int:
        """Number of sessions of each reader."""
        return max(trial.session for trial in self.trials)


def check_readings(readings: int, asked: str) -> None:
    """Raise LutgenError if there are more readings than a study may have; ``asked`` names their product."""
    if readings > MOST_READINGS:
        raise LutgenError(f"{asked} are {readings} readings; a study has at most {MOST_READINGS}. Ask for fewer.")


def condition_of(text: str) -> StudyCondition:
    """Return the condition that ``none`` or ``mode@hour`` names. Raises LutgenError that lists what is allowed."""
    text = text.strip(BLANKS)
    if text == UNAGED.name:
        return UNAGED
    mode, _, hour = text.partition("@")
    # Names of folders write hours in digits, with up to six decimals.
    hours = number(hour) if set(hour) <= set("0123456789.") else None
    # More hours are treated as a typing error.
    if mode not in MODES or hours is None or not 0 <= hours < 1e9 or round(hours, 6) != hours:
        raise LutgenError(
            f"unknown condition {text!r}. Write none (un-aged), or a mode and an hour such as chroma@18000; "
            f"modes are {', '.join(MODES)}."
        )
    return StudyCondition(f"{mode}@{hour_name(hours).removesuffix('h')}", mode, hours)


def conditions_of(texts: Sequence[str]) -> tuple[StudyCondition, ...]:
    """Return the conditions. Raises LutgenError for an unknown condition, a condition named twice, or none."""
    conditions: dict[str, StudyCondition] = {}
    for text in texts:
        condition = condition_of(text)
        if condition.name in conditions:
            raise LutgenError(f"--conditions names {condition.name} twice. Name each condition once.")
        conditions[condition.name] = condition
    if not conditions:
        raise LutgenError(f"--conditions names no condition. Write a list such as {PAPER_CONDITIONS}.")
    return tuple(conditions.values())


def balanced_design(
    images: Sequence[str],
    conditions: Sequence[StudyCondition],
    *,
    per_condition: int = PAPER_PER_CONDITION,
    readers: int = 1,
    sessions: int = PAPER_SESSIONS,
    seed: int,
) -> Design:
    """Draw the design that the module's docstring describes. Raises LutgenError: too few images, or wrong options."""
    for name, count in (("per-condition", per_condition), ("readers", readers), ("sessions", sessions)):
        if count < 1 or (name != "per-condition" and count > MOST):
            raise LutgenError(f"--{name} {count}: give {'1 or more' if name == 'per-condition' else f'1 to {MOST}'}.")
    needed = len(conditions) * per_condition
    if len(images) < needed:
        raise LutgenError(
            f"{len(images)} images are fewer than the design needs: {len(conditions)} conditions × {per_condition} "
            f"images each are {needed}. Give {needed - len(images)} more, or ask for at most "
            f"--per-condition {len(images) // len(conditions)}."
        )
    check_readings(needed * readers * sessions, f"{needed} images × {readers} readers × {sessions} sessions")
    # Stream (0, 0) is for the design itself; readers and sessions count from 1.
    drawn = [images[place] for place in stream(seed, 0, 0).permutation(len(images))[:needed]]
    trials: list[StudyTrial] = []
    for reader in range(1, readers + 1):
        turn = [conditions[(place + reader - 1) % len(conditions)].name for place in range(len(conditions))]
        first = {image: turn[place // per_condition] for place, image in enumerate(drawn)}
        for session in range(1, sessions + 1):
            shown = first if session == 1 else dict.fromkeys(drawn, UNAGED.name)
            trials += ordered(shown, reader, session, seed)
    later = [UNAGED] if sessions > 1 and UNAGED not in conditions else []
    read = set(drawn)
    return Design((*conditions, *later), tuple(trials), tuple(image for image in images if image not in read))


def ordered(shown: Mapping[str, str], reader: int, session: int, seed: int) -> list[StudyTrial]:
    """Return the trials of a session (image → condition) in random order, as the module's docstring describes."""
    rng = stream(seed, reader, session)
    times: dict[str, float] = {}
    for condition in dict.fromkeys(shown.values()):
        images = [image for image, name in shown.items() if name == condition]
        for stretch, place in enumerate(rng.permutation(len(images))):
            times[images[place]] = (stretch + rng.random()) / len(images)
    in_order = sorted(times, key=times.__getitem__)
    return [StudyTrial(reader, session, at, image, shown[image]) for at, image in enumerate(in_order, 1)]


def stream(seed: int, reader: int, session: int) -> np.random.Generator:
    """Return the random stream of a reader's session, which depends on no other session."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(reader, session)))


NEEDED, OPTIONAL = ("session", "image", "condition"), ("reader", "position")


class _DesignRow(NamedTuple):
    """A line of the table; ``reader`` None: the line holds for every reader."""

    line: int
    session: int
    image: str
    condition: StudyCondition
    reader: int | None
    position: int | None


def read_design(path: Path, images: Sequence[str], *, readers: int | None, seed: int) -> Design:
    """Read a design of images with these names from a table. Raises LutgenError, which names the wrong line."""
    rows = [_design_row(row, images) for row in read_rows(path, NEEDED, optional=OPTIONAL)[1]]
    named = {row.reader for row in rows if row.reader is not None}
    if named and readers is not None and readers != max(named):
        raise LutgenError(f"{path}: has readers up to {max(named)}, and --readers says {readers}. Leave --readers out.")
    count = max(named, default=readers or 1)
    sessions = max(row.session for row in rows)
    if not named:
        check_readings(len(rows) * count, f"{path}: {len(rows)} rows × {count} readers")
    trials: list[StudyTrial] = []
    for reader in range(1, count + 1):
        for session in range(1, sessions + 1):
            shown = [row for row in rows if row.session == session and row.reader in (None, reader)]
            if not shown:
                raise LutgenError(
                    f"{path}: reader {reader} reads nothing in session {session}. Number readers and sessions from 1, "
                    "and give every reader every session."
                )
            trials += _session(path, shown, reader, session, seed)
    read = {row.image for row in rows}
    conditions = {row.condition.name: row.condition for row in rows}
    return Design(tuple(conditions.values()), tuple(trials), tuple(image for image in images if image not in read))


def _session(path: Path, rows: Sequence[_DesignRow], reader: int, session: int, seed: int) -> list[StudyTrial]:
    shown: dict[str, _DesignRow] = {}
    for row in rows:
        if row.image in shown:
            raise LutgenError(
                f"{path}, line {row.line}: image {row.image} is in session {session} already (line "
                f"{shown[row.image].line}). Show each image once a session."
            )
        shown[row.image] = row
    if rows[0].position is None:
        return ordered({image: row.condition.name for image, row in shown.items()}, reader, session, seed)
    in_order = sorted(rows, key=lambda row: row.position or 0)
    for position, row in enumerate(in_order, 1):
        if row.position != position:
            raise LutgenError(
                f"{path}, line {row.line}: position {row.position} where {position} is next for reader {reader} in "
                f"session {session}. Number a session's positions 1 to {len(rows)}, each once."
            )
    return [StudyTrial(reader, session, at, row.image, row.condition.name) for at, row in enumerate(in_order, 1)]


def _design_row(row: Row, images: Sequence[str]) -> _DesignRow:
    if row.cells["image"] not in images:
        raise row.error("image", f"is no image that was given. Given were: {listed(images, 10)}.")
    try:
        condition = condition_of(row.cells["condition"])
    except LutgenError as error:
        raise row.refused("condition", error) from None
    return _DesignRow(
        row.line,
        row.whole("session", low=1, high=MOST),
        row.cells["image"],
        condition,
        row.whole("reader", low=1, high=MOST) if "reader" in row.cells else None,
        row.whole("position", low=1, high=len(images)) if "position" in row.cells else None,
    )
