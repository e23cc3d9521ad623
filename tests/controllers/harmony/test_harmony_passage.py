"""Whether the map has a way past, and where plans aim at."""

from __future__ import annotations

import numpy as np
import pytest
from harmony_scenes import DISCS, costmap_with, straight

from drake_navbench.controllers.harmony.detour import is_connected
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.way import (
    driving_on,
    progress_on,
    turn_at,
    up_to_blocked,
    way_along,
)
from drake_navbench.kernels.distance_field import distance_field

HERE, THERE = np.array([0.0, 0.0]), np.array([2.0, 0.0])
FAR_GOAL = np.array([8.0, 0.0, 0.0])


def field_with(*boxes):
    return distance_field(costmap_with(*boxes))


def test_a_wall_across_the_map_cuts_it_in_two():
    assert not is_connected(field_with((1.0, -3.0, 1.1, 3.0)), 0.31, 9.0, HERE, THERE)


@pytest.mark.parametrize(("width_m", "is_open"), [(0.5, False), (0.8, True)])
def test_a_door_is_a_way_where_it_is_wider_than_twice_the_clearance(width_m, is_open):
    half = round(0.5 * width_m / 0.05) * 0.05
    field = field_with((1.0, -3.0, 1.1, -half), (1.0, half, 1.1, 3.0))
    assert is_connected(field, 0.31, 9.0, HERE, THERE) is is_open


def test_a_way_around_counts_only_where_it_is_short_enough():
    field = field_with((1.0, -2.0, 1.1, 2.0))
    # By the wall's end with room for the robot: twice the way to (1, 2.31), 5.03 m.
    assert is_connected(field, 0.31, 5.3, HERE, THERE)
    assert not is_connected(field, 0.31, 4.9, HERE, THERE)


def test_off_the_map_nothing_is_connected():
    assert not is_connected(field_with(), 0.31, 9.0, HERE, np.array([9.0, 0.0]))


def test_plans_aim_a_horizon_ahead_on_the_path_or_at_the_goal():
    far = way_along(straight(2.5), FAR_GOAL, 1.5, field_with(), DISCS)
    np.testing.assert_allclose(far.target, [1.5, 0.0, 0.0])
    assert not far.nears_goal
    near = way_along(straight(1.0), np.array([1.0, 0.0, 0.7]), 1.5, field_with(), DISCS)
    np.testing.assert_allclose(near.target, [1.0, 0.0, 0.7])
    assert near.nears_goal


def test_the_path_is_blocked_where_the_front_would_touch():
    way = way_along(straight(2.5), FAR_GOAL, 1.5, field_with((1.8, -0.1, 2.0, 0.1)), DISCS)
    # The front disc reaches 0.72 + 0.341 m ahead of the base.
    assert way.blocked_m == pytest.approx(1.8 - 0.72 - 0.341, abs=0.06)
    # Free again where the rear disc, 0.12 + 0.341 m behind the base, has left the box.
    assert way.behind[0] == pytest.approx(2.0 + 0.12 + 0.341, abs=0.06)


def test_a_way_that_is_closed_ends_in_front_of_what_closes_it():
    way = way_along(straight(2.5), FAR_GOAL, 1.5, field_with((1.8, -3.0, 2.0, 3.0)), DISCS)
    ended = up_to_blocked(way, 0.5)
    assert ended.stop_m == pytest.approx(way.blocked_m - 0.5)
    assert ended.target[0] == pytest.approx(ended.stop_m, abs=0.051)
    # Out of reach nothing ends; too near already, it ends here.
    assert up_to_blocked(way._replace(blocked_m=2.2), 0.5).stop_m == np.inf
    assert up_to_blocked(way._replace(blocked_m=0.4), 0.5).stop_m == 0.0


def test_progress_is_measured_along_the_path():
    way = way_along(straight(2.5), FAR_GOAL, 1.5, field_with(), DISCS)
    assert progress_on(way, np.array([1.0, 0.4])) == pytest.approx(1.0, abs=0.03)


def test_at_the_goal_only_its_heading_is_left():
    way = turn_at(make_start(np.array([1.0, 2.0, 0.3]), 0.0, 0.0), np.array([1.1, 2.1, 1.5]))
    np.testing.assert_allclose(way.target, [1.0, 2.0, 1.5])
    assert way.nears_goal


def test_plans_drive_on_behind_the_goal_only_where_the_path_ends_in_its_heading():
    def ending(yaw, length_m=1.0):
        goal = np.array([length_m, 0.0, yaw])
        return driving_on(way_along(straight(length_m), goal, 1.5, field_with(), DISCS), 0.15)

    np.testing.assert_allclose(ending(0.0).target, [1.15, 0.0, 0.0])
    assert ending(0.0).stop_m == pytest.approx(1.15)
    # 0.15 m along the goal's heading, which is less than 0.1 rad from the path's.
    np.testing.assert_allclose(ending(0.09).target, [1.1494, 0.0135, 0.09], atol=1e-4)
    assert (ending(0.11).target[0], ending(0.11).stop_m) == (1.0, 1.0)
    # Of a path that is shorter than half a metre the whole counts.
    np.testing.assert_allclose(ending(0.0, 0.2).target, [0.35, 0.0, 0.0])
    # A goal out of reach is not aimed at.
    far = way_along(straight(2.5), FAR_GOAL, 1.5, field_with(), DISCS)
    assert driving_on(far, 0.15) is far
    # At the goal only the turn is left.
    here = turn_at(make_start(np.array([1.0, 2.0, 0.3]), 0.0, 0.0), np.array([1.0, 2.0, 0.3]))
    assert driving_on(here, 0.15) is here
