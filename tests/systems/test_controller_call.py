"""The check of the values that a controller leaves for the log."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.logs.log import as_json
from drake_navbench.trial.systems.controller_call import (
    MAX_NOTE_LENGTH,
    _is_short,
    require_loggable,
)

# As long as JSON can make them: 24 letters a number, 12 a letter that takes two codes.
LONGEST = {
    "a": -2.2250738585072014e-308,
    "b": math.inf,
    "c": False,
    "d": None,
    "e" * 50: "\x00" * 50,
    "\U0001f600" * 3: "\U0001f600" * 3,
}


def test_values_that_are_taken_without_writing_them_are_as_short_as_they_are_taken_for():
    for count in (1, 300):
        values = {f"{k}{key}": value for k in range(count) for key, value in LONGEST.items()}
        assert _is_short(values) == (count == 1)
        assert len(as_json(values)) <= MAX_NOTE_LENGTH or count > 1


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"text": "x" * MAX_NOTE_LENGTH}, "characters of JSON"),
        ({f"key {k}": 1.0 for k in range(10_000)}, "characters of JSON"),
        ({1: 2.0}, "expected text as keys"),
        ({"a": object()}, "got object"),
        ({"a": [1.0, {2.0}]}, "got set"),
        ({"a": np.array([object()])}, "expected numbers or text"),
        ([1.0], "expected a mapping"),
    ],
)
def test_values_that_no_log_can_hold_are_refused(values, told):
    with pytest.raises((TypeError, ValueError), match=told):
        require_loggable("diagnostics", values)


@pytest.mark.parametrize(
    "values", [{}, LONGEST, {"n": 3, "x": np.float64(1.0), "a": np.zeros(3), "l": [1, "b"]}]
)
def test_values_that_a_log_can_hold_are_taken(values):
    require_loggable("diagnostics", values)
