"""Sealed sets of the virtual display contain what their answers state, and diagnoses are scored against the sets."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lutgen.readings import read_measurements
from tests.virtual_display import sealed
from tests.virtual_display.__main__ import OFTENER, main
from tests.virtual_display.campaign import csv_text
from tests.virtual_display.figures import Result, Scored, Share, confusion, failures, results, table
from tests.virtual_display.judge import Reply, honest, names_the_place
from tests.virtual_display.score import score

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers


@pytest.fixture(scope="module")
def sets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sealed")
    sealed.make(
        folder, seed=3, counts=dict.fromkeys(sealed.KINDS, 2) | {"null": 4, "blind": 6, "broken": 4}, noise="good"
    )
    return folder


def answers_of(folder: Path) -> dict[str, dict[str, Any]]:
    answers: dict[str, dict[str, Any]] = json.loads((folder / sealed.ANSWERS).read_text(encoding="utf-8"))
    return answers


@pytest.mark.slow
@pytest.mark.parametrize("of_a_kind", [
    1,
    pytest.param(12, marks=pytest.mark.rare(instead="test_sealed_sets_are_what_their_answers_say")),
])  # fmt: skip
def test_sealed_sets_are_what_their_answers_say(sets: Path, of_a_kind: int) -> None:
    answers = answers_of(sets)
    assert {answer["kind"] for answer in answers.values()} == set(sealed.KINDS)
    looked_at: Counter[str] = Counter()
    for name, answer in answers.items():
        looked_at[answer["kind"]] += 1
        if looked_at[answer["kind"]] > of_a_kind:
            continue
        text = (sets / name).read_text(encoding="utf-8")
        assert (text == csv_text(sealed.campaign_of(answer))) == (answer["kind"] != "broken")
        assert read_measurements(sets / name).hours.size == text.count("\n") - 6
        low, high = sealed.BANDS.get(answer.get("band", ""), (0.0, np.inf))
        if answer["truth"] != ["quantization"]:
            assert 0.98 * low <= np.min(answer.get("multiple", low)) <= 1.02 * high


def test_sealed_sets_are_the_same_every_time(sets: Path, tmp_path: Path) -> None:
    sealed.make(tmp_path, seed=3, counts={"blind": 3, "broken": 4}, noise="good")
    for name in answers_of(tmp_path):
        assert (tmp_path / name).read_bytes() == (sets / name).read_bytes()


def test_wrong_rows_are_wrong_and_only_they(sets: Path) -> None:
    for name, answer in answers_of(sets).items():
        if answer.get("fault") != "one reading mistyped":
            continue
        right = csv_text(sealed.campaign_of(answer)).splitlines()
        wrong = (sets / name).read_text(encoding="utf-8").splitlines()
        differ = [line for line, (a, b) in enumerate(zip(right, wrong, strict=True), start=1) if a != b]
        assert differ == answer["lines"]


def oracle(answer: dict[str, Any]) -> Reply:
    """The first honest reply, as if lutgen had read the answers."""
    wanted = answer["honest"][0]
    names = tuple(wanted.get("effects", wanted.get("contains", wanted.get("any_two", ()))))
    return Reply(wanted["verdict"][0], names, unseen=tuple(wanted.get("unseen", ())), before=4.0, after=1.01, floor=1.0)


@pytest.mark.parametrize(("verdict", "code"), [("consistent", 0), ("named", 1)])
def test_the_command_writes_its_figures_and_fails_on_a_missed_gate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verdict: str, code: int
) -> None:
    options = ["--kinds", "null", "--per-kind", "3", "--noise", "good", "--workers", "0", "--folder", str(tmp_path)]
    assert main(options, ask=lambda *_: Reply(verdict, ("crosstalk",) * (verdict == "named"))) == code
    assert "| false alarms on null and hard null | " in capsys.readouterr().out
    assert len(answers_of(tmp_path)) == 3 * OFTENER["null"]


def asked(folder: Path, ask: Callable[[dict[str, Any]], Reply]) -> list[Scored]:
    answers = answers_of(folder)
    return score(folder, lambda path, *_: ask(answers[path.name]), workers=0)


def test_a_diagnosis_that_knows_all_meets_every_gate(sets: Path) -> None:
    scored = asked(sets, oracle)
    figures = results(scored)
    assert len(figures) > 10
    assert all(one.met and not one.clearly_missed for one in figures)
    assert "**no**" not in table(scored)
    assert failures(scored).count("\n") == 1


def test_a_diagnosis_that_always_names_the_same_misses_them(sets: Path) -> None:
    scored = asked(sets, lambda _: Reply("named", ("black-level",)))
    missed = [one.figure.title for one in results(scored) if one.clearly_missed]
    assert "false alarms on null and hard null" in missed
    assert "confidently wrong, outside the catalogue" in missed
    assert "| nothing | 4 | 0 |  | black-level: 4 |" in confusion(scored, noise="good")
    assert failures(scored).count("black-level") > 20


TRUTH = {"honest": sealed.right_family("crosstalk")}
PAIR = {"honest": sealed.right_family("loading", "crosstalk")}
TIE = {"honest": [{"verdict": ["one-of"], "any_two": ["crosstalk", "loading"]}]}
UNSEEN = {"honest": [{"verdict": ["consistent"], "unseen": ["warm-up"]}]}


@pytest.mark.parametrize(("answer", "reply", "right"), [
    (TRUTH, Reply("named", ("crosstalk",)), True),
    (TRUTH, Reply("form", ("crosstalk",)), True),
    (TRUTH, Reply("named", ("loading",)), False),
    (TRUTH, Reply("consistent"), False),
    (TRUTH, Reply("several", ("crosstalk", "loading")), False),
    (TRUTH, Reply("one-of", ("crosstalk",), (("crosstalk", "loading"),)), True),
    (TRUTH, Reply("one-of", (), (("crosstalk", "loading"),)), True),
    (TRUTH, Reply("one-of", ("crosstalk", "loading", "eotf-drift")), False),
    (PAIR, Reply("several", ("crosstalk", "loading")), True),
    (PAIR, Reply("named", ("crosstalk",)), False),
    (PAIR, Reply("several", ("crosstalk", "loading", "warm-up")), False),
    (TIE, Reply("one-of", ("crosstalk", "loading", "drive-loss")), True),
    (TIE, Reply("named", ("crosstalk",)), False),
    (UNSEEN, Reply("consistent", unseen=("warm-up", "edge-falloff")), True),
    (UNSEEN, Reply("consistent"), False),
    (TRUTH, Reply("error", sentence="ValueError"), False),
])  # fmt: skip
def test_what_counts_as_honest(answer: dict[str, Any], reply: Reply, *, right: bool) -> None:
    assert honest(reply, answer) is right


def test_a_reply_is_read_from_the_json_of_diagnose() -> None:
    document = {
        "verdict": "one-of",
        "effects": ["loading"],
        "rivals": [["crosstalk", "loading"], ["warm-up", "temperature"]],
        "visibility": [{"effect": "edge-falloff", "visible": False}, {"effect": "loading", "visible": True}],
        "sentence": "Line 118 (hour 2500) does not fit.",
    }
    reply = Reply.of(document, seconds=2.0)
    assert reply.answered == {"crosstalk", "loading"}
    assert reply.unseen == ("edge-falloff",)
    assert names_the_place(reply, {"lines": [118]})
    assert not names_the_place(reply, {"lines": [11], "hours": [300.0]})


@pytest.mark.parametrize(("value", "low", "high", "met", "clearly_missed"), [
    (0.01, 0.0, 0.05, True, False),
    (0.04, 0.01, 0.09, False, False),
    (0.20, 0.12, 0.30, False, True),
])  # fmt: skip
def test_a_gate_is_clearly_missed_when_the_whole_interval_is_beyond(
    value: float, low: float, high: float, *, met: bool, clearly_missed: bool
) -> None:
    figure = Share("false alarms", lambda _: True, lambda _: True, 0.02, 0.01, at_most=True)
    result = Result(figure, value, low, high, 100)
    assert (result.met, result.clearly_missed) == (met, clearly_missed)
