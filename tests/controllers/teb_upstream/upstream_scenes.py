"""Bands and scenes for the tests of the original TEB."""

import numpy as np

from drake_navbench.controllers.teb_upstream.normal_equations import COST_KINDS, STRIDE, System
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.penalties import BandSurroundings, add_edges
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel, circles
from drake_navbench.kernels.band_cholesky import BANDWIDTH
from drake_navbench.kernels.read_only import read_only

NOTHING = np.empty((0, 2))
POINT = circles(np.array([[0.0, 0.0]]))
OBSTACLES = np.array([[1.0, 0.3], [1.05, 0.3], [1.4, -0.6]])


def straight(length_m: float = 2.0, spacing_m: float = 0.25) -> np.ndarray:
    """Returns (P, 3) poses along the x axis."""
    x = np.arange(0.0, length_m + 1e-9, spacing_m)
    return np.column_stack([x, np.zeros(len(x)), np.zeros(len(x))])


def around(
    *,
    twist=(0.0, 0.0),
    obstacles=NOTHING,
    via_points=NOTHING,
    robot: RobotModel = POINT,
    stops_at_goal: bool = True,
    preferred_turn: float = 0.0,
) -> BandSurroundings:
    """Returns surroundings; nothing is there unless said."""
    return BandSurroundings(
        read_only(twist), stops_at_goal, preferred_turn, obstacles, via_points, robot
    )


def record_of(**values) -> np.ndarray:
    """Returns the record that the kernels take of parameters."""
    return TebUpstreamParameters(**values).kernel_record()


def evaluate(poses, steps, record, scene, attached, multiplier=1.0):
    """Returns the costs by kind and the right side of the normal equations."""
    count = len(poses)
    matrix, right = np.zeros((STRIDE * count, BANDWIDTH + 1)), np.zeros(STRIDE * count)
    costs = np.zeros(COST_KINDS)
    system = System(matrix, right, True, costs, np.zeros((count, 8)))
    padded = np.append(steps, 0.0)
    add_edges(poses, padded, count, record, scene, attached, multiplier, system)
    return costs, system
