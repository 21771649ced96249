"""The law of time: linear between measured times, with an error that covers a parabola."""

from __future__ import annotations

import numpy as np
import pytest

from lutgen.time_law import LEAST, LEAST_ERROR, between, error_between

pytestmark = pytest.mark.numbers

TIMES = np.array([0.0, 1000.0, 1500.0, 9000.0])


def test_values_are_those_of_numpys_interpolation() -> None:
    values = np.random.default_rng(1).random((4, 4, 3))
    for when in (0.0, 10.0, 1000.0, 1499.0, 5000.0, 9000.0):
        expected = [[np.interp(when, TIMES, values[:, row, column]) for column in range(3)] for row in range(4)]
        assert between(TIMES, values, when) == pytest.approx(np.array(expected), rel=1e-12)


def test_at_a_measured_time_the_value_is_the_measured_one_to_the_last_bit() -> None:
    values = np.random.default_rng(2).random((4, 2))
    assert [between(TIMES, values, when).tolist() for when in TIMES] == values.tolist()


def test_the_error_of_a_parabola_is_its_greatest_distance_from_the_line_between_equidistant_times() -> None:
    times = np.array([0.0, 2.0, 4.0])
    distance = abs(1.0**2 - between(times, times**2, 1.0))
    assert error_between(times, times**2, 1.0) == pytest.approx(distance)


@pytest.mark.parametrize("times", [TIMES, TIMES[:2]])
def test_a_straight_course_is_known_to_a_share_of_its_value(times: np.ndarray) -> None:
    values = 100.0 - times / 1000.0
    assert error_between(times, values, 700.0) == pytest.approx(LEAST_ERROR * 99.3 + LEAST)
