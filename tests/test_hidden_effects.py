"""A small seeded part of the scoring on data with hidden effects: no gate of criticism.md may be clearly missed."""

from __future__ import annotations

import pytest

from tests.virtual_display.__main__ import main

pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.rare(instead="test_verdicts.py::test_the_verdict_is_what_the_evidence_allows"),
]


def test_no_gate_is_clearly_missed_by_the_quick_part(capsys: pytest.CaptureFixture[str]) -> None:
    missed = main(["--quick"])
    assert not missed, capsys.readouterr().out
