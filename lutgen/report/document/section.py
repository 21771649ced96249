"""A section of the page: its heading, and the template that its values fill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class PageSection:
    """One section.

    Attributes
    ----------
    identifier
        Its anchor in the page.
    title
        Its heading.
    template
        A file of ``report/templates``, in which ``values`` are called so.
    values
        What the template shows.
    kind
        ``live``: seen where scripts run, not printed; ``still``: printed, and seen where no script runs; "": always.
    label
        Its name for programs that read the page aloud; "": its heading.

    """

    identifier: str
    title: str
    template: str
    values: Mapping[str, Any]
    kind: str = ""
    label: str = ""
