"""Hooks of mkdocs: pages of effects in the index, and links that leave docs/.

A page links to files of the repository by relative paths, so that the links work in the repository. A site contains
only docs/. There, such a link becomes a link to the repository's address (``repo_url`` in mkdocs.yml), or plain text if
mkdocs.yml has no address. A picture is copied into the site.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(((?:\.\./)+[^)\s]+)\)")


def on_config(config: Any) -> Any:
    """Put the page of every effect into the index, after the overview page."""
    folder = ROOT / "docs/reference/effects"
    pages = [f"reference/effects/{path.name}" for path in sorted(folder.glob("*.md")) if path.name != "index.md"]
    reference = next(part["Reference"] for part in config.nav if "Reference" in part)
    next(part["Effects"] for part in reference if "Effects" in part).extend(pages)
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pictures outside docs/ that pages show to the site."""
    from mkdocs.structure.files import File

    for path in sorted(pictures_outside(Path(config.docs_dir))):
        files.append(File.generated(config, f"images/{path.name}", abs_src_path=str(path)))
    return files


def pictures_outside(docs: Path) -> set[Path]:
    """Return the pictures outside docs/ that pages show."""
    paths = set()
    for page in docs.rglob("*.md"):
        for mark, _, target in _LINK.findall(page.read_text(encoding="utf-8")):
            path = (page.parent / target).resolve()
            if mark and not path.is_relative_to(docs):
                paths.add(path)
    return paths


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ARG001 - mkdocs' signature
    """Convert links that leave docs/ to links of the site."""
    here = Path(page.file.abs_src_path).parent

    def turned(link: re.Match[str]) -> str:
        mark, words, target = link.groups()
        path = (here / target.partition("#")[0]).resolve()
        if path.is_relative_to(config.docs_dir):
            return link[0]
        if mark:
            return f"![{words}]({os.path.relpath(Path(config.docs_dir, 'images', path.name), here)})"
        home = (config.repo_url or "").rstrip("/")
        return f"[{words}]({home}/blob/main/{path.relative_to(ROOT).as_posix()})" if home else words

    return _LINK.sub(turned, markdown)
