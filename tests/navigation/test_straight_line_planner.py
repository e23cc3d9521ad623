"""A straight line with a pose at least every so far, through whatever stands there."""

import numpy as np
import pytest

from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.navigation.straight_line_planner import StraightLine, StraightLineParameters

WALL = np.full((40, 40), LETHAL, np.uint8)


def plan(start, goal, **parameters):
    planner = StraightLine(StraightLineParameters(**parameters), None)
    return planner.plan(Costmap(WALL, -1.0, -1.0, 0.1), start, goal)


def test_the_line_is_cut_into_equal_steps_no_shorter_than_the_resolution():
    path = plan((0.0, 0.0, 0.7), (0.9, 1.2, -1.0), interpolation_resolution=0.4)
    # 1.5 m are three steps of 0.5 m.
    expected = [[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.6, 0.8, 0.0], [0.9, 1.2, -1.0]]
    np.testing.assert_allclose(path, expected, atol=1e-12)


@pytest.mark.parametrize("goal", [(0.0, 0.0, 2.0), (0.05, 0.0, 2.0)])
def test_a_goal_nearer_than_the_resolution_is_the_whole_path(goal):
    assert plan((0.0, 0.0, 0.7), goal).tolist() == [list(goal)]
