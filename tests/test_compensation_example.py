"""``examples/compensation.py``: it runs, states that its data are simulated, and reproduces its picture."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from PIL import Image

from examples.compensation import main

pytestmark = [pytest.mark.slow, pytest.mark.numbers]


def mean_after(name: str, lines: Sequence[str]) -> float:
    (line,) = (line for line in lines if f"{name}:" in line and line.startswith("chroma-luma"))
    return float(line.rpartition("mean ")[2])


def test_the_example_shows_what_a_correction_gives_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(tmp_path / "one.jpg")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Simulated")
    assert Path(lines[-1]) == tmp_path / "one.jpg"
    aged, clipped = mean_after("chroma-luma, 10000 h", lines), mean_after("compensated, clip", lines)
    assert clipped < aged / 3
    assert mean_after("compensated, scale", lines) < 0.1
    with Image.open(tmp_path / "one.jpg") as picture:
        assert picture.size == (1300, 1140)
    main(tmp_path / "two.jpg")
    assert (tmp_path / "two.jpg").read_bytes() == (tmp_path / "one.jpg").read_bytes()
