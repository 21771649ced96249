"""Standard errors of parameters: 95 % of the intervals contain the true value."""

from __future__ import annotations

import numpy as np
import pytest

from tests import interval_coverage
from tests.quick import mostly_slow

pytestmark = pytest.mark.numbers


@pytest.mark.parametrize("case", mostly_slow(["a leak", "an offset and coupled channels"], "a leak"))
def test_standard_errors_are_as_large_as_the_errors(case: str) -> None:
    off = [trial.off for number in range(6) for trial in interval_coverage.trials(case, [11, number])]
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


@pytest.mark.slow
@pytest.mark.rare(instead="test_standard_errors_are_as_large_as_the_errors")
def test_intervals_hold_the_true_value_in_nineteen_of_twenty_cases() -> None:
    assert interval_coverage.main(["--seed", "3", "--repeats", "4"]) == 0
