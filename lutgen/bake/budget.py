"""What a file may err: its budget, and the certificate that it was built with."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from lutgen.bake.expected import SLACK
from lutgen.bake.figures import MAX_DELTA_E, P99
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.bake.fidelity import Certificate
    from lutgen.bake.manifest import FileRecord


@dataclass(frozen=True)
class Budget:
    """Largest ΔE2000 allowed over the smooth colours, and its 99 % quantile.

    None: ``MAX_DELTA_E`` and ``P99``, or what the file was certified to err, where that is more.
    """

    max_delta_e: float | None = None
    p99: float | None = None

    def __post_init__(self) -> None:
        """Raise LutgenError for a limit that is no finite number from 0 on."""
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
    """Say where a certificate is over the budget, or worse than the one that a file's record has."""
    problems = []
    max_delta_e, p99 = budget.limits(record)
    for figure, limit, option in (("max", max_delta_e, "--max-delta-e"), ("p99", p99, "--p99")):
        value = getattr(certificate.smooth, figure)
        if value > limit:
            problems.append(f"fidelity: smooth ΔE2000 {figure} is {value:.4f}, over the budget of {limit:g} ({option})")
    for group, before in ((record.certificate if record else None) or {}).items():
        now = certificate.groups().get(group)
        if isinstance(before, dict) and now is not None:
            figures = [(name, getattr(now, name), _figure(before, name)) for name in ("mean", "p99", "max")]
            if any(value > limit + SLACK for _, value, limit in figures):
                texts = [f"{name} {value:.4f} (certified {limit:.4f})" for name, value, limit in figures]
                problems.append(f"fidelity: {group} ΔE2000 is worse than certified: {', '.join(texts)}")
    return problems


def _figure(group: Mapping[str, Any], name: str) -> float:
    value = group.get(name)
    return float(value) if isinstance(value, int | float) else 0.0
