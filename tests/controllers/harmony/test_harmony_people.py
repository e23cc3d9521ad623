"""harmony and somebody who walks into it, on a map that keeps no place that was left."""

from __future__ import annotations

import math

import pytest
from harmony_person import AT_REST_MPS, SPEED_MPS, speed_at_contact


@pytest.mark.parametrize("bearing_deg", [0, 45, 90])
def test_who_walks_into_a_robot_that_tracks_them_meets_it_at_rest(bearing_deg):
    speed_mps = speed_at_contact(math.radians(bearing_deg), 1.0, track_moving=True)
    assert speed_mps is not None
    assert speed_mps <= AT_REST_MPS


def test_without_tracking_they_meet_it_under_way():
    assert speed_at_contact(math.pi / 4, 1.0) > 0.5 * SPEED_MPS
