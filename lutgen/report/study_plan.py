"""The pages of ``lutgen study plan``, ``status`` and ``power``, and the picture of power."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import counted, listed, percent, spaced
from lutgen.report.drawing import BLACK, BLUE, GREEN, GREY, RED, picture, tidy
from lutgen.report.parts import Headline, Part, Table
from lutgen.study.design import UNAGED
from lutgen.study.power import ALPHA, ANSWERS, FISHER, LEAST, MOST, ONE_TAILED, TARGET, TWO_SIDED, Power, Seen, power_of
from lutgen.study.protocol import PROTOCOL

if TYPE_CHECKING:
    from collections.abc import Iterator
    from datetime import datetime

    from matplotlib.axes import Axes

    from lutgen.study.answers import SessionProgress, StudyStatus
    from lutgen.study.plan import Planned

#: Test → its name in tables.
TESTS = {TWO_SIDED: "t, two-sided", ONE_TAILED: "t, one-tailed", FISHER: "Fisher, one-tailed"}

#: Assumptions of the figures.
ASSUMED = (
    "Standard deviations: the paper's (Avanaki et al. 2015, Table 2: 95 % intervals read as ± 1.96 standard errors of "
    "39, 40 and 40 answers), pooled. Agreement: exact, from the paper's 27 of 39 un-aged. Your readers and images will "
    "differ. Ease of reading lies near the top of its scale, where t is an approximation."
)
SEVERAL = (
    "With several readers answers are not independent: the figures hold for these readers on such images, not for "
    "readers at large."
)


def power_page(power: Power) -> Iterator[Part]:
    """Yield what ``lutgen study power`` prints."""
    yield Headline(power_headline(power))
    yield ""
    yield from detectable_part(power)
    yield ""
    yield "Power to find differences as large as the paper saw, if they are true:"
    yield seen_table(power)
    yield ""
    yield (
        f"The paper's own numbers find such a fall of agreement {percent(_agreement(power).paper)} of the time. So its "
        "p for chroma (0.066, not significant) is weak evidence against a fall, and its p for chroma-luma (0.042, "
        "significant) is partly chance. The power is computed for the measured difference, and is as uncertain as this "
        "difference."
    )
    yield ASSUMED
    if power.readers > 1:
        yield SEVERAL


def power_headline(power: Power) -> str:
    """Return a sentence on the power for the paper's fall of agreement, and on the answers for the target power."""
    seen = _agreement(power)
    first, second = (f"{100 * value:.1f} %" for value in seen.values)
    answers = "1 answer" if power.answers == 1 else f"{power.answers} answers"
    return (
        f"With {answers} per condition a fall of agreement from {first} to {second}, as the paper saw for chroma, is "
        f"found {percent(seen.yours)} of the time; {percent(TARGET)} takes {seen.needed} answers."
    )


def detectable_part(power: Power, *, agreement: bool = True) -> Iterator[Part]:
    """Yield the smallest detectable differences, or why there are none; ``agreement``: include agreement."""
    if power.answers < LEAST:
        yield "One answer per condition has no variance: no test can be made. Plan at least 2, better 40."
        return
    yield f"Found {percent(TARGET)} of the time at a level of {percent(ALPHA)}, per comparison:"
    rows = []
    for each in power.detectable:
        if each.smallest is None:
            smallest = "none"
        elif each.base is not None:
            smallest = f"{100 * each.base:.1f} % falls to {100 * (each.base - each.smallest):.1f} %"
        else:
            smallest = f"{each.smallest:.1f} s" if each.measure == "time" else f"{each.smallest:.2f} steps"
        if agreement or each.base is None:
            rows.append((each.measure, TESTS[each.test], smallest))
    yield Table(("measure", "test", "smallest difference"), rows, words=range(2))


def seen_table(power: Power) -> Table:
    """Return a table of the power for each difference of the paper's Tables 2 and 3."""
    heads = ("between", "the paper saw", "test", "in the paper", f"with {power.answers}", f"{percent(TARGET)} takes")
    rows = [
        (
            each.measure,
            " – ".join(each.between),
            seen_values(each),
            TESTS[each.test],
            percent(each.paper),
            percent(each.yours),
            f"> {MOST}" if each.needed is None else str(each.needed),
        )
        for each in power.seen
    ]
    return Table(("measure", *heads), rows, words=range(4))


def seen_values(each: Seen) -> str:
    """Return the paper's values under both conditions as text: 41.0 → 50.1 s."""
    scale, unit = {"time": (1, " s"), "ease": (1, ""), "agreement": (100, " %")}[each.measure]
    return f"{scale * each.values[0]:.1f} → {scale * each.values[1]:.1f}{unit}"


def _agreement(power: Power) -> Seen:
    """Return the paper's first comparison of agreement, by the paper's test."""
    return next(each for each in power.seen if (each.measure, each.test) == ("agreement", ONE_TAILED))


#: Name of the file.
PICTURE = "study-power.png"

#: Line style of each aging mode, and colour of each measure.
LINES = {"chroma": "--", "chroma-luma": "-"}
COLOURS = {"time": BLUE, "ease": GREEN, "agreement": RED}

#: Least number of answers per condition at the right edge.
WIDE = 160

#: Answers per condition of the paper.
_PAPER = max(ANSWERS.values())


def plot_power(power: Power, folder: str | Path, *, force: bool = False) -> Path:
    """Draw the picture into a folder; errors as :func:`lutgen.report.drawing.picture`."""
    path = Path(folder) / PICTURE
    foot = (
        f"Level {ALPHA:g}: time to score and ease of reading by the two-sided t, agreement between sessions by the "
        f"one-tailed t on 0/1 values, as in the paper; its curves have teeth because counts are whole. {ASSUMED}"
    )
    second = "Power to find the differences of the paper's Tables 2 and 3, if they are true"
    with picture(path, power_headline(power), second=second, foot=foot, height=8.0, force=force) as (figure, low, high):
        bottom = low + 0.65 / 8.0
        axes = figure.add_axes((0.06, bottom, 0.68, high - bottom - 0.15 / 8.0))
        _draw_power(axes, power)
    return path


def _draw_power(axes: Axes, power: Power) -> None:
    widest = max(WIDE, round(1.2 * power.answers))
    answers = np.unique(np.linspace(LEAST, widest, WIDE).round().astype(int))
    ends = []
    # From un-aged to each aging mode, by the paper's tests.
    for each in (each for each in power.seen if each.between[0] == "none" and each.test != FISHER):
        curve = [power_of(each.test, each.values, each.sd, (int(n), int(n))) for n in answers]
        colour, line = COLOURS[each.measure], LINES[each.between[1]]
        axes.plot(answers, curve, line, color=colour, linewidth=2.2)
        ends.append((curve[-1], each))
        if each.needed is not None:
            axes.plot(each.needed, TARGET, "o", markersize=8, markerfacecolor="white", markeredgecolor=colour,
                      markeredgewidth=2.0, zorder=5)  # fmt: skip
            axes.vlines(each.needed, 0.0, TARGET, color=colour, linewidth=0.8, linestyle=":")
    axes.axhline(TARGET, color=BLACK, linewidth=1.2)
    axes.text(
        0.995 * widest, TARGET - 0.012, f"{percent(TARGET)} power", fontsize=11, weight="bold", ha="right", va="top"
    )
    marks = {_PAPER: "the paper"} | ({power.answers: "this study"} if power.answers != _PAPER else {})
    for count, name in marks.items():
        axes.axvline(count, color=GREY, linewidth=1.6)
        axes.text(count + 0.005 * widest, 0.015, f"{name}: {count}", fontsize=10, color=GREY, rotation=90, va="bottom")
    _label(axes, ends)
    axes.set(xlim=(0, widest), ylim=(0, 1.02), yticks=np.linspace(0, 1, 6))
    axes.yaxis.set_major_formatter(lambda value, _place: f"{100 * value:.0f} %")
    axes.set_xlabel("answers per condition (images × readers)", fontsize=12)
    axes.set_ylabel("power", fontsize=12)
    tidy(axes)


def _label(axes: Axes, ends: list[tuple[float, Seen]]) -> None:
    """Label the curves at the right, the highest first: line, paper's difference, answers for the target power."""
    for row, (_, each) in enumerate(sorted(ends, key=lambda end: (end[1].needed or MOST, -end[0]))):
        height, colour = 0.97 - 0.1 * row, COLOURS[each.measure]
        axes.plot([1.015, 1.05], [height, height], LINES[each.between[1]], color=colour, linewidth=2.2, clip_on=False,
                  transform=axes.transAxes)  # fmt: skip
        takes = f"over {MOST}" if each.needed is None else str(each.needed)
        label = f"{each.measure}, {each.between[1]}: {seen_values(each)}\n{percent(TARGET)} takes {takes}"
        axes.text(1.06, height, label, fontsize=11, color=colour, va="center", transform=axes.transAxes)


#: Most names in a sentence; further names are only counted.
LISTED = 8


def plan_page(planned: Planned) -> Iterator[Part]:
    """Yield what ``lutgen study plan`` prints."""
    protocol, power = planned.protocol, planned.power
    yield Headline(plan_headline(planned))
    yield condition_table(planned)
    yield ""
    yield from _sessions(planned)
    if protocol.practice:
        yield f"Practice, un-aged and not analysed: {listed([each.name for each in protocol.practice], LISTED)}."
    if planned.left_out:
        yield f"Read by nobody: {counted(len(planned.left_out), 'image')} given ({listed(planned.left_out, LISTED)})."
    if planned.rounded:
        yield f"16 bits per channel, rounded to 8 bits for the readers: {listed(planned.rounded, LISTED)}."
    yield from planned.remarks
    if power is not None:
        yield ""
        yield from detectable_part(power, agreement=protocol.sessions > 1)
        yield "lutgen study power states the assumptions, and the power of the paper's own study."
        if power.readers > 1:
            yield SEVERAL
    yield ""
    yield (
        f"{PROTOCOL} is frozen (SHA-256 {protocol.sha256[:16]}…). Only this file tells which picture is which: keep it "
        "from the readers."
    )


def plan_headline(planned: Planned) -> str:
    """Return the number of images, readers, sessions and pictures of the plan."""
    protocol = planned.protocol
    counts = {"image": len(protocol.images), "reader": protocol.readers, "session": protocol.sessions}
    listing = ", ".join(counted(count, noun) for noun, count in counts.items())
    return f"{planned.study}: {listing}, {counted(len(protocol.renders), 'picture')} rendered."


def condition_table(planned: Planned) -> Table:
    """Return a table of the conditions: number of images in session 1, and the largest error of the LUT."""
    rows = []
    for each in planned.protocol.conditions:
        lut, count = planned.protocol.model["luts"].get(each.name), planned.per_condition.get(each.name)
        error = "no LUT: pixels as they are"
        if lut is not None:
            smooth, worst = lut["worst_smooth_delta_e_2000"], lut["worst_delta_e_2000"]
            error = f"{smooth:.4f} ({worst:.2f} where the model jumps)"
        hours = "–" if each == UNAGED else spaced(each.hours)
        rows.append((each.name, hours, "later sessions" if count is None else str(count), error))
    return Table(("condition", "hours", "images a reader", "ΔE2000 of the LUT, worst"), rows)


def _sessions(planned: Planned) -> Iterator[str]:
    protocol = planned.protocol
    for number in range(1, protocol.sessions + 1):
        trials = [trial for trial in protocol.trials if trial.session == number]
        images = sorted(Counter(trial.reader for trial in trials).values())
        count = counted(images[-1], "image") if images[0] == images[-1] else f"{images[0]} to {images[-1]} images"
        used = {trial.condition for trial in trials}
        shown = ", ".join(dict.fromkeys(each.name for each in protocol.conditions if each.name in used))
        begins = f", from {protocol.washout_days:g} days after reading session {number - 1} on" if number > 1 else ""
        yield f"Reading session {number}: {count} under {shown}{begins}."


def study_status_page(status: StudyStatus) -> Iterator[Part]:
    """Yield a sentence, and a table with one row for each reader and session, without answers."""
    sessions = [session for reader in status.readers for session in reader.sessions]
    complete = sum(session.state == "complete" for session in sessions)
    yield f"{status.protocol.title}: {complete} of {len(sessions)} reading sessions are complete."
    yield ""
    headings = ("reader", "session", "state", "images", "began", "ended", "remarks")
    rows = [
        (
            reader.reader or f"place {reader.place}, free",
            str(session.session),
            session.state,
            f"{session.read} of {session.images}",
            _when(session.started),
            _when(session.ended),
            _remarks(session),
        )
        for reader in status.readers
        for session in reader.sessions
    ]
    yield Table(headings, rows, words=range(len(headings)))


def _when(time: datetime | None) -> str:
    return f"{time:%Y-%m-%d %H:%M}" if time else ""


def _remarks(session: SessionProgress) -> str:
    remarks = [f"may begin {_when(session.may_begin)} UTC"] if session.may_begin else []
    remarks += [f"resumed {session.resumed} ×"] if session.resumed else []
    remarks += [f"overridden: {reason}" for reason in dict.fromkeys(session.overrides)]
    return "; ".join(remarks)
