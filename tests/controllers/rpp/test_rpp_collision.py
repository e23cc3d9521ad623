"""The collision check looks as far ahead as in Nav2, and no farther.

The round robot has its outline at 0.23 m ahead (0.22 m and padding), so that a lethal cell at
0.5 m, [0.5, 0.55), is touched from x = 0.27 m on.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import straight_plan

from drake_navbench.controller import CollisionAhead, SpeedLimit
from drake_navbench.controllers.rpp import RegulatedPurePursuit, RegulatedPurePursuitParameters
from drake_navbench.controllers.rpp.controller import RppMemory
from drake_navbench.kernels.command_arc import project_arc


@pytest.fixture
def collides(make_controller, observe, make_costmap):
    """Tells whether the command of one cycle is refused, with lethal cells at given points."""

    def check(lethal, *, plan=None, cost=0, tracks_unknown=False, observed=None, **parameters):
        observation = observe(
            straight_plan(1.5) if plan is None else plan,
            costmap=make_costmap(cost, lethal=lethal, tracks_unknown=tracks_unknown),
            **(observed or {}),
        )
        parameters.setdefault("use_cost_regulated_linear_velocity_scaling", False)
        try:
            make_controller(**parameters).step(observation, RppMemory())
        except CollisionAhead:
            return True
        return False

    return check


# At 0.5 m/s a pose each 0.1 s is checked, up to 0.9 s (1.0 s is excluded): x up to 0.45 m. The
# outline then reaches 0.68 m.
def test_a_command_is_checked_for_a_second(collides):
    assert collides([(0.66, 0.01)])
    assert not collides([(0.71, 0.01)])


def test_a_command_is_checked_up_to_the_carrot(collides):
    # Two seconds reach 0.95 m, the carrot at 0.6 m cuts that: 0.6 + 0.23 m.
    assert collides([(0.81, 0.01)], max_allowed_time_to_collision_up_to_carrot=2.0)
    assert not collides([(0.86, 0.01)], max_allowed_time_to_collision_up_to_carrot=2.0)


def test_nothing_is_checked_where_switched_off(collides):
    assert not collides([(0.3, 0.01)], use_collision_detection=False)


def test_contact_at_the_present_pose_forbids_every_command(collides):
    behind = [[-0.05 * i, 0.0, 0.0] for i in range(31)]
    assert collides([(-0.22, 0.01)])
    assert collides([(-0.22, 0.01)], plan=behind)


def test_turning_in_place_sweeps_the_corners(make_controller, observe, make_costmap, setup):
    long_robot = replace(
        setup,
        footprint=np.array([[0.8, 0.3], [0.8, -0.3], [-0.2, -0.3], [-0.2, 0.3]]),
        circumscribed_radius_m=math.hypot(0.8, 0.3),
    )
    left = [[0.0, 0.05 * i, 0.0] for i in range(31)]
    turning = observe(left, twist=(0.0, 1.0), costmap=make_costmap(lethal=[(0.66, 0.51)]))
    controller = RegulatedPurePursuit(RegulatedPurePursuitParameters(), long_robot)
    with pytest.raises(CollisionAhead, match=r"v 0.000 m/s, w 1.160 rad/s"):
        controller.step(turning, RppMemory())


def test_a_graded_cost_is_no_collision_but_a_lethal_one_is(collides):
    assert not collides([], cost=253)
    assert collides([], cost=254)


def test_unknown_space_is_a_collision_unless_it_is_tracked(collides):
    assert collides([], cost=255)
    assert not collides([], cost=255, tracks_unknown=True)


def test_the_outline_off_the_map_collides_but_a_centre_off_the_map_passes(collides):
    # The map ends at 2 m. From 1.8 m the outline leaves it; from 2.5 m the centre is outside.
    ahead = [[1.8 + 0.05 * i, 0.0, 0.0] for i in range(20)]
    assert collides([], plan=ahead, observed={"pose": (1.8, 0.0, 0.0)})
    left = [[2.5, 0.05 * i, 0.0] for i in range(20)]
    assert not collides([], plan=left, observed={"pose": (2.5, 0.0, 0.0)})


def test_a_slow_command_is_checked_over_little_distance(collides):
    slow = {"observed": {"speed_limit": SpeedLimit(0.1)}}
    # 0.1 m/s: a pose each 0.5 s, so one only, at 0.05 m: 0.28 m.
    assert not collides([(0.31, 0.01)], **slow)
    # A distance of 0.4 m takes 4 s: poses up to 0.35 m, so 0.58 m.
    assert collides([(0.56, 0.01)], min_distance_to_obstacle=0.4, **slow)
    assert not collides([(0.61, 0.01)], min_distance_to_obstacle=0.4, **slow)


# Standing, the scaled lookahead is 0.3 m; at 0.5 m/s the check takes 0.8 / 0.5 = 1.6 s.
SCALED = {"use_velocity_scaled_lookahead_dist": True, "min_distance_to_obstacle": 0.8}


def test_a_scaled_lookahead_lets_the_check_reach_beyond_the_carrot(collides):
    # Poses up to 0.75 m (0.8 m is at 1.6 s, excluded): 0.98 m.
    assert collides([(0.96, 0.01)], **SCALED)
    assert not collides([(1.01, 0.01)], **SCALED)
    fixed = {"min_distance_to_obstacle": 0.8, "lookahead_dist": 0.3}
    assert not collides([(0.56, 0.01)], **fixed)


def test_the_end_of_the_plan_ends_the_check_unless_told_otherwise(collides):
    # A plan of 0.7 m in place of the 0.8 m: 0.93 m. Beyond it, 0.75 m and 0.98 m as above.
    plan = straight_plan(0.7)
    assert not collides([(0.96, 0.01)], plan=plan, **SCALED)
    assert collides([(0.96, 0.01)], plan=plan, allow_obstacle_checking_beyond_goal=True, **SCALED)


def test_the_largest_lookahead_bounds_that_check(collides):
    # 0.5 m in place of 0.8 m: 0.73 m.
    assert collides([(0.71, 0.01)], max_lookahead_dist=0.5, **SCALED)
    assert not collides([(0.81, 0.01)], max_lookahead_dist=0.5, **SCALED)


def test_the_error_tells_when_and_with_what_it_would_collide(
    make_controller, observe, make_costmap
):
    observation = observe(straight_plan(1.5), costmap=make_costmap(lethal=[(0.51, 0.01)]))
    controller = make_controller(use_cost_regulated_linear_velocity_scaling=False)
    with pytest.raises(CollisionAhead, match=r"collision ahead in 0.60 s with v 0.500") as failure:
        controller.step(observation, RppMemory())
    # The outline first touches at 0.27 m: the pose at 0.30 m, after 0.6 s.
    assert failure.value.details["time_to_collision_s"] == pytest.approx(0.6)
    assert failure.value.code == 106


def test_a_projected_arc_steps_along_the_heading_before_it_turns():
    arc = project_arc(0.0, 0.0, 0.0, 1.0, math.pi / 2.0, 1.0, 3.5, 10.0)
    # East, then north, then west.
    corners = [[0, 0, 0], [1, 0, math.pi / 2], [1, 1, math.pi], [0, 1, 1.5 * math.pi]]
    np.testing.assert_allclose(arc, corners, atol=1e-12)


def test_a_projected_arc_ends_before_its_limits():
    assert len(project_arc(0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 1.0, 10.0)) == 4  # 1.0 s is excluded
    assert len(project_arc(0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 9.0, 0.5)) == 3  # 0.5 m is included
    assert len(project_arc(0.0, 0.0, 0.0, 0.0, 0.0, math.inf, 1.0, 0.5)) == 1
