"""The picture of how the error falls with each added effect, and of the error that each effect alone would leave."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.report.criticism.diagnosis import noise_rms
from lutgen.report.criticism.residual_plot import LOGARITHMIC
from lutgen.report.drawing.figure import BAND, BLACK, BLUE, GREY, RED, picture, tidy

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.diagnose import Diagnosis

#: Effects that are drawn alone, at most.
ALONE = 12

#: Half the height of the band around 1 in which an error counts as noise.
NEAR = 0.1


class Stage(NamedTuple):
    """A model with some of the effects added: its name, and its comparison with the readings."""

    name: str
    comparison: Comparison


class Alone(NamedTuple):
    """An effect alone beside the model: rms error of its fit in σ, and whether the verdict names it."""

    name: str
    rms_sigma: float
    named: bool


def alone(diagnosis: Diagnosis) -> list[Alone]:
    """Return the effects alone, best first."""
    named = diagnosis.verdict.effects
    return [Alone(each.effect, each.rms_sigma, each.effect in named) for each in diagnosis.ranking[:ALONE]]


def plot_steps(stages: Sequence[Stage], diagnosis: Diagnosis | None, path: Path, *, foot: str, force: bool) -> None:
    """Draw the error after each step, and each effect alone or the errors in ΔE2000. Raises as :func:`picture`."""
    legend = (
        "Error: root mean square over that of noise alone, for readings predicted from white and primaries; grey: "
        "within a tenth of the noise. "
    )
    height = 6.4
    with picture(path, _title(stages), foot=legend + foot, height=height, force=force) as (figure, low, high):
        bottom, top = low + 0.75 / height, high - 0.4 / height
        wide = 0.34 if diagnosis else 0.42
        _way(figure.add_axes((0.055, bottom, wide, top - bottom)), stages)
        if diagnosis:
            _alone(figure.add_axes((0.56, bottom, 0.4, top - bottom)), diagnosis)
        else:
            _colours(figure.add_axes((0.55, bottom, 0.42, top - bottom)), stages)


def _title(stages: Sequence[Stage]) -> str:
    first, last = stages[0].comparison, stages[-1].comparison
    if len(stages) == 1:
        return f"The error is {first.ratio:.2f} times the noise, and no effect is added"
    added = ", ".join(stage.name.removeprefix("+ ") for stage in stages[1:])
    end = "the noise" if last.agrees else f"{last.ratio:.2f} times the noise: something is left"
    return f"With {added} the error falls from {first.ratio:.3g} times the noise to {end}"


def _way(axes: Axes, stages: Sequence[Stage]) -> None:
    ratio = np.array([stage.comparison.ratio for stage in stages])
    places = np.arange(len(stages))
    axes.axhspan(1.0 - NEAR, 1.0 + NEAR, color=BAND, linewidth=0)
    axes.axhline(1.0, color=GREY, linewidth=1.0)
    axes.plot(places, ratio, "-", color=BLACK, linewidth=1.6)
    for place, stage, value in zip(places, stages, ratio, strict=True):
        axes.plot(place, value, "o", color=BLUE if stage.comparison.agrees else RED, markersize=11)
        axes.annotate(
            f"{value:.3g} ×", (place, value), (12, 10), textcoords="offset points", fontsize=12, weight="bold"
        )
    if ratio.max() > LOGARITHMIC:
        axes.set_yscale("log")
        axes.set_ylim(0.6, 2.2 * ratio.max())
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_formatter(lambda _value, _: "")
    else:
        axes.set_ylim(0.0, max(2.0, 1.25 * float(ratio.max())))
    axes.set_xticks(places, [stage.name for stage in stages], fontsize=11)
    axes.set_xlim(-0.4, len(stages) - 0.4)
    axes.set_title("Error over noise, effect by effect", loc="left", fontsize=12)
    tidy(axes)


def _alone(axes: Axes, diagnosis: Diagnosis) -> None:
    rows, noise, base = alone(diagnosis), noise_rms(diagnosis), diagnosis.explanation.base
    nothing = (base.chi2 / base.readings) ** 0.5
    for row, each in enumerate(rows):
        axes.barh(row, each.rms_sigma, 0.66, color=BLUE if each.named else "#bbbbbb")
        axes.annotate(
            f"{each.rms_sigma / noise:.3g} ×",
            (max(each.rms_sigma, noise), row),
            (8, 0),
            textcoords="offset points",
            va="center",
            fontsize=10,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )
    axes.axvline(noise, color=GREY, linewidth=1.6)
    axes.axvline(nothing, color=RED, linewidth=1.6, linestyle="--")
    axes.text(noise, -0.75, "noise", ha="center", fontsize=10, color=GREY)
    if nothing > 1.15 * noise:
        axes.text(nothing, -0.75, "without it", ha="center", fontsize=10, color=RED)
    if nothing > LOGARITHMIC * noise:
        axes.set_xscale("log")
        axes.set_xlim(0.6 * noise, 2.0 * nothing)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(lambda _value, _: "")
    else:
        axes.set_xlim(0.0, 1.25 * max(nothing, noise))
    axes.set_yticks(range(len(rows)), [each.name for each in rows], fontsize=10)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_title("What each effect alone would leave, in σ", loc="left", fontsize=12, pad=20)
    tidy(axes)
    axes.grid(visible=False, axis="y")


def _colours(axes: Axes, stages: Sequence[Stage]) -> None:
    """Draw ΔE2000 before, after, and of noise alone."""
    keys = {"mean": "delta_e_mean", "95 % below": "delta_e_p95", "largest": "delta_e_max"}
    floor = stages[-1].comparison.floor
    shades = [RED, *["#bbbbbb"] * max(len(stages) - 2, 0), BLUE][: len(stages)]
    columns = [*((stage.name, stage.comparison.error, shade) for stage, shade in zip(stages, shades, strict=True))]
    width = 0.8 / (len(columns) + 1)
    for index, (name, errors, colour) in enumerate([*columns, ("noise alone", floor, BAND)]):
        values = [getattr(errors, key) for key in keys.values()]
        places = np.arange(len(keys)) + (index - len(columns) / 2) * width
        axes.bar(places, values, 0.9 * width, color=colour, label=name)
        for place, value in zip(places, values, strict=True):
            axes.text(place, value, f"{value:.2f}", ha="center", va="bottom", fontsize=9)
    axes.set_xticks(range(len(keys)), list(keys), fontsize=11)
    axes.set_title("ΔE2000", loc="left", fontsize=12)
    axes.legend(frameon=False, fontsize=10)
    tidy(axes)
    axes.grid(visible=False, axis="x")
