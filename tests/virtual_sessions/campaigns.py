"""Write sessions of a simulated display into a folder, with the campaign file that lists them."""

from __future__ import annotations

from datetime import date, timedelta
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_sessions.display import Panel, State, chart, csv_text, panel, read

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

START = date(2020, 1, 1)


def write(folder: Path, texts: Sequence[str], days: Sequence[int], *, entry: str = "", head: str = "") -> Path:
    """Write sessions and their campaign.

    ``entry`` is added to the last session's entry, ``head`` to the display's entry.
    """
    lines = ["schema = 1", "[display]", 'name = "simulated"', head]
    for number, (text, day) in enumerate(zip(texts, days, strict=True)):
        (folder / f"{number}.txt").write_text(text)
        lines += ["[[sessions]]", f'file = "{number}.txt"', f"date = {START + timedelta(days=day)}"]
    path = folder / "campaign.toml"
    path.write_text("\n".join([*lines, entry]) + "\n")
    return path


def life(states: Sequence[State], *, seed: int = 0, noise: float = 0.001, other: Panel | None = None) -> list[str]:
    """Return sessions of one panel in these states; ``other`` is the panel of the last session."""
    rng = np.random.default_rng(seed)
    display, code = panel(rng), chart(steps=9, mixed=3)
    panels = [display] * (len(states) - 1) + [other or display]
    return [
        csv_text(code, read(each, state, code, rng, noise=noise, floor=0.002))
        for each, state in zip(panels, states, strict=True)
    ]
