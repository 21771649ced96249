"""The page of ``lutgen merge``: which views a config has gained, and that its other parts give the same pixels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.report.parts import Headline

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.merge import Merged
    from lutgen.report.parts import Part


def merge_page(merged: Merged) -> Iterator[Part]:
    """Yield what ``lutgen merge`` prints."""
    yield Headline(f"{merged.config}: {len(merged.views)} aged view{'s' if len(merged.views) != 1 else ''} added.")
    for display, view in merged.views:
        yield f"display {display}, view {view}"
    yield (
        f"They take the code values of {merged.source_space}. All {merged.compared} parts that were there give the "
        f"same pixels as before; the aged views differ from the build's own by {merged.difference:.1g} at most."
    )
    for remark in merged.remarks:
        yield f"note: {remark}"
