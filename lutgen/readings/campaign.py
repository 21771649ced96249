"""``Campaign``: the sessions of one display over its life, as a campaign file (TOML) lists them.

::

    schema = 1
    [display]
    name = "KOIOS K2418U"
    hours_per_day = 8.0             # turns dates into operating hours; only its owner knows
    [[sessions]]
    file = "2019-04-01.ti3"         # beside the campaign file
    date = 2019-04-01               # or hours = 0.0
    instrument = "i1 DisplayPro"
    ambient_lx = 0.0
    settings = "brightness 30 %"
    position = [0.5, 0.5]           # from the left and the top, 0..1

A date is no operating hour: without ``hours`` or ``hours_per_day`` nothing is told about aging.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from datetime import date, datetime
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.documents import from_toml
from lutgen.errors import LutgenError
from lutgen.files import read_at_most
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.sessions import read_session
from lutgen.readings.sessions._source import YEARS
from lutgen.readings.table import OPTIONAL, RANGES, Measurements

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

SCHEMA = 1

#: What an entry may say, beside its file: text, and conditions with the ranges of a table of readings.
TEXTS = ("instrument", "settings", "note")
CONDITIONS = tuple(name for name in COLUMNS if name not in {"u", "v"})
_KEYS = ("file", "date", "hours", *TEXTS, *CONDITIONS, "position")
_TOP = {"schema", "display", "sessions"}
_DISPLAY = ("name", "hours_per_day", "note")

#: A campaign of more sessions than a day's worth for years is a slip.
MOST_SESSIONS = 2000

#: They take some hundred bytes each.
MAX_BYTES = 4_000_000


@dataclass(frozen=True)
class Entry:
    """One session of a campaign.

    Attributes
    ----------
    session
        Its readings.
    line
        Where the campaign file names it.
    date, hours
        When it was measured: a date, operating hours as counted by whoever wrote them; None: not said.
    instrument, settings, note
        What the campaign says, else for the instrument what the file says.
    conditions
        ``ambient_lx``, ``warmup_min``, ``temperature_c``, ``window`` and the position ``u``, ``v``, where said.

    """

    session: Session
    line: int
    date: date | None
    hours: float | None
    instrument: str
    settings: str
    note: str
    conditions: dict[str, float]


@dataclass(frozen=True)
class Campaign:
    """Sessions of one display.

    Attributes
    ----------
    display
        Its name.
    hours_per_day
        Operating hours a day, which turns dates into hours; None: not said.
    entries
        In the order of the file.
    file, sha256
        The campaign file, and the hash of its bytes and of all its sessions' in their order.

    """

    display: str
    hours_per_day: float | None
    entries: tuple[Entry, ...]
    file: str
    sha256: str

    def hours(self) -> Array:
        """Operating hours of each entry since the earliest, (n,): by its ``hours``, else by its date and hours a day.

        The hour of a single session is 0.

        Raises
        ------
        LutgenError
            An entry has neither, or some count hours and others only have dates.

        """
        if len(self.entries) == 1:
            return np.zeros(1)
        if all(entry.hours is not None for entry in self.entries):
            hours = np.array([entry.hours for entry in self.entries], dtype=np.float64)
            return np.asarray(hours - hours.min())
        for entry in self.entries:
            if entry.hours is not None or entry.date is None:
                what = "neither hours nor date" if entry.date is None else "hours where others only have a date"
                message = f"{self.file}, line {entry.line}: {what}. Give every session hours, or every session a date."
                raise LutgenError(message)
        if self.hours_per_day is None:
            message = (
                f"{self.file}: sessions have dates, which are no operating hours. Say how long the display is on: "
                "hours_per_day = 8.0 under [display], or hours = … in every session."
            )
            raise LutgenError(message)
        days = np.array([entry.date.toordinal() for entry in self.entries if entry.date], dtype=np.float64)
        return np.asarray((days - days.min()) * self.hours_per_day)

    def measurements(self) -> Measurements:
        """Return the readings of all sessions as one table, sorted by hour; hour 0 is the earliest session.

        ``lines`` are those of the entries in the campaign file.

        Raises
        ------
        LutgenError
            A session is relative, hours are not said, or the table is refused (tips are missing, …).

        """
        hours = self.hours()
        order = np.argsort(hours, kind="stable")
        entries = [self.entries[place] for place in order]
        counts = [len(entry.session.drive) for entry in entries]
        names = sorted({name for entry in entries for name in _conditions(entry)})
        return Measurements(
            hours=np.repeat(hours[order], counts),
            drive=np.vstack([entry.session.drive for entry in entries]),
            xyz_cd_m2=np.vstack([entry.session.xyz_cd_m2 for entry in entries]),
            lines=np.repeat([float(entry.line) for entry in entries], counts),
            conditions={name: np.concatenate([_condition(entry, name) for entry in entries]) for name in names},
            session=tuple(name for entry, n in zip(entries, counts, strict=True) for name in [_title(entry)] * n),
            note=tuple(text for entry, n in zip(entries, counts, strict=True) for text in [entry.settings] * n),
            metadata={
                "display": self.display,
                "source": f"campaign of {len(entries)} sessions, {Path(self.file).name}",
            },
            file=self.file,
            sha256=self.sha256,
            calibration=entries[0].session.calibration,
        )


def read_campaign(path: str | Path) -> Campaign:
    """Read a campaign file and all sessions that it names.

    Raises
    ------
    LutgenError
        Unreadable, no TOML, a key that is unknown or wrong, or a session that is: names file and line.

    """
    path = Path(path)
    try:
        text = read_at_most(path, MAX_BYTES, what="the campaign", none="campaign").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise LutgenError(f"{path}: is no UTF-8 text. A campaign is a TOML file.") from None
    return parse_campaign(text, file=str(path))


def campaign_of(paths: Sequence[str | Path]) -> Campaign:
    """Return the campaign of session files that no campaign file lists: their dates are those that they hold.

    Raises
    ------
    LutgenError
        A session cannot be read, or two are the same.

    """
    sessions = [read_session(path) for path in paths]
    entries = tuple(
        Entry(session, place, _date({}, session, session.file), None, session.instrument, "", "", {})
        for place, session in enumerate(sessions, start=1)
    )
    file = "the sessions given"
    _check_once(entries, file)
    sha256 = hashlib.sha256("".join(session.sha256 for session in sessions).encode()).hexdigest()
    display = next((session.display for session in sessions if session.display), "")
    return Campaign(display, None, entries, file, sha256)


def parse_campaign(text: str, *, file: str) -> Campaign:
    """Read campaign ``text`` whose sessions lie beside ``file``; errors as :func:`read_campaign`."""
    try:
        content = from_toml(text)
    except ValueError as error:
        message = f"{file}: is no TOML: {error}. Draft a campaign of session files with lutgen sessions init."
        raise LutgenError(message) from None
    _check_keys(content, tuple(_TOP), file)
    if content.get("schema") != SCHEMA:
        said = f"schema = {content.get('schema')!r}"
        message = f"{file}: {said}; a campaign has schema = {SCHEMA}. lutgen sessions init drafts one."
        raise LutgenError(message)
    display, listed = content.get("display", {}), content.get("sessions", [])
    if not isinstance(display, dict) or not isinstance(listed, list) or not listed:
        raise LutgenError(f"{file}: needs [display] and one [[sessions]] for every session.")
    if len(listed) > MOST_SESSIONS:
        raise LutgenError(f"{file}: {len(listed)} sessions; at most {MOST_SESSIONS}. Split the campaign.")
    _check_keys(display, _DISPLAY, f"{file}, [display]")
    lines = [n for n, line in enumerate(text.splitlines(), start=1) if re.match(r"\s*\[\[\s*sessions\s*\]\]", line)]
    if len(lines) != len(listed):
        raise LutgenError(f"{file}: write every session as a [[sessions]] block of its own.")
    entries = tuple(_entry(each, file, line) for each, line in zip(listed, lines, strict=True))
    _check_once(entries, file)
    sha256 = hashlib.sha256(text.encode())
    for entry in entries:
        sha256.update(bytes.fromhex(entry.session.sha256))
    per_day = _number(display, "hours_per_day", f"{file}, [display]")
    if per_day is not None and not 0 < per_day <= 24:
        raise LutgenError(f"{file}, [display]: hours_per_day = {per_day:g}; a day has above 0 and at most 24.")
    return Campaign(_text(display, "name", f"{file}, [display]"), per_day, entries, file, sha256.hexdigest())


def _entry(said: Any, file: str, line: int) -> Entry:
    where = f"{file}, line {line}"
    if not isinstance(said, dict):
        raise LutgenError(f"{where}: a session is a [[sessions]] block.")
    _check_keys(said, _KEYS, where)
    name = _text(said, "file", where)
    if not name:
        raise LutgenError(f'{where}: the session names no file. Add file = "….ti3".')
    session = read_session(Path(file).parent / name)
    hours = _number(said, "hours", where)
    conditions = {each: value for each in CONDITIONS if (value := _number(said, each, where)) is not None}
    conditions |= _position(said, where)
    for each, value in (*conditions.items(), *([("hour", hours)] if hours is not None else [])):
        low, high, meaning = RANGES[each]
        if not low <= value <= high:
            raise LutgenError(f"{where}: {'hours' if each == 'hour' else each} = {value:g} must be {meaning}.")
    return Entry(
        session=session,
        line=line,
        date=_date(said, session, where),
        hours=hours,
        instrument=_text(said, "instrument", where) or session.instrument,
        settings=_text(said, "settings", where),
        note=_text(said, "note", where),
        conditions=conditions,
    )


def _check_keys(said: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    unknown = next((key for key in said if key not in known), None)
    if unknown is not None:
        raise LutgenError(f"{where}: unknown key {unknown!r}. Pick one of: {', '.join(sorted(known))}.")


def _text(said: dict[str, Any], key: str, where: str) -> str:
    value = said.get(key, "")
    if not isinstance(value, str):
        raise LutgenError(f"{where}: {key} must be text in quotes, not {value!r}.")
    return value


def _number(said: dict[str, Any], key: str, where: str) -> float | None:
    value = said.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise LutgenError(f"{where}: {key} must be a number, not {value!r}.")
    return float(value)


def _position(said: dict[str, Any], where: str) -> dict[str, float]:
    value = said.get("position")
    if value is None:
        return {}
    numbers = isinstance(value, list) and len(value) == 2 and all(type(each) in (int, float) for each in value)
    if not numbers:
        raise LutgenError(f"{where}: position must be two numbers, such as [0.5, 0.5] for the centre, not {value!r}.")
    return {"u": float(value[0]), "v": float(value[1])}


def _date(said: dict[str, Any], session: Session, where: str) -> date | None:
    value = said.get("date")
    if value is None:
        return session.created.date() if session.created else None
    found = value.date() if isinstance(value, datetime) else value
    if not isinstance(found, date):
        raise LutgenError(f"{where}: date must be a TOML date without quotes, such as 2020-05-26, not {value!r}.")
    if found.year not in YEARS:
        raise LutgenError(
            f"{where}: date = {found}: between {YEARS[0]} and {YEARS[-1]}, please: displays are not older."
        )
    return found


def _check_once(entries: tuple[Entry, ...], file: str) -> None:
    seen: dict[str, int] = {}
    for entry in entries:
        if entry.session.sha256 in seen:
            first = seen[entry.session.sha256]
            message = (
                f"{file}, line {entry.line}: {entry.session.file} holds the same bytes as the session of line {first}."
            )
            raise LutgenError(f"{message} Delete one of them.")
        seen[entry.session.sha256] = entry.line


def _conditions(entry: Entry) -> set[str]:
    return {*entry.conditions, *(("u", "v") if entry.session.positions is not None else ())}


def _condition(entry: Entry, name: str) -> Array:
    if entry.session.positions is not None and name in {"u", "v"} and name not in entry.conditions:
        return entry.session.positions[:, "uv".index(name)]
    return np.full(len(entry.session.drive), entry.conditions.get(name, OPTIONAL[name]))


def _title(entry: Entry) -> str:
    return Path(entry.session.file).name
