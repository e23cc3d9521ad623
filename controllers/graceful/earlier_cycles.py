"""One cycle of the Graceful Controller in the releases up to Kilted, as a single kernel each.

Source: nav2_graceful_controller, branches humble, jazzy and kilted. Up to Kilted the controller
drives to a pose of the plan itself, never nearer than `min_lookahead` before its end; in Humble to
one pose, whatever is in the way.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.graceful.control_law import velocity_to
from drake_navbench.controllers.graceful.cycle import (
    FOLLOW,
    ROTATE_TO_GOAL,
    ROTATE_TO_TARGET,
    Cycle,
    blocked,
    can_turn,
    following,
    turning,
)
from drake_navbench.controllers.graceful.simulation import drive_to, touches, turn_rate_to
from drake_navbench.controllers.graceful.targets import distances_along, orient
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.kernels.poses import to_robot_frame

# Humble's simulation has at most this many poses for each cell on the straight line.
HUMBLE_POSES_PER_CELL = 2.0


@njit(cache=True)
def run_kilted_cycle(settings_record, scene, plan, near_goal, goal_tolerance, may_turn_first):
    """Returns the Cycle for one observation, in Jazzy and Kilted.

    plan: (M, 3) the rest of the plan after the controller's cut, odometry frame, M at least 1.
    near_goal: as in `GracefulMemory`. goal_tolerance: tolerance of the goal checker, m. Others as
    in `run_cycle`.
    """
    settings = settings_record[0]
    poses = to_robot_frame(plan, scene.x, scene.y, scene.yaw)
    orient(poses)
    plan_length = arc_length(poses)
    near_goal = near_goal or plan_length < goal_tolerance
    if near_goal and can_turn(settings, scene, poses[-1, 2]):
        w = turn_rate_to(settings, scene, poses[-1, 2])
        return turning(w, poses[-1, 2], may_turn_first, math.nan, near_goal)
    distances = distances_along(poses)
    for i in range(poses.shape[0] - 1, -1, -1):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        if distances[i] > settings.max_lookahead:
            continue
        if plan_length < settings.max_lookahead:
            if settings.prefer_final_rotation:
                yaw = math.atan2(y, x)
        elif distances[i] < settings.min_lookahead:
            break
        drive = drive_to(settings, scene, x, y, yaw, distances[i], may_turn_first)
        may_turn_first = drive.may_turn_first
        if drive.is_free:
            return following(drive, x, y, may_turn_first, math.nan, near_goal)
    return blocked(may_turn_first, math.nan, near_goal)


@njit(cache=True)
def run_humble_cycle(settings_record, scene, plan, near_goal, goal_tolerance):
    """Returns the Cycle for one observation, in Humble; see `run_kilted_cycle`.

    For a local plan of one pose Nav2 reads memory before that pose; here the pose keeps its
    heading.
    """
    settings = settings_record[0]
    poses = to_robot_frame(plan, scene.x, scene.y, scene.yaw)
    plan_length = arc_length(poses)
    last = poses.shape[0] - 1
    target = last
    for i in range(last + 1):
        if math.hypot(poses[i, 0], poses[i, 1]) >= settings.motion_target_dist:
            target = i
            break
    x, y, yaw = poses[target, 0], poses[target, 1], poses[target, 2]
    bearing = math.atan2(y, x)
    if settings.final_rotation and plan_length < settings.motion_target_dist and last > 0:
        yaw = math.atan2(poses[last, 1] - poses[last - 1, 1], poses[last, 0] - poses[last - 1, 0])
    backward = settings.allow_backward and x < 0.0
    if backward:
        yaw = wrap(yaw + math.pi)
    v, w, branch = 0.0, 0.0, FOLLOW
    if settings.final_rotation and (near_goal or plan_length < goal_tolerance):
        near_goal, branch = True, ROTATE_TO_GOAL
        w = turn_rate_to(settings, scene, poses[-1, 2])
    elif settings.initial_rotation and abs(bearing) > settings.initial_rotation_min_angle:
        branch = ROTATE_TO_TARGET
        w = turn_rate_to(settings, scene, bearing)
    else:
        v, w = velocity_to(scene.law, scene.max_v, (x, y, yaw), (0.0, 0.0, 0.0), backward)
    # The drive to the target is checked before a turn in place, too.
    is_free, trajectory = _humble_drive(settings, scene, x, y, yaw, backward)
    if not is_free:
        return blocked(False, math.nan, near_goal)
    return Cycle(v, w, branch, x, y, yaw, trajectory, False, math.nan, near_goal)


@njit(cache=True)
def _humble_drive(settings, scene, target_x, target_y, target_yaw, backward):
    """Returns whether the drive to a target is free, from the robot's own pose on, and its poses.

    The trajectory is (N, 3) in the base frame.
    """
    resolution = scene.grid.resolution
    dt = resolution / scene.max_v if scene.max_v > 0.0 else 0.0
    most = int(HUMBLE_POSES_PER_CELL * math.hypot(target_x, target_y) / resolution)
    trajectory = np.zeros((max(2, most), 3))
    if touches(settings, scene, scene.footprint, 0.0, 0.0, 0.0):
        return False, trajectory[:1]
    target = target_x, target_y, target_yaw
    x = y = yaw = 0.0
    count = 1
    while True:
        v, w = velocity_to(scene.law, scene.max_v, target, (x, y, yaw), backward)
        x, y = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw)
        yaw = wrap(yaw + w * dt)
        # One by one: a tuple would have numba compile its strings, for an error message.
        trajectory[count, 0], trajectory[count, 1], trajectory[count, 2] = x, y, yaw
        count += 1
        if touches(settings, scene, scene.footprint, x, y, yaw):
            return False, trajectory[:count]
        distance = math.hypot(target_x - x, target_y - y)
        if not (distance > resolution and count < most):
            return True, trajectory[:count]
