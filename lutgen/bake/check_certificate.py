"""A certificate of a manifest against a new one of the same file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

#: A file may differ from its own certificate by this much: OpenColorIO 2.1 and 2.6 differ by up to 0.003 on one file.
SLACK = 0.005


def otherwise_certified(said: Mapping[str, Any] | None, now: Mapping[str, Any]) -> list[str]:
    """Return what a certificate says otherwise than a new one, in sentences; worse figures are told elsewhere."""
    if not isinstance(said, dict):
        return ["there is no certificate"]
    before, after = dict(_figures(said)), dict(_figures(now))
    problems = [f"its certificate lacks {name}" for name in after if name not in before]
    problems += [f"its certificate has {name}, which no certificate has" for name in before if name not in after]
    for name, value in after.items():
        claimed = before.get(name, value)
        if not _alike(claimed, value):
            problems.append(f"its certificate says {name} {claimed!r}, and it is {value!r}")
    return problems


def _figures(content: Mapping[str, Any], head: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _figures(value, f"{head}{key} ")
        else:
            yield f"{head}{key}", value


def _alike(said: Any, now: Any) -> bool:
    if isinstance(said, bool) or not isinstance(said, int | float) or not isinstance(now, int | float):
        return bool(said == now)
    # Counts of colours: rounding may move one in a thousand over a border.
    return abs(said - now) <= max(SLACK, 1e-3 * abs(now) if isinstance(now, int) else 0.0)
