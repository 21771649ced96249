"""Tables on a narrow terminal: every figure and name stays whole, and what can wrap does."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table
from rich.text import Text

from lutgen.cli import outputs
from lutgen.cli.narrow import LONGEST_WORD, WHOLE, fitted
from lutgen.report.criticism.comparison import table
from tests.command import in_process

pytestmark = pytest.mark.numbers

SESSION = "examples/session.ti3"


def printed(made: Table, width: int) -> list[str]:
    """Lines as a terminal so wide gets them."""
    console = Console(file=io.StringIO(), width=width)
    to = fitted(made, console)
    to.print(made)
    assert isinstance(console.file, io.StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def of(heads: tuple[str, ...], *rows: tuple[str | Text, ...], left: int = 1) -> Table:
    made = table(*heads, left=left)
    for row in rows:
        made.add_row(*row)
    return made


@pytest.mark.parametrize("width", [30, 40, 60, 80])
def test_no_figure_is_cut_off_however_narrow_the_terminal_is(width: int) -> None:
    figures = ("0.3127", "11\N{NO-BREAK SPACE}600", "45.5–50.4", "1096", "133.52 ×")
    heads = ("mode", "white x", "operating hours", "middle half", "contrast", "error over noise")
    text = "\n".join(printed(of(heads, (Text("chroma-luma", no_wrap=True), *figures)), width))
    assert all(cell in text for cell in ("chroma-luma", *figures))
    assert all(word in text for head in heads for word in head.split())


def test_headings_wrap_before_anything_else() -> None:
    lines = printed(of(("where", "mean change of a pixel"), ("18000 h", "2.55")), 20)
    assert max(map(len, lines)) <= 20
    assert lines[-1].split() == ["18000", "h", "2.55"]


def test_long_texts_wrap_and_leave_room_for_the_others() -> None:
    meaning = "share of white's light that passes at black, at hour 0, and what has come to it since"
    lines = printed(of(("parameter", "value", "meaning"), ("saturation", "20 ± 38", meaning), left=3), 50)
    assert max(map(len, lines)) <= 50
    assert any(line.startswith("saturation  20 ± 38  share") for line in lines)
    assert " ".join(" ".join(line[21:] for line in lines[1:]).split()) == meaning


def test_a_table_with_room_is_left_as_it_is() -> None:
    made, console = of(("a", "b"), ("1", "2")), Console(file=io.StringIO(), width=80)
    assert fitted(made, console) is console
    assert [column.width for column in made.columns] == [None, None]


def test_only_a_very_long_word_is_folded() -> None:
    for length, lines in ((LONGEST_WORD, 2), (2 * LONGEST_WORD, 3)):
        assert len(printed(of(("file", "hours"), ("x" * length, "8 850")), WHOLE)) == lines


def test_a_table_without_head_or_rows_is_printed() -> None:
    assert printed(Table(), 80) == [""]
    assert printed(of(("one", "two")), 5) == ["one  two"]


def test_commands_keep_the_figures_of_a_session_at_80_letters(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(outputs, "WIDTH", 80)
    lines = in_process(monkeypatch, capsys, "inspect")(SESSION).lines
    (green,) = [line.split() for line in lines if line.startswith("green")]
    assert green == ["green", "0.3390", "0.6019", "204.4", "0.018", "0.045", "0.089", "2.11", "1.000"]
    assert all(len(line.rstrip()) <= 80 for line in lines if line.startswith(("channel", "red", "green", "blue")))


def test_a_sentence_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    path = "in /data/:bomb:/[red]a.png, " + 20 * "and so on "
    outputs.print_page([path])
    assert capsys.readouterr().out == f"{path}\n"
