"""A few cases of a slow table for ``make test``; ``make test-all`` runs the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable


def mostly_slow(cases: Iterable[Any], *quick: object) -> list[Any]:
    """Mark all cases slow except the named cases; a case is named by its name or by its first value."""
    given = [case if isinstance(case, tuple) else (case,) for case in cases]
    assert {*quick} <= {case[0] for case in given}
    return [pytest.param(*case, marks=() if case[0] in quick else pytest.mark.slow) for case in given]
