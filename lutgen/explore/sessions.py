"""Files that were dropped together, as one file of readings: a table, a campaign file, or sessions and their hours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.history.draft import check_one_display
from lutgen.readings import read_session

if TYPE_CHECKING:
    from collections.abc import Sequence


def gathered(paths: Sequence[str], hours: Sequence[float] | None) -> dict[str, Any]:
    """Return ``data``, the file to read; or ``needs_hours``, the sessions whose hours only a person knows.

    Raises
    ------
    LutgenError
        As ``lutgen sessions init``, or as many hours as there are sessions were not given.

    """
    files = [Path(path) for path in paths]
    campaign = next((file for file in files if file.suffix.lower() == ".toml"), None)
    if campaign or len(files) == 1:
        return {"data": str(campaign or files[0])}
    sessions = [read_session(file) for file in files]
    check_one_display(sessions)
    if hours is None:
        dates = [each.created.strftime("%Y-%m-%d %H:%M") if each.created else None for each in sessions]
        names = [{"name": file.name, "dated": date} for file, date in zip(files, dates, strict=True)]
        return {"needs_hours": names}
    if len(hours) != len(files):
        raise LutgenError(f"{len(hours)} hours were given for {len(files)} sessions. Give one for each.")
    ordered = sorted(zip(hours, files, strict=True))
    entries = [f"[[sessions]]\nfile = {json.dumps(file.name)}\nhours = {float(hour)!r}" for hour, file in ordered]
    to = files[0].parent / "campaign.toml"
    to.write_text("\n\n".join(["schema = 1", *entries, ""]), encoding="utf-8")
    return {"data": str(to)}
