"""The library of the explore page is the library that its NOTICE names, and the page requests no other library."""

import json
import re
from hashlib import sha256
from pathlib import Path

import pytest

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "lutgen/explore/page"
NOTICE = (PAGE / "vendor/NOTICE").read_text(encoding="utf-8")


def test_the_notice_has_version_hashes_and_licence_of_every_file() -> None:
    listed = dict(reversed(line.split("  ")) for line in re.findall(r"^[0-9a-f]{64}  .*$", NOTICE, re.MULTILINE))
    files = {path.name for path in (PAGE / "vendor").iterdir()} - {"NOTICE"}
    assert listed == {name: sha256((PAGE / "vendor" / name).read_bytes()).hexdigest() for name in files}
    asked = json.loads((ROOT / "tests/page/package.json").read_text())["dependencies"]["uplot"]
    assert NOTICE.startswith(f"uPlot {asked}, MIT, ")
    assert "Permission is hereby granted, free of charge" in NOTICE


def test_the_page_has_no_inline_code_or_style_and_names_only_its_own_files() -> None:
    html = (PAGE / "index.html").read_text(encoding="utf-8")
    assert not re.findall(r"<style|\sstyle=|\son\w+=|<script(?![^>]*\ssrc=)", html)
    own = {path.relative_to(PAGE).as_posix() for path in PAGE.rglob("*")}
    files = own | {"viewer.js", "viewer.css", "data:,"}
    assert set(re.findall(r'(?:src|href)="([^"]*)"', html)) <= files
    for module in (*PAGE.glob("*.js"), ROOT / "lutgen/pictures/viewer/viewer.js"):
        imported = re.findall(r'\bfrom "([^"]*)"', module.read_text(encoding="utf-8"))
        assert {name.removeprefix("./") for name in imported} <= files
