"""Trends against exactly known decays and against scipy's fits."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.integrate import quad

from lutgen import LutgenError
from lutgen.history.decay import LAWS, decay_of
from lutgen.history.history import QUANTITIES, SETS, Limit, history, limits_of, parse_limit
from lutgen.history.inspect import inspect_session
from lutgen.history.transfer import contrast_response, index_of, luminance_of
from lutgen.history.trend import ENOUGH, FEWEST, Trend, shortest, trend, trend_as_json
from lutgen.names import LIMIT_SETS
from lutgen.numerals import spaced
from lutgen.readings import read_campaign, read_session
from lutgen.report.drawing import DPI
from lutgen.report.parts import Table
from lutgen.report.trend import plot_trend, trend_headline, trend_page
from tests import trend_coverage
from tests.quick import mostly_slow
from tests.real_data import real_data
from tests.virtual_sessions.campaigns import life, write
from tests.virtual_sessions.display import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.readings.campaign import Campaign

pytestmark = pytest.mark.numbers

LIMITS = [parse_limit("contrast>=100"), parse_limit("gsdf<=20%")]

DAYS = [0, 250, 500, 800, 1100, 1500]


def fading(folder: Path, life_days: float, *, days: list[int] | None = None, head: str = "", **last: float) -> Campaign:
    """A display with exponentially decaying light. ``last`` changes the state of the last session."""
    days = days or DAYS
    states = [State(aged=np.full(3, np.exp(-day / life_days)) * np.array([1.0, 1.0, 1.0 - day * 3e-5])) for day in days]
    if last:
        states[-1] = State(aged=states[-1].aged, **last)  # type: ignore[arg-type]
    return read_campaign(write(folder, life(states, seed=4), days, head=head))


@pytest.fixture(scope="module")
def faded(tmp_path_factory: pytest.TempPathFactory) -> Trend:
    """Six sessions of a display that fades in 3000 days, with three limits."""
    limits = [parse_limit(each) for each in ("white>=55%", "white>=80%", "contrast>=10")]
    return trend(fading(tmp_path_factory.mktemp("faded"), 3000.0), limits)


@pytest.mark.parametrize("life_days", mostly_slow([3000.0, 6000.0], 3000.0))
def test_the_time_of_a_limit_is_that_of_the_known_decay(life_days: float, faded: Trend, tmp_path: Path) -> None:
    if life_days == 3000.0:
        passing = faded.passings[0]
    else:
        (passing,) = trend(fading(tmp_path, life_days), [parse_limit("white>=55%")]).passings
    truth = -life_days * np.log(0.55)
    assert passing.status == "ahead"
    assert passing.extrapolated
    assert passing.time == pytest.approx(truth, rel=0.12)
    assert passing.low is not None
    assert passing.low <= truth
    assert passing.high is None or passing.high >= truth


@pytest.mark.parametrize(("name", "truth"), [
    ("constant", lambda t: 3.0 + 0.0 * t),
    ("linear", lambda t: 3.0 - 1.5 * t),
    ("exponential", lambda t: 3.0 * np.exp(-t / 0.9)),
])  # fmt: skip
def test_the_law_that_made_a_history_has_the_largest_weight(name: str, truth: object) -> None:
    assert callable(truth)
    time = np.linspace(0.0, 1.0, 12)
    decay = decay_of(time, truth(time), np.full(12, 0.01), time, draws=300, seed=[1])
    assert next(iter(decay.weights)) == name
    assert sum(decay.weights.values()) == pytest.approx(1.0)
    np.testing.assert_allclose(np.median(decay.curves, axis=0), truth(time), atol=0.02)


def test_weights_are_the_integrals_that_they_stand_for() -> None:
    """Constant against linear, by quadrature over their coefficients with known scatter."""
    time, figures, sigma = np.linspace(0.0, 1.0, 5), np.array([1.0, 0.99, 1.0, 0.97, 0.98]), 0.01
    laws = [law for law in LAWS if law.name in {"constant", "linear"}]

    def likelihood(values: object) -> float:
        return float(np.exp(-0.5 * (((figures - values) / sigma) ** 2).sum()))

    def prior(value: float, width: float) -> float:
        return float(np.exp(-0.5 * (value / width) ** 2) / width)

    one = quad(lambda a: prior(a, 1.0) * likelihood(a), 0.9, 1.1)[0]
    two = quad(
        lambda b: prior(b, 0.5) * quad(lambda a: prior(a, 1.0) * likelihood(a + b * time), 0.9, 1.1)[0], -0.15, 0.15
    )[0] / np.sqrt(2.0 * np.pi)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lutgen.history.decay.LAWS", tuple(laws))
        patch.setattr("lutgen.history.decay._SCATTER", (np.geomspace(0.999, 1.001, 3), 1.0, 0.4))
        weights = decay_of(time, figures, np.full(5, sigma), time, draws=10, seed=[1]).weights
    assert weights["linear"] / weights["constant"] == pytest.approx(two / one, rel=0.02)


def test_light_that_falls_by_a_quarter_is_not_constant_in_few_sessions() -> None:
    time = np.array([0.0, 0.4, 1.0])
    decay = decay_of(time, np.array([200.0, 181.0, 154.0]), np.array([2.0, 1.8, 1.5]), time, draws=50, seed=[1])
    assert next(iter(decay.weights)) != "constant"
    assert decay.weights["constant"] < 0.05


@pytest.mark.parametrize("name", trend_coverage.truths(np.random.default_rng(0)))
@pytest.mark.slow
def test_intervals_hold_the_true_time_about_as_often_as_they_say(name: str) -> None:
    """40 histories: a true share of 0.9 gives fewer than 31 with a probability of 1 %. The script scores more."""
    missed = [trend_coverage.held(name, 8, (5, n)) for n in range(40)]
    assert sum(any(each) for each in missed) <= 9


def test_an_interval_is_the_shortest_that_holds_its_share() -> None:
    """Of times with a long tail the interval holds the earliest. An infinite time counts as the end of the horizon."""
    tailed = np.exp(np.linspace(0.0, 3.0, 101))
    assert shortest(tailed[::-1], 0.9, 100.0) == (tailed[0], tailed[90])
    assert shortest(np.append(tailed, np.inf), 0.9, 100.0) == (tailed[0], tailed[91])
    assert shortest(np.append(tailed[:85], np.full(16, np.inf)), 0.9, 21.0) == (tailed[10], np.inf)


def test_three_sessions_promise_no_time(tmp_path: Path) -> None:
    course = trend(fading(tmp_path, 3000.0, days=[0, 500, 1000]), [parse_limit("white>=55%")])
    assert course.passings[0].status == "cannot-tell"
    assert (FEWEST, ENOUGH) == (4, 8)


def test_laws_beside_the_likeliest_are_separated_by_semicolons(faded: Trend) -> None:
    (table,) = (each for each in trend_page(faded) if isinstance(each, Table) and "also" in each.headings)
    also = [row[3].split("; ") for row in table.rows if row[3] != "–"]
    assert max(map(len, also)) > 1
    assert {law for laws in also for law in laws} <= {law.name for law in LAWS}


def test_fewer_than_eight_sessions_are_said_where_it_matters(faded: Trend) -> None:
    lines = [str(each) for each in trend_page(faded)]
    assert any(line.startswith("Fewer than 8 sessions (6)") for line in lines)


def test_the_grayscale_function_is_that_of_dicom() -> None:
    # PS3.14, table B-1: luminance of the first two indices and of the last.
    np.testing.assert_allclose(luminance_of(np.array([1.0, 2.0, 1023.0])), [0.05, 0.0547, 3993.404], rtol=1e-3)
    light = np.geomspace(0.06, 3900.0, 50)
    np.testing.assert_allclose(luminance_of(index_of(light)), light, rtol=0.005)


@pytest.mark.parametrize(("gamma", "conforms"), [(None, True), (2.2, False)])
def test_greys_are_held_against_the_grayscale_function(gamma: float | None, conforms: bool, tmp_path: Path) -> None:
    code = np.linspace(0.0, 1.0, 18)
    ends = index_of(np.array([0.5, 300.0]))
    light = luminance_of(ends[0] + code * (ends[1] - ends[0])) if gamma is None else 0.5 + 299.5 * code**gamma
    rows = "\n".join(f"{c:.8f},{c:.8f},{c:.8f},{y:.6f},{y:.6f},{y:.6f}" for c, y in zip(code, light, strict=True))
    (tmp_path / "greys.csv").write_text(f"# drive: 0..1\nR,G,B,X_cdm2,Y_cdm2,Z_cdm2\n{rows}\n")
    response = contrast_response(read_session(tmp_path / "greys.csv"))
    assert response is not None
    assert (response.worst < 0.02) == conforms
    if not conforms:
        assert response.worst > 0.2
    lit = contrast_response(read_session(tmp_path / "greys.csv"), ambient_cd_m2=1.0)
    assert lit is not None
    assert lit.worst != response.worst


def test_a_limit_passed_is_passed_at_the_session_that_shows_it(faded: Trend) -> None:
    # exp(-800 / 3000) is 0.77, exp(-500 / 3000) is 0.85.
    assert (faded.passings[1].status, faded.passings[1].time) == ("passed", 800.0)
    assert "white has been below its 80 % limit since 500 to 800 days" in trend_headline(faded)
    assert (faded.passings[2].status, faded.passings[2].extrapolated) == ("kept", False)


def one_of_three_used(folder: Path) -> Trend:
    """Return the trend of a dim display whose settings changed twice: only the reference is used."""
    states = [State(brightness=size) for size in (1.0, 0.5, 3.0)]
    course = trend(read_campaign(write(folder, life(states), [0, 30, 700])), [parse_limit("white>=400"), *LIMITS])
    assert course.kept.tolist() == [True, False, False]
    return course


def test_a_headline_says_which_sessions_it_is_based_on(tmp_path: Path) -> None:
    course = one_of_three_used(tmp_path)
    # The session of day 700, which is left out, keeps the limit.
    assert course.history.values["white"][2] > 400
    assert "white was below its 400 cd/m² limit in the only session used, day 0" in trend_headline(course)
    campaign = fading(tmp_path, 3000.0, days=[0, 400, 800, 1200], brightness=3.0)
    bright = trend(campaign, [parse_limit("white>=80%"), parse_limit("white>=400")])
    assert bright.kept.tolist() == [True, True, True, False]
    assert "white has been below its 80 % limit in the sessions used, since 400 to 800 days" in trend_headline(bright)
    assert "its 400 cd/m² limit since the first session used, day 0" in trend_headline(bright)


def brightened(folder: Path, sizes: list[float], limits: list[str]) -> Trend:
    """Return the trend of a display whose brightness was set anew before each session, a year apart."""
    texts = life([State(brightness=size) for size in sizes])
    campaign = read_campaign(write(folder, texts, [365 * year for year in range(len(sizes))]))
    return trend(campaign, [parse_limit(each) for each in limits], all_sessions=True)


def when_of(course: Trend) -> list[str]:
    """Return the last column of the table of limits."""
    (table,) = (each for each in trend_page(course) if isinstance(each, Table) and "when" in each.headings)
    return [row[-1] for row in table.rows]


def test_a_limit_that_the_last_session_keeps_is_not_passed_now(tmp_path: Path) -> None:
    white = history(read_campaign(write(tmp_path, life([State()]), [0]))).values["white"][0]
    limit = f"white>={0.8 * white:.4g}"
    course = brightened(tmp_path, [0.5, 0.9, 1.0], [limit, "contrast>=10"])
    now = f"{white:.0f} cd/m²"
    assert (course.passings[0].status, course.passings[0].low, course.passings[0].time) == ("returned", 0.0, 0.0)
    assert f"white was below its {limit[7:]} cd/m² limit at day 0 and is above it now, {now}" in trend_headline(course)
    assert when_of(course)[0] == f"below at day 0, above it now, {now}"
    often = brightened(tmp_path, [0.5, 1.0, 0.5, 1.0], [limit])
    assert (often.passings[0].status, often.passings[0].low, often.passings[0].time) == ("returned", 0.0, 730.0)
    last = f"{often.history.values['white'][-1]:.0f} cd/m²"
    assert f"limit, last at day 730, and is above it now, {last}" in trend_headline(often)
    again = brightened(tmp_path, [0.5, 1.0, 1.0, 0.5], [limit])
    assert f"limit since 730 to {spaced(1095)} days" in trend_headline(again)


def test_no_time_is_told_for_a_limit_that_the_laws_pass_before_a_session_that_keeps_it(
    tmp_path: Path, panels: Callable[[Trend], dict[str, Axes]]
) -> None:
    """A sudden loss, which a smooth law overshoots: all sessions keep the limit, the law does not."""
    sizes = [1.0, 1.0, 1.0, 1.0, 0.3, 0.3, 0.3, 0.3]
    white = history(read_campaign(write(tmp_path, life([State()]), [0]))).values["white"][0]
    course = brightened(tmp_path, sizes, [f"white>={0.29 * white:.4g}"])
    (passing,) = course.passings
    assert (passing.status, passing.time, passing.high) == ("contradicted", 2555.0, None)
    assert not passing.extrapolated
    now = f"{0.3 * white:.0f} cd/m²"
    said = f"limit now, {now}, but follows no smooth curve, so no time is told"
    assert said in trend_headline(course)
    assert "will" not in trend_headline(course)
    assert when_of(course) == [f"above it now, {now}, but follows no smooth curve, so no time is told"]
    assert trend_as_json(course)["limits"][0]["status"] == "contradicted"
    axes = panels(course)[QUANTITIES["white"].description]
    assert not [line for line in axes.lines if line.get_markerfacecolor() == "none"]


def test_a_steady_course_at_its_limit_is_too_near_to_tell_a_time(faded: Trend) -> None:
    """The last session lies just above a limit that the median of the laws is just below."""
    last, error = faded.history.values["white"][-1], faded.history.errors["white"][-1]
    assert faded.courses["white"].curve[np.searchsorted(faded.ahead, 1500.0)] == pytest.approx(last, rel=0.01)
    near = replace(faded.passings[0], status="contradicted", bound=float(last - error), time=1500.0)
    course = replace(faded, passings=(near,))
    assert when_of(course) == [f"above it now, {last:.0f} cd/m², too near to it to tell a time"]


@pytest.mark.slow
def test_limits_that_aging_passes_come_before_those_passed_from_the_start(tmp_path: Path) -> None:
    limits = [parse_limit(each) for each in ("gsdf<=1%", "contrast>=100000", "white>=55%", "white>=80%", "white>=40%")]
    campaign = fading(tmp_path, 3000.0)
    first, second, *_ = trend_headline(trend(campaign, limits)).split("; ")
    assert "white has been below its 80 % limit since 500 to 800 days" in first
    assert "white will fall below its 55 % limit at " in second
    later = trend_headline(trend(campaign, limits[:3]))
    assert "simulated: white will fall below its 55 % limit at " in later
    assert "; the deviation from DICOM's contrast response has been above its 1 % limit since the first" in later
    assert later.endswith("; passed in all: 2 limits.")


def test_the_reference_is_the_session_from_which_most_differ_by_nothing_but_age(tmp_path: Path) -> None:
    """A display that was dimmed in its first session: the other sessions agree."""
    states = [State(brightness=0.2), *(State(aged=np.full(3, share)) for share in (1.0, 0.97, 0.94))]
    campaign = read_campaign(write(tmp_path, life(states), [0, 1, 400, 800]))
    course = trend(campaign, [parse_limit("white>=99%"), parse_limit("white-shift<=0.01")])
    assert (course.reference, course.kept.tolist()) == (1, [False, True, True, True])
    # A share, and a shift of colour, begin at the first session used.
    assert course.passings[0].bound == pytest.approx(0.99 * course.history.values["white"][1])
    assert course.history.values["white-shift"][1] == 0
    assert any(str(each).startswith("Compared with 1.txt: --reference FILE") for each in trend_page(course))
    assert trend_as_json(course)["reference"].endswith("1.txt")
    chosen = trend(campaign, LIMITS, reference="0.txt")
    assert (chosen.reference, chosen.kept.tolist()) == (0, [True, False, False, False])


def test_of_references_with_as_many_sessions_the_earliest_counts(tmp_path: Path) -> None:
    campaign = read_campaign(write(tmp_path, life([State(brightness=size) for size in (1, 0.3, 1, 0.3)]), [0, 1, 2, 3]))
    assert trend(campaign, []).kept.tolist() == [True, False, True, False]


def test_a_headline_without_two_sessions_begins_with_that(tmp_path: Path) -> None:
    headline = trend_headline(one_of_three_used(tmp_path))
    assert headline.startswith("simulated: no trend, since 2 of 3 sessions differ by more than age; white was below")


def test_a_real_session_that_was_dimmed_is_no_reference() -> None:
    course = trend(read_campaign(*sorted((real_data() / "real" / "jamesits").glob("ThinkPad_X61*"))), [])
    assert course.kept.tolist() == [False, True, True, True]


@pytest.fixture
def panels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Trend], dict[str, Axes]]:
    """Return a function that draws a trend and returns title → panel."""
    figure = Figure(figsize=(15.0, 11.6), dpi=DPI)

    @contextmanager
    def kept(*_: object, **__: object) -> Iterator[tuple[Figure, float, float]]:
        yield figure, 0.03, 0.93

    def drawn(course: Trend) -> dict[str, Axes]:
        monkeypatch.setattr("lutgen.report.trend.picture", kept)
        plot_trend(course, tmp_path / "trend.png")
        figure.canvas.draw()
        return {each.get_title(loc="left"): each for each in figure.axes}

    return drawn


def test_a_picture_has_no_negative_axes_and_no_left_out_curves(
    tmp_path: Path, panels: Callable[[Trend], dict[str, Axes]]
) -> None:
    course = panels(one_of_three_used(tmp_path))
    response = course.pop("contrast response of greys against DICOM's")
    assert all(each.get_ylim()[0] >= 0 for each in course.values())
    assert [each.get_label() for each in response.lines] == ["0 days"]
    legend = response.get_legend()
    assert legend is not None
    assert [each.get_text() for each in legend.get_texts()] == ["±20 %", "±10 %", "0 days"]
    gsdf = course[QUANTITIES["gsdf"].description]
    assert all(each.get_text().endswith(" %") for each in gsdf.get_yticklabels())


@pytest.mark.slow
def test_the_label_of_a_limit_covers_no_session(tmp_path: Path, panels: Callable[[Trend], dict[str, Axes]]) -> None:
    course = fading(tmp_path, 3000.0)
    # The line lies closely below the first session.
    white = history(course).values["white"][0]
    axes = panels(trend(course, [parse_limit(f"white>={0.98 * white:.4g}")]))[QUANTITIES["white"].description]
    (label,) = (each for each in axes.texts if each.get_text().startswith("white>="))
    box = label.get_window_extent()
    places = axes.transData.transform(np.vstack([np.asarray(line.get_xydata()) for line in axes.lines[:4]]))
    assert not any(box.contains(x, y) for x, y in places)


def test_too_few_sessions_promise_nothing(tmp_path: Path) -> None:
    course = trend(fading(tmp_path, 3000.0, days=[0, 250]), [parse_limit("white>=50%")])
    assert course.passings[0].status == "cannot-tell"
    assert trend_headline(course).endswith("and these sessions do not show when one will be.")


def test_fewer_sessions_than_a_time_needs_are_dots_without_laws(
    tmp_path: Path, panels: Callable[[Trend], dict[str, Axes]]
) -> None:
    limits = trend(fading(tmp_path, 3000.0, days=[0, 250, 500]), [])
    assert not any("likeliest law" in each.headings for each in trend_page(limits) if isinstance(each, Table))
    assert "3 sessions: a time cannot be told from fewer than 4." in [*trend_page(limits)]
    assert {course["law"] for course in trend_as_json(limits)["courses"].values()} == {None}
    white = panels(limits)[QUANTITIES["white"].description]
    assert not white.collections
    # Dots and crosses.
    assert {line.get_linestyle() for line in white.lines} == {"None"}


def test_two_sessions_of_one_day_are_one_curve_of_contrast_response(
    tmp_path: Path, panels: Callable[[Trend], dict[str, Axes]]
) -> None:
    texts = life([State(brightness=0.3), State(), State()])
    course = panels(trend(read_campaign(write(tmp_path, texts, [0, 30, 30])), []))
    response = course["contrast response of greys against DICOM's"]
    assert [each.get_label() for each in response.lines] == ["30 days"]


def named(names: list[str], *, display: str) -> Trend:
    """Return a trend of which only display names matter: the first session is left out."""
    sessions = [
        SimpleNamespace(session=SimpleNamespace(display=name, file=f"{name}.ti3", metadata={})) for name in names
    ]
    campaign = SimpleNamespace(display=display, file="a.ti3 and b.ti3", entries=sessions)
    places = tuple(range(len(names)))
    history = SimpleNamespace(
        campaign=campaign, places=places, time=np.arange(float(len(names))), unit="days", values={}
    )
    used = SimpleNamespace(history=history, kept=np.array([False, *(True for _ in names[1:])]), left_out={0: None})
    return cast("Trend", SimpleNamespace(**vars(used), passings=(), why={0: "brightness"}))


@pytest.mark.parametrize(
    ("names", "display", "message"),
    [
        (["A", "B", "B"], "A", "B: "),
        (["A", "A", "B"], "A", "A and B: "),
        (["A", "B", "B"], "room 3", "room 3: "),
        (["A", "", ""], "A", "A: "),
        (["", "", ""], "", "a.ti3 and b.ti3: "),
    ],
)
def test_a_headline_names_the_display_of_the_sessions_used(names: list[str], display: str, message: str) -> None:
    assert trend_headline(named(names, display=display)).startswith(message)


def test_files_that_name_different_displays_are_said_so(tmp_path: Path) -> None:
    campaign = fading(tmp_path, 6000.0, days=[0, 400])
    names = ("Color LCD", "DELL U2718Q")
    entries = tuple(
        replace(entry, session=replace(entry.session, display=name))
        for entry, name in zip(campaign.entries, names, strict=True)
    )
    named = "Color LCD (1 session); DELL U2718Q (1 session)"
    remark = f"The files name different displays: {named}. A trend follows one display."
    assert remark in [*trend_page(trend(replace(campaign, entries=entries), []))]
    assert not any("different displays" in str(each) for each in trend_page(trend(campaign, [])))


def test_one_session_that_is_left_has_no_table_of_laws(tmp_path: Path) -> None:
    course = trend(read_campaign(write(tmp_path, life([State(), State(brightness=0.5)]), [0, 30])), [])
    assert int(course.kept.sum()) == 1
    parts = [*trend_page(course)]
    assert "1 session: a time cannot be told from fewer than 4." in parts
    assert not any("likeliest law" in each.headings for each in parts if isinstance(each, Table))


@pytest.mark.slow
def test_a_session_of_another_setting_is_left_out_unless_asked_for(tmp_path: Path) -> None:
    campaign = fading(tmp_path, 6000.0, brightness=1.5)
    limit = [parse_limit("white>=10")]
    course = trend(campaign, limit)
    assert course.why == {5: "brightness"}
    assert course.kept.tolist() == [True] * 5 + [False]
    assert trend(campaign, limit, all_sessions=True).kept.all()


def test_dates_become_hours_where_the_campaign_says_how_many_a_day(tmp_path: Path) -> None:
    days = history(fading(tmp_path, 3000.0))
    hours = history(fading(tmp_path, 3000.0, head="hours_per_day = 8.0"))
    assert (days.unit, hours.unit) == ("days", "hours")
    np.testing.assert_allclose(hours.time, 8.0 * days.time)


def test_places_that_cancel_have_no_uniformity(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A meter's zero may be as far below 0 as a dark corner is above."""
    monkeypatch.setattr(
        "lutgen.history.history.inspect_session",
        lambda session: replace(inspect_session(session), uniformity=(-1.0, 1.0)),
    )
    assert not np.isfinite(history(fading(tmp_path, 3000.0)).values["non-uniformity"]).any()


def test_limits_are_read_as_they_are_written() -> None:
    assert parse_limit("white>=200") == Limit("white", 200.0, "user")
    assert parse_limit(" white-shift <= 0.005 ") == Limit("white-shift", 0.005, "user", above=False)
    assert parse_limit("white>=80%").text == "white>=80%"
    # Samei et al. 2005: 170 and 100 cd/m², luminance ratios 250 and 100, for primary and secondary displays.
    light = [each for name in ("tg18-primary", "tg18-secondary") for each in limits_of(name) if each.above]
    assert [each.value for each in light] == [170, 250, 100, 100]
    assert parse_limit("gsdf<=10%") == Limit("gsdf", 0.1, "user", above=False)
    assert parse_limit("non-uniformity<=30%").text == "non-uniformity<=30%"
    assert {*LIMIT_SETS} == {*SETS}
    for text, message in (
        ("white", "write a quantity"),
        ("red>=3", "Pick one of: white"),
        ("white>=0", "no number"),
    ):
        with pytest.raises(LutgenError, match=message):
            parse_limit(text)
    with pytest.raises(LutgenError, match="Pick one of"):
        limits_of("none")


def test_campaigns_that_have_no_trend_are_refused(tmp_path: Path) -> None:
    texts = life([State(), State()])
    with pytest.raises(LutgenError, match="a trend needs two or more"):
        trend(read_campaign(write(tmp_path, texts[:1], [0])), [])
    with pytest.raises(LutgenError, match="sessions that are months apart"):
        trend(read_campaign(write(tmp_path, texts, [0, 0])), [])
