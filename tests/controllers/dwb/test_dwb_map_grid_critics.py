"""PathDist, GoalDist, PathAlign, GoalAlign: scores counted by hand on small grids.

Cells of 1 m from the origin on, so that the point (2.5, 0.5) lies in column 2, row 0.
"""

import math

import dwb_reference
import numpy as np
import pytest
from dwb_cases import SETUP, free_map, map_of, parameters, scene_of, situate
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.controllers.dwb.critics.map_grid import (
    GoalAlign,
    GoalDist,
    MapGridCritic,
    PathAlign,
    PathDist,
)
from drake_navbench.controllers.dwb.map_grids import cell_distances, densify_plan
from drake_navbench.kernels.read_only import read_only

OFF_GRID, UNREACHABLE = 1, 2
# Five columns, four rows; a plan along the lowest row, whose poses are one cell apart.
MAP = map_of(np.zeros((4, 5)))
PLAN = np.array([[0.5, 0.5, 0.0], [1.5, 0.5, 0.0], [2.5, 0.5, 0.0]])
WORLD = {"costmap": MAP, "plan": PLAN, "pose": (0.5, 0.5, 0.0), "goal": (20.0, 0.5, 0.0)}


def critic(critic_class, **block) -> MapGridCritic:
    return critic_class(critic_class.Parameters(**block), parameters(), setup=SETUP)


def judge(judging, scene):
    """Returns [(score, violation)] of every trajectory."""
    scores, violations = judging.score(scene, None)
    return list(zip(scores.tolist(), violations.tolist(), strict=True))


def test_path_dist_counts_cells_to_the_nearest_plan_cell():
    # (1, 3) is 3 above the plan; (4, 2) is 2 right of its end and 2 above: 4; (2, 0) is on it.
    ends = [(1.5, 3.5, 0.0), (4.5, 2.5, 0.0), (2.5, 0.5, 0.0)]
    scene = scene_of([[(0.5, 0.5, 0.0), end] for end in ends], **WORLD)
    assert judge(critic(PathDist), scene) == [(3.0, 0), (4.0, 0), (0.0, 0)]


def test_goal_dist_counts_cells_to_the_end_of_the_local_plan():
    # The end is cell (2, 0): (1, 3) is |1-2| + 3 = 4 away, (4, 2) is 2 + 2 = 4, (0, 0) is 2.
    ends = [(1.5, 3.5, 0.0), (4.5, 2.5, 0.0), (0.5, 0.5, 0.0)]
    scene = scene_of([[end] for end in ends], **WORLD)
    assert judge(critic(GoalDist), scene) == [(4.0, 0), (4.0, 0), (2.0, 0)]


def test_obstacles_do_not_lengthen_the_way():
    costs = np.zeros((4, 5))
    costs[1, :] = 254
    scene = scene_of([[(1.5, 3.5, 0.0)]], **(WORLD | {"costmap": map_of(costs)}))
    assert judge(critic(PathDist), scene) == [(3.0, 0)]


def test_plan_ends_for_the_grids_at_its_first_unknown_cell():
    costs = np.zeros((4, 5))
    costs[0, 1] = 255
    scene = scene_of([[(2.5, 0.5, 0.0)]], **(WORLD | {"costmap": map_of(costs)}))
    # Only cell (0, 0) is left of the plan: 2 cells from (2, 0).
    assert judge(critic(PathDist), scene) == [(2.0, 0)]
    assert judge(critic(GoalDist), scene) == [(2.0, 0)]


def test_plan_before_the_map_is_skipped():
    plan = np.array([[-1.5, 0.5, 0.0], [-0.5, 0.5, 0.0], [0.5, 0.5, 0.0]])
    scene = scene_of([[(2.5, 0.5, 0.0)]], **(WORLD | {"plan": plan}))
    assert judge(critic(PathDist), scene) == [(2.0, 0)]


def test_dist_critics_want_every_pose_on_the_map():
    poses = [(0.5, 0.5, 0.0), (-0.5, 0.5, 0.0), (0.5, 0.5, 0.0)]
    assert judge(critic(PathDist), scene_of([poses], **WORLD)) == [(0.0, OFF_GRID)]


def test_plan_off_the_map_makes_every_place_unreachable_but_not_for_align_critics():
    plan = np.array([[20.5, 0.5, 0.0]])
    scene = scene_of([[(0.5, 0.5, 0.0)], [(-0.5, 0.5, 0.0)]], **(WORLD | {"plan": plan}))
    assert judge(critic(PathDist), scene) == [(0.0, UNREACHABLE), (0.0, OFF_GRID)]
    assert judge(critic(GoalDist), scene)[0] == (0.0, UNREACHABLE)
    # 4 * 5 cells and one: the value of a cell that nothing reached.
    assert judge(critic(PathAlign, forward_point_distance=0.1), scene)[0] == (21.0, 0)


def test_path_align_looks_ahead_of_the_robot():
    # 2 m ahead of (1.5, 0.5) looking up is cell (1, 2): 2 cells above the plan.
    # 2 m ahead of (0.5, 0.5) looking along the plan is on it.
    ends = [(1.5, 0.5, math.pi / 2), (0.5, 0.5, 0.0)]
    scene = scene_of([[end] for end in ends], **WORLD)
    aligning = critic(PathAlign, forward_point_distance=2.0)
    assert judge(aligning, scene) == [(2.0, 0), (0.0, 0)]


def test_align_critics_read_the_last_pose_only():
    poses = [(-9.5, 0.5, 0.0), (1.5, 0.5, math.pi / 2)]
    aligning = critic(PathAlign, forward_point_distance=2.0)
    assert judge(aligning, scene_of([poses], **WORLD)) == [(2.0, 0)]
    ahead_of_the_map = [(0.5, 0.5, 0.0), (4.5, 0.5, 0.0)]
    assert judge(aligning, scene_of([ahead_of_the_map], **WORLD))[0][1] == OFF_GRID


def test_goal_align_moves_the_end_towards_the_global_goal():
    # The goal is straight above the robot: the end (2.5, 0.5) moves up by 2 m to cell (2, 2).
    # The nose of a robot at (1.5, 0.5) looking right is 2 m ahead in cell (3, 0): 1 + 2 cells.
    scene = scene_of([[(1.5, 0.5, 0.0)]], **(WORLD | {"goal": (0.5, 9.5, 0.0)}))
    assert judge(critic(GoalAlign, forward_point_distance=2.0), scene) == [(3.0, 0)]


def test_goal_align_with_its_end_moved_off_the_map_takes_the_last_point_inside():
    # The end moves from (2.5, 0.5) by 9 m to (11.5, 0.5). From (1.5, 0.5) to there are 10 m:
    # k = 10 - 2 - 1 = 7 intervals of 10/7 m; the last point inside is 1.5 + 2 * 10/7 = 4.36.
    # The nose of a robot at (-8.5, 1.5) is 9 m ahead in cell (0, 1): 4 + 1 cells.
    scene = scene_of([[(-8.5, 1.5, 0.0)]], **WORLD)
    assert judge(critic(GoalAlign, forward_point_distance=9.0), scene) == [(5.0, 0)]


def test_scale_is_halved_and_in_metres():
    situation = situate(costmap=free_map(resolution=0.05))
    assert critic(PathDist, scale=32.0).scale(situation, None) == pytest.approx(0.8)
    assert critic(GoalAlign, scale=24.0).scale(situation, None) == pytest.approx(0.6)


def test_path_align_falls_silent_within_its_forward_distance_of_the_goal():
    aligning = critic(PathAlign, scale=2.0, forward_point_distance=0.5)
    assert aligning.scale(situate(goal=(0.5, 0.0, 0.0)), None) == 0.0
    assert aligning.scale(situate(goal=(0.51, 0.0, 0.0)), None) > 0.0


@pytest.mark.parametrize(
    ("aggregation", "expected"),
    [
        ("last", 2.0),
        ("sum", 3.0 + 1.0 + 2.0),
        ("Product", 3.0 * 1.0 * 2.0),
        ("nonsense", 2.0),
    ],
)
def test_values_of_the_poses_are_aggregated(aggregation, expected):
    poses = [(0.5, 3.5, 0.0), (1.5, 1.5, 0.0), (2.5, 2.5, 0.0)]
    scene = scene_of([poses], **WORLD)
    assert judge(critic(PathDist, aggregation_type=aggregation), scene) == [(expected, 0)]
    # A forward point of no distance is the centre itself.
    aligning = critic(PathAlign, aggregation_type=aggregation, forward_point_distance=0.0)
    assert judge(aligning, scene) == [(expected, 0)]


def test_product_stays_zero_once_it_is_zero():
    poses = [(0.5, 0.5, 0.0), (1.5, 3.5, 0.0)]
    scene = scene_of([poses], **WORLD)
    assert judge(critic(PathDist, aggregation_type="product"), scene) == [(0.0, 0)]


def test_holes_of_two_cells_stay_and_longer_ones_are_split():
    # D = 0.52 at 0.05 m: k = int(0.42 / 0.05) - 1 = 7, six points every 0.52 / 7 = 0.0743 m.
    plan = np.array([[0.0, 0.0, 0.0], [0.52, 0.0, 0.0], [0.62, 0.0, 0.0]])
    points = densify_plan(read_only(plan), 0.05)
    expected = [*(j * 0.52 / 7 for j in range(8)), 0.62]
    np.testing.assert_allclose(points[:, 0], expected, rtol=0, atol=1e-12)


@given(
    shape=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    picks=st.lists(st.integers(0, 80), max_size=5),
)
def test_distances_are_those_of_a_breadth_first_flood(shape, picks):
    rows, columns = shape
    seeds = np.array([pick % (rows * columns) for pick in picks], dtype=np.int32)
    flooded = dwb_reference.flood(
        map_of(np.zeros(shape)), [(int(s) % columns, int(s) // columns) for s in seeds]
    )
    np.testing.assert_array_equal(cell_distances(rows, columns, seeds), flooded)
