"""The page of ``lutgen sessions explain``: a table of verdicts, then what each rests on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from lutgen.report.criticism.comparison import table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from lutgen.measurements.campaign import Campaign
    from lutgen.sessions.separate import Separation


def separate_page(found: Separation) -> Iterator[RenderableType]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = found.campaign.entries[found.reference].session
    yield from simulated(found.campaign)
    yield f"Held against {Path(reference.file).name}."
    made = table("session", "days", "verdict", "cause", "the display")
    for pair, said in zip(found.pairs, found.verdicts, strict=True):
        join = " and " if said.kind == "several" else " or "
        days = "–" if pair.days is None else f"{pair.days:.0f}"
        made.add_row(
            Path(pair.after.session.file).name, days, said.kind, join.join(said.names) or "–", said.display
        )  # fmt: skip
    yield made
    for pair, said in zip(found.pairs, found.verdicts, strict=True):
        yield ""
        yield Text(Path(pair.after.session.file).name, style="bold")
        yield said.sentence
        yield from (f"• {each}" for each in said.evidence)
        yield from (f"To tell: {each}." for each in said.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that says so where sessions are simulated."""
    said = [
        text for entry in campaign.entries for key, text in entry.session.metadata.items() if key.upper() == "SIMULATED"
    ]
    if said:
        yield f"Simulated, not measured: {said[0]}."
