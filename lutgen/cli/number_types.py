"""Types of options that are numbers: digits 0 to 9, read by :mod:`lutgen.cells`.

click's own take what ``float`` and ``int`` take: ``1_000``, full-width digits, and ``nan``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from lutgen.cells import number, whole

if TYPE_CHECKING:
    from collections.abc import Callable

#: Whole numbers of options are far smaller.
_MOST = 10**15


class _Number(click.types.FloatParamType):
    """A finite number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read an option."""
        return super().convert(_read(self, value, _number, param, ctx), param, ctx)


class _Whole(click.types.IntParamType):
    """A whole number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read an option."""
        return super().convert(_read(self, value, _whole, param, ctx), param, ctx)


class WholeFrom(click.IntRange):
    """A whole number from ``min`` on."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read an option."""
        return super().convert(_read(self, value, _whole, param, ctx), param, ctx)


class NumberFrom(click.FloatRange):
    """A finite number from ``min`` on."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read an option."""
        return super().convert(_read(self, value, _number, param, ctx), param, ctx)


NUMBER, WHOLE = _Number(), _Whole()


def _number(text: str) -> float | None:
    return number(text)


def _whole(text: str) -> int | None:
    return whole(text, least=-_MOST, most=_MOST)


def _read(
    kind: click.ParamType[Any],
    value: Any,
    read: Callable[[str], float | None],
    param: click.Parameter | None,
    ctx: click.Context | None,
) -> Any:
    if not isinstance(value, str):  # a default
        return value
    parsed = read(value)
    if parsed is None:
        what = "a whole number, such as 8" if read is _whole else "a finite number, such as 8 or 0.5"
        kind.fail(f"{value[:40]!r} is not {what}, in digits 0 to 9.", param, ctx)
    return parsed
