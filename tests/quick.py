"""A few cases of a slow table, and a few draws of a property, for ``make test``; ``--everything`` runs all."""

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

#: Draws of a property with ``--everything``, and without it.
DRAWS, FEWER_DRAWS = 100, 25


def draws(most: int, **options: Any) -> settings:
    """Return the settings of a property that is drawn ``most`` times with ``--everything``, else a quarter of that."""
    share = settings().max_examples / DRAWS
    return settings(max_examples=round(most * share), **options)


def mostly_slow(cases: Iterable[Any], *quick: object) -> list[Any]:
    """Mark all cases slow except the named cases; a case is named by its name or by its first value."""
    tuples = [case if isinstance(case, tuple) else (case,) for case in cases]
    assert {*quick} <= {case[0] for case in tuples}
    return [pytest.param(*case, marks=() if case[0] in quick else pytest.mark.slow) for case in tuples]
