"""Campaign files (TOML): the sessions of one display over its life.

::

    schema = 1
    [display]
    name = "KOIOS K2418U"
    hours_per_day = 8.0             # converts dates into operating hours
    [[sessions]]
    file = "2019-04-01.ti3"         # in the folder of the campaign file
    date = 2019-04-01               # or hours = 0.0
    instrument = "i1 DisplayPro"
    ambient_lx = 0.0
    settings = "brightness 30 %"
    position = [0.5, 0.5]           # from the left and the top, 0..1
    white_cd_m2 = 120.0             # for a session whose file is relative to white
"""

import hashlib
import re
from datetime import date, datetime
from math import isfinite
from pathlib import Path
from typing import Any

from lutgen.documents import from_toml
from lutgen.errors import LutgenError
from lutgen.readings.campaign import Campaign, CampaignEntry, check_once
from lutgen.readings.conditions import CONDITIONS, Condition
from lutgen.readings.formats import open_source, read_source, reader_of
from lutgen.readings.formats._source import WHITE_CD_M2, YEARS, FileText
from lutgen.readings.session import Session
from lutgen.readings.table import RANGES

NAME = "campaign file"
SUFFIXES = (".toml",)

SCHEMA = 1

#: Further keys of an entry: texts, and conditions with the same ranges as in a table of readings.
TEXTS = ("instrument", "settings", "note")
_KEYS = ("file", "date", "hours", *TEXTS, *(each.key for each in CONDITIONS), "white_cd_m2")
_COUNTS = {2: "two", 3: "three", 4: "four"}
_TOP = {"schema", "display", "sessions"}
_DISPLAY = ("name", "hours_per_day", "note")

#: Largest number of sessions: about one session per day for five years.
MOST_SESSIONS = 2000

_SESSIONS = re.compile(r"^[ \t]*\[\[[ \t]*sessions[ \t]*\]\]", re.MULTILINE)


def claims(source: FileText) -> bool:
    """Whether the text lists sessions as TOML tables."""
    return bool(_SESSIONS.search(source.text))


def read(source: FileText) -> Campaign:
    """Read a campaign file and the sessions in its folder that it names. Raises LutgenError, with file and line."""
    text, file = source.text, source.file
    try:
        content = from_toml(text)
    except ValueError as error:
        raise LutgenError(
            f"{file}: is no TOML: {error}. Draft a campaign of session files with lutgen sessions init."
        ) from None
    if "model" in content:
        raise LutgenError(f"{file}: is a saved model, not a table of measurements. Give it with --model.")
    _check_keys(content, tuple(_TOP), file)
    if content.get("schema") != SCHEMA:
        schema = f"schema = {content.get('schema')!r}"
        raise LutgenError(f"{file}: {schema}; a campaign has schema = {SCHEMA}. lutgen sessions init drafts one.")
    display, listed = content.get("display", {}), content.get("sessions", [])
    if not isinstance(display, dict) or not isinstance(listed, list) or not listed:
        raise LutgenError(f"{file}: needs [display] and one [[sessions]] for every session.")
    if len(listed) > MOST_SESSIONS:
        raise LutgenError(f"{file}: {len(listed)} sessions; at most {MOST_SESSIONS}. Split the campaign.")
    _check_keys(display, _DISPLAY, f"{file}, [display]")
    lines = [n for n, line in enumerate(text.splitlines(), start=1) if _SESSIONS.match(line)]
    if len(lines) != len(listed):
        raise LutgenError(f"{file}: write every session as a [[sessions]] block of its own.")
    entries = tuple(_entry(each, file, line) for each, line in zip(listed, lines, strict=True))
    check_once(entries)
    sha256 = hashlib.sha256(text.encode())
    for entry in entries:
        sha256.update(bytes.fromhex(entry.session.sha256))
    per_day = _number(display, "hours_per_day", f"{file}, [display]")
    if per_day is not None and not 0 < per_day <= 24:
        raise LutgenError(
            f"{file}, [display]: hours_per_day = {per_day:g}; a day has more than 0 and at most 24 hours."
        )
    return Campaign(_text(display, "name", f"{file}, [display]"), per_day, entries, file, sha256.hexdigest())


def _entry(block: Any, file: str, line: int) -> CampaignEntry:
    where = f"{file}, line {line}"
    if not isinstance(block, dict):
        raise LutgenError(f"{where}: a session is a [[sessions]] block.")
    _check_keys(block, _KEYS, where)
    name = _text(block, "file", where)
    if not name:
        raise LutgenError(f'{where}: the session names no file. Add file = "….ti3".')
    session = _session(Path(file).parent / name, where)
    white = _number(block, "white_cd_m2", where)
    if white is not None and not WHITE_CD_M2[0] <= white <= WHITE_CD_M2[1]:
        low, high = WHITE_CD_M2
        raise LutgenError(f"{where}: white_cd_m2 = {white:g} must be white's luminance in cd/m², {low:g}..{high:g}.")
    session = session if white is None else session.with_white(white, f"by {where}")
    hours = _number(block, "hours", where)
    session = session.dated_elsewhere() if {"hours", "date"} & block.keys() else session
    conditions = {name: value for each in CONDITIONS for name, value in _values(block, each, where).items()}
    for each, value in (*conditions.items(), *([("hour", hours)] if hours is not None else [])):
        low, high, meaning = RANGES[each]
        if not low <= value <= high:
            raise LutgenError(f"{where}: {'hours' if each == 'hour' else each} = {value:g} must be {meaning}.")
    return CampaignEntry(
        session=session,
        where=where,
        date=_date(block, session, where),
        hours=hours,
        instrument=_text(block, "instrument", where) or session.instrument,
        settings=_text(block, "settings", where),
        note=_text(block, "note", where),
        conditions=conditions,
    )


def _session(path: Path, where: str) -> Session:
    source = open_source(path)
    if reader_of(source).NAME == NAME:
        raise LutgenError(f"{where}: {path} is a campaign file itself. Name the session files that it lists.")
    entries = read_source(source).campaign().entries
    if len(entries) > 1:
        raise LutgenError(f"{where}: {path} holds {len(entries)} sessions. Make a file of each.")
    return entries[0].session


def _check_keys(block: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    unknown = next((key for key in block if key not in known), None)
    if unknown is not None:
        raise LutgenError(f"{where}: unknown key {unknown!r}. Pick one of: {', '.join(sorted(known))}.")


def _text(block: dict[str, Any], key: str, where: str) -> str:
    value = block.get(key, "")
    if not isinstance(value, str):
        raise LutgenError(f"{where}: {key} must be text in quotes, not {value!r}.")
    return value


def _number(block: dict[str, Any], key: str, where: str) -> float | None:
    value = block.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise LutgenError(f"{where}: {key} must be a number, not {value!r}.")
    return float(value)


def _values(block: dict[str, Any], condition: Condition, where: str) -> dict[str, float]:
    """Return column → value of a condition, which a list states if the condition has several columns."""
    key, columns = condition.key, condition.columns
    if key not in block:
        return {}
    if len(columns) == 1:
        value = _number(block, key, where)
        return {} if value is None else {key: value}
    values, usual = block[key], {column.name: column.usual for column in columns}
    if not (isinstance(values, list) and len(values) == len(columns) and all(type(v) in (int, float) for v in values)):
        example = f"such as {[*usual.values()]} for the {condition.in_words(usual)}"
        raise LutgenError(f"{where}: {key} must be {_COUNTS[len(columns)]} numbers, {example}, not {values!r}.")
    return {name: float(value) for name, value in zip(usual, values, strict=True)}


def _date(block: dict[str, Any], session: Session, where: str) -> date | None:
    value = block.get("date")
    if value is None:
        return session.created.date() if session.created else None
    day = value.date() if isinstance(value, datetime) else value
    if not isinstance(day, date):
        raise LutgenError(f"{where}: date must be a TOML date without quotes, such as 2020-05-26, not {value!r}.")
    if day.year not in YEARS:
        raise LutgenError(
            f"{where}: date = {day}: must lie between {YEARS[0]} and {YEARS[-1]}: displays are not older."
        )
    return day
