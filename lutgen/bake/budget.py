"""Limits for the errors of files, and where a file exceeds its limits or is worse than its certificate."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from lutgen.bake.figures import MAX_DELTA_E, P99, SLACK
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.bake.fidelity import Certificate
    from lutgen.bake.manifest import FileRecord


@dataclass(frozen=True)
class Budget:
    """Limits for the largest ΔE2000 of the smooth colours, and for its 99 % quantile.

    None: ``MAX_DELTA_E`` and ``P99``, or the certified figure of the file if that is larger.
    """

    max_delta_e: float | None = None
    p99: float | None = None

    def __post_init__(self) -> None:
        """Raise LutgenError for a limit that is not finite or is negative."""
        for option, limit in (("--max-delta-e", self.max_delta_e), ("--p99", self.p99)):
            if limit is not None and not 0 <= limit < inf:
                raise LutgenError(f"{option} {limit:g}: a colour difference ΔE2000 from 0 on, such as 0.1.")

    def limits(self, record: FileRecord | None) -> tuple[float, float]:
        """Return the limits for a file: largest ΔE2000 and 99 % quantile."""
        smooth = ((record.certificate if record else None) or {}).get("smooth")
        certified = smooth if isinstance(smooth, dict) else {}
        return (
            max(MAX_DELTA_E, _figure(certified, "max") + SLACK) if self.max_delta_e is None else self.max_delta_e,
            max(P99, _figure(certified, "p99") + SLACK) if self.p99 is None else self.p99,
        )


def over_budget(certificate: Certificate, record: FileRecord | None, budget: Budget) -> list[str]:
    """Describe where a certificate exceeds the budget, or is worse than the certificate in the file's record."""
    problems = []
    max_delta_e, p99 = budget.limits(record)
    for figure, limit, option in (("max", max_delta_e, "--max-delta-e"), ("p99", p99, "--p99")):
        value = getattr(certificate.smooth, figure)
        if value > limit:
            problems.append(f"fidelity: smooth ΔE2000 {figure} is {value:.4f}, over the budget of {limit:g} ({option})")
    for group, before in ((record.certificate if record else None) or {}).items():
        now = certificate.groups().get(group)
        if isinstance(before, dict) and now is not None:
            compared = [(name, getattr(now, name), _figure(before, name)) for name in ("mean", "p99", "max")]
            if any(value > limit + SLACK for _, value, limit in compared):
                texts = [f"{name} {value:.4f} (certified {limit:.4f})" for name, value, limit in compared]
                problems.append(f"fidelity: {group} ΔE2000 is worse than certified: {', '.join(texts)}")
    return problems


def _figure(group: Mapping[str, Any], name: str) -> float:
    value = group.get(name)
    return float(value) if isinstance(value, int | float) else 0.0
