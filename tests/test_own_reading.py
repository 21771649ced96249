"""A strict .cube has exactly one text for each table: the reader compares the file with lutgen's own text."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake import own_reading
from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Lut
from lutgen.bake.manifest import HeldFile
from lutgen.bake.own_reading import is_text_of, whole_steps
from tests.quick import mostly_slow

pytestmark = pytest.mark.numbers

PROVENANCE = Provenance("Aged display, chroma, 600h", "lutgen", ("display: Büro", "hours: 600"))


def table(lowest: float) -> Lut:
    """A table of 3³ points, with a negative number if ``lowest`` is negative."""
    values = np.round(np.random.default_rng(1).uniform(max(lowest, 0.0), 1.0, (3, 3, 3, 3)), 7)
    values[1, 1, 1, 1] = lowest
    return Lut("code", values)


@pytest.mark.parametrize("name", ["cube", "resolve"])
@pytest.mark.parametrize("lowest", mostly_slow([0.0, 0.25, -0.25], 0.0, -0.25))
def test_a_file_is_its_text_and_each_letter_counts(name: str, lowest: float) -> None:
    form, lut = format_named(name), table(lowest)
    assert form.head is not None
    head, data = form.head(lut, PROVENANCE), form.write(lut, PROVENANCE)
    assert data.startswith(head)
    assert is_text_of(HeldFile(Path("a.cube"), data), head, lut)
    for place in range(len(data)):
        for letter in b"0-+ 9.\n\r\te#":
            other = data[:place] + bytes([letter]) + data[place + 1 :]
            assert (other == data) is is_text_of(HeldFile(Path("a.cube"), other), head, lut), (place, letter)
    for other in (data + b"\n", data[:-1], data + data[-31:], b"#\n" + data, data.replace(b"\n", b"\r\n")):
        assert not is_text_of(HeldFile(Path("a.cube"), other), head, lut)
    assert not is_text_of(HeldFile(Path("a.cube"), data), form.head(lut, replace(PROVENANCE, lines=("a",))), lut)
    assert not is_text_of(HeldFile(Path("a.cube"), data), head[: len(head) // 2], lut)


def test_signs_have_one_form() -> None:
    row = b" 0.1000000  0.0000000  0.2000000\n"
    assert whole_steps(letters(b"-0.1000000  0.0000000  0.2000000\n")).tolist() == [[-1_000_000, 0, 2_000_000]]
    for other in (row, row.replace(b" 0.0000000", b"-0.0000000"), b"-0.1000000 -0.0000000  0.2000000\n"):
        with pytest.raises(ValueError, match="signs"):
            whole_steps(letters(other))


def letters(text: bytes) -> np.ndarray:
    return np.frombuffer(text, np.uint8).reshape(text.count(b"\n"), -1)


def test_equal_rows_are_read_once_and_other_ones_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    form, lut = format_named("cube"), table(0.25)
    assert form.head is not None
    read: list[int] = []

    def counted(text: np.ndarray) -> np.ndarray:
        read.append(len(text))
        return whole_steps(text)

    monkeypatch.setattr(own_reading, "whole_steps", counted)
    monkeypatch.setattr(own_reading, "_LAST", [])
    provenances = [replace(PROVENANCE, lines=(f"hours: {hours}",)) for hours in (0, 600, 18_000)]
    for provenance in provenances:
        file = HeldFile(Path("a.cube"), form.write(lut, provenance))
        assert is_text_of(file, form.head(lut, provenance), lut)
        assert not is_text_of(file, form.head(lut, PROVENANCE), lut)
    assert read == [27]
    other = Lut("code", lut.table + 1e-7)
    assert not is_text_of(file, form.head(lut, provenances[-1]), other)
    changed = HeldFile(Path("a.cube"), form.write(other, PROVENANCE))
    assert not is_text_of(changed, form.head(lut, PROVENANCE), lut)
    assert is_text_of(changed, form.head(lut, PROVENANCE), other)
    assert read == [27, 27]
