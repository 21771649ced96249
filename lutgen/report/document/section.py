"""The sections of the page, and the templates that show them.

Templates escape every value that they are given, so that a file name cannot become markup.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from lutgen.numerals import spaced
from lutgen.pictures.viewer import FOLDER
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Says before anything is drawn that scripts run here.
_CLASS_SCRIPT = 'document.documentElement.className = "script";'


#: Says before anything is drawn that scripts run here.
_CLASS_SCRIPT = 'document.documentElement.className = "script";'


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


def style_and_script() -> dict[str, Any]:
    """Give the page's own style and scripts, with the viewer's, and the hashes by which the page permits these alone.

    The main script is one module in the page, so what it imports stands before it.
    """
    templates = files("lutgen.report").joinpath("templates")
    own = templates.joinpath("page.js").read_text("utf-8").splitlines(keepends=True)
    script = (FOLDER / "viewer.js").read_text("utf-8") + "".join(each for each in own if not each.startswith("import "))
    style = (FOLDER / "viewer.css").read_text("utf-8") + templates.joinpath("page.css").read_text("utf-8")
    given = {"style": style, "script": script, "class_script": _CLASS_SCRIPT}
    hashes = {"script_hash": _hash(script), "class_hash": _hash(_CLASS_SCRIPT)}
    return {name: Markup(text) for name, text in given.items()} | hashes  # noqa: S704 - files of this package


def _hash(script: str) -> str:
    return f"sha256-{b64encode(sha256(script.encode()).digest()).decode()}"


def render(template: str, **values: Any) -> str:
    """Fill a template of ``report/templates``."""
    return environment().get_template(template).render(**values)
