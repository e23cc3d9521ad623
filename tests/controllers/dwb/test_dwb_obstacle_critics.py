"""BaseObstacle and ObstacleFootprint: costs read by hand off small grids."""

from dataclasses import replace

import dwb_reference
import numpy as np
import pytest
from dwb_cases import SETUP, map_of, parameters, scene_of, situate
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.controllers.dwb.critics.obstacles import (
    BaseObstacle,
    ObstacleFootprint,
    clearances_of,
)

# Cells of 1 m; row 0 is the lowest.
COSTS = np.array(
    [
        [10, 20, 30, 40, 50, 60, 70],
        [0, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 99, 0, 0],
        [0, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, 7],
    ]
)
SQUARE = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def with_cost(cost, *cells):
    costs = COSTS.copy()
    for column, row in cells:
        costs[row, column] = cost
    return map_of(costs)


def base_obstacle(**block):
    return BaseObstacle(BaseObstacle.Parameters(**block), parameters(), setup=SETUP)


def footprint_critic(footprint=SQUARE, **block):
    setup = replace(SETUP, footprint=footprint)
    return ObstacleFootprint(ObstacleFootprint.Parameters(**block), parameters(), setup=setup)


def judge(critic, poses, costmap):
    """Returns (score, reason or None) of one trajectory."""
    scores, violations = critic.score(scene_of([poses], costmap=costmap), None)
    code = int(violations[0])
    return (None, critic.reasons[code - 1]) if code else (float(scores[0]), None)


def at(x, y, yaw=0.0):
    return (x + 0.5, y + 0.5, yaw)


def test_clearance_is_the_larger_of_the_ways_in_x_and_y_to_the_nearest_forbidden_cell():
    costs = with_cost(254, (1, 1)).costs.copy()
    costs[5, 6] = 255
    clearances = clearances_of(map_of(costs).costs)
    for row in range(7):
        for column in range(7):
            ways = [max(abs(column - c), abs(row - r)) for c, r in ((1, 1), (6, 5))]
            assert clearances[row, column] == min(ways)
    assert (clearances_of(with_cost(0).costs) > 7).all()


class TestBaseObstacle:
    def test_score_is_the_cost_under_the_last_pose(self):
        assert judge(base_obstacle(), [at(0, 0), at(2, 0)], with_cost(0)) == (30.0, None)

    def test_score_may_be_the_sum_over_all_poses(self):
        poses = [at(0, 0), at(2, 0), at(2, 0)]
        assert judge(base_obstacle(sum_scores=True), poses, with_cost(0)) == (70.0, None)

    @pytest.mark.parametrize("cost", [253, 254, 255])
    def test_any_pose_on_an_obstacle_is_illegal(self, cost):
        poses = [at(0, 0), at(1, 1), at(2, 0)]
        expected = (None, "Trajectory Hits Obstacle.")
        assert judge(base_obstacle(), poses, with_cost(cost, (1, 1))) == expected

    def test_cost_252_is_legal(self):
        assert judge(base_obstacle(), [at(1, 1)], with_cost(252, (1, 1))) == (252.0, None)

    def test_leaving_the_map_is_illegal_and_what_comes_first_names_the_reason(self):
        off, hit = at(-1, 0), at(1, 1)
        costmap = with_cost(254, (1, 1))
        assert judge(base_obstacle(), [off, hit], costmap)[1] == "Trajectory Goes Off Grid."
        assert judge(base_obstacle(), [hit, off], costmap)[1] == "Trajectory Hits Obstacle."

    def test_scale_is_taken_as_it_is(self):
        assert base_obstacle(scale=0.02).scale(situate(), None) == 0.02


class TestObstacleFootprint:
    def test_score_is_the_largest_cost_under_the_outline_of_the_last_pose(self):
        # The outline round (4, 1) covers columns 3 to 5 of rows 0 and 2: 40, 50, 60 and 99.
        assert judge(footprint_critic(), [at(1, 2), at(4, 1)], with_cost(0)) == (99.0, None)

    def test_score_may_be_the_sum_over_all_poses(self):
        # Round (1, 1): 10, 20, 30, the largest 30; round (4, 1) 99; the interior does not count.
        poses = [at(1, 1), at(4, 1), at(4, 1)]
        assert judge(footprint_critic(sum_scores=True), poses, with_cost(0)) == (228.0, None)

    @pytest.mark.parametrize("cost", [253, 254, 255])
    def test_interior_is_not_looked_at(self, cost):
        assert judge(footprint_critic(), [at(3, 4)], with_cost(cost, (3, 4))) == (0.0, None)

    def test_inscribed_cost_is_allowed(self):
        assert judge(footprint_critic(), [at(3, 4)], with_cost(253, (4, 4))) == (253.0, None)

    @pytest.mark.parametrize(
        ("cost", "reason"),
        [(254, "Trajectory Hits Obstacle."), (255, "Trajectory Hits Unknown Region.")],
    )
    def test_touching_an_obstacle_on_the_way_is_illegal(self, cost, reason):
        poses = [at(3, 4), at(1, 4)]
        assert judge(footprint_critic(), poses, with_cost(cost, (4, 4))) == (None, reason)

    def test_first_edge_names_the_reason(self):
        # Vertices in order (4,5) (4,3) (2,3) (2,5): the right edge is walked first, down from 5.
        costs = with_cost(254, (2, 4)).costs.copy()
        costs[4, 4] = 255
        reason = judge(footprint_critic(), [at(3, 4)], map_of(costs))[1]
        assert reason == "Trajectory Hits Unknown Region."

    def test_vertex_off_the_map_counts_when_its_edge_is_due(self):
        # Round (0, 1) both left vertices are off the map; the right edge is walked before.
        critic = footprint_critic()
        assert judge(critic, [at(0, 1)], with_cost(0))[1] == "Footprint Goes Off Grid."
        hit = with_cost(254, (1, 1))
        assert judge(critic, [at(0, 1)], hit)[1] == "Trajectory Hits Obstacle."
        assert judge(critic, [at(-1, 1)], hit)[1] == "Trajectory Goes Off Grid."

    @pytest.mark.parametrize("x", [0.4, 3.5, 6.6])
    @pytest.mark.parametrize("y", [0.4, 3.5, 6.6])
    def test_outline_may_not_leave_the_map_on_the_way_even_far_from_obstacles(self, x, y):
        # The outline reaches 0.5 m: only the middle of the 7 m wide map holds it.
        critic = footprint_critic(0.5 * SQUARE)
        expected = (0.0, None) if x == y == 3.5 else (None, "Footprint Goes Off Grid.")
        poses = [(x, y, 0.0), (3.5, 3.5, 0.0)]
        costmap = map_of(np.zeros((70, 70)), resolution=0.1)
        assert judge(critic, poses, costmap) == expected

    def test_outline_of_two_vertices_is_a_line(self):
        # Nav2 gives such an outline no radius; it still may not cross an obstacle.
        critic = footprint_critic(np.array([[2.0, 0.0], [-2.0, 0.0]]))
        poses = [at(3, 3), at(3, 4)]
        assert judge(critic, poses, with_cost(0))[0] == 0.0
        assert judge(critic, poses, with_cost(254, (5, 3)))[1] == "Trajectory Hits Obstacle."

    def test_closing_edge_runs_from_the_last_to_the_first_vertex(self):
        # Vertices (0,0) (4,0) (4,1): from (4,1) to (0,0) the line is cells (4,1) (3,1) (2,0) ...;
        # error 2: 3, 4 -> step after two cells. From (0,0) it would be (0,0) (1,0) (2,1) ...
        triangle = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0]])
        critic = footprint_critic(triangle)
        assert judge(critic, [at(0, 3)], with_cost(50, (3, 4)))[0] == 50.0
        assert judge(critic, [at(0, 3)], with_cost(50, (2, 4)))[0] == 0.0

    def test_scale_is_in_metres(self):
        critic = footprint_critic(scale=0.02)
        assert critic.scale(situate(), None) == pytest.approx(0.05 * 0.02)

    @settings(max_examples=60, deadline=None)
    @given(seed=st.integers(0, 2**32 - 1), density=st.sampled_from([0.0, 0.002, 0.02, 0.2]))
    def test_skipping_clear_cells_changes_nothing(self, seed, density):
        random = np.random.default_rng(seed)
        costs = random.integers(0, 254, (40, 40))
        costs[random.random((40, 40)) < density] = 254
        costs[random.random((40, 40)) < 0.2 * density] = 255
        costmap = map_of(costs, resolution=0.1)
        footprint = np.array([[0.5, 0.3], [0.5, -0.3], [-0.2, -0.3], [-0.2, 0.3]])
        critic = footprint_critic(footprint)
        poses = [tuple(p) for p in random.uniform([0, 0, -3], [4, 4, 3], (3, 3)).tolist()]
        try:
            corners = [tuple(c) for c in footprint.tolist()]
            expected = dwb_reference.outline_cost(poses, costmap, corners), None
        except dwb_reference.Illegal as illegal:
            expected = None, str(illegal)
        assert judge(critic, poses, costmap) == expected
