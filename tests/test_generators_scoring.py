"""The scoring of all generators: its questions, the sizes of hidden effects, and the required counts of replies."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import pytest

from tests.generators import __main__ as command
from tests.generators import spectral
from tests.generators.meters import METERS
from tests.generators.rewritings import NOTHING_LOST, OF_TRUTH, SOMETHING_LOST
from tests.generators.scoring import ask as asking
from tests.generators.scoring.ask import Answered, Outcome, Rewritten, ask, put
from tests.generators.scoring.figures import FIGURES, result, right
from tests.generators.scoring.questions import LAWS, SORTS, Question, Wanted, questions
from tests.generators.scoring.report import report
from tests.generators.scoring.sources import SOURCES, Source
from tests.generators.scoring.strength import MOST, sized
from tests.generators.table import parsed
from tests.stub_generator import KINDS, campaign
from tests.virtual_display.judge import Reply

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.generators.truth import Truth

pytestmark = pytest.mark.numbers

STUB = Source("stub", "tests.stub_generator")


@pytest.fixture(autouse=True)
def _only_the_stub(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(SOURCES):
        monkeypatch.delitem(SOURCES, name)
    monkeypatch.setitem(SOURCES, "stub", STUB)


def _answered(
    sort: str, verdict: str, effects: Sequence[str] = (), *, truth: Sequence[str] = ("black-level",), **more: object
) -> Answered:
    question = replace(Question("stub", sort, 0, 1, effects=tuple(truth)), **more)  # type: ignore[arg-type]
    return Answered(question, (), Outcome(Reply(verdict, effects=tuple(effects))))


@pytest.mark.parametrize(
    ("sort", "truth", "verdict", "effects", "is_right"),
    [
        ("healthy", [], "consistent", [], True),
        ("healthy", [], "unexplained", [], False),
        ("healthy", [], "named", ["loading"], False),
        ("clear", ["black-level"], "named", ["black-level"], True),
        ("clear", ["black-level"], "form", ["black-level"], True),
        ("clear", ["black-level"], "one-of", ["black-level", "meter-offset"], True),
        ("clear", ["black-level"], "one-of", ["black-level", "meter-offset", "ambient-reflection"], False),
        ("clear", ["black-level"], "several", ["black-level", "loading"], False),
        ("faint", ["black-level"], "consistent", [], False),
        ("faint", ["black-level"], "traceback", [], False),
        ("pair", ["black-level", "loading"], "several", ["black-level", "loading"], True),
        ("pair", ["black-level", "loading"], "several", ["black-level", "loading", "crosstalk"], False),
        ("pair", ["black-level", "loading"], "named", ["black-level"], False),
        ("law", ["yellowing"], "one-of", ["phosphor-wear", "yellowing"], True),
        ("law", ["yellowing"], "named", ["phosphor-wear"], False),
        ("outside", ["mood"], "unexplained", [], True),
        ("outside", ["mood"], "named", ["black-level"], False),
        ("outside", ["mood"], "form", ["black-level"], True),
        ("outside", ["mood"], "refused", [], False),
        ("removed", ["black-level"], "form", ["black-level"], False),
        ("removed", ["black-level"], "one-of", ["loading", "crosstalk"], True),
    ],
)
def test_replies_are_judged(sort: str, truth: list[str], verdict: str, effects: list[str], *, is_right: bool) -> None:
    assert right(_answered(sort, verdict, effects, truth=truth)) is is_right


@pytest.mark.parametrize(
    ("design", "name", "verdict", "effects", "is_right"),
    [
        ("colour", "warm-up", "consistent", [], True),
        ("colour", "warm-up", "one-of", ["warm-up", "loading"], False),
        ("grey", "crosstalk", "one-of", ["crosstalk", "loading"], True),
        ("grey", "crosstalk", "one-of", ["eotf-drift", "loading"], False),
        ("grey", "crosstalk", "named", ["crosstalk"], False),
        ("grey", "crosstalk", "consistent", [], False),
        ("grey", "meter-offset", "named", ["meter-offset"], True),
        ("grey", "meter-offset", "named", ["black-level"], False),
    ],
)
def test_blind_designs_are_judged(design: str, name: str, verdict: str, effects: list[str], *, is_right: bool) -> None:
    assert right(_answered("blind", verdict, effects, truth=[name], design=design)) is is_right


def test_a_figure_is_a_share_of_its_own_questions_with_wilsons_interval() -> None:
    clear = next(figure for figure in FIGURES if figure.title.startswith("right family, clear"))
    answers = [_answered("clear", "named", ["black-level"])] * 3 + [_answered("clear", "consistent")]
    share = result(clear, [*answers, _answered("faint", "consistent")])
    assert share is not None
    assert (share.hits, share.n, share.met) == (3, 4, False)
    # Wilson's interval of 3 of 4 at 95 %, by its closed form.
    assert share.interval == pytest.approx((0.3006, 0.9544), abs=1e-4)
    assert result(clear, [_answered("faint", "consistent")]) is None


def test_a_refused_file_is_no_confident_reply() -> None:
    wrong = next(figure for figure in FIGURES if figure.title == "confidently wrong, outside the catalogue")
    replies = [_answered("outside", verdict, ["loading"], truth=["mood"]) for verdict in ("refused", "named")]
    assert [list(wrong.trials(one)) for one in replies] == [[False], [True]]


def test_an_effect_that_shows_too_little_is_not_counted() -> None:
    clear = next(figure for figure in FIGURES if figure.title.startswith("right family, clear"))
    small = replace(_answered("clear", "consistent", sizes=(5.0,)), multiples=(0.4,))
    assert result(clear, [small]) is None
    assert result(clear, [replace(small, multiples=(4.9,))]) is not None


def test_questions_are_the_same_every_time_and_of_every_sort() -> None:
    wanted = Wanted(seed=3, per_kind=5, rewritten=2)
    asked = questions(STUB, wanted)
    assert asked == questions(STUB, wanted)
    assert asked != questions(STUB, replace(wanted, seed=4))
    assert {one.sort for one in asked} == set(SORTS)
    healthy = [one for one in asked if one.sort == "healthy"]
    assert {one.meter for one in healthy} == set(METERS)
    assert len(healthy) == 5 * len(METERS)
    for one in asked:
        assert set(one.effects) <= {*KINDS, "mood"}
        assert (one.baseline == "first-hour") == (one.sort == "law")
        assert all(name in LAWS for name in one.effects) or one.sort != "law"


def test_campaigns_are_rewritten_with_and_without_conditions() -> None:
    asked = questions(STUB, Wanted(rewritten=8, only="rewritten"))
    assert [one.design for one in asked] == ["full", "colour"] * 4
    assert {len(one.effects) for one in asked} == {0, 1, 2}
    assert all("edge-falloff" not in one.effects for one in asked if one.design == "colour")


def test_further_readings_leave_the_old_ones_as_they_were() -> None:
    question = Question("stub", "rewritten", 0, 7)
    before = parsed(asking._text(question, campaign(7, {})))
    for read_more in OF_TRUTH.values():
        after = parsed(asking._read_more(question, campaign(7, {}), read_more))
        old = [row for row, name in enumerate(after.session) if name in before.session]
        assert after.rows(old).columns == before.columns
        assert len(after) > len(before)


def test_one_sort_or_one_effect_can_be_asked_alone() -> None:
    assert {one.sort for one in questions(STUB, Wanted(per_kind=3, only="faint"))} == {"faint"}
    crosstalk = questions(STUB, Wanted(per_kind=3, only="crosstalk"))
    assert all("crosstalk" in one.effects for one in crosstalk)
    assert sum(one.sort == "clear" for one in crosstalk) == 3


def test_displays_of_their_own_curves_are_not_foretold_from_hour_0() -> None:
    asked = questions(replace(STUB, baseline="native"), Wanted(per_kind=3))
    assert {one.baseline for one in asked} == {"native"}
    assert "law" not in {one.sort for one in asked}


@pytest.mark.parametrize("target", [1.2, 3.0, 9.0])
def test_a_hidden_size_is_solved_for(target: float) -> None:
    solution = sized(partial(_hiding, "black-level"), target, baseline="colour-points")
    assert solution.multiple == pytest.approx(target, rel=0.06)
    twice = sized(partial(_hiding, "black-level"), 2 * target, baseline="colour-points")
    # A leak is linear in its size.
    assert twice.size / solution.size == pytest.approx(2.0, rel=0.12)


def test_a_wrong_model_of_the_display_hides_more() -> None:
    fine, coarse = (
        sized(partial(_hiding, "black-level"), 3.0, baseline="colour-points", discrepancy=wrong).size
        for wrong in ((0.0, 0.0), (0.01, 0.02))
    )
    assert coarse > 2.0 * fine


def test_a_native_display_has_what_never_changes_in_its_own_curves() -> None:
    def hiding(size: float) -> Truth:
        return spectral.campaign(4, {"loading": size}, design="grey")

    assert sized(hiding, 3.0, baseline="colour-points").multiple == pytest.approx(3.0, rel=0.06)
    assert sized(hiding, 3.0, baseline="native").multiple < 0.01


@pytest.mark.parametrize(
    ("sort", "multiples", "counts"), [("law", (0.9,), False), ("law", (1.1,), True), ("blind", (), True)]
)
def test_a_typical_size_that_no_meter_would_see_is_left_out(
    sort: str, multiples: tuple[float, ...], counts: bool
) -> None:
    question = Question("stub", sort, 0, 7, effects=("meter-drift",), sizes=(0.8,), typical=True)
    assert Answered(question, multiples, Outcome(Reply("consistent"))).large_enough is counts


def test_uniform_decay_shows_from_hour_0_alone() -> None:
    beside_tips = sized(partial(_hiding, "backlight-decay"), 3.0, baseline="colour-points")
    assert beside_tips.multiple < 0.01
    from_hour_0 = sized(partial(_hiding, "backlight-decay"), 3.0, baseline="first-hour")
    assert from_hour_0.multiple == pytest.approx(3.0, rel=0.06)
    assert from_hour_0.size < MOST


def _hiding(name: str, size: float) -> Truth:
    return campaign(4, {name: size})


@pytest.mark.slow
def test_lutgen_is_asked_with_the_file_and_answers() -> None:
    question = Question("stub", "clear", 0, 7, effects=("black-level",), sizes=(8.0,))
    answer = ask(question)
    assert answer.large_enough
    assert answer.reply.verdict not in ("refused", "traceback"), answer.reply.sentence
    assert "black-level" in answer.reply.answered


def test_a_file_that_lutgen_refuses_is_a_reply() -> None:
    outcome = put(Question("stub", "clear", 0, 1), "hour,R,G,B\n")
    assert outcome.reply.verdict == "refused"
    assert "readings.csv" in outcome.reply.sentence


def test_each_rewriting_is_tried_and_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    replies = iter([Outcome(Reply("named", ("black-level",)), {"black-level": 0.9}, 1.0)] * 1000)
    monkeypatch.setattr(asking, "put", lambda _question, _text: next(replies))
    question = Question("stub", "rewritten", 0, 7, effects=("black-level",), sizes=(8.0,))
    answer = ask(question)
    assert {each.name for each in answer.rewritten} == {*NOTHING_LOST, *SOMETHING_LOST, *OF_TRUTH}
    assert all(each.verdict and each.figures for each in answer.rewritten)
    assert right(answer)
    outside = ask(replace(question, effects=("mood",)))
    assert {each.name for each in outside.rewritten} == set(NOTHING_LOST)


@pytest.mark.parametrize(
    ("outcome", "verdict", "figures"),
    [
        (Outcome(Reply("named", ("black-level",)), {"black-level": 0.904}, 1.004), True, True),
        (Outcome(Reply("named", ("black-level",)), {"black-level": 0.93}, 1.0), True, False),
        (Outcome(Reply("named", ("black-level",)), {"black-level": 0.9}, 1.1), True, False),
        (Outcome(Reply("named", ("loading",)), {"loading": 0.9}, 1.0), False, False),
        (Outcome(Reply("refused", sentence="why")), False, False),
    ],
)
def test_a_change_by_rewriting_is_seen(
    outcome: Outcome, *, verdict: bool, figures: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = Outcome(Reply("named", ("black-level",)), {"black-level": 0.9}, 1.0)
    replies = iter([before, *[outcome] * 1000])
    monkeypatch.setattr(asking, "put", lambda _question, _text: next(replies))
    answer = ask(Question("stub", "rewritten", 0, 7))
    tried = [each for each in answer.rewritten if not each.cannot]
    assert {(each.verdict, each.figures) for each in tried} == {(verdict, figures)}
    lossless = next(figure for figure in FIGURES if figure.title.startswith("nothing lost: verdict, share"))
    share = result(lossless, [answer])
    assert share is not None
    assert share.value == (0.0 if figures else 1.0)


def test_the_report_shows_generators_side_by_side_and_where_they_disagree() -> None:
    ours = [_answered("clear", "named", ["black-level"])] * 20
    theirs = [replace(one, question=replace(one.question, generator="other")) for one in ours]
    wrong = [replace(one, outcome=Outcome(Reply("named", effects=("loading",)))) for one in theirs]
    broken = replace(
        _answered("clear", "traceback"), outcome=Outcome(Reply("traceback", sentence="ValueError: matmul"))
    )
    changed = replace(
        _answered("rewritten", "consistent"),
        rewritten=(
            Rewritten("lines that end in CR LF", lossless=True, verdict=False, figures=False, answer="refused: a | b"),
        ),
    )
    text = report([*ours, *wrong, broken, changed])
    assert "| figure | stub | other |" in text
    assert "right family, clear (3–10×): stub" in text
    assert "clear, black-level, right: stub 20 of 21, other 0 of 20" in text
    assert "loading: 20" in text
    assert "traceback: ValueError: matmul" in text
    assert "lines that end in CR LF | 1 | 0 | 1 | black-level: consistent → refused: a / b" in text


def test_the_command_prints_figures_and_says_by_its_exit_code_whether_they_meet_their_gates(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def consistent(question: Question) -> Answered:
        return Answered(question, (), Outcome(Reply("consistent", seconds=0.1)))

    monkeypatch.setattr(command, "ask", consistent)
    few = ["--per-kind", "1", "--workers", "0"]
    assert command.main([*few, "--only", "healthy"]) == 0
    assert "healthy, shot-noise: not consistent | 0.000" in capsys.readouterr().out
    assert command.main([*few, "--only", "clear"]) == 1
    assert "black-level" in capsys.readouterr().out


def test_a_run_that_is_out_of_time_reports_what_was_asked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Threads, since other processes would not see the patched functions.
    monkeypatch.setattr(command, "ProcessPoolExecutor", ThreadPoolExecutor)
    monkeypatch.setattr(command, "ask", _slowly)
    command.main(["--per-kind", "4", "--only", "healthy", "--workers", "1", "--minutes", "0.005"])
    out = capsys.readouterr().out
    assert "Of 24 campaigns " in out
    assert "healthy, all meters: not consistent | 0.000" in out


def _slowly(question: Question) -> Answered:
    time.sleep(0.1)
    return Answered(question, (), Outcome(Reply("consistent", seconds=0.1)))


def test_a_generator_that_is_not_there_is_left_out_and_said_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(SOURCES, "gone", Source("gone", "tests.generators.gone"))
    monkeypatch.setitem(SOURCES, "bare", Source("bare", "tests.stub_generator", needs="LUTGEN_NO_SUCH_DATA"))
    assert command.main(["--generator", "gone", "--generator", "bare"]) == 1
    output = capsys.readouterr().err
    assert "gone is left out: there is no tests.generators.gone" in output
    assert "bare is left out: LUTGEN_NO_SUCH_DATA is not set" in output
