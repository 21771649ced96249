"""Measurement designs that cannot identify the effect at any noise level. The honest reply says this.

Either the effect leaves no trace in the data: the reply is ``consistent`` and lists the effect as not visible. Or two
effects leave the same trace: the reply is ``one-of`` and includes the true effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from tests.virtual_display.physics import find
from tests.virtual_display.strength import DETECTABLE, sized

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from tests.virtual_display.campaign import Campaign

#: Sizes for tied effects: clear but moderate, 2–4 × the smallest detectable size. At these sizes a small difference in
#: colour distinguishes nothing.
TIED_MULTIPLES = (2.0, 4.0)

#: Effects that add the same light to every reading.
ADDITIVE = ["ambient-reflection", "black-level", "meter-offset"]


@dataclass(frozen=True)
class Blind:
    """A campaign whose data cannot identify the effect, the honest replies, and the reason."""

    campaign: Campaign
    honest: list[dict[str, Any]]
    why: str


def _unseen(design: str, name: str) -> Callable[[Campaign, np.random.Generator], Blind]:
    """Return a case with effect ``name`` at its typical size, where ``design`` has no patch that shows the effect."""

    def case(base: Campaign, rng: np.random.Generator) -> Blind:
        form = str(rng.choice(["same", "other"]))
        effect = find(name, form)
        hidden = ((name, effect.typical, form),)
        campaign = replace(base, design=design, display=str(rng.choice(effect.classes)), hidden=hidden)
        return Blind(campaign, [{"verdict": ["consistent"], "unseen": [name]}], f"{design} do not show {name}")

    return case


def _tied(design: str, name: str, form: str, rivals: list[str], **base_changes: Any) -> Callable[..., Blind]:
    """Return a case with effect ``name``, where ``rivals`` leave the same trace."""

    def case(base: Campaign, rng: np.random.Generator) -> Blind:
        display = str(rng.choice(find(name, form).classes))
        campaign = replace(base, design=design, display=display, **base_changes)
        solved = sized(campaign, name, form, DETECTABLE * float(rng.uniform(*TIED_MULTIPLES)))
        campaign = replace(campaign, hidden=((name, solved.size, form),))
        return Blind(campaign, [{"verdict": ["one-of"], "any_two": rivals}], f"{' = '.join(rivals)} on {design}")

    return case


#: One case per row. With white held and no growth, leaked light is as constant as a meter's offset or the room's lamp.
CASES: tuple[Callable[[Campaign, np.random.Generator], Blind], ...] = (
    _tied("greys", "crosstalk", "same", ["crosstalk", "loading"]),
    _unseen("tips", "black-level"),
    _tied("greys", "black-level", "constant", ADDITIVE, held=True, ageing=0.3),
    _unseen("colours", "edge-falloff"),
    _tied("greys", "loading", "same", ["crosstalk", "loading"]),
    _unseen("tips", "eotf-drift"),
    _tied("greys", "ambient-reflection", "same", ADDITIVE, held=True, ageing=0.3, room_lx=40.0),
    _unseen("colours", "warm-up"),
    _tied("greys", "meter-offset", "same", ADDITIVE, held=True, ageing=0.3),
    _unseen("colours", "veiling-glare"),
    _unseen("tips", "crosstalk"),
    _unseen("colours", "ambient-reflection"),
)
