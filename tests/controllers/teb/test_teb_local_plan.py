import numpy as np
import pytest
from controller_scenes import observe
from scenes import straight_plan
from teb_bands import map_of

from drake_navbench.controller import InvalidPath
from drake_navbench.controllers.teb.feasibility import (
    checked_pose_count,
    first_collision,
    is_free,
)
from drake_navbench.controllers.teb.local_plan import cut_local_plan, via_points
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.kernels.distance_field import distance_field

PARAMETERS = TebParameters(max_global_plan_lookahead_dist=2.0, min_obstacle_dist=0.2)
POINT = np.array([[0.0, 0.0]])
SQUARE = np.array([[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]])


def cut(plan, boxes=(), pose=(0.0, 0.0, 0.0), parameters=PARAMETERS):
    grid = map_of(boxes)
    observation = observe(plan, pose=pose, costmap=grid, goal=np.array([2.5, 0.0, 1.0]))
    return cut_local_plan(observation, parameters, discs=POINT, field=distance_field(grid))


def test_the_plan_is_cut_at_the_look_ahead_distance():
    plan = cut(straight_plan(2.5))
    assert plan.poses[-1, 0] == pytest.approx(2.0, abs=0.051)
    assert not plan.ends_plan
    assert not plan.is_cut_short


def test_the_end_of_the_plan_is_known():
    plan = cut(straight_plan(2.5), pose=(1.0, 0.0, 0.0))
    assert plan.ends_plan
    assert plan.poses[0, 0] == pytest.approx(1.0)


def test_goal_heads_along_the_plan_unless_it_is_its_end():
    poses = straight_plan(2.5)
    poses[:, 2] = 1.0
    middle = cut(poses)
    assert middle.goal(overwrite_orientation=True)[2] == pytest.approx(0.0)
    assert middle.goal(overwrite_orientation=False)[2] == pytest.approx(1.0)
    assert cut(poses, pose=(1.0, 0.0, 0.0)).goal(overwrite_orientation=True)[2] == 1.0


def test_a_wall_across_the_plan_blocks_it_where_the_outline_check_would_fail():
    # Face at x = 1 m: clearance falls below 0.02 m behind 0.98 m, below 0.2 m behind 0.8 m.
    plan = cut(straight_plan(2.5), [(1.0, -3.0, 1.2, 3.0)])
    assert plan.poses[plan.blocked_index, 0] == pytest.approx(1.0)
    free = plan.before_the_block(PARAMETERS.min_obstacle_dist)
    assert free.poses[free.goal_index, 0] == pytest.approx(0.8, abs=0.03)
    assert free.blocked_index is None
    assert free.is_cut_short


@pytest.mark.parametrize(
    ("half_width", "last_x"),
    [
        # 0.2 m are nowhere left, half of them are up to 0.1 m before the wall.
        (0.15, 0.9),
        # Not even half: up to where the plan is blocked.
        (0.1, 0.95),
    ],
)
def test_in_a_narrow_corridor_a_block_is_approached_as_far_as_it_is_allowed(half_width, last_x):
    sides = [(-3.0, half_width, 3.0, 2.0), (-3.0, -2.0, 3.0, -half_width)]
    plan = cut(straight_plan(2.5), [*sides, (1.0, -3.0, 1.2, 3.0)])
    free = plan.before_the_block(PARAMETERS.min_obstacle_dist)
    assert free.poses[free.goal_index, 0] == pytest.approx(last_x)


def test_a_goal_inside_an_obstacle_moves_back_to_where_there_is_clearance():
    plan = cut(straight_plan(2.2), [(1.9, -0.5, 2.9, 0.5)], pose=(1.0, 0.0, 0.0))
    assert plan.poses[plan.goal_index, 0] == pytest.approx(1.7, abs=0.03)
    assert plan.blocked_index is None
    assert plan.is_cut_short


def test_a_goal_with_less_than_min_obstacle_dist_stays_where_it_is():
    # The end of the plan at x = 2.5 m is 0.1 m before the box, min_obstacle_dist 0.2 m.
    plan = cut(straight_plan(2.5), [(2.6, -0.5, 2.9, 0.5)], pose=(1.0, 0.0, 0.0))
    assert plan.ends_plan
    assert not plan.is_cut_short


def test_a_plan_that_is_not_finite_is_refused():
    with pytest.raises(InvalidPath, match="finite"):
        cut(np.full((2, 3), np.nan))


def test_via_points_lie_on_the_plan_at_the_separation():
    points = via_points(cut(straight_plan(2.5)), 0.5)
    np.testing.assert_allclose(points[:, 0], [0.5, 1.0, 1.5], atol=0.051)
    assert via_points(cut(straight_plan(2.5)), -1.0).shape == (0, 2)


def test_outline_meets_a_box_in_the_interval_in_which_it_reaches_it():
    # The front is 0.2 m ahead of the pose: it reaches the face at x = 1 in the second interval.
    poses = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]])
    grid = map_of([(1.0, -0.5, 1.5, 0.5)])
    assert first_collision(grid, SQUARE, poses) == 1
    assert first_collision(grid, SQUARE, poses[:2]) is None


def test_a_thin_obstacle_between_two_poses_is_not_jumped_over():
    poses = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert first_collision(map_of([(0.0, -0.02, 0.05, 0.03)]), SQUARE, poses) == 0


def test_turning_into_an_obstacle_is_seen():
    bar = np.array([[1.0, 0.05], [1.0, -0.05], [0.0, -0.05], [0.0, 0.05]])
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.5]])
    assert first_collision(map_of([(0.6, 0.6, 0.7, 0.7)]), bar, poses) == 0


def test_leaving_the_map_counts_as_a_collision():
    poses = np.array([[2.0, 0.0, 0.0], [2.9, 0.0, 0.0]])
    assert first_collision(map_of(), SQUARE, poses) == 0


def test_the_check_covers_the_named_poses():
    poses = np.zeros((10, 3))
    poses[:, 0] = 0.1 * np.arange(10)
    assert checked_pose_count(poses, 5, -1.0) == 6
    assert checked_pose_count(poses, -1, -1.0) == 10
    assert checked_pose_count(poses, 50, -1.0) == 10
    assert checked_pose_count(poses, 5, 0.25) == 3
    assert checked_pose_count(poses, 0, -1.0) == 2


def test_the_outline_is_checked_with_a_margin():
    # The side of the square runs 1 cm or 3 cm beside the box; the margin is 2 cm.
    poses = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    grid = map_of([(-0.3, 0.2, 0.0, 0.5)])
    near, far = poses - [0.0, 0.01, 0.0], poses - [0.0, 0.03, 0.0]
    assert first_collision(grid, SQUARE, near) is None
    assert not is_free(grid, SQUARE, near)
    assert is_free(grid, SQUARE, far)


def test_a_robot_inside_the_margin_may_leave_it_but_not_stay():
    # It stands 1 cm beside the box.
    grid = map_of([(-0.5, 0.2, 0.5, 0.5)])
    start = np.array([0.0, -0.01, 0.0])
    assert is_free(grid, SQUARE, np.array([start, [0.0, -0.1, 0.0]]))
    assert not is_free(grid, SQUARE, np.array([start, [0.1, -0.01, 0.0]]))
    assert not is_free(grid, SQUARE, np.array([start, [0.0, 0.1, 0.0]]))
