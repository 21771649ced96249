"""Findings of lint on ICC profiles: the result of each profile in LittleCMS, Argyll and Chromium."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.lint.finding import ARGYLL, CHROMIUM, LCMS_8, LCMS_16, READS, Linted
from tests.profile_cases import CASES, profile_of, put
from tests.quick import draws

pytestmark = pytest.mark.numbers


def linted(folder: Path, data: bytes) -> Linted:
    path = folder / "display.icc"
    path.write_bytes(data)
    return lint(path)


@pytest.mark.parametrize("name", CASES)
def test_the_rules_say_what_becomes_of_a_profile(name: str, tmp_path: Path) -> None:
    """``make consumers`` runs the readers themselves."""
    case = CASES[name]
    report = linted(tmp_path, case.data)
    assert {reader: report.fate(reader)[0].outcome for reader in case.outcomes} == case.outcomes
    assert report.fate(LCMS_16) == report.fate(LCMS_8)
    assert {each.rule for each in report.findings} >= ({case.rule} if case.rule else set())
    assert bool(report.findings) == bool(case.rule)


# White


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("icc", {LCMS_8, LCMS_16, ARGYLL}),
        ("icc-v2", {LCMS_8, LCMS_16, CHROMIUM}),
        ("devicelink", {LCMS_8, LCMS_16}),
        ("icc-matrix", {LCMS_16}),
    ],
)
def test_white_that_littlecms_would_not_show_is_told(name: str, wrong: set[str], tmp_path: Path) -> None:
    data = profile_of(name, 18_000)
    report = linted(tmp_path, data)
    assert {reader for reader in report.readers if report.fate(reader)[0].outcome != READS} == wrong
    (finding,) = (each for each in report.findings if each.rule == "profile-white")
    assert "180 168 150" in finding.what


def test_profiles_of_common_spaces_are_clean(tmp_path: Path) -> None:
    import imagecodecs

    for space in ("srgb", "adobergb"):
        report = linted(tmp_path, imagecodecs.cms_profile(space))
        assert {each.rule for each in report.findings} <= {"profile-version", "profile-parts"}


def test_a_link_is_told_to_be_none_for_viewers(tmp_path: Path) -> None:
    report = linted(tmp_path, profile_of("devicelink", 0))
    assert report.kind == "link"
    assert CHROMIUM not in report.readers
    assert [each.rule for each in report.findings] == ["profile-table"]


def test_without_littlecms_white_is_said_to_be_unknown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(__import__("sys").modules, "imagecodecs", None)
    report = linted(tmp_path, profile_of("icc-matrix", 18_000))
    assert "was not checked for its white" in report.findings[0].what
    assert report.clean


def changes(size: int) -> st.SearchStrategy[list[tuple[int, bytes]]]:
    places = st.integers(0, 300) | st.integers(0, size)
    return st.lists(st.tuples(places, st.binary(min_size=1, max_size=8)), min_size=1, max_size=5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("profiles")


@given(st.sampled_from(["icc", "icc-v2", "icc-matrix", "devicelink"]), changes(3000), st.integers(0, 3000))
@draws(150)
def test_no_mutation_of_a_profile_brings_lint_down(
    folder: Path, name: str, edits: list[tuple[int, bytes]], end: int
) -> None:
    data = profile_of(name, 0)
    for place, value in edits:
        data = put(data, place, value)
    for content in (data, data[:end]):
        try:
            report = linted(folder, content)
        except LutgenError as error:
            assert "\n" not in str(error)  # noqa: PT017 - either is right
            continue
        assert all("\n" not in each.what for each in report.findings)


def test_a_gigabyte_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "large.icc"
    path.write_bytes(profile_of("icc-matrix", 0))
    with path.open("r+b") as file:
        file.truncate(1 << 30)  # sparse
    report = lint(path)
    assert "has 1024 MiB, more than any profile" in {each.what for each in report.findings}
