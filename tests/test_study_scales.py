"""The scales that readers answer on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from click.testing import CliRunner

from lutgen.cli.commands.study.plan import command
from lutgen.errors import LutgenError
from lutgen.study.protocol import PAPER_EASE, PAPER_NEGATIVE, PAPER_POSITIVE, categories_of, ease_of

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.numbers


def test_the_papers_diagnoses_are_given_by_their_own_digits() -> None:
    categories = [(each.name, each.key, each.positive) for each in categories_of(PAPER_NEGATIVE, PAPER_POSITIVE)]
    assert categories == [("0", "0", False), ("1+", "1", False), ("2+", "2", True), ("3+", "3", True)]


def test_other_diagnoses_are_numbered() -> None:
    categories = categories_of("benign, atypical", "in situ,invasive")
    assert [(each.name, each.key) for each in categories] == [
        ("benign", "1"), ("atypical", "2"), ("in situ", "3"), ("invasive", "4"),
    ]  # fmt: skip


def test_digits_that_two_names_share_are_no_keys() -> None:
    assert [each.key for each in categories_of("1a,1b", "2")] == ["1", "2", "3"]


def test_the_commands_defaults_are_the_papers() -> None:
    defaults = {option.name: option.default for option in command.params}
    assert (defaults["negative"], defaults["positive"]) == (PAPER_NEGATIVE, PAPER_POSITIVE)
    assert defaults["ease"] == PAPER_EASE


@pytest.mark.parametrize(
    ("negative", "positive", "message"),
    [
        ("", "1", "diagnosis ''"),
        ("0,,1", "2", "diagnosis ''"),
        ("0", "a\nb", r"diagnosis 'a\\nb'"),
        ("0", "x" * 41, "1 to 40"),
        ("0,1", "1", "'1' is given twice"),
        ("0,1,2,3,4", "5,6,7,8,9", "10 diagnoses, and 9 keys"),
    ],
)
def test_diagnoses_that_cannot_be_asked_for_are_refused(negative: str, positive: str, message: str) -> None:
    with pytest.raises(LutgenError, match=message):
        categories_of(negative, positive)


@pytest.mark.parametrize(("text", "ends"), [("1..10", (1, 10)), ("0..9", (0, 9)), ("1..5", (1, 5))])
def test_every_step_of_ease_has_a_digit(text: str, ends: tuple[int, int]) -> None:
    assert ease_of(text) == ends


@pytest.mark.parametrize("text", ["", "10", "1..", "1..1", "5..1", "0..10", "1..11", "2..5", "-1..5", "1..x", "1...5"])
def test_a_scale_without_digits_for_its_steps_is_refused(text: str) -> None:
    with pytest.raises(LutgenError, match=r"--ease .*such as 1\.\.10"):
        ease_of(text)


def test_a_wrong_scale_makes_no_study(tmp_path: Path) -> None:
    done = CliRunner().invoke(command, ["nothing.png", "--ease", "1..99", "-o", str(tmp_path / "study")])
    assert isinstance(done.exception, LutgenError)
    assert not any(tmp_path.iterdir())
