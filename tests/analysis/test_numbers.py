"""Numbers are written for a reader."""

import pytest

from drake_navbench.analysis.html import relative_change
from drake_navbench.analysis.numbers import number, short_number


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (3e-17, "0"),
        (14.5123, "14.51"),
        (99.99996, "100.0"),
        (-0.99999, "-1.000"),
        (0.012345, "0.01235"),
        (3.2e-7, "3.200e-07"),
        (12345.6, "12346"),
        (float("nan"), "–"),
        (None, "–"),
    ],
)
def test_numbers_have_four_digits_and_nan_is_no_number(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12345.6, "12\u202f300"),
        (1234.0, "1\u202f230"),
        (999.4, "999"),
        (0.1, "0.100"),
        (float("nan"), "–"),
        (float("-inf"), "–"),
        (None, "–"),
    ],
)
def test_numbers_in_the_page_have_three_digits_and_thousands_apart(value, text):
    assert short_number(value) == text


@pytest.mark.parametrize(
    ("ratio", "text"),
    [
        (0.73, "+73%"),
        (-0.123, "-12%"),
        (0.0042, "+0.4%"),
        (-0.0042, "-0.4%"),
        (0.0004, "0%"),
        (-0.0004, "0%"),
        (0.0, "0%"),
        (-1.0, "-100%"),
    ],
)
def test_small_changes_have_a_decimal_and_none_has_no_sign(ratio, text):
    assert relative_change(ratio) == text
