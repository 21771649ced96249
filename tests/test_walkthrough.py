"""examples/WALKTHROUGH.md is held to what its commands print."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from PIL import Image

from examples import make_displays
from examples.walkthrough import FOLDER, LEFT_OUT, TEXT, copy_to, differences, pictures, renewed, run, same, steps
from tests.virtual_display.campaign import csv_text

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.texts

WALKTHROUGH = TEXT.read_text(encoding="utf-8")
STEPS = steps(WALKTHROUGH)

#: Bytes that a picture or a table may take in the repository.
SMALL = 150_000


@pytest.mark.slow
def test_the_text_says_what_its_commands_print_and_shows_their_pictures(tmp_path: Path) -> None:
    """Every command runs in order, and once."""
    copy_to(tmp_path)
    printed = {step.command: run(step.command, tmp_path) for step in STEPS}
    differ = {step.command: differences(step.said, printed[step.command]) for step in STEPS}
    assert {command: found for command, found in differ.items() if found} == {}
    again = renewed(WALKTHROUGH, [printed[step.command] for step in STEPS])
    assert all(same(*lines) for lines in zip(again.splitlines(), WALKTHROUGH.splitlines(), strict=True))
    for shown, source in pictures(WALKTHROUGH).items():
        with Image.open(shown) as old, Image.open(tmp_path / source) as new:
            assert old.size == new.size, shown.name
        assert shown.stat().st_size < SMALL, shown.name


def test_every_command_of_criticism_has_its_step_and_its_output() -> None:
    commands = " ".join(step.command for step in STEPS)
    assert all(f"lutgen {name} " in commands for name in ("compare", "diagnose", "refine", "effects", "build", "check"))
    assert all(set(step.said) - {LEFT_OUT, ""} for step in STEPS)


def test_the_own_effect_is_that_of_the_file_and_takes_15_lines() -> None:
    (shown,) = re.findall(r"^```python\n(.*?)^```$", WALKTHROUGH, flags=re.DOTALL | re.MULTILINE)
    assert shown == (FOLDER / "viewing_gamma.py").read_text(encoding="utf-8")
    assert len(shown.splitlines()) <= 15


@pytest.mark.parametrize("name", make_displays.DISPLAYS)
def test_a_display_is_what_its_maker_makes_and_says_that_it_is_simulated(name: str) -> None:
    text = (FOLDER / name).read_text(encoding="utf-8")
    assert make_displays.same(text, csv_text(make_displays.DISPLAYS[name]))
    assert "SIMULATED" in text.partition("\n")[0]
    assert len(text) < SMALL


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", WALKTHROUGH):
        assert (FOLDER / target).exists(), target


SAID = ("a 1.00", LEFT_OUT, "c 3.00")


@pytest.mark.parametrize(
    ("printed_lines", "alike"),
    [
        (("a 1.00", "b 2.00", "c 3.00"), True),
        (("a  1.01", "c 2.99"), True),
        (("a 1.02", "b 2.00", "c 3.00"), False),
        (("a 1.00", "b 2.00", "d 3.00"), False),
        (("a 1.00", "c 3.00", "d 4.00"), False),
        (("b 2.00", "a 1.00", "c 3.00"), False),
    ],
)
def test_a_difference_is_seen_and_rounding_is_none(printed_lines: tuple[str, ...], alike: bool) -> None:
    assert (differences(SAID, printed_lines) == []) == alike


def test_a_renewed_text_has_new_numbers_and_the_same_gaps() -> None:
    text = "```\n$ one\na 1.00\n…\nc 3.00\n```\n\n```\n$ two\n```\n"
    again = renewed(text, [("a 5.00", "b 6.00", "c 7.00"), ("x", "y")])
    assert again == "```\n$ one\na 5.00\n…\nc 7.00\n```\n\n```\n$ two\nx\ny\n```\n"
