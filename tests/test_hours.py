"""``--hours``: the meaning of each form, and refused forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.display import Tips, hour_name
from lutgen.display.tips import MAX_HOURS, parse_hours
from lutgen.errors import LutgenError

pytestmark = pytest.mark.numbers

#: Measured hours at uneven intervals, some of them not whole.
MEASURED = [0.0, 562.5, 1000.0, 10_000.0, 18_000.0]


@pytest.fixture(scope="module")
def tips() -> Tips:
    four = [[0.3127, 0.329, 250.0], [0.64, 0.33, 54.0], [0.30, 0.60, 180.0], [0.15, 0.06, 18.0]]
    return Tips(np.array(MEASURED), np.array([four] * 5), source="display.csv")


@pytest.mark.parametrize(
    ("text", "hours"),
    [
        ("0..18000", MEASURED),
        ("0 .. 18000", MEASURED),
        ("500..10000", [500, 562.5, 1000, 10_000]),
        ("562.5..1000", [562.5, 1000]),
        ("1..2", [1, 2]),
        ("0..0", [0]),
        ("18000..18000", [18_000]),
        ("0..18000:6000", [0, 6000, 12_000, 18_000]),
        ("0..18000:7000", [0, 7000, 14_000]),
        ("0..1:0.25", [0, 0.25, 0.5, 0.75, 1]),
        ("0..0.3:0.1", [0, 0.1, 0.2, 0.3]),
        ("100..200:1000", [100]),
        ("0..18000:18000", [0, 18_000]),
        ("0", [0]),
        ("10000", [10_000]),
        ("562.5", [562.5]),
        ("0,5000,10000", [0, 5000, 10_000]),
        ("10000,0,5000", [0, 5000, 10_000]),
        ("0, 5000 ,10000", [0, 5000, 10_000]),
        ("5000,5000.0,5e3,05000", [5000]),
        ("1e3", [1000]),
        ("1.8e4", [18_000]),
        ("-0", [0]),
        ("0.0000004", [0]),
        ("0.000001,0.0000014", [0.000001]),
    ],
)
def test_hours_are_what_they_say(text: str, hours: list[float], tips: Tips) -> None:
    assert parse_hours(text, tips) == hours


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not a number"),
        (" ", "not a number"),
        (",", "not a number"),
        ("0,", "not a number"),
        ("0,,5", "not a number"),
        ("ten", "'ten' is not a number"),
        ("10000h", "not a number"),
        ("0..", "not a number"),
        ("..18000", "not a number"),
        ("..", "not a number"),
        ("0...18000", "not a number"),
        ("0..10..20", "not a number"),
        ("0..18000:", "not a number"),
        ("0..18000:100:2", "not a number"),
        ("0:100", "not a number"),
        ("0-18000", "not a number"),
        ("0..18000,500", "not a number"),
        ("0;5000", "not a number"),
        ("0,5;1", "not a number"),
        ("nan", "not a finite number"),
        ("inf", "not a finite number"),
        ("0..inf", "not a finite number"),
        ("0..18000:nan", "not a finite number"),
        ("sNaN", "not a number"),
        ("-1", "not a finite number of hours from 0 on"),
        ("-5..10", "from 0 on"),
        ("0..18000:0", "a step of 0 does not advance"),
        ("0..18000:0.0000001", "does not advance"),
        ("0..18000:-500", "from 0 on"),
        ("18000..0", "backwards. Write 0..18000"),
        ("18000..0:500", "backwards"),
        ("20000", "outside the measured span 0..18000 h of display.csv"),
        ("0..20000", "outside the measured span"),
        ("0..20000:500", "outside the measured span"),
        ("18000.1", "hour 18000.1 is outside the measured span"),
        ("18000.0625", "hour 18000.0625 is outside the measured span 0..18000 h"),
        ("1000000000", "outside the measured span"),
        ("0..1000000000", "outside the measured span"),
        ("1e400", "outside the measured span"),
        ("1e999999999", "outside the measured span"),
        ("0..1e30:1", "outside the measured span"),
        ("0..18000:0.001", "more than 10000"),
        ("0..18000:0.000001", "more than 10000"),
    ],
)
def test_other_hours_are_refused_in_one_sentence(text: str, says: str, tips: Tips) -> None:
    with pytest.raises(LutgenError) as error:
        parse_hours(text, tips)
    message = str(error.value)
    assert says in message
    assert "\n" not in message


def test_a_list_of_too_many_hours_is_refused(tips: Tips) -> None:
    with pytest.raises(LutgenError, match="more than 10000"):
        parse_hours(",".join(map(str, range(MAX_HOURS + 1))), tips)
    assert len(parse_hours(",".join(map(str, range(MAX_HOURS))), tips)) == MAX_HOURS


@given(st.text(alphabet="0123456789.,:e-+_ inf", max_size=20) | st.text(max_size=20))
def test_any_text_gives_hours_in_the_span_in_order_or_is_refused(text: str) -> None:
    four = [[0.3127, 0.329, 250.0], [0.64, 0.33, 54.0], [0.30, 0.60, 180.0], [0.15, 0.06, 18.0]]
    display = Tips(np.array(MEASURED), np.array([four] * 5), source="display.csv")
    try:
        hours = parse_hours(text, display)
    except LutgenError:
        return
    assert hours
    assert hours == sorted(set(hours))
    assert 0 <= hours[0] <= hours[-1] <= 18_000


@given(st.lists(st.floats(0, 18_000), min_size=1, max_size=50))
def test_different_hours_never_share_a_folder(hours: list[float]) -> None:
    four = [[0.3127, 0.329, 250.0], [0.64, 0.33, 54.0], [0.30, 0.60, 180.0], [0.15, 0.06, 18.0]]
    display = Tips(np.array(MEASURED), np.array([four] * 5), source="display.csv")
    parsed = parse_hours(",".join(map(repr, hours)), display)
    names = [hour_name(hour) for hour in parsed]
    assert len(set(names)) == len(parsed)
    for name, hour in zip(names, parsed, strict=True):
        assert float(name.removesuffix("h")) == hour


@pytest.mark.parametrize(
    ("hours", "name"),
    [(0, "0h"), (10_000, "10000h"), (562.5, "562.5h"), (0.000001, "0.000001h"), (18_000.0, "18000h"), (100, "100h")],
)
def test_an_hour_has_one_name(hours: float, name: str) -> None:
    assert hour_name(hours) == name
