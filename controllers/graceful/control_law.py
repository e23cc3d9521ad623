"""The control law: the drive to a pose, given in egocentric polar coordinates.

Park, Kuipers: A Smooth Control Law for Graceful Motion of Differential Wheeled Mobile Robots in 2D
Environment (2011). Source: nav2_graceful_controller's SmoothControlLaw, branch lyrical, which keeps
the polar coordinates in single precision. Poses are (x m, y m, yaw rad) in one frame; v is in m/s,
w in rad/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.kernels.angles import wrap


class Law(NamedTuple):
    """The parameters of the control law under Nav2's names, with lambda as `lambda_`.

    max_w: largest turn rate, under a speed limit.
    """

    k_phi: float
    k_delta: float
    beta: float
    lambda_: float
    slowdown_radius: float
    deceleration_max: float
    v_linear_min: float
    max_w: float


@njit(cache=True, error_model="numpy")
def curvature_to(law, distance, target_angle, robot_angle):
    """Returns the curvature to steer, 1/m, equation 13 of the paper.

    distance: to the target, m; at 0 the curvature is not finite. target_angle, robot_angle:
    headings at the target and of the robot against the line of sight, rad (theta and delta of the
    paper).
    """
    slow = law.k_phi * target_angle
    proportional = law.k_delta * (robot_angle - math.atan(-slow))
    feedback = (1.0 + law.k_phi / (1.0 + slow * slow)) * math.sin(robot_angle)
    return -1.0 / distance * (proportional + feedback)


@njit(cache=True, error_model="numpy")
def velocity_to(law, max_v, target, pose, backward):
    """Returns (v, w) at a pose for a target pose; not a number where both are in one place.

    target, pose: (x m, y m, yaw rad) in one frame. max_v: largest speed. backward: arrive driving
    backwards, the headings turned round.
    The comparisons are ordered as std::min and std::clamp order them.
    """
    target_x, target_y, target_yaw = target
    x, y, yaw = pose
    delta_x, delta_y = np.float32(target_x - x), np.float32(target_y - y)
    sight = np.float64(math.atan2(-delta_y, delta_x))
    if backward:
        sight = np.float64(np.float32(sight + math.pi))
    distance = np.float64(np.sqrt(delta_x * delta_x + delta_y * delta_y))
    target_angle = np.float64(np.float32(wrap(target_yaw + sight)))
    robot_angle = np.float64(np.float32(wrap(yaw + sight)))
    curvature = curvature_to(law, distance, target_angle, robot_angle)
    if backward:
        curvature = -curvature
    v = max_v / (1.0 + law.beta * math.pow(abs(curvature), law.lambda_))
    near = max_v * (distance / law.slowdown_radius)
    v = v if v < near else near
    stoppable = math.sqrt(2.0 * distance * law.deceleration_max)
    v = v if v < stoppable else stoppable
    if v < law.v_linear_min:
        v = law.v_linear_min
    elif max_v < v:
        v = max_v
    if backward:
        v = -v
    w = curvature * v
    if w < -law.max_w:
        w = -law.max_w
    elif law.max_w < w:
        w = law.max_w
    if curvature != 0.0:
        v = w / curvature
    return v, w
