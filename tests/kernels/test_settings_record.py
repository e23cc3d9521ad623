"""Settings reach kernels by name, whatever they are made of."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from numba import njit

from drake_navbench.kernels.settings_record import settings_record


class Inner(NamedTuple):
    is_on: bool
    count: int


def record(*inner, speed=0.75):
    return settings_record({"inner": Inner(*inner), "speed": speed})


@njit
def twice_the_speed_if_on(records):
    settings = records[0]
    return settings.speed * settings.inner.count if settings.inner.is_on else 0.0


def test_a_kernel_reads_a_record_by_the_names_of_its_values():
    assert twice_the_speed_if_on(record(True, 2)) == 1.5
    assert twice_the_speed_if_on(record(False, 2)) == 0.0


def test_other_values_need_no_other_kernel():
    before = len(twice_the_speed_if_on.signatures)
    twice_the_speed_if_on(record(True, 5, speed=-3.0))
    assert len(twice_the_speed_if_on.signatures) == max(before, 1)


def test_equal_settings_share_one_type_which_kernels_know_at_once():
    first, second = (record(True, n) for n in (2, 3))
    assert first.dtype is second.dtype


def test_a_record_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        record(True, 2)["speed"] = 1.0
