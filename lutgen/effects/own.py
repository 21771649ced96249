"""Users' own effects: from a Python file, an installed package, or a one-line expression.

lutgen imports the effects into this process, like plug-ins: a file runs with the rights of the user, without limits of
time or memory. ``lutgen effects --check`` checks a file that is not trusted yet; see :mod:`lutgen.effects.child`.

A file declares effects with the same decorator as the built-in effects. Users name the file by its path::

    lutgen effects --effects my_effect.py

A package lists modules, or single effects, as entry points of the group ``lutgen.effects``. For expressions see
:mod:`lutgen.effects.expression`.
"""

import ast
import hashlib
import sys
from collections.abc import Iterable
from contextlib import redirect_stdout
from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType

from lutgen.effects import catalogue
from lutgen.effects.declare import BUILT_IN, CODE, Effect, chain_order
from lutgen.errors import LutgenError, in_one_line, pick_one
from lutgen.files import read_at_most

#: Group of the entry points. Each entry point is a module that declares effects, or an effect.
GROUP = "lutgen.effects"

#: Largest size of a file of effects, which a person writes by hand.
MAX_BYTES = 4_000_000

#: Prefix of the module names of users' files. A hash of path and content follows.
_PRIVATE = "lutgen_own_"


def everything(files: Iterable[str | Path] = (), expressions: Iterable[str] = ()) -> dict[str, Effect]:
    """Return all effects by name, in chain order: built-in, installed, from files and from expressions.

    ``files``, ``expressions``: the values of ``--effects`` and ``--add-expr``.

    Raises LutgenError: a file, package or expression is refused, or two effects have the same name.
    """
    from lutgen.effects.expression import parse

    effects = dict(catalogue())
    for each in (*installed(), *(each for path in files for each in load_file(path)), *map(parse, expressions)):
        if each.name in effects and effects[each.name].origin != each.origin:
            raise LutgenError(
                f"two effects are named {each.name!r}: of {effects[each.name].origin} and of {each.origin}. Rename "
                f"one: a file's effect by its function, an expression by `another-name: …` before it."
            )
        effects[each.name] = each
    return {each.name: each for each in sorted(effects.values(), key=chain_order)}


def load_file(path: str | Path) -> tuple[Effect, ...]:
    """Import a Python file and return the effects that it declares, in chain order.

    ``path``, unchanged, becomes the ``origin`` of the effects.

    Raises LutgenError: the file is missing, is no Python, raises an exception, or declares no effect; a declaration is
    refused, or an effect has the name of a built-in one.
    """
    name = _module_name(path)
    module = sys.modules.get(name) or _run(name, path)
    effects = {name: value for name, value in vars(module).items() if isinstance(value, Effect)}
    # Effects that the module imports are not its own.
    declared = {name: each for name, each in effects.items() if each.function.__module__ == module.__name__}
    refused = [each.name for each in declared.values() if each.name in catalogue()]
    if refused or not declared:
        del sys.modules[module.__name__]
    if refused:
        raise LutgenError(f"{path}: {refused[0]!r} is a built-in effect. Rename the function.")
    if not declared:
        raise LutgenError(
            f"{path}: declares no effect. Put the decorator `@effect(stage=…, …)` of lutgen.effects on a function."
        )
    for attribute, each in declared.items():
        # If a file declares several effects, each function's docstring describes its effect.
        text = (len(declared) > 1 and each.function.__doc__) or each.text
        setattr(module, attribute, replace(each, origin=str(path), text=text))
    return tuple(sorted((getattr(module, attribute) for attribute in declared), key=chain_order))


def installed() -> tuple[Effect, ...]:
    """Load the effects of installed packages. Raises LutgenError: an entry point cannot be loaded, or is no effect."""
    effects = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: (_distribution(point), point.name)):
        for each in _effects_of(point):
            if each.name in catalogue():
                raise LutgenError(f"{_whose(point)}: {each.name!r} is a built-in effect. Ask its authors to rename it.")
            effects[each.name] = replace(each, origin=_distribution(point))
    return tuple(sorted(effects.values(), key=chain_order))


def recall(name: str, origin: str) -> Effect:
    """Return an effect by name and origin, as model files and workers store them. Raises LutgenError: not found."""
    from lutgen.effects.expression import parse

    if origin == BUILT_IN:
        known: dict[str, Effect] = catalogue()
    elif origin.startswith(CODE):
        raise LutgenError(
            f"effect {name!r} was declared by a running program ({origin}). Put it into a file of its own."
        )
    elif origin.endswith(".py"):
        known = {each.name: each for each in load_file(origin)}
    else:
        packages = {each.name: each for each in installed() if each.origin.split()[:1] == origin.split()[:1]}
        known = packages or {each.name: each for each in (parse(origin),)}
    if name not in known:
        unknown = pick_one("effect", name, known)
        raise unknown if origin == BUILT_IN else LutgenError(f"{origin}: {unknown}")
    return known[name]


def _module_name(path: str | Path) -> str:
    """Return a module name from the file's path and content, so that another version of the file is another module."""
    if Path(path).suffix != ".py":
        raise LutgenError(f"{path}: effects are read from Python files. Give a name that ends in .py.")
    data = read_at_most(Path(path), MAX_BYTES, what="the effects", none="file of effects")
    try:
        ast.parse(data, str(path))
    except SyntaxError as error:
        raise LutgenError(f"{path}: line {error.lineno}: not Python: {error.msg}.") from None
    except (ValueError, MemoryError, RecursionError) as error:
        raise LutgenError(f"{path}: not Python: {error}.") from None
    return _PRIVATE + hashlib.sha256(str(Path(path).resolve()).encode() + data).hexdigest()[:16]


def _run(name: str, path: str | Path) -> ModuleType:
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # the decorator reads the module's docstring in sys.modules
    try:
        code = compile(Path(path).read_bytes(), str(path), "exec", dont_inherit=True)
        with redirect_stdout(sys.stderr):  # the file's output must not enter lutgen's JSON
            exec(code, vars(module))  # noqa: S102 - a plug-in runs with the rights of the user
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, KeyboardInterrupt):
            raise
        reason = what_was_raised(error, str(path))
        if not isinstance(error, LutgenError):
            reason = f"cannot be loaded: {reason}. Run it with Python to see more."
        raise LutgenError(f"{path}: {reason}") from None
    return module


def what_was_raised(error: BaseException, file: str) -> str:
    """Return the type and the message of an exception, and the line of ``file`` that raised it."""
    line, trace = 0, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    message = in_one_line(error)
    kind = "" if isinstance(error, LutgenError) else type(error).__name__
    return f"line {line}: {': '.join(part for part in (kind, message) if part)}" if line else f"{kind}: {message}"


def _effects_of(point: EntryPoint) -> tuple[Effect, ...]:
    try:
        loaded = point.load()
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        raise LutgenError(
            f"{_whose(point)}: {what_was_raised(error, '')}. Update, mend or uninstall the package."
        ) from None
    values = (loaded,) if isinstance(loaded, Effect) else vars(loaded).values() if hasattr(loaded, "__dict__") else ()
    effects = tuple(value for value in values if isinstance(value, Effect) and value.origin != BUILT_IN)
    if not effects:
        raise LutgenError(f"{_whose(point)}: {point.value} holds no effect. Update, mend or uninstall the package.")
    return effects


def _distribution(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else point.value


def _whose(point: EntryPoint) -> str:
    return f"installed package {_distribution(point)}, entry point {point.name!r} of {GROUP}"
