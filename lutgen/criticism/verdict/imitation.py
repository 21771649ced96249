"""Imitation: which other effects the form of an admitted effect could imitate on these readings.

A good fit proves an effect only if its form cannot fit other effects. Therefore the signature of each other effect, in
its simple forms at typical sizes, is scaled to the χ² that the admitted effect explains, and is projected off the tips,
the other admitted effects and the form's free parameters. The remaining part distinguishes the two effects. Effects of
the catalogue represent similar effects that the catalogue lacks: a form that imitates the first also imitates the
second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.linear import Term
from lutgen.criticism.search.candidates import STRONG
from lutgen.criticism.search.explanation import ages_light, bends_curves
from lutgen.criticism.search.forms import simple_forms
from lutgen.criticism.search.free_term import LEAST_SEEN
from lutgen.numerals import percent

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.fit.score import Score
    from lutgen.criticism.search.candidates import Candidate
    from lutgen.criticism.search.explanation import Step
    from lutgen.effects import Effect

#: Directions of a form with a singular value below this share of the largest one are ignored.
OWN = 1e-4

#: Each of several named effects must keep at least this share of its signature (in χ²) after projection off the other
#: effects' forms. Chosen on seeds 617 to 619 of ``python -m tests.generators``, below all hidden pairs that were found.
APART = 0.75

#: A curve may depart from its formula by this share of its change. If two effects on curves differ by less, readings
#: prove neither. An assumption.
DEPARTURE = 0.05


@dataclass(frozen=True)
class Imitated:
    """An effect, and how well the form of another effect can follow its signature.

    Attributes
    ----------
    name
        Name of the effect.
    share
        Share of the effect's signature, in χ², that the form cannot follow: 0 to 1.
    left
        χ² of the effect that the form could not explain, if the effect's χ² were equal to the form's own gain.
    alone
        χ² that the imitated effect itself explains, as a share of the χ² that the finding explains; None: not known.

    """

    name: str
    share: float
    left: float
    alone: float | None = None


def nearest(step: Step, final: Fit, scale: float) -> Imitated | None:
    """Return the effect that the form of an admitted effect follows best; ``scale``: unit of χ² from the noise."""
    score = step.without.score
    form = _form(score, step.chosen)
    strength = (step.without.chi2 - final.chi2) / scale
    admitted = {step.name, *(other.effect.name for other in step.beside)}
    shares = [
        (max(_outside(form, score, term) for term in terms), effect.name)
        for effect in step.effects
        if effect.name not in admitted
        for terms in _typical(effect)
    ]
    share, name = min(shares, default=(1.0, ""))
    return Imitated(name, share, strength * share) if name else None


def unproved(step: Step, final: Fit, scale: float) -> str:
    """Say why readings do not prove an effect that fits them best; "" if they do; ``scale``: as in :func:`nearest`.

    A smooth curve of another formula differs from a small change by less than the noise. Light that the display adds to
    every reading looks like an offset of the meter, unless readings of the capped lens show the offset.
    """
    effect, problem = step.effect, final.problem
    strength = (step.without.chi2 - final.chi2) / scale
    if bends_curves(effect) and not effect.propose and strength * DEPARTURE**2 < 2 * STRONG:
        return f"A curve of another formula, different by {percent(DEPARTURE)} of this change, fits as well."
    asks_for_cap = effect.stage == "instrument" and any("lens capped" in way for way in effect.confused_with.values())
    capped = problem.is_capped
    shown = (step.without.residual[capped] ** 2).sum() - (final.residual[capped] ** 2).sum()
    if asks_for_cap and shown < STRONG:
        return "No reading with the lens capped shows that the meter, and not the display, adds this light."
    return ""


def assumes_held_luminance(step: Step, problem: Problem) -> str:
    """Say that a fault of the meter assumes a sensor that holds the luminance, if the file does not state it; or "".

    Light that ages looks like a drift of the meter, unless a sensor of the display holds the luminance.
    """
    effect, stated = step.effect, "luminance" in problem.readings.metadata
    ages = [other.name for other in step.effects if other.name in effect.confused_with and ages_light(other)]
    if stated or not problem.holds_white or effect.stage != "instrument" or not ages:
        return ""
    return (
        f"This assumes that a sensor holds the luminance, which the file does not say. If no sensor does, add a line "
        f"# luminance: free to the file: the cause may then be {ages[0]}."
    )


def overlap(chosen: Sequence[Candidate], base: Fit) -> bool:
    """Whether the forms of the other effects can follow a large part of the signature of one of several effects.

    A greedy search combines effects with overlapping forms to imitate another effect; separate effects do not overlap.
    """
    if len(chosen) < 2:
        return False
    score = base.score
    forms = [_form(score, each) for each in chosen]
    return any(
        _outside(_basis(np.column_stack([*forms[:at], *forms[at + 1 :]])), score, each.term) < APART
        for at, each in enumerate(chosen)
    )


def _typical(effect: Effect) -> Iterator[list[Term]]:
    """Yield each simple form of an effect at its declared typical sizes, as one term for each size.

    A form imitates an effect only if it follows all of these terms. For example, a common drift of three channels does
    not imitate a drift of one channel.
    """
    for form in simple_forms(effect):
        values = {name: effect.parameters[name].value for name in form}
        sizes = [name for name in form if name in effect.neutral]
        alone = [
            {other: value for other, value in values.items() if other == name or other not in sizes} for name in sizes
        ]
        yield [Term.at_rest(effect, form, **each) for each in alone or [values]]


def _form(score: Score, chosen: Candidate) -> Array:
    """Return an orthonormal basis of a form near its fit: of the effect as fitted and after a step of each parameter.

    A parameter whose step changes the effect by a share of less than about ``OWN`` adds no direction.
    """
    nudged = (chosen.term.nudged(name)[0] for name in chosen.term.free)
    columns = [score.project(score.switched_on(each)) for each in (*nudged, chosen.term)]
    sizes = np.linalg.norm(columns, axis=1, keepdims=True)
    return _basis((np.array(columns) / np.where(sizes > 0, sizes, 1.0)).T)


def _basis(columns: Array) -> Array:
    """Return an orthonormal basis of the span of columns."""
    basis, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(basis[:, singular > OWN * singular[0]])


def _outside(form: Array, score: Score, term: Term) -> float:
    """Return the share of an effect's signature, in χ², that a form cannot follow; 1 if the effect is invisible."""
    whole = score.switched_on(term)
    signature = score.project(whole)
    size = float(np.linalg.norm(signature))
    if size <= LEAST_SEEN * float(np.linalg.norm(whole)):
        return 1.0
    return max(1.0 - float(((form.T @ signature) ** 2).sum()) / size**2, 0.0)
