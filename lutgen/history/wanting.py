"""What a session lacks, and which question stays open for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import CHANNELS, mean_xyz, ramp, repeats, tip

if TYPE_CHECKING:
    from lutgen.readings.session import Session

#: Levels between black and full drive that a curve takes.
FEWEST_LEVELS = 5

#: Mixtures of the channels that crosstalk and loading take.
FEWEST_MIXTURES = 8


def wanting(session: Session) -> tuple[str, ...]:
    """Say what is missing for which diagnosis, a sentence each, the gravest first."""
    return tuple(sentence for missing, sentence in (*_patches(session), *_circumstances(session)) if missing)


def _patches(session: Session) -> list[tuple[bool, str]]:
    tips = [name for name in CHANNELS if tip(session, name) is None]
    if mean_xyz(session, "white") is None:
        tips.insert(0, "white")
    short = [name for name in CHANNELS if ramp(session, name).drive.size <= FEWEST_LEVELS]
    once = not any(rows.size > 1 for rows in repeats(session))
    return [
        (bool(tips), f"No {' or '.join(tips)} at full drive: no model of the display, no gamut, no additivity."),
        (
            mean_xyz(session, "black") is None,
            "No black: no contrast, no black-level or ambient light, and γ is fitted without taking black off.",
        ),
        (once, "No patch was read twice: no noise, no drift within the session (warm-up, automatic brightness)."),
        (
            ramp(session, "grey").drive.size <= FEWEST_LEVELS,
            f"Fewer than {FEWEST_LEVELS} greys below white: a coarse transfer curve, no drift of γ.",
        ),
        (bool(short), f"No ramp of {', '.join(short)}: a channel's own γ cannot be told from that of all."),
        (
            session.kinds.count("mixture") < FEWEST_MIXTURES,
            "Hardly any mixtures: no crosstalk, no loading, and no check of the model where it is used.",
        ),
    ]


def _circumstances(session: Session) -> list[tuple[bool, str]]:
    return [
        (
            not session.absolute,
            "No cd/m²: no fading of the backlight, no black level, no luminance to compare with other dates.",
        ),
        (
            session.calibration is None,
            "No calibration curves: what the panel did and what the calibration did cannot be told apart.",
        ),
        (
            session.positions is None or not np.ptp(session.positions, axis=0).any(),
            "One place on the screen: no edge fall-off, no uniformity.",
        ),
        (session.spectra is None, "No spectra: yellowing, phosphor wear and backlight decay are told by colour alone."),
        (session.created is None, "No date: say it in the campaign file."),
        (not session.instrument, "No instrument named: a change of meter could pass for aging."),
    ]
