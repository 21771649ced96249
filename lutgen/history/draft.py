"""Draft a campaign file from session files; lines that only a person can complete stay open."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.documents import toml_text
from lutgen.errors import LutgenError
from lutgen.history.pair import UNKNOWN
from lutgen.history.patches import CHANNELS, mean_xyz, primaries
from lutgen.history.transfer import calibration
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.session import Session

#: Δu'v' of a primary between two sessions that is too large for aging: another panel, mode or correction of the meter.
#: In 18 000 hours each primary of the paper's display moves by less than half of this value.
ANOTHER = 0.02

#: Keys that only a person can fill in, for the display and for a session → question.
OF_DISPLAY = {"hours_per_day": "Hours a day that the display is on"}
OF_SESSION = {
    **{name: column.question for name, column in COLUMNS.items() if column.question},
    "settings": "Settings of the display (brightness, mode)",
}


@dataclass(frozen=True)
class Answers:
    """Answers of a person, for the display and for all sessions; a key without an answer stays open in the draft."""

    #: The display's name; "": the name in the files.
    name: str = ""
    #: Keys of ``OF_DISPLAY`` and ``OF_SESSION`` with numbers or text.
    values: Mapping[str, float | str] = field(default_factory=dict)


def displays_of(sessions: Sequence[Session]) -> list[list[Session]]:
    """Group sessions by display, in the given order: same name, and primaries as close as aging allows."""
    groups: list[list[tuple[Session, dict[str, Array]]]] = []
    for session in sessions:
        tips = primaries(session)
        entry = (session, {name: xyz_to_uv(xyz) for name, xyz in tips.xyz.items()} if tips else {})
        match = next((group for group in groups if all(_alike(entry, each) for each in group)), [])
        if not match:
            groups.append(match)
        match.append(entry)
    return [[session for session, _ in group] for group in groups]


def check_one_display(sessions: Sequence[Session]) -> None:
    """Raise LutgenError for sessions of different displays: primaries differ by more than by aging, or names differ."""
    groups = displays_of(sessions)
    if len(groups) < 2:
        return
    listed = "; ".join(
        f"{number}) {_names(group) or 'no name'}: {', '.join(Path(each.file).name for each in group)}"
        for number, group in enumerate(groups, start=1)
    )
    raise LutgenError(
        f"these sessions are of {len(groups)} displays, or of very different settings (primaries differ by more than "
        f"Δu'v' {ANOTHER:g}, or names differ): {listed}. A campaign holds one display: give only its files, or add "
        "--same-display if all files are of one display."
    )


def draft(sessions: Sequence[Session], beside: Path, answers: Answers | None = None) -> str:
    """Return a campaign file for the folder ``beside``, sessions by date. Raises LutgenError: a file is given twice."""
    answers = answers or Answers()
    by_hash = {each.sha256: each for each in sessions}
    if len(by_hash) < len(sessions):
        same = next(each for each in sessions if by_hash[each.sha256] is not each)
        raise LutgenError(f"{same.file} and {by_hash[same.sha256].file} hold the same bytes. Name one of them.")
    ordered = sorted(sessions, key=lambda each: (each.created.isoformat() if each.created else "undated", each.file))
    names = _names(ordered)
    lines = [
        "# A campaign: the sessions of one display, drafted by lutgen sessions init.",
        "# Only you can complete the lines with TODO: write the value and delete '# TODO'.",
        "schema = 1",
        "",
        "[display]",
        f"name = {toml_text(answers.name or names)}",
    ]
    if not answers.name and "," in names:
        lines[-1] += "  # TODO the files name several; their primaries agree"
    why = "dates are no operating hours; or give hours for each session"
    lines.append(_answered("hours_per_day", answers, "8.0", why))
    for session in ordered:
        lines += ["", *_entry(session, beside, answers)]
    return "\n".join(lines) + "\n"


def _entry(session: Session, beside: Path, answers: Answers) -> list[str]:
    path = Path(os.path.relpath(Path(session.file).resolve(), beside.resolve())).as_posix()
    lines = ["[[sessions]]", f"# {_summary(session)}", f"file = {toml_text(path)}"]
    lines.append(f"date = {session.created.date()}" if session.created else "# TODO date = 2020-05-26, or hours = 0.0")
    known = f"instrument = {toml_text(session.instrument)}"
    lines.append(known if session.instrument else '# TODO instrument = "maker and model"')
    asked = [(name, column) for name, column in COLUMNS.items() if column.question]
    lines += [_answered(name, answers, str(column.usual), column.words) for name, column in asked]
    lines.append(_answered("settings", answers, '"brightness 30 %"', "the display's own"))
    if not session.absolute:
        lines.append("# TODO white_cd_m2 = 120.0  # luminance of white; the file is relative to white")
    lines.append("# position = [0.5, 0.5]  # place on the screen, from the left and the top; default: the centre")
    return lines


def _answered(key: str, answers: Answers, example: str, why: str) -> str:
    """Return the line of a key, as a TODO without an answer."""
    value = answers.values.get(key, "")
    if value == "":
        return f"# TODO {key} = {example}  # {why}"
    return f"{key} = {toml_text(value) if isinstance(value, str) else repr(float(value))}"


def _summary(session: Session) -> str:
    """Return a comment on the file: readings, white, calibration."""
    parts = [f"{len(session.drive)} readings"]
    white, loaded = mean_xyz(session, "white"), calibration(session)
    if white is not None:
        parts.append(f"white {white[1]:.1f} cd/m²" if session.absolute else "relative to white")
    if loaded is not None:
        ends = ", ".join(f"{name} {end:.3f}" for name, end in zip(CHANNELS, loaded.ends, strict=True))
        parts.append(f"calibration ends at {ends}")
    return "; ".join(parts)


def _names(sessions: Sequence[Session]) -> str:
    return ", ".join(dict.fromkeys(each.display for each in sessions if each.display))


def _alike(one: tuple[Session, dict[str, Array]], other: tuple[Session, dict[str, Array]]) -> bool:
    (mine, my_uv), (theirs, their_uv) = one, other
    named = {each.display for each in (mine, theirs) if each.display.lower() not in UNKNOWN}
    both = my_uv.keys() & their_uv.keys()
    return len(named) < 2 and all(float(np.hypot(*(my_uv[name] - their_uv[name]))) <= ANOTHER for name in both)
