"""Why sessions differ: tests against another simulator, by arithmetic, and against the notes on real sessions."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from colour.models import normalised_primary_matrix

from lutgen import LutgenError
from lutgen.display import default_display
from lutgen.history.causes import ON_THE_DISPLAY, Cause, causes
from lutgen.history.colour_points import COLOURS, PARAMETERS, ColourPoints, changed, covariance, fit
from lutgen.history.explain import SECOND, explain, explanations
from lutgen.history.pair import FACTS, SessionPair, line_shift
from lutgen.history.steadiness import steadiness
from lutgen.history.transfer import full_light_ratio
from lutgen.history.verdicts import KINDS, RIVAL, SessionVerdict, pronounce
from lutgen.numerals import spaced
from lutgen.readings import read_campaign, read_session
from lutgen.readings.campaign import Campaign, CampaignEntry
from lutgen.readings.session import Session
from lutgen.readings.steadiness import drift_by_repeats
from lutgen.report.inspection import explanation_page
from lutgen.report.parts import Table
from tests.quick import mostly_slow
from tests.real_data import real_data
from tests.session_files import DRIVE
from tests.virtual_sessions import __main__ as scoring
from tests.virtual_sessions.campaigns import life, write
from tests.virtual_sessions.causes import SIZES, case
from tests.virtual_sessions.display import Panel, State, chart, csv_text, panel, read, ti3_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

#: An additive display: sRGB's primaries at 100 cd/m² of white (IEC 61966-2-1), and 0.1 cd/m² of black.
FIVE = ColourPoints(
    np.array([[41.24, 21.26, 1.93], [35.76, 71.52, 11.92], [18.05, 7.22, 95.05]]),
    np.zeros(3),
    np.array([0.095, 0.1, 0.13]),
    has_black=True,
)

ONE_METER = "# display: one\n# instrument: one meter\n"

#: Levels of a ramp.
LEVELS = np.linspace(0.0, 1.0, 33)[1:]


def two(folder: Path, texts: list[str], days: int = 10) -> SessionVerdict:
    """The verdict on two sessions."""
    return explain(read_campaign(write(folder, texts, [0, days])), reference="0.txt").verdicts[0]


def texts_of(
    displays: Sequence[Panel | tuple[Panel, State]], code: Array, rng: np.random.Generator, head: str = ""
) -> list[str]:
    """A session of each display, in its usual state unless a state is given."""
    states = (each if isinstance(each, tuple) else (each, State()) for each in displays)
    return [
        head + csv_text(code, read(display, state, code, rng, noise=0.001, floor=0.002)) for display, state in states
    ]


def judged(folder: Path, cause: str, size: float, seed: int) -> tuple[SessionVerdict, str]:
    sessions = case(cause, size, seed)
    return two(folder, [sessions.before, sessions.after], sessions.days), sessions.label


@pytest.mark.parametrize(
    "size",
    [
        pytest.param((cause, size), marks=() if size == sizes[0] else pytest.mark.slow)
        for cause, sizes in SIZES.items()
        for size in sizes
    ],
    ids=str,
)
def test_a_simulated_cause_is_named_alone_or_among_its_rivals(size: tuple[str, float], tmp_path: Path) -> None:
    # A seed that no tuning has used.
    verdict, label = judged(tmp_path, *size, 901)
    assert verdict.kind in KINDS
    if label == "same":
        assert (verdict.kind, verdict.names, verdict.display) == ("same", (), "unchanged")
    else:
        assert label in verdict.names, verdict
        # At most four names: a verdict with every name gives no information.
        assert len(verdict.names) <= 4
        assert verdict.tests


@pytest.mark.parametrize("cause", ["brightness", "tables", "ambient", "hdr", "dynamic", "drift"])
def test_a_cause_with_a_signature_of_its_own_is_named_alone(cause: str, tmp_path: Path) -> None:
    verdict, label = judged(tmp_path, cause, SIZES[cause][1], 903)
    assert (verdict.kind, verdict.names) == ("named", (label,))


@pytest.mark.parametrize("seed", [904, 905, 906])
def test_aging_behind_a_sensor_that_holds_white_is_no_change_of_the_meter(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    display = panel(rng)
    aged = State(aged=np.array([0.80, 0.77, 0.66]), brightness=1.0 / 0.77)
    texts = texts_of([display, (display, aged)], chart(steps=9), rng, ONE_METER + "# luminance: held\n")
    verdict = two(tmp_path, texts, 1500)
    assert "aging" in verdict.names, verdict
    assert verdict.display != "unchanged"


def test_the_default_display_ages() -> None:
    explained = explain(read_campaign(default_display()))
    later = [each for pair, each in zip(explained.pairs, explained.verdicts, strict=True) if (pair.hours or 0) >= 3000]
    assert all("aging" in each.names for each in later)
    assert sum(each.kind == "named" for each in later) >= len(later) / 2


def test_light_changes_as_each_parameter_says() -> None:
    still = FIVE.xyz()
    assert still.shape == (len(COLOURS), 3)
    np.testing.assert_allclose(changed(FIVE, {"scale": np.log([0.5])}), 0.5 * still)
    gained = changed(FIVE, {"gains": np.log([1.0, 1.0, 0.5])})
    np.testing.assert_allclose(gained[4], still[4])
    np.testing.assert_allclose(gained[2] - gained[4], 0.5 * FIVE.channels[2])
    np.testing.assert_allclose(gained[3], still[3] - 0.5 * FIVE.channels[2])
    aged = changed(FIVE, {"aged": np.log([0.5, 0.5, 0.5])})
    np.testing.assert_allclose(aged, 0.5 * still)
    lit = changed(FIVE, {"added": np.array([0.3])})
    np.testing.assert_allclose(lit - still, np.broadcast_to([0.3, 0.3, 0.21], (5, 3)))
    matrix = np.diag([1.1, 1.0, 0.9]) - np.eye(3)
    np.testing.assert_allclose(changed(FIVE, {"matrix": matrix.ravel()}), still * [1.1, 1.0, 0.9])


@pytest.mark.parametrize("name", ["scale", "gains", "aged"])
def test_a_fit_finds_what_was_changed(name: str) -> None:
    size = np.log(np.array([0.8, 0.85, 0.7])[: PARAMETERS[name][0]])
    solution = fit(FIVE, changed(FIVE, {name: size}), [name], noise=0.0)
    # The prior shifts the estimate by some parts in a thousand.
    np.testing.assert_allclose(solution.values[name], size, atol=0.004)
    assert solution.chi2 < 1.0
    assert solution.evidence > fit(FIVE, changed(FIVE, {name: size}), [], noise=0.0).evidence


def test_the_evidence_is_the_integral_that_it_approximates() -> None:
    # One parameter: sum prior times likelihood over a fine grid (Laplace's method is exact except for the exponential).
    after = changed(FIVE, {"gauge": np.array([0.01])})
    grid = np.linspace(-0.2, 0.2, 8001)
    inverse = np.linalg.inv(covariance(FIVE, after, noise=0.0))
    residuals = [(after - changed(FIVE, {"gauge": np.array([value])})).ravel() for value in grid]
    likelihood = np.exp(-0.5 * np.array([each @ inverse @ each for each in residuals]))
    width = PARAMETERS["gauge"][1]
    prior = np.exp(-0.5 * (grid / width) ** 2) / (width * np.sqrt(2 * np.pi))
    exact = np.log(np.trapezoid(prior * likelihood, grid))
    assert fit(FIVE, after, ["gauge"], noise=0.0).evidence == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize(
    ("kind", "names", "label", "says"),
    [
        ("same", (), "same", "alone"),
        ("same", (), "aging", "wrong"),
        ("named", ("aging",), "aging", "alone"),
        ("named", ("hdr",), "same", "wrong"),
        ("one-of", ("aging", "brightness"), "aging", "among rivals"),
        ("unclear", (), "aging", "unclear"),
    ],
)
def test_a_verdict_is_judged_by_what_was_simulated(kind: str, names: tuple[str, ...], label: str, says: str) -> None:
    assert scoring.judged(SessionVerdict(kind, names, "", (), (), "cannot tell"), label) == says


def test_scoring_counts_what_is_wrong(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(scoring, "outcome", lambda cause, _size, _seed: "wrong" if cause == "hdr" else "alone")
    assert scoring.main(["--seed", "1", "--repeats", "1"]) == 1
    assert "Wrong: 2 of 32" in capsys.readouterr().out


def test_tables_name_causes_in_words() -> None:
    words = {name: cause.words for name, cause in causes().items()}
    assert not any("-" in each for each in words.values())
    assert (words["hdr"], words["another-display"]) == ("HDR", "another display")


def test_clauses_of_a_sentence_are_separated_by_commas(tmp_path: Path) -> None:
    verdict = two(tmp_path, life([State(), State(aged=np.full(3, 0.9))]), 700)
    meanings = [causes()[name].meaning for name in verdict.names]
    assert len(meanings) == 2
    assert verdict.sentence == f"It looks as if {meanings[0]}, or {meanings[1]}."


def test_no_file_of_causes_is_left_out() -> None:
    folder = Path(__file__).parents[1] / "lutgen/history/causes"
    files = {path.stem.replace("_", "-") for path in folder.glob("[!_]*.py")}
    assert {*causes()} == files
    for cause in causes().values():
        assert {name for way in cause.ways for name in way} <= {*PARAMETERS}
        assert cause.display in ON_THE_DISPLAY
        assert cause.moves <= {*FACTS}


@pytest.mark.parametrize("backwards", [False, True])
def test_clipped_levels_are_a_signals_range_and_of_the_session_that_shows_them(backwards: bool, tmp_path: Path) -> None:
    states = [State(), State(clip=0.8)]
    pair = life(states[::-1] if backwards else states)
    verdict = two(tmp_path, pair, 0)
    assert (verdict.kind, verdict.names, verdict.display) == ("named", ("signal-range",), "cannot tell")
    whose = "the reference, and not in the session" if backwards else "the session, and not in the reference"
    assert re.search(rf"red, green and blue show one light from code 0\.8\d up in {whose}", verdict.evidence[0])
    (same,) = explain(read_campaign(write(tmp_path, life([states[1], states[1]], seed=9), [0, 0]))).verdicts
    assert same.kind == "same"


def test_one_dark_level_of_one_channel_is_noise_and_no_signals_range(tmp_path: Path) -> None:
    campaign = read_campaign(write(tmp_path, life([State(), State()]), [0, 0]))
    session = campaign.entries[1].session
    lit = (session.drive > 0).sum(axis=1) == 1
    read_as_black = {}
    for channels in ((2,), (0, 1, 2)):
        xyz = session.xyz.copy()
        for channel in channels:
            levels = lit & (session.drive[:, channel] > 0)
            lowest = session.drive[levels, channel].min()
            xyz[levels & (session.drive[:, channel] == lowest)] = session.xyz[~session.drive.any(axis=1)].mean(axis=0)
        entries = (campaign.entries[0], replace(campaign.entries[1], session=replace(session, xyz=xyz)))
        (verdict,) = explain(replace(campaign, entries=entries)).verdicts
        read_as_black[channels] = "signal-range" in verdict.names
    assert read_as_black == {(2,): False, (0, 1, 2): True}


def test_a_loss_over_many_sessions_is_aging_and_light_that_comes_back_is_not(tmp_path: Path) -> None:
    days = [0, 300, 600, 900, 1200]
    states = [State(aged=np.exp(-np.array([0.06, 0.07, 0.10]) * day / 300.0)) for day in days]
    steady = explain(read_campaign(write(tmp_path, life(states), days)))
    assert {each.names for each in steady.verdicts} == {("aging",)}
    assert {each.display for each in steady.verdicts} == {"changed"}
    states[2] = replace(states[2], brightness=0.6)
    verdicts = explain(read_campaign(write(tmp_path, life(states), days))).verdicts
    assert verdicts[1].names == ("brightness",)
    assert any("came back" in each for each in verdicts[1].evidence)
    assert [verdicts[place].names for place in (0, 2, 3)] == [("aging",)] * 3


@pytest.mark.parametrize(("days", "left", "rival"), [(400, 0.8, True), (30, 0.8, False), (400, 0.4, False)])
def test_light_that_fell_alike_is_a_setting_or_age_unless_it_fell_too_fast(
    days: int, left: float, rival: bool, tmp_path: Path
) -> None:
    for number, state in enumerate([State(brightness=left), State(aged=np.full(3, left))]):
        folder = tmp_path / str(number)
        folder.mkdir()
        campaign = read_campaign(write(folder, life([State(), state]), [0, days]))
        (verdict,) = explain(campaign).verdicts
        assert verdict.names == (("brightness", "aging") if rival else ("brightness",))
        assert verdict.display == ("cannot tell" if rival else "unchanged")
        one, other = (
            replace(entry, settings=setting) for entry, setting in zip(campaign.entries, ("50", "40"), strict=True)
        )
        (verdict_of_settings,) = explain(replace(campaign, entries=(one, other))).verdicts
        assert verdict_of_settings.names == ("brightness",)


def test_room_light_is_certain_where_the_rest_is_a_setting_or_age(tmp_path: Path) -> None:
    state = State(brightness=0.8, ambient=np.array([1.1, 1.0, 0.4]))
    verdict = two(tmp_path, life([State(), state]), 400)
    assert (verdict.kind, verdict.names, verdict.sure) == ("one-of", ("ambient", "brightness", "aging"), ("ambient",))
    assert verdict.causes_in_words == "room light and (brightness or aging)"
    assert verdict.sentence == (
        "It looks as if the room's light on the screen was different; and in addition, the display's brightness or "
        "preset was changed, or the display itself has aged."
    )


def test_light_that_fell_after_years_without_loss_was_turned_down(tmp_path: Path) -> None:
    states = [State(), State(), State(), State(brightness=0.75)]
    verdicts = explain(read_campaign(write(tmp_path, life(states), [0, 500, 1000, 1300]))).verdicts
    assert [each.names for each in verdicts] == [(), (), ("brightness",)]
    assert any("until 300 days before" in each for each in verdicts[2].evidence)


def test_light_lost_alike_and_steadily_over_many_sessions_is_aging(tmp_path: Path) -> None:
    days = [0, 300, 600, 900, 1200]
    states = [State(aged=np.full(3, np.exp(-0.06 * day / 300.0))) for day in days]
    steady = explain(read_campaign(write(tmp_path, life(states), days)))
    assert {each.names for each in steady.verdicts} == {("aging",)}


@pytest.mark.parametrize("seed", range(6, 12))
def test_a_noisy_instrument_and_no_repeats_are_no_cause(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    display = panel(rng)
    code = np.vstack([np.ones(3), np.zeros(3), np.eye(3), np.repeat(np.linspace(0.1, 0.9, 9)[:, np.newaxis], 3, 1)])
    texts = [csv_text(code, read(display, State(), code, rng, noise=0.005, floor=0.002)) for _ in range(2)]
    verdict = two(tmp_path, texts)
    assert (verdict.kind, verdict.names) == ("same", ())


@pytest.mark.parametrize("readings", mostly_slow([6, 12, 20], 12))
@pytest.mark.parametrize(
    ("noise", "moved", "share"),
    [
        (0.003, lambda _place: 0.0, (0.0, 0.01)),
        (0.008, lambda _place: 0.0, (0.0, 0.12)),
        (0.003, lambda place: 0.04 * place, (0.95, 1.0)),
        (0.003, lambda place: 0.04 * (1 - np.exp(-4 * place)), (0.95, 1.0)),
        (0.008, lambda place: -0.1 * (place > 0.5), (0.90, 1.0)),
    ],
    ids=["good meter", "noisy meter", "steady course", "warm-up", "noisy meter, jump"],
)
def test_what_scatters_is_told_from_what_drifts(
    readings: int, noise: float, moved: Callable[[Array], Array], share: tuple[float, float], tmp_path: Path
) -> None:
    """Share of 300 sessions with a detected drift, if each session reads white this number of times."""
    random = np.random.default_rng(20261122)
    white = np.array([95.04, 100.0, 108.9])
    (tmp_path / "s.csv").write_text(csv_text(np.ones((readings, 3)), np.tile(white, (readings, 1))))
    session = read_session(tmp_path / "s.csv")
    light = (1.0 + moved(np.linspace(0.0, 1.0, readings))) * (1.0 + noise * random.standard_normal((300, readings)))
    drifts = [drift_by_repeats(steadiness(replace(session, xyz=np.outer(each, white)))) for each in light]
    low, high = share
    assert low <= sum(each.drifted for each in drifts) / 300 <= high


def test_dimming_between_five_patches_is_a_rival_of_hdr(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    display, code = panel(rng), np.vstack([np.ones(3), np.eye(3), np.zeros(3)])
    still, dimmed = (read(display, State(), code, rng, noise=0.001, floor=0.002) for _ in range(2))
    dimmed[2:] *= 0.88
    texts = [csv_text(code, xyz) for xyz in (still, dimmed)]
    verdict = two(tmp_path, texts)
    assert (verdict.kind, verdict.names) == ("one-of", ("hdr", "drift"))


def test_a_display_has_changed_where_aging_is_certain_whatever_else_happened(tmp_path: Path) -> None:
    states = [State(), State(aged=np.exp(-np.array([0.18, 0.21, 0.6])), curve=1.1)]
    campaign = read_campaign(write(tmp_path, life(states), [0, 900]))
    inputs = np.linspace(0.0, 1.0, 33)
    loaded = [np.column_stack([inputs, *[inputs**state.curve] * 3]) for state in states]
    entries = [
        replace(entry, session=replace(entry.session, calibration=curves))
        for entry, curves in zip(campaign.entries, loaded, strict=True)
    ]
    (verdict,) = explain(replace(campaign, entries=tuple(entries))).verdicts
    assert (verdict.kind, verdict.names, verdict.display) == ("several", ("aging", "calibration"), "changed")


def test_curves_that_only_the_files_bend_are_a_calibration(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    display, code, inputs = panel(rng), chart(9, 3), np.linspace(0.0, 1.0, 33)
    campaign = read_campaign(write(tmp_path, life([State(), State()]), [0, 10]))
    entries = [
        replace(
            entry,
            session=replace(
                entry.session,
                drive=code,
                xyz=read(display, State(curve=curve), code, rng, noise=0.001, floor=0.002),
                calibration=np.column_stack([inputs, *[inputs**curve] * 3]),
            ),
        )
        for entry, curve in zip(campaign.entries, (1.0, 1.1), strict=True)
    ]
    (verdict,) = explain(replace(campaign, entries=tuple(entries))).verdicts
    assert (verdict.kind, verdict.names, verdict.display) == ("named", ("calibration",), "unchanged")
    assert any("with the calibrations in the files" in each for each in verdict.evidence)


@pytest.mark.parametrize("ends", [(0.8, 1.0), (1.0, 0.8)])
def test_what_a_calibration_takes_is_read_off_a_curve_that_is_no_power(ends: tuple[float, float]) -> None:
    def native(drive: Array) -> Array:
        return np.asarray(np.expm1(4.0 * drive) / np.expm1(4.0))

    drive = np.vstack([np.ones(3), np.zeros(3), *(level * each for each in np.eye(3) for level in LEVELS)])
    sessions = [
        Session(
            drive=drive,
            xyz=native(drive * end) @ FIVE.channels,
            absolute=True,
            names=("",) * len(drive),
            lines=np.arange(len(drive)),
            form="",
            calibration=np.array([[0.0, 0.0, 0.0, 0.0], [1.0, end, end, end]]),
        )
        for end in ends
    ]
    expected = native(np.array(ends[1])) / native(np.array(ends[0]))
    np.testing.assert_allclose(full_light_ratio(*sessions), expected, rtol=0.005)


def test_sessions_of_one_day_are_never_called_aging(tmp_path: Path) -> None:
    aged = State(aged=np.array([0.9, 0.88, 0.8]))
    assert "aging" not in two(tmp_path, life([State(), aged]), 0).names


def test_another_display_is_noticed_by_name_and_by_colour(tmp_path: Path) -> None:
    other = panel(np.random.default_rng(77))
    path = write(tmp_path, life([State(), State(), State()], other=other), [0, 10, 20])
    verdicts = explain(read_campaign(path)).verdicts
    assert verdicts[0].kind == "same"
    assert "another-display" in verdicts[1].names
    campaign = read_campaign(path)
    named = tuple(
        replace(entry, session=replace(entry.session, display=name))
        for entry, name in zip(campaign.entries, ("A", "A", "B"), strict=True)
    )
    assert explain(replace(campaign, entries=named)).verdicts[1].names == ("another-display",)


def test_what_the_campaign_says_of_the_instrument_counts(tmp_path: Path) -> None:
    turned = State(matrix=np.array([[1.04, -0.02, 0.0], [0.01, 0.99, 0.0], [0.0, 0.02, 0.95]]))
    path = write(tmp_path, life([State(), turned]), [0, 0], entry='instrument = "another meter"')
    campaign = read_campaign(path)
    entries = (replace(campaign.entries[0], instrument="one meter"), campaign.entries[1])
    (verdict,) = explain(replace(campaign, entries=entries)).verdicts
    assert verdict.names == ("instrument",)
    assert "the instrument is 'another meter', it was 'one meter'" in verdict.evidence


def test_a_cause_on_record_is_no_second_assumption(tmp_path: Path) -> None:
    wrong = np.array([[0.97, 0.03, 0.0], [0.02, 0.98, 0.0], [0.01, 0.0, 0.98]])
    sessions = life([State(), State(brightness=0.2, matrix=wrong)])
    campaign = read_campaign(write(tmp_path, sessions, [0, 800], entry='instrument = "other"'))
    verdicts = {}
    for before in ("one meter", "other"):
        pair = SessionPair(replace(campaign.entries[0], instrument=before), campaign.entries[1], None, ())
        weighed = {frozenset(each.names): each for each in explanations(pair)}
        verdicts[before] = weighed[frozenset({"brightness", "instrument"})], weighed[frozenset({"gamut-mode"})], pair
    recorded, unsaid = verdicts["one meter"][0], verdicts["other"][0]
    assert (recorded.assumed, unsaid.assumed) == (1, 2)
    # The prior of the instrument is also 2 in place of -1.
    assert recorded.weight - unsaid.weight == pytest.approx(SECOND + 3.0)
    # A single preset is nearly as likely: a recorded cause must stay even if it makes one cause more.
    both, preset, pair = verdicts["one meter"]
    assert "instrument" in pronounce(pair, [both, replace(preset, weight=both.weight - RIVAL + 0.1)]).names
    both, preset, pair = verdicts["other"]
    assert "instrument" not in pronounce(pair, [both, replace(preset, weight=both.weight - RIVAL + 0.1)]).names


@pytest.mark.parametrize(("shift", "other", "possible"), [
    (0.03, False, True), (0.05, False, False), (0.05, True, True), (0.11, True, False),
])  # fmt: skip
def test_wrong_corrections_move_primaries_only_so_far(shift: float, other: bool, possible: bool) -> None:
    """Two instruments may both be wrong; a gamut of half the area is no fault of theirs."""
    pair = SimpleNamespace(before=SimpleNamespace(instrument="meter"), other_instrument=other, largest_shift=shift)
    assert causes()["instrument"].possible(pair) is possible  # type: ignore[arg-type]


def test_spectral_lines_that_all_shift_are_the_instruments(tmp_path: Path) -> None:
    campaign = read_campaign(write(tmp_path, life([State(), State()]), [0, 0]))
    at = np.arange(380.0, 781.0, 2.0)
    peaks = np.exp(-(((at - np.array([[620.0], [530.0], [455.0]])) / 15.0) ** 2))
    moved = np.exp(-(((at - 1.0 - np.array([[620.0], [530.0], [455.0]])) / 15.0) ** 2))
    entries = [
        replace(entry, session=replace(entry.session, spectra=chart(9, 3) @ lines, wavelengths=at))
        for entry, lines in zip(campaign.entries, (peaks, moved), strict=True)
    ]
    assert line_shift(entries[0].session, entries[1].session) == pytest.approx(1.0, abs=0.15)
    assert line_shift(entries[0].session, entries[0].session) == pytest.approx(0.0, abs=0.05)
    moved_colours = entries[1].session.xyz @ np.array([[1.1, 0.0, -0.1], [-0.05, 1.0, 0.1], [0.0, 0.05, 0.8]])
    moved = replace(entries[1], session=replace(entries[1].session, xyz=np.maximum(moved_colours, 0.0)))
    for later in (entries[1], moved):
        (verdict,) = explain(replace(campaign, entries=(entries[0], later))).verdicts
        assert (verdict.kind, verdict.names) == ("named", ("instrument",))
    # An instrument moves no curve: where a curve moved too, something else has happened besides.
    level = entries[1].session.xyz / entries[1].session.xyz.max()
    bent = replace(entries[1], session=replace(entries[1].session, xyz=entries[1].session.xyz * level**0.15))
    (verdict,) = explain(replace(campaign, entries=(entries[0], bent))).verdicts
    assert verdict.sure == ("instrument",)
    assert {"brightness", "calibration"} <= {*verdict.names}


def test_sessions_without_primaries_are_unclear_and_say_why(tmp_path: Path) -> None:
    greys = "R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n255,255,255,95,100,108\n128,128,128,20,21,23\n"
    path = write(tmp_path, [greys, greys.replace("100", "101")], [0, 5])
    (verdict,) = explain(read_campaign(path)).verdicts
    assert (verdict.kind, verdict.names) == ("unclear", ())
    assert "white or a primary" in verdict.evidence[0]
    pair = explain(read_campaign(path)).pairs[0]
    assert explanations(pair) == ()


def test_a_session_without_black_is_compared_without(tmp_path: Path) -> None:
    texts = life([State(), State(brightness=0.6)])
    head, *rows = texts[1].splitlines()
    lit = [row for row in rows if not row.startswith("0.0000,0.0000,0.0000,")]
    assert len(lit) < len(rows)
    explanation = explain(read_campaign(write(tmp_path, [texts[0], "\n".join([head, *lit])], [0, 0])))
    # Without readings of light after black, a common factor cannot be distinguished from gains of the channels.
    assert "brightness" in explanation.verdicts[0].names
    assert explanation.pairs[0].contrast is None


HOURS = (0.0, 4000.0, 8000.0, 12_000.0)

#: White and primaries without black at two hours, as in docs/guides/your-display.md.
NO_BLACK = """hour,R,G,B,x,y,Y
0,1,1,1,0.3127,0.3290,250.0
0,1,0,0,0.6365,0.3462,54.6
0,0,1,0,0.3078,0.5906,176.1
0,0,0,1,0.1502,0.0632,19.3
12000,1,1,1,0.3210,0.3405,251.0
12000,1,0,0,0.6371,0.3478,55.4
12000,0,1,0,0.3102,0.5899,178.3
12000,0,0,1,0.1507,0.0664,17.3
"""


def test_room_light_is_not_told_without_black(tmp_path: Path) -> None:
    table = tmp_path / "room-3.csv"
    table.write_text(NO_BLACK)
    campaign = read_campaign(table)
    (verdict,) = explain(campaign).verdicts
    assert (verdict.kind, verdict.names) == ("named", ("aging",))
    assert any("black was not read in both sessions" in each for each in verdict.evidence)
    # Room light on record is no guess.
    lit = [replace(each, conditions={"ambient_lx": lux}) for each, lux in zip(campaign.entries, (0, 60), strict=True)]
    (recorded,) = explain(replace(campaign, entries=tuple(lit))).verdicts
    assert "ambient" in recorded.names


def test_sessions_with_hours_are_explained_in_hours(tmp_path: Path) -> None:
    table = tmp_path / "room-3.csv"
    table.write_text(NO_BLACK)
    ((cells,),) = (each.rows for each in explanation_page(explain(read_campaign(table))) if isinstance(each, Table))
    assert cells[:2] == ("room-3.csv, hour 12000", spaced(12_000))
    dated = write(tmp_path, life([State(), State(), State(), State(brightness=0.75)]), [0, 400, 800, 1200])
    entries = [replace(each, hours=hours) for each, hours in zip(read_campaign(dated).entries, HOURS, strict=True)]
    *_, last = explain(replace(read_campaign(dated), entries=tuple(entries))).verdicts
    assert f"hardly any of this light was lost until {spaced(4000)} hours before" in last.evidence


def test_a_campaign_of_one_session_and_an_unknown_reference_are_refused(tmp_path: Path) -> None:
    texts = life([State(), State()])
    with pytest.raises(LutgenError, match="a comparison needs two or more"):
        explain(read_campaign(write(tmp_path, texts[:1], [0])))
    with pytest.raises(LutgenError, match=r"'x' names 0 of its sessions. Pick one of: 0.txt, 1.txt"):
        explain(read_campaign(write(tmp_path, texts, [0, 1])), reference="x")


@pytest.mark.parametrize("order", ["", "sorted", "shuffled"])
def test_sessions_sorted_by_code_do_not_drift(order: str, tmp_path: Path) -> None:
    """A change of brightness after a spreadsheet sorted the rows, with and without a record of the order."""
    rng = np.random.default_rng(8)
    display, code = panel(rng), np.unique(chart(9, 4), axis=0)
    texts = []
    for brightness in (1.0, 0.7):
        head, *rows = csv_text(
            code, read(display, State(brightness=brightness), code, rng, noise=0.001, floor=0.002)
        ).splitlines()
        if order == "shuffled":
            rows = [rows[place] for place in rng.permutation(len(rows))]
        if order == "sorted":
            head, rows = f"{head},order", [f"{row},{place}" for place, row in enumerate(rows)]
        texts.append("\n".join([head, *rows]) + "\n")
    assert two(tmp_path, texts).names == ("brightness",)


def test_a_drift_shows_in_the_order_of_reading_where_that_is_not_the_codes(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    display, code = panel(rng), rng.permutation(np.unique(chart(9, 4), axis=0))
    still, ran = (read(display, State(drift=d), code, rng, noise=0.001, floor=0.002) for d in (0.0, 0.15))
    assert two(tmp_path, [ti3_text(code, xyz, "Tue Mar 04 10:12:00 2025") for xyz in (still, ran)]).names == ("drift",)


def test_blue_that_fades_over_a_year_is_aging(tmp_path: Path) -> None:
    """Light of short wavelengths is lost, as behind a yellowing sheet: red and green hardly change."""
    rng = np.random.default_rng(3)
    display, code = panel(rng), chart(9, 3)
    short = 0.1 * display.channels[:, 2]
    faded = replace(display, channels=display.channels - np.column_stack([0.195 * short, 0.0 * short, short]))
    states = ((display, State()), (faded, State(aged=np.array([0.95, 0.95, 0.93]))))
    verdict = two(tmp_path, texts_of(states, code, rng), 400)
    assert (verdict.names, verdict.display) == (("aging",), "changed")


@pytest.mark.parametrize(("x", "y", "z"), [(0.95, 0.97, 0.85), (0.97, 0.87, 0.96)], ids=["short", "long"])
def test_blue_light_that_fades_alone_is_aging_and_no_instrument(x: float, y: float, z: float, tmp_path: Path) -> None:
    """Only blue's filter fades, towards short or long wavelengths: red and green do not change at all."""
    rng = np.random.default_rng(12)
    display, code = panel(rng), chart(9, 3)
    faded = replace(display, channels=display.channels * np.array([[1.0] * 3, [1.0] * 3, [x, y, z]]))
    texts = texts_of((display, faded), code, rng)
    verdict = two(tmp_path, texts, 400)
    assert (verdict.names, verdict.display) == (("aging",), "changed")
    assert "aging" not in two(tmp_path, texts, 1).names


def test_a_matrix_that_moves_blue_alone_over_a_year_may_be_aging(tmp_path: Path) -> None:
    """Blue becomes brighter and changes its hue. lutgen knows no such loss, but no record names another meter."""
    rng = np.random.default_rng(13)
    display, code = panel(rng), chart(9, 3)
    moved = replace(display, channels=display.channels * np.array([[1.0] * 3, [1.0] * 3, [1.0, 1.1, 1.0]]))
    assert two(tmp_path, texts_of((display, moved), code, rng), 400).names == ("instrument", "aging")


def test_a_preset_of_which_nobody_told_is_among_the_rivals(tmp_path: Path) -> None:
    """No instrument and no settings are recorded: primaries that mix while black stays may be a preset."""
    verdict, label = judged(tmp_path, "gamut-mode", 0.1, 7103)
    assert label in verdict.names


@pytest.mark.parametrize("curve", [1.0, 1.08])
def test_another_gamut_mode_is_a_preset_and_no_hdr(curve: float, tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    display, code = panel(rng), chart(9, 3)
    mixed = np.array([[0.94, 0.045, 0.015], [0.03, 0.96, 0.01], [0.005, 0.02, 0.975]])
    states = ((display, State()), (replace(display, channels=mixed @ display.channels), State(curve=curve)))
    verdict = two(tmp_path, texts_of(states, code, rng, ONE_METER), 0)
    assert verdict.names[0] == "gamut-mode"
    assert not {"hdr", "instrument", "another-display", "aging"} & {*verdict.names}
    assert verdict.display == "unchanged"


def test_a_mode_of_nearly_the_same_gamut_is_a_rival_of_the_instrument(tmp_path: Path) -> None:
    """A panel a little wider than P3, shown as P3: white stands still, the primaries move by Δu'v' 0.004 to 0.011."""
    panel_xy, p3_xy = ([0.682, 0.315], [0.255, 0.695], [0.149, 0.055]), ([0.68, 0.32], [0.265, 0.69], [0.15, 0.06])
    texts = []
    for primaries in (panel_xy, p3_xy):
        matrix = normalised_primary_matrix(np.array(primaries), [0.3127, 0.3290])
        light = 200.0 * DRIVE**2.2 @ matrix.T + 0.2
        rows = [",".join(f"{value:.7g}" for value in (*(255 * d), *c)) for d, c in zip(DRIVE, light, strict=True)]
        texts.append("\n".join(["# display: one", "# instrument: one meter", "R,G,B,X,Y,Z", *rows]))
    verdict = two(tmp_path, texts)
    assert {*verdict.names} == {"instrument", "gamut-mode"}
    assert verdict.display == "unchanged"


@pytest.mark.parametrize("beside", ["", "brightness"])
@pytest.mark.parametrize(("code", "factor"), [((255, 0, 0), 0.6), ((0, 0, 0), 30.0)])
def test_one_of_two_readings_of_a_patch_misread_is_no_drift(
    code: tuple[int, int, int], factor: float, beside: str, tmp_path: Path
) -> None:
    texts = life([State(), State(brightness=0.6 if beside else 1.0)])
    rows = texts[1].splitlines()
    head = next(n for n, row in enumerate(rows) if row.startswith("R"))
    numbers = np.array([row.split(",")[:6] for row in rows[head + 1 :]], dtype=np.float64)
    places = np.flatnonzero((numbers[:, :3] == code).all(axis=1))
    assert places.size == 2
    numbers[places[1], 3:] *= factor
    rows[head + 1 :] = [",".join(f"{each:.6g}" for each in row) for row in numbers]
    verdict = two(tmp_path, [texts[0], "\n".join(rows)])
    assert verdict.names == (("misreading", beside) if beside else ("misreading",))


@pytest.mark.parametrize("beside", ["", "brightness"])
def test_one_patch_misread_is_named_and_left_out(beside: str, tmp_path: Path) -> None:
    texts = life([State(), State(brightness=0.5 if beside else 1.0)])
    head, *rows = texts[1].splitlines()
    place = next(
        n for n, row in enumerate(rows) if len({*row.split(",")[:3]}) == 1 and 120 < float(row.split(",")[0]) < 150
    )
    rows[place] = ",".join([*rows[place].split(",")[:3], "190", "200", "218"])
    verdict = two(tmp_path, [texts[0], "\n".join([head, *rows])])
    assert verdict.names == (("misreading", beside) if beside else ("misreading",))
    assert f"1.txt, line {place + 2}: code 0.5" in verdict.evidence[0]
    assert verdict.display == "unchanged"


@pytest.mark.parametrize("code", ["255.0000,255.0000,255.0000", "255.0000,0.0000,0.0000", "0.0000,0.0000,0.0000"])
def test_a_misread_end_of_a_ramp_is_named(code: str, tmp_path: Path) -> None:
    """A window of a middle grey covers white, red or black. This is no HDR and no other range of the signal."""
    texts = life([State(), State()])
    head, *rows = texts[1].splitlines()
    (grey,) = (row.split(",")[3:] for row in rows if len({*row.split(",")[:3]}) == 1 and row.startswith("159"))
    places = [n for n, row in enumerate(rows) if row.startswith(f"{code},")]
    for place in places:
        rows[place] = ",".join([code, *grey])
    verdict = two(tmp_path, [texts[0], "\n".join([head, *rows])])
    assert verdict.names[0] == "misreading"
    assert not {"hdr", "signal-range", "gamut-mode", "another-display"} & {*verdict.names}
    assert f"1.txt, line {places[0] + 2}: code" in verdict.evidence[0]


def test_a_level_below_full_drive_that_reads_another_colour_is_the_misread_one(tmp_path: Path) -> None:
    """The readings of the next-brightest red and of a grey are exchanged: full red is as it should be."""
    texts = life([State(), State()])
    head, *rows = texts[1].splitlines()
    reds = [n for n, row in enumerate(rows) if row.split(",")[1:3] == ["0.0000", "0.0000"] and row[0] != "0"]
    levels = sorted(reds, key=lambda n: float(rows[n].split(",")[0]))
    below = next(n for n in reversed(levels) if not rows[n].startswith("255"))
    grey = next(n for n, row in enumerate(rows) if len({*row.split(",")[:3]}) == 1 and row.startswith("159"))
    cells = [rows[n].split(",") for n in (below, grey)]
    for n, own, other in ((below, cells[0], cells[1]), (grey, cells[1], cells[0])):
        rows[n] = ",".join([*own[:3], *other[3:6], *own[6:]])
    verdict = two(tmp_path, [texts[0], "\n".join([head, *rows])])
    assert verdict.names[0] == "misreading"
    misread = " ".join(verdict.evidence)
    assert f"1.txt, line {below + 2}: code" in misread
    assert "code 1.00, 0.00, 0.00" not in misread


def test_a_loss_that_a_calibration_hides_in_blue_may_be_aging(tmp_path: Path) -> None:
    """Light falls by a tenth in three years; a calibration that no file holds raised blue again, and moved its hue."""
    rng = np.random.default_rng(21)
    display, code = panel(rng), chart(9, 3)
    lost = replace(display, channels=display.channels * np.array([[0.9] * 3, [0.88] * 3, [0.9, 0.943, 0.87]]))
    verdict = two(tmp_path, texts_of((display, lost), code, rng, ONE_METER), 1133)
    assert "aging" in verdict.names
    assert verdict.display != "unchanged"


@pytest.mark.parametrize("declares", ["proof", "sign", "beside", "bends"])
def test_a_cause_is_one_file(declares: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each declaration of an invented cause suffices to name the cause. No other module has to know the cause."""
    says: dict[str, object] = {declares: lambda _pair: True if declares == "bends" else "a cat sat on the screen"}
    invented = Cause("cat", "a cat sat on the screen", "look", "unchanged", frozenset({"sum"}), **says)  # type: ignore[arg-type]
    known = {**causes(), "cat": invented}
    for module in ("verdicts", "explain"):
        monkeypatch.setattr(f"lutgen.history.{module}.causes", lambda: known)
    greys = "R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n255,255,255,95,100,108\n128,128,128,20,21,23\n"
    texts = [greys, greys.replace("100", "101")] if declares == "sign" else life([State(), State()])
    assert "cat" in two(tmp_path, texts).names


X61_2020 = "ThinkPad_X61__N121X5-L06__1_2020-05-26"

#: Real pairs by the first letters of their file names, and the names that a verdict may contain ("": no name).
REAL = {
    "one day, twice": ("K2721UG__1_2022-08-20_16", "K2721UG__1_2022-08-20_17", {""}),
    "one day, recalibrated": ("U2718Q__1_2020-05-26_12-15", "U2718Q__1_2020-05-26_12-58", {""}),
    # Their colours repeat. In one session of each pair the light is constant from code 224 or 199 of 255 upwards.
    "Dell": ("DELL_P2715Q_2022", "DELL_P2715Q_14", {"signal-range"}),
    "LG": ("LG_ULTRAWIDE_2022", "LG_ULTRAWIDE_14", {"signal-range"}),
    "LG, two cables": ("LG_ULTRAWIDE_17-06-2022_D65_120_D", "LG_ULTRAWIDE_17-06-2022_D65_120_H", {"signal-range"}),
    "LG, the same range": ("LG_ULTRAWIDE_2022", "LG_ULTRAWIDE_17-06-2022_D65_120_D", {"calibration", "brightness"}),
    "HDR on": ("K2418U__2_2021-02-09_09-11", "K2418U__2_2021-02-09_09-32", {"hdr"}),
    "wrong matrix": ("U2718Q__1_2020-05-26_13", "U2718Q__1_2020-05-26_12-58", {"instrument", "calibration"}),
    "no matrix any more": ("U2718Q__1_2020-05-26_12-15", "U2718Q__1_2020-05-26_13", {"instrument", "calibration"}),
    "wrong matrix, and dimmed": ("U2718Q__1_2020-05-26_12-58", "U2718Q__2_2022",
                                 {"instrument", "brightness", "gamut-mode"}),
    "white less than its primaries in 2017": ("U2718Q__2_2017", "U2718Q__2_2022", {"hdr"}),
    "drift, June": ("MacBook_Pro_13_2013_Late___1_2018-06-21", "MacBook_Pro_13_2013_Late___1_2018-06-03", {"drift"}),
    "drift, October": ("MacBook_Pro_13_2013_Late___1_2018-06-21", "MacBook_Pro_13_2013_Late___1_2018-10", {"drift"}),
    "X61, three years": ("ThinkPad_X61__N121X5-L06__1_2017-04-19_15", f"{X61_2020}_13", {"aging"}),
    "X61, dimmed": ("ThinkPad_X61__N121X5-L06__1_2017-04-19_10", "ThinkPad_X61__N121X5-L06__1_2017-04-19_15",
                    {"brightness", "calibration"}),
    "X61, one day": (f"{X61_2020}_13", f"{X61_2020}_15", {""}),
    "two models": ("U2718Q__1_2020-05-26_13", "K2721UG__1_2022-08-20_17", {"another-display"}),
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    mostly_slow(
        REAL,
        "one day, twice",
        "Dell",
        "LG, the same range",
        "HDR on",
        "wrong matrix",
        "wrong matrix, and dimmed",
        "drift, June",
        "X61, three years",
        "X61, dimmed",
        "two models",
        "white less than its primaries in 2017",
    ),
)
def test_real_sessions_are_explained_as_their_authors_noted(name: str) -> None:
    before, after, expected = REAL[name]
    entries = tuple(_entry(real_data(), start) for start in (before, after))
    campaign = Campaign("real", None, entries, "<memory>", "")
    (verdict,) = explain(campaign, reference=entries[0].session.file).verdicts
    assert {*verdict.names} == expected - {""}
    assert (verdict.display == "changed") == (expected == {"aging"})


def _entry(folder: Path, start: str) -> CampaignEntry:
    (path,) = Path(folder, "real").rglob(f"{start}*")
    session = read_session(path)
    when = session.created.date() if session.created else _named_date(path.name)
    return CampaignEntry(session, session.file, when, None, session.instrument, "", "", {})


def _named_date(name: str) -> date:
    match = re.search(r"(\d\d)-(\d\d)-(2022)|(2022)(\d\d)(\d\d)", name)
    assert match is not None
    day, month, _, _, later_month, later_day = match.groups()
    return date(2022, int(month or later_month), int(day or later_day))


@pytest.mark.parametrize("z", [0.96, 1.04])
def test_a_correction_that_turns_white_bluer_is_no_aging(z: float, tmp_path: Path) -> None:
    """One axis of the meter changes by 4 %: towards yellow it may be aging, towards blue it may not."""
    rng = np.random.default_rng(4)
    display, code = panel(rng), chart(9, 3)
    turned = replace(display, channels=display.channels * np.array([1.0, 1.0, z]))
    verdict = two(tmp_path, texts_of((display, turned), code, rng), 400)
    assert ("aging" in verdict.names) == (z < 1.0)
