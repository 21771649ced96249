"""The sections of the page, and the templates that show them.

Templates escape every value that they are given, so that a file name cannot become markup.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table

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
        A file of ``report/templates``, which uses ``values`` by these names.
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


@cache
def environment() -> Environment:
    """Give the environment of ``report/templates``: autoescape, and an error for a value that was not given."""
    templates = Environment(
        loader=PackageLoader("lutgen.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["spaced"] = spaced
    templates.tests |= {
        "table": lambda part: isinstance(part, Table),
        "headline": lambda part: isinstance(part, Headline),
    }
    templates.policies["json.dumps_kwargs"] = {"ensure_ascii": False}
    return templates


def render(template: str, **values: Any) -> str:
    """Fill a template of ``report/templates``."""
    return environment().get_template(template).render(**values)
