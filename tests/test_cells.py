"""Numbers as text: Python's ``float`` and ``int`` define plain numbers; the tests list the additional refusals."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.cells import NUMBER, number, whole

pytestmark = pytest.mark.numbers

PLAIN = ("0", "-1", "+1.5", ".5", "2.", "1e3", "1E-3", " 7 ", "\t7\r\n", "007", "1e-400", "1" * 300)
NO_NUMBERS = (
    "", " ", ".", "-", "e3", "1e", "1e+", "1.2.3", "1,5", "0;75", "1'000", "1/2", "1_000", "0x10", "1d0", "1.5f", "50%",
    "--1", "1 2", "１", "٣", "1\u00a0", "\u20031", "1\0", "#N/A", "nan(1)", "1.#QNAN", "one", "1" * 5000,
)  # fmt: skip


@pytest.mark.parametrize("text", PLAIN)
def test_a_plain_number_is_what_python_reads(text: str) -> None:
    assert number(text) == float(text)
    assert re.fullmatch(NUMBER, text.strip())


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_what_other_programs_read_otherwise_is_no_number(text: str) -> None:
    assert number(text) is None
    assert number(text, non_finite=True) is None
    assert whole(text, least=-(10**9), most=10**9) is None


@pytest.mark.parametrize("text", ["nan", "NaN", "-inf", "+Infinity", "1e999", "-1e999"])
def test_a_value_that_is_not_finite_is_taken_only_where_it_is_asked_for(text: str) -> None:
    assert number(text) is None
    value = number(text, non_finite=True)
    assert value is not None
    assert not math.isfinite(value)


@pytest.mark.parametrize(
    ("text", "value"),
    [("5", 5), ("+5", 5), ("-5", -5), (" 10 ", 10), ("0", 0), ("-0", 0), ("0" * 5000 + "7", 7), ("-10", -10)],
)
def test_a_whole_number_within_its_limits_is_taken(text: str, value: int) -> None:
    assert whole(text, least=-10, most=10) == value


@pytest.mark.parametrize("text", ["11", "-11", "100", "9" * 5000, "-" + "9" * 5000, "1.0", "1e0", "0x1", "nan"])
def test_a_whole_number_beyond_its_limits_is_none_without_an_error(text: str) -> None:
    assert whole(text, least=-10, most=10) is None


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_double_is_read_back(value: float) -> None:
    assert number(repr(value)) == value
    assert number(f"{value:.17e}") == value


@given(st.text(max_size=12))
def test_what_is_taken_is_ascii_and_pythons_number(text: str) -> None:
    value = number(text)
    if value is not None:
        assert text.isascii()
        assert value == float(text)


@given(st.integers(), st.integers(), st.integers())
def test_whole_agrees_with_python(value: int, one: int, other: int) -> None:
    least, most = sorted((one, other))
    assert whole(str(value), least=least, most=most) == (value if least <= value <= most else None)
