"""The declaration of a physical effect: one decorator over one pure function, for built-in effects and users' own.

::

    @effect(
        stage="optics",
        neutral={"leak": 0.0},
        leak=Parameter(0.002, (0.0, 0.05), "1", "light that black lets through, as a share of white's, at 18 000 h"),
    )
    def black_level(xyz, scene, *, leak):
        return xyz + leak * scene.tau * scene.white

The function takes the signal of its stage and the :class:`~lutgen.effects.scene.Scene`, and returns a new signal. The
function's name, with hyphens, is the effect's name. The module's docstring describes the mechanism and its source.
"""

from __future__ import annotations

import inspect
import sys
from dataclasses import dataclass, field, replace
from importlib import import_module
from math import isfinite
from typing import TYPE_CHECKING, Any, Protocol

from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene

#: Stages of the display, in the order in which the signal passes them, and the signal that an effect of the stage takes
#: and returns.
STAGES = {
    "drive": "code values (..., 3), 0..1",
    "transfer": "linear light per channel (..., 3)",
    "mixing": "linear light per channel (..., 3)",
    "emission": "XYZ of white, red, green, blue at full drive (..., 4, 3), cd/m²",
    "optics": "XYZ (..., 3), cd/m²",
    "viewing": "XYZ (..., 3), cd/m²",
    "instrument": "XYZ as the meter reports it (..., 3), cd/m²",
    "selection": "linear light per channel (..., 3); the effect returns the grey in each colour, in all three channels",
}

#: Prefix of the modules of built-in effects.
_CATALOGUE = "lutgen.effects.catalogue."

#: Origin of an effect of the catalogue; prefix of the origin of an effect that a program declares, before the name of
#: the program's module.
BUILT_IN, CODE = "built-in", "code, module "

#: Two values of a parameter are equal if they differ by no more than this share of the parameter's range.
NEARBY = 1e-9


@dataclass(frozen=True)
class Parameter:
    """One physical number of an effect.

    Attributes
    ----------
    value
        Typical value: the start of a search, and the parameter's value in a form that does not free the parameter.
    bounds
        Smallest and largest physical value.
    unit
        Unit in the field's spelling, ``1`` for a ratio.
    meaning
        One sentence.
    grid
        Values to try one by one, for a parameter without a useful gradient (a number of bits). ``"gaps"``: midpoints
        between neighbouring sessions, for the date of an event. ``"proposed"``: the values that the effect proposes.
    beside_first
        Value if the display's own model of the first session is used. This model contains the effects of hour 0, so an
        amplitude at hour 0 is 0 there. None: the parameter is free there too, as the date of an event always is.

    """

    value: float
    bounds: tuple[float, float]
    unit: str
    meaning: str
    grid: tuple[float, ...] | str = ()
    beside_first: float | None = None

    def is_at_bound(self, value: float) -> bool:
        """Whether a value lies at one of the bounds."""
        return any(self.is_at(bound, value) for bound in self.bounds)

    def is_at(self, place: float, value: float) -> bool:
        """Whether a value equals ``place`` within the tolerance ``NEARBY``."""
        low, high = self.bounds
        return bool(abs(value - place) <= NEARBY * (high - low))


#: Grid of a parameter with too many values to fit each: the effect proposes settings (``Effect.propose``).
PROPOSED = "proposed"


#: What the clauses ``says`` and ``says_less`` insert besides parameters.
INSERTED = ("size", "channels", "when")


class Transform(Protocol):
    """The function of an effect."""

    def __call__(self, signal: Array, scene: Scene, /, **parameters: float) -> Array:
        """Return the signal after the effect; shapes broadcast; the input is not changed."""


class Propose(Protocol):
    """The function that proposes settings for a fit, of an effect that shifts code values."""

    def __call__(self, code: Array, pull: Array, information: Array, /) -> tuple[list[dict[str, float]], int]:
        """Return settings, best first, and the number of settings that were compared.

        ``code``: code values of the readings, (m,). Shifts s of the code values change χ² by
        sᵀ · information · s − 2 · pull · s, with ``pull`` (m,) and ``information`` (m, m).
        """


@dataclass(frozen=True)
class Effect:
    """A declared effect.

    Attributes
    ----------
    name
        Name that users type.
    stage
        One of ``STAGES``.
    parameters
        Name → :class:`Parameter`, in the function's order.
    neutral
        Amplitude → the value at which the effect does nothing, for all values of the other parameters.
    forms
        Sets of parameters that a fit frees, simplest first. The other parameters keep their neutral value, or their
        typical value if they have no neutral value. Forms from index ``refined`` on are refinements: the same physics
        with a freer formula. A refinement with more than three parameters counts only where a shorter form explains
        more than half of the refinement's improvement.
    refined
        Index of the first refinement in ``forms``.
    needs
        Columns of the readings without which the readings cannot show the effect.
    baseline
        ``colour-points``: the effect is visible although white and primaries are measured again at every hour.
        ``first-hour``: the effect is visible only in a model whose white and primaries come from hour 0 alone.
    compensated
        Whether a sensor that holds white's luminance compensates the effect. False for an effect that leaves the sensor
        no reserve.
    confused_with
        Name of another effect → the measurement that would separate the two effects, one sentence.
    says
        A clause that describes the effect and its size: ``black leaks {size} of white``. ``{size}`` is the first
        amplitude and its growth, in percent. ``{channels}`` lists red, green and blue, where their parameters are not
        neutral. ``{when}`` is a date with ``grid`` ``gaps``, between two sessions. Other parameters are inserted by
        their names, as in :meth:`str.format`.
    says_less
        The clause for a negative size, which is inserted without its sign; "": ``says``.
    source
        Source of the form and of the size, with DOI where there is one; "an assumption" where there is no source.
    propose
        For parameters whose ``grid`` is ``proposed``: the function that returns the settings to try, best first. See
        :class:`Propose`.
    text, origin
        The module's docstring. The source of the effect: ``built-in``, a file, a package, an expression or code.

    """

    name: str
    stage: str
    parameters: Mapping[str, Parameter]
    neutral: Mapping[str, float]
    forms: tuple[tuple[str, ...], ...]
    function: Transform
    refined: int = 1
    needs: tuple[str, ...] = ()
    baseline: str = "colour-points"
    compensated: bool = True
    confused_with: Mapping[str, str] = field(default_factory=dict)
    says: str = ""
    says_less: str = ""
    source: str = ""
    propose: Propose | None = None
    text: str = ""
    origin: str = BUILT_IN

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the effect by its module and its function's name, under which the decorator has stored the effect."""
        return _recalled, (self.name, self.origin, self.function.__module__, getattr(self.function, "__name__", ""))

    @property
    def summary(self) -> str:
        """The first line of the docstring, without its full stop."""
        return self.text.strip().partition("\n")[0].rstrip(".")

    def as_json(self) -> dict[str, Any]:
        """Return the declaration as JSON, without the function."""
        return {
            "name": self.name,
            "stage": self.stage,
            "summary": self.summary,
            "baseline": self.baseline,
            "needs": list(self.needs),
            "origin": self.origin,
            "parameters": {
                name: {
                    "value": parameter.value,
                    "bounds": list(parameter.bounds),
                    "unit": parameter.unit,
                    "meaning": parameter.meaning,
                    "neutral": self.neutral.get(name),
                    "grid": list(parameter.grid) if not isinstance(parameter.grid, str) else parameter.grid,
                }
                for name, parameter in self.parameters.items()
            },
            "forms": [list(form) for form in self.forms],
            "refined": self.refined,
            "confused_with": dict(self.confused_with),
            "source": self.source,
            "text": self.text,
        }

    def is_kin(self, other: Effect) -> bool:
        """Whether one of the two effects names the other in ``confused_with``."""
        return other.name in self.confused_with or self.name in other.confused_with

    def since_first_session(self) -> Effect:
        """Return the effect for a display whose own model contains the effects of hour 0; see ``beside_first``."""
        held = {name: each.beside_first for name, each in self.parameters.items() if each.beside_first is not None}
        if not held:
            return self
        kept = [tuple(n for n in form if n not in held or self.parameters[n].grid == "gaps") for form in self.forms]
        forms = tuple(dict.fromkeys(form for form in kept if form))
        simple = len(dict.fromkeys(form for form in kept[: self.refined] if form))
        parameters = {
            name: replace(parameter, value=held[name]) if name in held else parameter
            for name, parameter in self.parameters.items()
        }
        says = f"{self.says} beyond that of the first session" if "{size}" in self.says else self.says
        less = f"{self.says_less}, compared with the first session" if self.says_less else ""
        return replace(self, parameters=parameters, forms=forms, refined=simple, says=says, says_less=less)

    def rest(self) -> dict[str, float]:
        """Return parameters at which the effect does nothing: neutral amplitudes, typical other parameters."""
        return {name: self.neutral.get(name, parameter.value) for name, parameter in self.parameters.items()}

    def typical(self) -> dict[str, float]:
        """Return every parameter's typical value."""
        return {name: parameter.value for name, parameter in self.parameters.items()}


def chain_order(declared: Effect) -> tuple[int, str]:
    """Return a sort key: stage first, then name."""
    return list(STAGES).index(declared.stage), declared.name


def _recalled(name: str, origin: str, module: str, attribute: str) -> Effect:
    """Return a pickled effect: from its module, or by its origin if the origin is a file or an expression."""
    source = import_module(module) if origin.startswith(CODE) else sys.modules.get(module)
    effect = getattr(source, attribute, None)
    if isinstance(effect, Effect) and effect.origin == origin:
        return effect
    recalled: Effect = import_module("lutgen.effects.own").recall(name, origin)  # `own` imports this module
    return recalled


def effect(
    *,
    stage: str,
    neutral: Mapping[str, float],
    forms: tuple[tuple[str, ...], ...] = (),
    refined: int = 1,
    needs: tuple[str, ...] = (),
    baseline: str = "colour-points",
    compensated: bool = True,
    confused_with: Mapping[str, str] | None = None,
    says: str = "",
    says_less: str = "",
    source: str = "",
    propose: Propose | None = None,
    **parameters: Parameter,
) -> Callable[[Callable[..., Array]], Effect]:
    """Declare a function as an effect, and check the declaration.

    Raises
    ------
    LutgenError
        The declaration is inconsistent; the message says what to change.

    """

    def declare(function: Callable[..., Array]) -> Effect:
        name = function.__name__.replace("_", "-")
        module = sys.modules.get(function.__module__)
        declared = Effect(
            name=name,
            stage=stage,
            parameters=parameters,
            neutral=dict(neutral),
            forms=forms or _usual_forms(neutral, parameters),
            function=function,
            refined=refined,
            needs=needs,
            baseline=baseline,
            compensated=compensated,
            confused_with=confused_with or {},
            says=says,
            says_less=says_less,
            source=source,
            propose=propose,
            text=inspect.getdoc(module) or inspect.getdoc(function) or "",
            origin=BUILT_IN if function.__module__.startswith(_CATALOGUE) else CODE + function.__module__,
        )
        check_declaration(declared)
        return declared

    return declare


def _usual_forms(neutral: Mapping[str, float], parameters: Mapping[str, Parameter]) -> tuple[tuple[str, ...], ...]:
    """Return the default forms: the amplitudes; then all parameters, if there are others."""
    amplitudes = tuple(name for name in parameters if name in neutral)
    return (amplitudes,) if len(amplitudes) == len(parameters) else (amplitudes, tuple(parameters))


def check_declaration(declared: Effect) -> None:
    """Check the consistency of a declaration. Raises LutgenError; the message says what to change."""
    who = f"effect {declared.name!r}"
    if declared.stage not in STAGES:
        _refuse(f"{who}: unknown stage {declared.stage!r}. Pick one of: {', '.join(STAGES)}.")
    if declared.baseline not in {"colour-points", "first-hour"}:
        _refuse(f"{who}: unknown baseline {declared.baseline!r}. Pick one of: colour-points, first-hour.")
    _check_signature(declared, who)
    for name, parameter in declared.parameters.items():
        _check_parameter(f"{who}: parameter {name!r}", parameter, declared.neutral.get(name))
    # A selection has no amplitude.
    if not declared.neutral and declared.parameters and declared.stage != "selection":
        _refuse(f"{who}: neutral is empty. Name the amplitudes and the values at which the effect does nothing.")
    _check_names(f"{who}: neutral", tuple(declared.neutral), declared.parameters)
    _check_names(f"{who}: needs", declared.needs, COLUMNS)
    for form in declared.forms:
        _check_names(f"{who}: forms", form, declared.parameters)
    for key, clause in (("says", declared.says), ("says_less", declared.says_less)):
        try:
            clause.format(**{**declared.typical(), **dict.fromkeys(INSERTED, "")})
        except (LookupError, ValueError) as error:
            allowed = ", ".join(f"{{{name}}}" for name in (*INSERTED, *declared.parameters))
            _refuse(f"{who}: {key} cannot be filled in ({error}). It may insert {allowed}.")


def _check_names(who: str, names: tuple[str, ...] | str, allowed: Iterable[str]) -> None:
    if isinstance(names, str):
        _refuse(f"{who} is the text {names!r}. Write ({names!r},), with a comma.")
    for name in names:
        if name not in allowed:
            _refuse(f"{who} names {name!r}. Pick from: {', '.join(allowed)}.")


def _check_signature(declared: Effect, who: str) -> None:
    signature = inspect.signature(declared.function).parameters.values()
    positional = [p.name for p in signature if p.kind in {p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD}]
    keyword = [p.name for p in signature if p.kind == p.KEYWORD_ONLY]
    if len(positional) != 2 or any(p.kind in {p.VAR_KEYWORD, p.VAR_POSITIONAL} for p in signature):
        _refuse(f"{who}: the function takes (signal, scene, *, parameters…); write exactly two names before the star.")
    if set(keyword) != set(declared.parameters):
        odd = sorted(set(keyword) ^ set(declared.parameters))
        _refuse(
            f"{who}: function and decorator differ in {', '.join(odd)}. Each parameter stands after the function's "
            f"star and, with a Parameter, in the decorator."
        )


def _check_parameter(who: str, parameter: Any, neutral: float | None) -> None:
    if not isinstance(parameter, Parameter):
        _refuse(f"{who} is {parameter!r}. Declare it as Parameter(value, (low, high), unit, meaning).")
    low, high = parameter.bounds
    if not (isfinite(low) and isfinite(high) and low < high):
        _refuse(f"{who}: bounds ({low:g}, {high:g}) must be finite, the smaller first.")
    if not low <= parameter.value <= high:
        _refuse(f"{who}: the typical value {parameter.value:g} lies outside its bounds {low:g}..{high:g}.")
    if neutral is not None and not parameter.grid and not low <= neutral <= high:
        _refuse(f"{who}: the neutral value {neutral:g} lies outside its bounds {low:g}..{high:g}.")
    if not parameter.unit or not parameter.meaning:
        _refuse(f"{who}: give its unit (`1` for a ratio) and one sentence of meaning.")


def _refuse(message: str) -> None:
    raise LutgenError(message)
