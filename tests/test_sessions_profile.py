"""Sessions in ICC profiles: read like the .ti3 from which the profile was made, or refused, even with a false table."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen import LutgenError
from lutgen.bake import icc_profile as icc
from lutgen.readings import read_session
from tests.command import in_process
from tests.quick import draws
from tests.session_files import DRIVE, curves, ti3

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.numbers

TEXT = ti3(calibration=curves(1.0, 0.95, 0.9))


def profile(*tags: tuple[bytes, bytes]) -> bytes:
    return icc.profile(device_class=b"mntr", pcs=b"XYZ ", tags=((b"desc", icc.description("display")), *tags))


def written(folder: Path, data: bytes) -> Path:
    path = folder / "display.icc"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("tag", ["targ", "CIED", "DevD"])
def test_the_readings_of_a_profile_are_those_of_its_ti3(tag: str, tmp_path: Path) -> None:
    path = written(tmp_path, profile((b"cprt", icc.text("none")), (tag.encode(), icc.text(TEXT))))
    (tmp_path / "session.ti3").write_text(TEXT)
    session, meant = read_session(path), read_session(tmp_path / "session.ti3")
    np.testing.assert_array_equal(session.drive, meant.drive)
    np.testing.assert_array_equal(session.xyz, meant.xyz)
    np.testing.assert_array_equal(session.lines, meant.lines)
    assert session.calibration is not None
    assert (session.form, session.created, session.metadata) == (meant.form, meant.created, meant.metadata)
    assert session.file == str(path)
    assert session.sha256 != meant.sha256
    assert f"tag {tag}" in session.remarks[0]


def test_the_standards_tag_comes_first_and_one_without_readings_is_passed_over(tmp_path: Path) -> None:
    other = ti3(DRIVE[:5])
    tags = ((b"CIED", icc.text(other)), (b"targ", icc.text(TEXT)))
    assert len(read_session(written(tmp_path, profile(*tags))).drive) == len(DRIVE)
    tags = ((b"targ", icc.text("ICCHDAT FOGRA39L")), (b"CIED", icc.text(other)))
    assert len(read_session(written(tmp_path, profile(*tags))).drive) == 5


#: The fault, the profile, and the words of the error.
BAD: dict[str, tuple[bytes, str]] = {
    "no readings": (profile(), "is an ICC profile without readings"),
    "our own": (profile((b"targ", icc.text("lutgen: what an aged display shows"))), "without readings"),
    "of another type": (profile((b"targ", b"zxml" + icc.text(TEXT)[4:])), "without readings"),
    "a printer's": (
        profile((b"targ", icc.text(TEXT.replace("RGB_R RGB_G RGB_B", "CMYK_C CMYK_M CMYK_Y")))), "without readings"
    ),
    "drive and colours apart": (
        profile((b"CIED", icc.text(TEXT.replace("RGB_", "DEV_"))), (b"DevD", icc.text(TEXT.replace("XYZ_", "CIE_")))),
        "without readings",
    ),
    "a wrong number": (
        profile((b"targ", icc.text(TEXT.replace("100.0000000", "1OO", 1)))), r"tag targ, line \d+, RGB_R"
    ),
    "cut off in the tag": (profile((b"targ", icc.text(TEXT[:-300]))), "tag targ.* without END_"),
    "cut off": (profile((b"targ", icc.text(TEXT)))[:-200], "lies outside the file"),
    "cut off in the table": (profile((b"targ", icc.text(TEXT)))[:140], "claims 2 tags"),
    "cut off in the header": (profile()[:100], "is no ICC profile"),
    "a tag beyond the end": (
        profile((b"targ", icc.text(TEXT)))[:148] + struct.pack(">II", 2**31, 2**31) + bytes(4000), "lies outside"
    ),
    "many tags": (profile()[:128] + struct.pack(">I", 2**32 - 1) + bytes(4000), "claims 4294967295 tags"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_profile_that_cannot_be_read_is_refused_with_a_sentence(name: str, tmp_path: Path) -> None:
    data, message = BAD[name]
    path = written(tmp_path, data)
    with pytest.raises(LutgenError, match=message) as refused:
        read_session(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_inspect_shows_the_session_of_a_profile(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, profile((b"targ", icc.text(TEXT))))
    done = in_process(monkeypatch, capsys, "inspect")("display.icc")
    assert (done.code, done.err) == (0, "")
    assert "Read from the tag targ of an ICC profile" in " ".join(done.out.split())


def changes(size: int) -> st.SearchStrategy[list[tuple[int, bytes]]]:
    """Bytes to write at random places, mostly in the header and the table."""
    places = st.integers(0, 170) | st.integers(0, size)
    return st.lists(st.tuples(places, st.binary(min_size=1, max_size=8)), min_size=1, max_size=5)


WHOLE = profile((b"targ", icc.text(TEXT)), (b"CIED", icc.text(TEXT)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("profiles")


@given(changes(len(WHOLE)), st.integers(0, len(WHOLE)))
@draws(150)
def test_a_mutated_profile_is_read_or_refused(folder: Path, edits: list[tuple[int, bytes]], end: int) -> None:
    data = bytearray(WHOLE)
    for place, put in edits:
        data[place : place + len(put)] = put
    for content in (bytes(data), bytes(data[:end])):
        try:
            session = read_session(written(folder, content))
        except LutgenError as error:
            assert "\n" not in str(error)  # noqa: PT017 - either is right
        else:
            assert np.isfinite(session.xyz).all()
