"""What to measure next: sets of patches that distinguish effects, and lists that can be measured and read back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.plan import MeasurementPlan, plan
from lutgen.criticism.search.candidates import family
from lutgen.criticism.search.separate import POOL, separation, with_patches
from lutgen.criticism.verdict.visibility import visibility
from lutgen.effects import catalogue
from lutgen.effects.expression import parse
from lutgen.errors import LutgenError
from lutgen.report.measurement_plan import plan_page
from lutgen.report.parts import Headline
from tests.criticism_twin import FRESH, TIPS, Fault, Reading, shown
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.schemas import validator
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)


@cache
def readings(design: str, hidden: tuple[tuple[str, float, str], ...] = ()) -> Measurements:
    campaign = Campaign(design=design, hours=HOURS, seed=3, hidden=hidden, held=True, ageing=0.3)
    return read(csv_text(campaign), file="plan.csv", sha256="")


@cache
def planned(design: str, *pair: str) -> MeasurementPlan:
    return plan(readings(design), between=(pair[0], pair[1]))


@pytest.mark.parametrize(("design", "pair", "sets", "times"), [
    ("greys", ("crosstalk", "loading"), {"10 % windows", "black in a white surround"}, 4.0),
    ("greys", ("black-level", "meter-offset"), {"lens cap", "black, shrouded, and black in the lit room"}, 4.0),
    ("greys", ("black-level", "ambient-reflection"), {"black, shrouded, and black in the lit room"}, 1.0),
    ("colours", ("warm-up", "temperature"), {"after power-on", "in a room 8 K warmer"}, 1.0),
])  # fmt: skip
def test_the_set_that_separates_two_effects_is_chosen(
    design: str, pair: tuple[str, str], sets: set[str], times: float
) -> None:
    choice = planned(design, *pair).separation
    assert choice is not None
    assert choice.name in sets
    assert choice.after > times * choice.before + 20.0
    assert f"To tell {pair[0]} from {pair[1]}: {choice.name}." in planned(design, *pair).sentence


def test_effects_that_the_readings_tell_apart_need_no_patches() -> None:
    """The greys of a display whose exponent changed do not look like black that leaks."""
    proposal = plan(readings("colours", (("eotf-drift", 0.05, "same"),)), between=("black-level", "eotf-drift"))
    assert proposal.sentence.startswith("These readings already tell eotf-drift from black-level: eotf-drift alone ")
    assert proposal.sentence.endswith("No further reading is needed for that.")
    assert (proposal.patches, proposal.gains, proposal.separation) == ((), {}, None)
    assert [str(part) for part in plan_page(proposal, "between", [])] == [str(Headline(proposal.sentence))]
    validator("plan").validate(proposal.as_json())


def test_a_healthy_display_may_show_neither_of_two_effects() -> None:
    proposal = plan(readings("colours"), between=("eotf-drift", "black-level"))
    assert proposal.sentence.startswith("These readings show neither ")
    assert "would tell them apart" in proposal.sentence
    assert not proposal.patches


def test_an_effect_that_may_only_take_light_away_is_planned_with_a_loss() -> None:
    sag = parse("sag: linear*(1 + k*tau*code); k=-0.01[-0.5,0]")
    proposal = plan(readings("colours"), between=("sag", "crosstalk"), effects={**catalogue(), "sag": sag})
    assert proposal.sentence.startswith("These readings show neither ")


def test_of_two_effects_that_do_not_explain_the_readings_none_is_told_apart() -> None:
    """The exponent changed; which of two other effects then fits less badly says nothing about the two."""
    proposal = plan(readings("colours", (("eotf-drift", 0.1, "same"),)), between=("black-level", "crosstalk"))
    assert proposal.sentence.startswith("To tell black-level from crosstalk: ")
    assert "another error is larger than either" in proposal.sentence
    assert proposal.patches


def test_windows_lift_crosstalk_from_loading_and_more_greys_do_not() -> None:
    base = fit(Problem.of(readings("greys")))
    effects = catalogue()
    truth = fit(base.problem, (Term(effects["crosstalk"], effects["crosstalk"].rest() | {"new": 0.01}),))
    light = replace(base.problem.readings, xyz_cd_m2=truth.predicted)
    rival = fit(replace(base.problem, readings=light), (Term.at_rest(effects["loading"], ("new",)),))
    apart = {}
    for name in ("10 % windows", "black and dark greys"):
        problem = with_patches(base.problem, POOL[name])
        exact = replace(problem.readings, xyz_cd_m2=predict(problem, State(truth.terms, truth.tips, truth.gains)))
        apart[name] = fit(replace(problem, readings=exact), (Term.at_rest(effects["loading"], ("new",)),)).chi2
    assert apart["10 % windows"] > 5.0 * rival.chi2
    assert apart["black and dark greys"] < 2.0 * rival.chi2 + 5.0


def test_the_separation_that_is_promised_is_what_measuring_brings() -> None:
    """Measure the chosen patches of lutgen's own display twelve times: the rival's fit worsens as predicted."""
    effects = catalogue()
    base = fit(Problem.of(readings("greys"), instrument="0.002,0.003"))
    truth = fit(base.problem, (Term(effects["meter-offset"], effects["meter-offset"].rest() | {"offset": 0.02}),))
    readings_of_truth = replace(base.problem.readings, xyz_cd_m2=truth.predicted)
    bare = fit(replace(base.problem, readings=readings_of_truth))
    simple = replace(effects["black-level"], forms=(("new",),), refined=1)
    promised = separation(truth, family(bare, simple).best, ("meter-offset", "black-level"))
    problem = with_patches(base.problem, promised.patches)
    light = predict(problem, State(truth.terms, truth.tips, truth.gains))
    root, brought = np.linalg.cholesky(problem.noise.covariance(light)), []
    for seed in range(12):
        noise = np.einsum("nij,nj->ni", root, np.random.default_rng(seed).standard_normal(light.shape))
        again = replace(problem, readings=replace(problem.readings, xyz_cd_m2=light + noise))
        right = fit(again, (Term.at_rest(effects["meter-offset"], ("offset",)),))
        wrong = fit(again, (Term.at_rest(simple, ("new",)),))
        brought.append(wrong.chi2 - right.chi2)
    # χ² between two models of one parameter each has a standard deviation of twice its root.
    error = 2.0 * np.sqrt(promised.after) / np.sqrt(12)
    assert promised.after > promised.before
    assert np.mean(brought) == pytest.approx(promised.after, abs=4.0 * error + 0.05 * promised.after)


@pytest.mark.parametrize(("name", "chosen"), mostly_slow([
    ("edge-falloff", "nine positions"),
    ("warm-up", "after power-on"),
    ("temperature", "in a room 8 K warmer"),
    ("ambient-reflection", "black, shrouded, and black in the lit room"),
    ("veiling-glare", "black in a white surround"),
], "edge-falloff", "ambient-reflection"))  # fmt: skip
def test_an_effect_that_cannot_be_seen_is_opened_by_its_own_patches(name: str, chosen: str) -> None:
    proposal = plan(readings("colours"), effect=name)
    assert chosen in proposal.sentence
    assert "Today it cannot be seen; with these patches from" in proposal.sentence
    assert all(patch in proposal.patches for patch in POOL[chosen])
    before, after = proposal.gains[chosen]
    assert before is None
    assert after is not None
    largest = max(abs(bound) for bound in catalogue()[name].parameters[visible_parameter(name)].bounds)
    assert 0.0 < after < largest


def visible_parameter(name: str) -> str:
    base = fit(Problem.of(readings("full")))
    return visibility(base, [catalogue()[name]])[0].parameter


def test_general_coverage_opens_what_greys_cannot_show() -> None:
    proposal = plan(readings("greys"))
    opened = proposal.sentence.partition("They make visible: ")[2].rstrip(".").split(", ")
    blind = {each.effect for each in diagnose(readings("greys")).visibility if not each.visible}
    assert set(opened) <= blind
    assert {"edge-falloff", "warm-up", "temperature", "veiling-glare"} <= set(opened)


@pytest.mark.parametrize("design", mostly_slow(["tips", "greys", "colours", "full"], "tips", "greys"))
def test_every_plan_begins_with_what_a_session_needs(design: str) -> None:
    patches = plan(readings(design)).patches
    for code in (*TIPS, (0.0, 0.0, 0.0)):
        assert sum(patch.code == code and not patch.conditions for patch in patches) >= 3


def test_a_plan_filled_in_is_read_back() -> None:
    proposal = plan(readings("colours"))
    lines = proposal.as_csv().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("hour,"))
    columns, filled = lines[head].split(","), lines[: head + 1]
    rng = np.random.default_rng(1)
    for line in lines[head + 1 :]:
        cells = dict(zip(columns, line.split(","), strict=True))
        code = (float(cells["R"]), float(cells["G"]), float(cells["B"]))
        light = shown(Reading(0.0, code), FRESH, Fault(), {}) * rng.normal(1.0, 0.002) + rng.normal(0.0, 0.003, 3)
        cells |= {"hour": "0", **dict(zip("XYZ", (f"{value:.4f}" for value in light), strict=True))}
        filled.append(",".join(cells[name] for name in columns))
    back = read("\n".join(filled) + "\n", file="filled.csv", sha256="")
    assert back.hours.size == len(proposal.patches)
    for row, patch in zip(np.argsort(back.lines), proposal.patches, strict=True):
        assert tuple(back.drive[row]) == patch.code
        assert back.note[row] == patch.note
        for name, value in patch.conditions.items():
            assert back.column(name)[row] == value
    assert diagnose(back).verdict.name != "measurement-problem"


def ti1(text: str) -> tuple[dict[str, str], list[str], list[dict[str, str]]]:
    """Read CGATS in ArgyllCMS' form: keywords, the names of the fields, and the rows of data."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    assert lines[0] == "CTI1"
    keywords: dict[str, str] = {}
    names: list[str] = []
    rows: list[dict[str, str]] = []
    block = ""
    for line in lines[1:]:
        if line in {"BEGIN_DATA_FORMAT", "BEGIN_DATA"}:
            block = line
        elif line in {"END_DATA_FORMAT", "END_DATA"}:
            assert block == line.replace("END", "BEGIN")
            block = ""
        elif block == "BEGIN_DATA_FORMAT":
            names += line.split()
        elif block == "BEGIN_DATA":
            rows.append(dict(zip(names, line.split(), strict=True)))
        else:
            keyword, _, value = line.partition(" ")
            keywords[keyword] = value.strip('"')
    assert not block
    return keywords, names, rows


def test_a_ti1_is_cgats_with_codes_in_percent() -> None:
    proposal = planned("greys", "crosstalk", "loading")
    keywords, names, rows = ti1(proposal.as_ti1())
    assert keywords["COLOR_REP"] == "RGB"
    assert int(keywords["NUMBER_OF_FIELDS"]) == len(names) == 7
    assert int(keywords["NUMBER_OF_SETS"]) == len(rows) == len(proposal.patches)
    assert [row["SAMPLE_ID"] for row in rows] == [str(k) for k in range(1, len(rows) + 1)]
    for row, patch in zip(rows, proposal.patches, strict=True):
        assert [float(row[f"RGB_{c}"]) for c in "RGB"] == pytest.approx(
            [100.0 * value for value in patch.code], abs=1e-4
        )
        assert all(float(row[f"XYZ_{c}"]) >= 0.0 for c in "XYZ")


@pytest.mark.parametrize(("asked", "told"), [
    ({"between": ("crosstalk", "crosstalk")}, "--between needs two different effects; crosstalk was given twice"),
    ({"between": ("crosstalk", "loadding")}, r"effect 'loadding'.*Pick one of"),
    ({"effect": "leak"}, "effect 'leak'"),
    ({"effect": "backlight-decay"}, r"re-measured white and primaries hide it\. Use --baseline first-hour\."),
    ({"effect": "backlight-decay", "baseline": "native"}, r"Use --baseline native-first-hour\."),
    ({"between": ("backlight-decay", "meter-drift")}, r"no patch .* hide both\. Use --baseline first-hour, or"),
    ({"between": ("backlight-decay", "black-level")}, "primaries hide backlight-decay"),
    pytest.param(
        {"between": ("backlight-decay", "meter-drift"), "baseline": "native"},
        "hide both. Use --baseline native-first-hour, or",
        marks=pytest.mark.slow,
    ),
    (
        {"between": ("backlight-decay", "meter-drift"), "baseline": "first-hour"},
        r": fitted to all patches that a plan knows, .* shows the same light as .*: a second meter or a check",
    ),
])  # fmt: skip
def test_what_cannot_be_planned_is_refused(asked: dict[str, object], told: str) -> None:
    with pytest.raises(LutgenError, match=told):
        plan(readings("colours"), **asked)  # type: ignore[arg-type]
