"""The parts of a cycle of the Rotation Shim: the turn's side, its rate, its collision check.

Source: nav2_rotation_shim_controller, branches humble to lyrical. Poses are (x m, y m, yaw rad),
in the odometry frame; w is in rad/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import NO_INFORMATION
from drake_navbench.kernels.poses import see_point

LEAST_POSES = 2


class Turn(NamedTuple):
    """w: the turn rate. is_blocked: whether turning by it would collide."""

    w: float
    is_blocked: bool


@njit(cache=True)
def heading_of_plan(plan, x, y, yaw, distance, use_path_orientations, takes_last_pose):
    """Returns the angle from a robot's heading to that of a plan (M, 3), rad.

    The plan's heading is that of the first pose at least `distance` m from its first pose. A
    shorter plan has the heading of its last pose with `takes_last_pose`; otherwise the angle is
    NaN. The kernel is called in every cycle and takes few arguments: to pass a tuple of settings
    costs more than the computation.
    """
    count = plan.shape[0]
    if count < LEAST_POSES:
        return math.nan
    sample = 1
    while sample < count:
        if math.hypot(plan[sample, 0] - plan[0, 0], plan[sample, 1] - plan[0, 1]) >= distance:
            break
        sample += 1
    if sample == count:
        if not takes_last_pose:
            return math.nan
        sample = count - 1
    if use_path_orientations:
        return wrap(plan[sample, 2] - yaw)
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    seen_x, seen_y = see_point(plan[sample, 0], plan[sample, 1], x, y, cos_yaw, sin_yaw)
    return math.atan2(seen_y, seen_x)


@njit(cache=True)
def turn_rate(settings, angle, current_w):
    """Returns w for a turn by `angle` rad: as fast as asked and reachable from `current_w`.

    The bound that lets the robot stop in time ignores the acceleration, as in Nav2.
    """
    sign = 1.0 if angle > 0.0 else -1.0
    change = settings.max_angular_accel * settings.control_period_s
    w = sign * settings.rotate_to_heading_angular_vel
    w = min(max(w, current_w - change), current_w + change)
    stoppable = math.sqrt(2.0 * settings.max_angular_accel * abs(angle))
    if settings.stops_in_time and abs(w) > stoppable:
        return sign * stoppable
    return w


@njit(cache=True)
def turns_into_obstacle(settings, angle, w, pose, grid, tracks_unknown, footprint):
    """Tells whether turning at w for `simulate_ahead_time` meets a cost that is too high.

    As in Nav2, the check ends where the primary controller would take over, but the turn so far is
    measured with a sign: only the check of a turn to the right ends there.
    """
    x, y, yaw = pose
    until_handover = abs(angle) - settings.angular_dist_threshold
    time = 0.0
    while time < settings.simulate_ahead_time:
        time += settings.control_period_s
        turned_yaw = yaw + w * time
        if wrap(yaw - turned_yaw) >= until_handover:
            return False
        cost = footprint_cost(grid, footprint, x, y, turned_yaw, True)
        if cost == NO_INFORMATION and tracks_unknown:
            return True
        if cost >= settings.max_cost_threshold:
            return True
    return False


@njit(cache=True)
def turn_by(settings_record, angle, current_w, pose, grid, tracks_unknown, footprint):
    """Returns the Turn by an angle, rad, with `parameters.as_record` (1,) as settings.

    pose: (x m, y m, yaw rad). grid, tracks_unknown: grid and rule of the costmap. footprint: (K, 2)
    m.
    """
    settings = settings_record[0]
    w = turn_rate(settings, angle, current_w)
    return Turn(w, turns_into_obstacle(settings, angle, w, pose, grid, tracks_unknown, footprint))
