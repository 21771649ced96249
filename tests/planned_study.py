"""A small planned study: a protocol without a planner, read by tests of what comes after planning."""

from __future__ import annotations

from lutgen.study.protocol import Condition, Protocol, Render, StudyImage, Trial
from lutgen.study.scales import PAPER_CATEGORIES


def planned(images: int, *, readers: int = 1) -> Protocol:
    """A protocol of two sessions: half of the images aged in the first, all un-aged in the second."""
    names = [f"image-{number}" for number in range(1, images + 1)]
    under = {name: "chroma@18000" if number % 2 else "none" for number, name in enumerate(names)}
    places = range(1, readers + 1)
    trials = [
        Trial(reader, session, position, name, under[name] if session == 1 else "none")
        for reader in places
        for session in (1, 2)
        for position, name in enumerate(names, start=1)
    ]
    shown = sorted({(trial.image, trial.condition) for trial in trials})
    return Protocol(
        title="a small study",
        conditions=(Condition("none", "stable", 0.0), Condition("chroma@18000", "chroma", 18_000.0)),
        images=tuple(StudyImage(name, "0" * 64, 96, 96) for name in names),
        practice=(),
        categories=PAPER_CATEGORIES,
        ease=(1, 10),
        readers=readers,
        sessions=2,
        washout_days=24.0,
        seed=1,
        model={},
        renders=tuple(
            Render(image, condition, f"images/{number}.png", "0" * 64)
            for number, (image, condition) in enumerate(shown)
        ),
        trials=tuple(trials),
        version="0",
    )
