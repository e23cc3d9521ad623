"""harmony and somebody who walks into it: what is stated of still maps is not stated of people."""

from __future__ import annotations

import math

import pytest
from harmony_person import SPEED_MPS, speed_at_contact


@pytest.mark.parametrize("walking_mps", [0.7, 1.0, 1.4])
def test_who_walks_into_the_robot_from_ahead_meets_it_all_but_at_rest(walking_mps):
    assert speed_at_contact(0.0, walking_mps) < 0.1 * SPEED_MPS


def test_who_walks_into_it_from_45_degrees_off_may_meet_it_under_way():
    assert speed_at_contact(math.pi / 4, 1.0) > 0.5 * SPEED_MPS
