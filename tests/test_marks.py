"""The marks of slow tests keep the time budget of CONTRIBUTING.md without a clock: tests run, and their substitutes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.conftest import COLLECTED, FEW, left_out, substitute

if TYPE_CHECKING:
    from collections.abc import Iterable

pytestmark = pytest.mark.texts

ROOT = Path(__file__).parents[1]


def with_mark(name: str, items: Iterable[pytest.Item]) -> list[pytest.Item]:
    return [item for item in items if item.get_closest_marker(name)]


def name_of(item: pytest.Item) -> str:
    return item.nodeid.partition("[")[0]


def test_rare_tests_are_slow_and_name_what_is_run_instead(request: pytest.FixtureRequest) -> None:
    """A rare test without the mark `slow` never runs. Without a substitute nothing tests its rule until a release."""
    collected = request.config.stash[COLLECTED]
    out = left_out(collected)
    never = {name_of(item) for item in out} - {name_of(item) for item in collected if item not in out}
    for item in with_mark("rare", collected):
        assert item.get_closest_marker("slow"), item.nodeid
        mark = item.get_closest_marker("rare")
        assert mark is not None
        assert mark.kwargs.keys() == {"instead"}, item.nodeid
        file, _, name = mark.kwargs["instead"].rpartition("::")
        text = (item.path.with_name(file) if file else item.path).read_text(encoding="utf-8")
        match = re.search(rf"^def {name}\(", text, flags=re.MULTILINE)
        assert match, f"{item.nodeid}: {mark.kwargs['instead']} is no test"
        # A parametrised test may have rare cases: its other cases are the sample.
        assert substitute(item) not in never, f"{item.nodeid}: {mark.kwargs['instead']} is not run either"


def test_no_more_slow_cases_are_run_than_the_budget_says(request: pytest.FixtureRequest) -> None:
    collected = request.config.stash[COLLECTED]
    (allowed,) = re.findall(
        r"^\| `make test-slow`.* at most (\d+) cases", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), flags=re.MULTILINE
    )
    assert len(set(with_mark("slow", collected)) - left_out(collected)) <= int(allowed)


def test_of_a_slow_table_a_sample_is_run_and_always_the_same() -> None:
    class Case:
        def __init__(self, nodeid: str, **marks: pytest.Mark) -> None:
            self.nodeid, self.marks = nodeid, marks

        def get_closest_marker(self, name: str) -> pytest.Mark | None:
            return self.marks.get(name)

    slow, every = pytest.mark.slow.mark, pytest.mark.slow(every=True).mark
    rare = pytest.mark.rare(instead="test_quick").mark
    table = [Case(f"test_a.py::test_table[{case}]", slow=slow) for case in range(9)]
    whole = [Case(f"test_a.py::test_whole[{case}]", slow=every) for case in range(3)]
    seldom = [Case("test_a.py::test_whole[3]", slow=every, rare=rare), Case("test_a.py::test_seldom", rare=rare)]
    quick = [Case(f"test_a.py::test_quick[{case}]") for case in range(3)]
    many = [Case(f"test_b.py::test_{number}[{case}]", slow=slow) for number in range(20) for case in range(2)]
    three = [Case(f"test_d.py::test_three[{case}]", slow=pytest.mark.slow(cases=3).mark) for case in range(9)]
    items: list[pytest.Item] = [*table, *whole, *seldom, *quick, *many, *three]  # type: ignore[list-item]
    out = left_out(items)
    run = [item.nodeid for item in items if item not in out]
    names = [each.partition("[")[0] for each in run]
    assert [each for each in run if "quick" in each or "whole" in each] == [each.nodeid for each in (*whole, *quick)]
    assert names.count("test_a.py::test_table") == 1
    assert (
        sum(name.startswith("test_b.py") for name in names) == FEW == len({each for each in names if "_b.py" in each})
    )
    assert names.count("test_d.py::test_three") == 3
    assert out == left_out(items)
    draws = [left_out(items, seed) for seed in range(300)]
    assert {item.nodeid for item in set.intersection(*draws)} == {each.nodeid for each in seldom}
