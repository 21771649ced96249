"""The page of ``lutgen sessions explain``: a table of verdicts, then the evidence for each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.history.explain import Explanations
    from lutgen.readings.campaign import Campaign
    from lutgen.report.parts import Part


def explanation_page(separation: Explanations) -> Iterator[Part]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = separation.campaign.entries[separation.reference].session
    yield from simulated(separation.campaign)
    yield f"Held against {Path(reference.file).name}."
    yield Table(
        ("session", "days", "verdict", "cause", "the display"),
        [
            (
                Path(pair.after.session.file).name,
                "–" if pair.days is None else f"{pair.days:.0f}",
                verdict.kind,
                (" and " if verdict.kind == "several" else " or ").join(verdict.names) or "–",
                verdict.display,
            )
            for pair, verdict in zip(separation.pairs, separation.verdicts, strict=True)
        ],
    )
    for pair, verdict in zip(separation.pairs, separation.verdicts, strict=True):
        yield ""
        yield Headline(Path(pair.after.session.file).name)
        yield verdict.sentence
        yield from (f"• {each}" for each in verdict.evidence)
        yield from (f"To tell: {each}." for each in verdict.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that says that sessions are simulated, if any is."""
    notices = [
        text for entry in campaign.entries for key, text in entry.session.metadata.items() if key.upper() == "SIMULATED"
    ]
    if notices:
        yield f"Simulated, not measured: {notices[0]}."
