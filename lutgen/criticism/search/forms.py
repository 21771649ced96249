"""The forms of an effect: all, the simple ones, the formulas, and those whose settings the effect proposes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.effects.declare import PROPOSED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.effects import Effect

    Form = tuple[str, ...]

#: A form with at most this number of free parameters is a formula.
FORMULA = 3


def all_forms(effect: Effect) -> Sequence[Form]:
    """Return the forms of an effect; an effect without parameters has one form, which is empty."""
    return effect.forms or ((),)


def simple_forms(effect: Effect) -> Sequence[Form]:
    """Return the simple forms of an effect; the empty form if all their parameters are held."""
    return effect.forms[: effect.refined] or ((),)


def is_refined(effect: Effect, form: Form) -> bool:
    """Whether a form is none of the simple forms of an effect, in any order of the parameters."""
    return all(set(form) != set(simple) for simple in all_forms(effect)[: effect.refined])


def is_formula(effect: Effect, form: Form) -> bool:
    """Whether a form is short enough to be a formula of the effect; the effect's simple forms always are."""
    return not is_refined(effect, form) or len(form) <= max(FORMULA, len(simple_forms(effect)[0]))


def is_proposed(effect: Effect, form: Form) -> bool:
    """Whether a form has parameters whose settings the effect proposes from the residuals."""
    return any(effect.parameters[name].grid == PROPOSED for name in form)
