"""The penalties that the optimiser minimises: teb_local_planner's edges with their slopes.

Every edge is a residual e with a weight w and adds w e^2. Formulas of teb_local_planner's
g2o_types (ros2-master); slopes are exact, where g2o takes most of them by central differences.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.teb_upstream.motion_edges import add_accelerations, add_intervals
from drake_navbench.controllers.teb_upstream.normal_equations import STRIDE
from drake_navbench.controllers.teb_upstream.obstacle_edges import add_obstacles, add_via_points
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel

Array = NDArray[np.float64]


class Terms(NamedTuple):
    """Limits and weights of the edges, by teb_local_planner's names.

    Speeds m/s, rad/s, accelerations m/s^2, rad/s^2, distances m. is_carlike: the turning radius
    is bounded. obstacle_ratio_weight: of the speed limit near obstacles.
    """

    max_vel_x: float
    max_vel_x_backwards: float
    max_vel_theta: float
    acc_lim_x: float
    acc_lim_theta: float
    min_turning_radius: float
    is_carlike: bool
    exact_arc_length: bool
    penalty_epsilon: float
    min_obstacle_dist: float
    inflation_dist: float
    obstacle_cost_exponent: float
    proximity_ratio: float
    proximity_lower: float
    proximity_upper: float
    weight_max_vel_x: float
    weight_max_vel_theta: float
    weight_acc_lim_x: float
    weight_acc_lim_theta: float
    weight_kinematics_nh: float
    weight_kinematics_forward_drive: float
    weight_kinematics_turning_radius: float
    weight_optimaltime: float
    weight_shortest_path: float
    weight_obstacle: float
    weight_inflation: float
    weight_viapoint: float
    weight_prefer_rotdir: float
    weight_velocity_obstacle_ratio: float


class Surroundings(NamedTuple):
    """The surroundings of one band in one cycle.

    start_twist: (2,) v m/s, w rad/s. stops_at_goal: the band ends at rest. preferred_turn: 1 left,
    -1 right, 0 neither. obstacles: (N, 2) m. via_points: (V, 2) m. robot: the robot's shape.
    """

    start_twist: Array
    stops_at_goal: bool
    preferred_turn: float
    obstacles: Array
    via_points: Array
    robot: RobotModel


class Attached(NamedTuple):
    """Which poses feel which obstacles and via-points, until the next rebuild of the edges.

    obstacle_poses, obstacles: (P,) index pairs; of pose 0 they only limit the speed. via_poses:
    (V,) index of the pose, or -1.
    """

    obstacle_poses: NDArray[np.int64]
    obstacles: NDArray[np.int64]
    via_poses: NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def add_edges(
    poses, steps, count, terms, around, attached, multiplier, system, with_slopes, costs, motion
):
    """Fills `costs` (COST_KINDS,) and, if wanted, the normal equations.

    poses (C, 3), steps (C,): the first `count` poses are the band's. multiplier: of the weight of
    obstacles. motion: (C, 8) scratch.
    """
    costs[:] = 0.0
    if with_slopes:
        system.matrix[: STRIDE * count] = 0.0
        system.right[: STRIDE * count] = 0.0
    add_intervals(poses, steps, count, terms, around, system, with_slopes, costs, motion)
    add_accelerations(steps, count, terms, around, system, with_slopes, costs, motion)
    add_obstacles(
        poses, steps, terms, around, attached, multiplier, system, with_slopes, costs, motion
    )
    add_via_points(poses, terms, around, attached, system, with_slopes, costs)
