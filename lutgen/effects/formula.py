"""Formulas of one-line effects: a small grammar, and a stack machine that evaluates the formulas without ``eval``.

A formula holds numbers, + - * / **, parentheses, the functions of ``FUNCTIONS`` and names. A name is the signal, a
quantity of ``QUANTITIES``, or a parameter.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from inspect import Parameter as Argument
from inspect import Signature
from math import isfinite, pi
from operator import attrgetter
from typing import NoReturn

import numpy as np

from lutgen import cells
from lutgen.colorimetry import Array, code_to_linear
from lutgen.effects.scene import Scene
from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.conditions.position import PLACE
from lutgen.readings.conditions.window import PICTURE

#: Name of a signal → the stage of an effect on it.
SIGNALS = {"code": "drive", "linear": "transfer", "xyz": "optics"}

#: Name of a quantity → the function that reads the quantity from the scene, and the columns that the quantity needs.
QUANTITIES: dict[str, tuple[Callable[[Scene], Array], tuple[str, ...]]] = {
    "code": (attrgetter("code"), ()),
    "r": (lambda scene: code_to_linear(scene.code[..., :1]), ()),
    "g": (lambda scene: code_to_linear(scene.code[..., 1:2]), ()),
    "b": (lambda scene: code_to_linear(scene.code[..., 2:]), ()),
    "tau": (attrgetter("tau"), ()),
    "hours": (attrgetter("hours"), ()),
    "white": (attrgetter("white"), ()),
    "fresh_white": (attrgetter("fresh_white"), ()),
    "rho": (attrgetter("radius"), PLACE),
    **{name: (attrgetter(name), (name,)) for name in COLUMNS},
    "mean_drive": (attrgetter("mean_drive"), PICTURE),
    "pi": (lambda _scene: np.array(pi), ()),
}

#: Name of a function → NumPy's function and its number of arguments. `min` and `max` of more arguments are nested
#: pairs.
FUNCTIONS: dict[str, tuple[Callable[..., Array], int]] = {
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "clip": (np.clip, 3),
}

_SIGNS: dict[type[ast.AST], tuple[str, Callable[..., Array], int]] = {
    ast.Add: ("+", np.add, 2),
    ast.Sub: ("-", np.subtract, 2),
    ast.Mult: ("*", np.multiply, 2),
    ast.Div: ("/", np.divide, 2),
    ast.Pow: ("**", np.power, 2),
    ast.USub: ("minus", np.negative, 1),
}
_OPERATIONS = FUNCTIONS | {sign: (compute, count) for sign, compute, count in _SIGNS.values()}

#: Largest depth of nested operations in a formula.
MAX_DEPTH = 40

#: Largest constant exponent. A larger exponent overflows, and is probably a typing error.
MAX_POWER = 20

_HINTS = {
    "^": ": a power is written **",
    "=": ": values of parameters stand behind a semicolon: `; k=0.01[-0.1,0.1]`",
    "[": ": the channels of linear light are r, g and b",
    ":": ": it stands behind a name of small letters, digits and hyphens",
}


@dataclass(frozen=True)
class Formula:
    """The function of a one-line effect."""

    #: The formula as the user wrote it.
    text: str
    #: The signal that the formula changes: a key of ``SIGNALS``.
    signal: str
    #: Names of the parameters, in the order of their appearance.
    parameters: tuple[str, ...]
    #: Numbers, names and operations of the stack machine, in postfix order.
    program: tuple[tuple[str, str | float], ...]

    @property
    def __signature__(self) -> Signature:
        """The signature that :func:`inspect.signature` returns."""
        taken = [Argument(name, Argument.POSITIONAL_ONLY) for name in ("signal", "scene")]
        return Signature([*taken, *(Argument(name, Argument.KEYWORD_ONLY) for name in self.parameters)])

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the scene's quantities that the formula reads."""
        names = (str(operand) for kind, operand in self.program if kind == "name")
        return tuple(dict.fromkeys(name for name in names if name != self.signal and name in QUANTITIES))

    def __call__(self, signal: Array, scene: Scene, /, **parameters: float) -> Array:
        """Evaluate the formula; a division by zero or an overflow gives a result that is not finite."""
        stack: list[Array] = []
        with np.errstate(all="ignore"):
            for kind, operand in self.program:
                if kind == "operation":
                    compute, count = _OPERATIONS[str(operand)]
                    stack[-count:] = [compute(*stack[-count:])]
                elif kind == "number":
                    stack.append(np.array(float(operand)))
                else:
                    stack.append(self._value(str(operand), signal, scene, parameters))
            return np.asarray(stack.pop() + np.zeros_like(signal))

    def _value(self, name: str, signal: Array, scene: Scene, parameters: Mapping[str, float]) -> Array:
        if name in parameters:
            return np.array(float(parameters[name]))
        if name == self.signal:
            return signal
        if self.signal == "linear" and name in {"r", "g", "b"}:
            channel = "rgb".index(name)
            return signal[..., channel : channel + 1]
        return QUANTITIES[name][0](scene)


def read_formula(text: str) -> Formula:
    """Parse a formula. Raises LutgenError: the text is outside the grammar, or does not name exactly one signal."""
    odd = re.search(r"[^A-Za-z0-9_+\-*/()., ]", text)
    if odd:
        _outside(text, f"{odd[0]!r} is not allowed{_HINTS.get(odd[0], '')}")
    try:
        tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        _outside(text, "is no formula: a sign, a parenthesis or a name is missing or too many")
    program = tuple(_steps(tree, text, 0))
    names = dict.fromkeys(str(operand) for kind, operand in program if kind == "name")
    signal = _signal(text, names)
    return Formula(text, signal, tuple(name for name in names if name not in {signal, *QUANTITIES}), program)


def _signal(text: str, names: Mapping[str, None]) -> str:
    """Return the signal that the formula changes: `xyz` or `linear` if the formula names it, otherwise `code`."""
    signals = [name for name in ("xyz", "linear") if name in names] or [name for name in ("code",) if name in names]
    if len(signals) != 1:
        why = "names both xyz and linear, which belong to two stages" if signals else "names no signal to change"
        refuse(text, f"{why}. Begin with exactly one of: {', '.join(SIGNALS)}")
    return signals[0]


def _steps(node: ast.expr, text: str, depth: int) -> Iterator[tuple[str, str | float]]:
    """Yield the postfix program of a node."""
    if depth > MAX_DEPTH:
        refuse(text, f"is nested more than {MAX_DEPTH} deep. Write it as a file for --effects")
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            yield "number", number_of(ast.get_source_segment(text, node) or str(number), text)
        case ast.Name(id=name):
            if name in FUNCTIONS or name.startswith("_"):
                _outside(text, f"the name {name!r} stands for no number")
            yield "name", "code" if name == "drive" else name
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            yield from _steps(operand, text, depth + 1)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield from _steps(operand, text, depth + 1)
            yield "operation", "minus"
        case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _SIGNS:
            if isinstance(sign, ast.Pow):
                _check_power(right, text)
            yield from _steps(left, text, depth + 1)
            yield from _steps(right, text, depth + 1)
            yield "operation", _SIGNS[type(sign)][0]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            yield from _call(name, arguments, text, depth)
        case _:
            _outside(text, f"`{ast.unparse(node)}` is not allowed")


def _call(name: str, arguments: list[ast.expr], text: str, depth: int) -> Iterator[tuple[str, str | float]]:
    if name not in FUNCTIONS:
        _outside(text, f"{name!r} is no function")
    count = FUNCTIONS[name][1]
    if len(arguments) != count and not (count == 2 and len(arguments) > 2):
        _outside(text, f"{name} takes {count} argument{'s' * (count > 1)}, not {len(arguments)}")
    for position, argument in enumerate(arguments):
        yield from _steps(argument, text, depth + 1)
        if count == 2 and position:
            yield "operation", name
    if count != 2:
        yield "operation", name


def _check_power(exponent: ast.expr, text: str) -> None:
    inner = exponent.operand if isinstance(exponent, ast.UnaryOp) else exponent
    huge = isinstance(inner, ast.Constant) and isinstance(inner.value, int | float) and abs(inner.value) > MAX_POWER
    tower = isinstance(inner, ast.BinOp) and isinstance(inner.op, ast.Pow)
    if huge or tower:
        refuse(text, f"a power of `{ast.unparse(exponent)}`: numbers up to {MAX_POWER} are allowed there")


def number_of(number: str, text: str) -> float:
    """Return the value of a number in a formula. Raises LutgenError: the text is no number, or not finite."""
    value = cells.number(number, non_finite=True)
    if value is None:
        refuse(text, f"`{number[:40]}` is no number: write digits with a decimal point, such as 1000 or 0.5")
    if not isfinite(value):
        refuse(text, "holds a number that is too large")
    return value


def _outside(text: str, why: str) -> NoReturn:
    refuse(
        text,
        f"{why}. Allowed are one of the signals {', '.join(SIGNALS)}; numbers; + - * / ** and parentheses; the "
        f"functions {', '.join(FUNCTIONS)}; the quantities {', '.join(QUANTITIES)}; and names of parameters",
    )


def refuse(text: str, why: str) -> NoReturn:
    """Raise a LutgenError with the reason why a formula is refused."""
    excerpt = text if len(text) <= 60 else f"{text[:57]}…"
    raise LutgenError(f"expression {excerpt!r}: {why}.")
