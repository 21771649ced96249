"""Mutations of every reader, planted faults and kills: a seeded run, and failures that the run must detect."""

import random
from pathlib import Path

import pytest

from tests import fuzz


@pytest.mark.slow
def test_two_thousand_mutations_find_nothing() -> None:
    words: list[str] = []
    assert fuzz.fuzz(2000, 15, say=words.append) == 0, "\n".join(words)


def test_no_letter_of_a_cube_can_be_wrong_unseen(tmp_path: Path) -> None:
    """`make fuzz ARGS="--only rows --count 20000"` tests ten thousand. The bound is the last decimal."""
    failures = [fuzz.one("rows", 7, case, tmp_path) for case in range(300)]
    assert not any(failures)


def test_a_reader_that_raises_and_a_fault_that_is_not_told_are_failures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fuzz, "checked_table", lambda _file, lut, _folder: lut)
    lenient = [fault for case in range(40) if (fault := fuzz.one("rows", 7, case, tmp_path))]
    assert any("off" in failure.what or "cannot read" in failure.what for failure in lenient)
    monkeypatch.setitem(fuzz.KINDS, "rows", lambda *_: 1 // 0)
    failure = fuzz.one("rows", 7, 1, tmp_path)
    assert failure is not None
    assert failure.what.startswith("ZeroDivisionError")


def test_the_same_case_is_the_same_mutation() -> None:
    data = b"LUT_3D_SIZE 2\n" + b"0.5 0.25 1\n" * 8
    one, other = (fuzz.mutated(data, random.Random("1 rows 3")) for _ in range(2))  # noqa: S311 - a case, no key
    assert one == other != data
