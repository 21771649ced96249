"""``Campaign``: the sessions of one display over its life, and the table of readings made from them.

Aging needs the operating hours of each session, or dates and the operating hours per day.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.readings.conditions import CONDITIONS, OF_COLUMN
from lutgen.readings.session import Session
from lutgen.readings.table import OPTIONAL, Measurements


@dataclass(frozen=True)
class CampaignEntry:
    """One session of a campaign."""

    #: The readings.
    session: Session
    #: Source for error messages: file and line of the entry in the campaign file, or the file of the session.
    where: str
    #: Date of the session, and its operating hours as stated in the campaign; None: not known.
    date: date | None
    hours: float | None
    #: Texts of the campaign file; without an instrument there, the instrument of the session's file.
    instrument: str
    settings: str
    note: str
    #: Column of a condition → value in all readings of the session, for columns that the campaign states.
    conditions: dict[str, float]


#: How sessions get times.
_GIVE_TIMES = (
    "Give every session hours, or every session a date: in one table of all sessions (.csv) with a column 'hour', in a "
    "line '# date: 2026-03-01' of each table of one session, or with hours = … or date = … in a campaign file, which "
    "lutgen sessions init FILE... -o campaign.toml drafts."
)


@dataclass(frozen=True)
class Campaign:
    """Sessions of one display."""

    #: Name of the display.
    display: str
    #: Operating hours per day, which convert dates into hours; None: not stated.
    hours_per_day: float | None
    #: The sessions, in the order of the file.
    entries: tuple[CampaignEntry, ...]
    #: The campaign file, and the hash of its bytes and of the hashes of all sessions in the order of ``entries``.
    file: str
    sha256: str

    def hours(self) -> Array:
        """Return the operating hours of each entry since the earliest entry, (n,).

        The source is ``hours``, or ``date`` and the hours per day. A campaign of one session needs neither.

        Raises LutgenError: an entry has neither hours nor date, or some entries have hours and others only dates.
        """
        if len(self.entries) == 1:
            return np.zeros(1)
        if all(entry.hours is not None for entry in self.entries):
            hours = np.array([entry.hours for entry in self.entries], dtype=np.float64)
            return np.asarray(hours - hours.min())
        for entry in self.entries:
            if entry.hours is not None or entry.date is None:
                what = "neither hours nor date" if entry.date is None else "hours where others only have a date"
                raise LutgenError(f"{entry.where}: {what}. {_GIVE_TIMES}")
        if self.hours_per_day is None:
            raise LutgenError(
                f"{self.file}: sessions have dates, which are no operating hours. Say how long the display is on: "
                "hours_per_day = 8.0 under [display] of a campaign file (lutgen sessions init drafts one), "
                "or hours = … in every session."
            )
        days = np.array([entry.date.toordinal() for entry in self.entries if entry.date], dtype=np.float64)
        return np.asarray((days - days.min()) * self.hours_per_day)

    def check_several(self, purpose: str) -> None:
        """Raise LutgenError if the campaign has one session; ``purpose`` ("a trend") names what needs several."""
        if len(self.entries) < 2:
            raise LutgenError(
                f"{self.file}: one session; {purpose} needs two or more. Name further files, or add [[sessions]] to a "
                f"campaign file."
            )

    def measurements(self) -> Measurements:
        """Return the readings of all sessions as one table, sorted by hour; hour 0 is the earliest session.

        ``files`` and ``lines`` come from the sessions. ``order`` is None unless every session has an order.

        Raises LutgenError: a session is relative, hours are missing, or the table is invalid (tips are missing, …).
        """
        hours = self.hours()
        places = np.argsort(hours, kind="stable")
        entries = [self.entries[place] for place in places]
        sessions = [entry.session for entry in entries]
        counts = [len(session.drive) for session in sessions]
        names = sorted({name for entry in entries for name in (*entry.conditions, *entry.session.conditions)})
        return Measurements(
            hours=np.repeat(hours[places], counts),
            drive=np.vstack([session.drive for session in sessions]),
            xyz_cd_m2=np.vstack([session.xyz_cd_m2 for session in sessions]),
            lines=np.concatenate([session.lines.astype(np.float64) for session in sessions]),
            conditions={name: np.concatenate([_condition(entry, name) for entry in entries]) for name in names},
            session=tuple(Path(session.file).name for session in sessions for _ in session.drive),
            note=tuple(text for entry in entries for text in _notes(entry)),
            order=_order(sessions),
            metadata={**_common(sessions), "display": self.display, "source": self._source()},
            remarks=_remarks(sessions),
            file=self.file,
            files=tuple(session.file for session in sessions for _ in session.drive),
            sha256=self.sha256,
            calibrations=_calibrations(hours[places], sessions),
        )

    def _source(self) -> str:
        """Return the source of the readings; the text says whether a session is simulated."""
        sessions = [entry.session for entry in self.entries]
        remarks = [session.metadata.get("SIMULATED", "") for session in sessions]
        simulated = next((f"simulated, not measured ({text}); " for text in remarks if text), "")
        if len(sessions) > 1:
            return f"{simulated}campaign of {len(sessions)} sessions, {Path(self.file).name}"
        day = f" of {sessions[0].created.date()}" if sessions[0].created else ""
        return sessions[0].metadata.get("source") or f"{simulated}one session{day}, {sessions[0].form}"

    def campaign(self) -> "Campaign":
        """Return the campaign itself; required by the interface ``Readable``."""
        return self


def alone(session: Session) -> Campaign:
    """Return the campaign of one session, at hour 0, with the date of the session's own file."""
    day = session.created.date() if session.created else None
    entry = CampaignEntry(session, session.file, day, None, session.instrument, "", "", {})
    return campaign_of([entry], file=session.file)


def campaign_of(entries: Sequence[CampaignEntry], *, file: str) -> Campaign:
    """Return the campaign of sessions without a campaign file. Raises LutgenError: two sessions are the same."""
    check_once(entries)
    sha256 = hashlib.sha256("".join(entry.session.sha256 for entry in entries).encode()).hexdigest()
    display = next((entry.session.display for entry in entries if entry.session.display), "")
    return Campaign(display, None, tuple(entries), file, sha256)


def sessions_of(readings: Measurements) -> Campaign:
    """Split a table of readings into sessions; a session has one hour and one session name.

    The first session has the remarks on the whole table.

    Readings away from rest are left out, except readings that are away from rest only by a condition that is
    ``of_readings``.
    """
    rest = np.ones(readings.hours.size, dtype=bool)
    for condition in CONDITIONS:
        if condition.cell in readings.rest.away and not condition.of_readings:
            rest &= ~readings.rest.away[condition.cell]
    first, *others = [
        _entry_at_rest(readings, np.flatnonzero((readings.sessions == each) & rest))
        for each in np.unique(readings.sessions[rest])
    ]
    first = replace(first, session=replace(first.session, remarks=readings.remarks))
    return campaign_of([first, *others], file=readings.file)


def _entry_at_rest(readings: Measurements, rows: NDArray[np.intp]) -> CampaignEntry:
    """Return the entry of the session that has these rows of a table."""
    hour, name = float(readings.hours[rows[0]]), readings.session[rows[0]] if readings.session else ""
    file = f"{readings.file}, hour {hour:g}{f', session {name}' if name else ''}"
    own = [name for name, condition in OF_COLUMN.items() if condition.of_readings]
    varied = any(each in readings.conditions for each in own)
    instrument = readings.metadata.get("instrument", "")
    session = Session(
        drive=readings.drive[rows],
        xyz=readings.xyz_cd_m2[rows],
        absolute=True,
        names=("",) * rows.size,
        lines=readings.lines[rows].astype(np.int64),
        form="table of readings",
        conditions={each: readings.column(each)[rows] for each in own} if varied else {},
        order=None if readings.order is None else readings.order[rows],
        notes=tuple(readings.note[row] for row in rows) if readings.note else (),
        instrument=instrument,
        display=readings.metadata.get("display", ""),
        metadata=readings.metadata,
        file=file,
        sha256=hashlib.sha256(f"{readings.sha256} {hour!r} {name}".encode()).hexdigest(),
    )
    logged = {each: float(values[rows[0]]) for each, values in readings.rest.values.items() if each not in own}
    conditions = {each: value for each, value in logged.items() if np.isfinite(value)}
    return CampaignEntry(session, file, None, hour, instrument, "", "", conditions)


def check_once(entries: Sequence[CampaignEntry]) -> None:
    """Raise LutgenError if a session is listed twice."""
    seen: dict[str, CampaignEntry] = {}
    for entry in entries:
        first = seen.setdefault(entry.session.sha256, entry)
        if first is not entry:
            raise LutgenError(
                f"{entry.where}: the session holds the same bytes as the session of {first.where}. Delete one of them."
            )


def _calibrations(hours: Array, sessions: Sequence[Session]) -> dict[float, Array]:
    """Return hour → calibration curves of the hour's first session that has curves."""
    loaded: dict[float, Array] = {}
    for hour, session in zip(hours.tolist(), sessions, strict=True):
        if session.calibration is not None:
            loaded.setdefault(hour, session.calibration)
    return loaded


def _common(sessions: Sequence[Session]) -> dict[str, str]:
    """Return the metadata that all sessions have in common."""
    first = sessions[0].metadata
    return {key: text for key, text in first.items() if all(each.metadata.get(key) == text for each in sessions)}


def _remarks(sessions: Sequence[Session]) -> tuple[str, ...]:
    """Return the remarks of all sessions once each; the files are named if not all sessions have the remark."""
    files: dict[str, list[str]] = {}
    for session in sessions:
        for remark in dict.fromkeys(session.remarks):
            files.setdefault(remark, []).append(Path(session.file).name)
    return tuple(
        remark if len(names) == len(sessions) else f"{', '.join(names)}: {remark}" for remark, names in files.items()
    )


def _order(sessions: Sequence[Session]) -> Array | None:
    """Return numbers that grow with the time of reading, session by session; None if a session has no order."""
    after, orders = 0.0, []
    for session in sessions:
        if session.order is None:
            return None
        orders.append(session.order - session.order.min() + after)
        after = float(orders[-1].max()) + 1.0
    return np.concatenate(orders)


def _notes(entry: CampaignEntry) -> list[str]:
    notes = entry.session.notes or ("",) * len(entry.session.drive)
    return ["; ".join(filter(None, (entry.settings, note))) for note in notes]


def _condition(entry: CampaignEntry, name: str) -> Array:
    """Return the values of a column, (n,): from the campaign file, or from the session."""
    session = entry.session
    if name in entry.conditions:
        return np.full(len(session.drive), entry.conditions[name])
    return session.conditions.get(name, np.full(len(session.drive), OPTIONAL[name]))
