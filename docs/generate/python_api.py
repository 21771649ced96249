"""reference/python.md: the names that ``lutgen`` and ``lutgen.effects`` export, from their docstrings."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import Any

from docs.generate.markup import anchor, docstring, inline, page, table

#: The packages with a stable interface; all other names may change without notice.
PUBLIC = ("lutgen", "lutgen.effects")


def pages() -> dict[str, str]:
    """Return path below docs/reference → text."""
    intro = (
        "What these packages export is the interface: it changes only as the changelog says. Arrays are of numpy; "
        "shapes and units stand with each name. Bad input raises `LutgenError`, whose text says what is wrong, where, "
        "what is allowed and what to do."
    )
    parts = [intro]
    for package in PUBLIC:
        module = import_module(package)
        names = sorted(name for name in module.__all__ if not name.startswith("__"))
        values = {name: _called(getattr(module, name)) for name in names}
        rows = [
            (f"[`{name}`](#{anchor(_title(package, name, value))})", _summary(value)) for name, value in values.items()
        ]
        parts += [f"## {package}", docstring(module.__doc__), table(("name", "what it is"), rows)]
        parts += [_entry(package, name, value) for name, value in values.items()]
    return {"python.md": page("Python API", *parts)}


def _called(value: Any) -> Any:
    """Return the function of a package that can be called; other values unchanged."""
    return type(value).__call__ if inspect.ismodule(value) else value


def _title(package: str, name: str, value: Any) -> str:
    """Return a unique heading, also when upper and lower case are ignored: there are an Effect and an effect()."""
    return f"{'class ' if inspect.isclass(value) else ''}{package}.{name}"


def _summary(value: Any) -> str:
    text = inspect.getdoc(value) if callable(value) else _is(value)
    return inline((text or "").partition("\n\n")[0].replace("\n", " "))


def _is(value: Any) -> str:
    return f"A {type(value).__name__}: {', '.join(f'`{key}`' for key in value)}."


def _entry(package: str, name: str, value: Any) -> str:
    head = f"### {_title(package, name, value)}"
    if not callable(value):
        return f"{head}\n\n{_is(value)}"
    parts = [head, _signature(name, value), docstring(inspect.getdoc(value))]
    if inspect.isclass(value):
        parts += [_method(each, member) for each, member in vars(value).items() if _is_public(each, member)]
    return "\n\n".join(parts)


def _is_public(name: str, member: Any) -> bool:
    wrapped = member.__func__ if isinstance(member, classmethod | staticmethod) else member
    return not name.startswith("_") and (inspect.isfunction(wrapped) or isinstance(wrapped, property))


def _method(name: str, member: Any) -> str:
    if isinstance(member, property):
        return f"#### {name}\n\n{docstring(inspect.getdoc(member))}"
    signature = _signature(name, getattr(member, "__func__", member))
    return f"#### {name}()\n\n{signature}\n\n{docstring(inspect.getdoc(member))}"


def _signature(name: str, value: Any) -> str:
    """Return a signature as in the code; a long signature has one line per parameter."""
    try:
        signature = inspect.signature(value)
    except ValueError:  # for example of an exception without its own signature
        return f"```python\n{name}(...)\n```"
    plain = [str(parameter) for parameter in _plain(signature).parameters.values()]
    end = f" -> {_words(signature.return_annotation)}" if signature.return_annotation is not signature.empty else ""
    kinds = [parameter.kind for parameter in signature.parameters.values()]
    if inspect.Parameter.KEYWORD_ONLY in kinds:
        plain.insert(kinds.index(inspect.Parameter.KEYWORD_ONLY), "*")
    line = f"{name}({', '.join(plain)}){end}"
    if len(line) > 100:
        line = f"{name}(\n" + "".join(f"    {each},\n" for each in plain) + f"){end}"
    return f"```python\n{line}\n```"


def _plain(signature: inspect.Signature) -> inspect.Signature:
    """Return the signature with annotations as written in the code, and without defaults that print an address."""
    parameters = []
    for each in signature.parameters.values():
        annotation = each.empty if each.annotation is each.empty else _Written(_words(each.annotation))
        parameters.append(each.replace(annotation=annotation, default=_default(each.default)))
    return signature.replace(parameters=parameters)


class _Written:
    """Text that prints without quotes."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def _words(annotation: Any) -> str:
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))


def _default(default: Any) -> Any:
    simple = default is inspect.Parameter.empty or " at 0x" not in repr(default)
    return default if simple and "<factory>" not in repr(default) else _Written("...")
