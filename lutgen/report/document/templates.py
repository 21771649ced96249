"""The templates of the page. They escape every value that they are given, so that a file name cannot become markup."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table


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
