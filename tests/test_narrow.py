"""Tables on a narrow terminal: every number and name stays whole, and other text wraps."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table as TerminalTable

from lutgen.cli import outputs
from lutgen.cli.outputs import LONGEST_WORD, WHOLE_CELL, fitted
from lutgen.report.parts import Headline, Table, terminal_table
from tests.command import in_process

pytestmark = pytest.mark.numbers

SESSION = "examples/session.ti3"


def printed(table: Table, width: int) -> list[str]:
    """Lines on a terminal of this width."""
    console = Console(file=io.StringIO(), width=width)
    laid_out = terminal_table(table)
    fitted(laid_out, console).print(laid_out)
    assert isinstance(console.file, io.StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


@pytest.mark.parametrize("width", [30, 40, 60, 80])
def test_no_figure_is_cut_off_however_narrow_the_terminal_is(width: int) -> None:
    figures = ("0.3127", "11\N{NO-BREAK SPACE}600", "45.5–50.4", "1096", "133.52 ×")
    heads = ("mode", "white x", "operating hours", "middle half", "contrast", "error over noise")
    text = "\n".join(printed(Table(heads, [("chroma-luma", *figures)], unbroken=True), width))
    assert all(cell in text for cell in ("chroma-luma", *figures))
    assert all(word in text for head in heads for word in head.split())


@pytest.mark.parametrize("width", [30, 50, 70])
def test_no_line_of_a_cell_is_cut_off_however_narrow_the_terminal_is(width: int) -> None:
    cells = ("4 438\n12.3 months\n4 012 to 4 871", "11 084\n30.8 months\n9 995 to 12 345")
    table = Table(("hours until", "Max ΔE2000 3", "Avg ΔE2000 3"), [("chroma-luma, a slide", *cells)], unbroken=True)
    lines = printed(table, width)
    assert any(line.startswith("chroma-luma, a slide ") and line.endswith("11 084") for line in lines)
    for below in ("12.3 months 30.8 months", "4 012 to 4 871 9 995 to 12 345"):
        assert below in [" ".join(line.split()) for line in lines]


def test_headings_wrap_before_anything_else() -> None:
    lines = printed(Table(("where", "mean change of a pixel"), [("18000 h", "2.55")]), 20)
    assert max(map(len, lines)) <= 20
    assert lines[-1].split() == ["18000", "h", "2.55"]


def test_headings_break_after_a_hyphen_where_the_table_is_too_wide_otherwise() -> None:
    table = Table(("session", "primaries-shift", "hours"), [("a.ti3", "0.0001", "1510")])
    assert printed(table, 40)[0].split() == ["session", "primaries-shift", "hours"]
    heads, row = [["primaries-"], ["session", "shift", "hours"]], ["a.ti3", "0.0001", "1510"]
    assert [line.split() for line in printed(table, 27)] == [*heads, row]


def test_long_texts_wrap_and_leave_room_for_the_others() -> None:
    meaning = "share of white's light that passes at black, at hour 0, and what has come to it since"
    lines = printed(Table(("parameter", "value", "meaning"), [("saturation", "20 ± 38", meaning)], words=range(3)), 50)
    assert max(map(len, lines)) <= 50
    assert any(line.startswith("saturation  20 ± 38  share") for line in lines)
    assert " ".join(" ".join(line[21:] for line in lines[1:]).split()) == meaning


def test_a_table_with_room_is_left_as_it_is() -> None:
    laid_out = terminal_table(Table(("a", "b"), [("1", "2")]))
    console = Console(file=io.StringIO(), width=80)
    assert fitted(laid_out, console) is console
    assert [column.width for column in laid_out.columns] == [None, None]


def test_only_a_very_long_word_is_folded() -> None:
    for length, lines in ((LONGEST_WORD, 2), (2 * LONGEST_WORD, 3)):
        assert len(printed(Table(("file", "hours"), [("x" * length, "8 850")]), WHOLE_CELL)) == lines


def test_a_table_without_head_or_rows_is_printed() -> None:
    console = Console(file=io.StringIO(), width=80)
    assert fitted(TerminalTable(), console) is console
    assert printed(Table(("one", "two"), []), 5) == ["one  two"]


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


def test_names_are_broken_unless_the_table_forbids_it() -> None:
    name = "chroma-luma, a whole slide"
    for unbroken, lines in ((True, 2), (False, 3)):
        assert len(printed(Table(("mode", "hours"), [(name, "1")], unbroken=unbroken), WHOLE_CELL)) == lines


def test_brackets_in_a_cell_or_a_heading_are_no_markup() -> None:
    assert printed(Table(("[b]file[/x]", "n"), [("[red]a[/red].png", "1")]), 80)[1].startswith("[red]a[/red].png")
    assert printed(Table(("[b]file[/x]", "n"), []), 80) == ["[b]file[/x]  n"]


def test_rows_that_stand_out_and_step_back_are_bold_and_dim() -> None:
    rows = [("a", "1"), ("b", "2"), ("c", "3")]
    laid_out = terminal_table(Table(("x", "y"), rows, strong=[0], faint=[2]))
    assert [row.style for row in laid_out.rows] == ["bold", "", "dim"]


def test_a_table_refuses_a_row_of_another_length() -> None:
    with pytest.raises(ValueError, match="1 cells under 2 headings"):
        Table(("x", "y"), [("a",)])


def test_headlines_are_printed_whole_and_the_notes_of_a_table_below_it(capsys: pytest.CaptureFixture[str]) -> None:
    sentence = "[red]No[/red] effect is missing, " + 20 * "and so on "
    outputs.print_page([Headline(sentence), "", Table(("x", "y"), [("a", "1")], notes=["y: years."])])
    assert capsys.readouterr().out == f"{sentence}\n\nx  y\na  1\ny: years.\n"
