"""Write docs/reference: ``python -m docs.generate``. Pages without a source in the code are removed."""

from __future__ import annotations

import sys
from pathlib import Path

from docs.generate import commands, effects, json_schemas, python_api
from docs.generate.markup import MADE
from lutgen.effects import catalogue

REFERENCE = Path(__file__).resolve().parents[1] / "reference"


def pages() -> dict[str, str]:
    """Return every generated page by its path below docs/reference."""
    return {path: text for each in (commands, effects, json_schemas, python_api) for path, text in each.pages().items()}


def generated() -> set[str]:
    """Return the paths below docs/reference of the existing generated pages."""
    generated_pages = (
        path for path in REFERENCE.rglob("*.md") if path.read_text(encoding="utf-8").endswith(f"{MADE}\n")
    )
    return {path.relative_to(REFERENCE).as_posix() for path in generated_pages}


def main() -> int:
    """Write all pages and plots. Return the exit code."""
    texts = pages()
    for gone in generated() - set(texts):
        (REFERENCE / gone).unlink()
        (REFERENCE / gone).with_suffix(".png").unlink(missing_ok=True)
    for path, text in texts.items():
        (REFERENCE / path).parent.mkdir(parents=True, exist_ok=True)
        (REFERENCE / path).write_text(text, encoding="utf-8")
    for name in catalogue():
        (REFERENCE / "effects" / f"{name}.png").write_bytes(effects.plot(name))
    print(f"docs/reference: {len(texts)} pages, {len(catalogue())} plots")
    return 0


if __name__ == "__main__":
    sys.exit(main())
