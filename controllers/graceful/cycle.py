"""One cycle of the Graceful Controller in Lyrical as a single kernel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.graceful.simulation import (
    best_approach,
    drive_to,
    largest_cost,
    largest_valid_cost,
    touches,
    turn_rate_to,
)
from drake_navbench.controllers.graceful.targets import distances_along, orient, point_ahead
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.kernels.poses import to_robot_frame

# The values of `Cycle.branch`, the branch that a cycle took.
FOLLOW, ROTATE_TO_GOAL, BLOCKED, ROTATE_TO_TARGET = range(4)


class Cycle(NamedTuple):
    """The outcome of one cycle.

    v m/s, w rad/s; branch: FOLLOW, ROTATE_TO_GOAL, BLOCKED or, in Humble, ROTATE_TO_TARGET.
    target_x, target_y m, target_yaw rad, and the trajectory (N, 3) to it: in the base frame.
    may_turn_first, safe_angle, near_goal: as in `GracefulMemory`, not a number for None.
    """

    v: float
    w: float
    branch: int
    target_x: float
    target_y: float
    target_yaw: float
    trajectory: NDArray[np.float64]
    may_turn_first: bool
    safe_angle: float
    near_goal: bool


@njit(cache=True)
def can_turn(settings, scene, angle):
    """Tells whether the robot can turn in place by an angle, looking at steps up to its end."""
    if not settings.use_collision_detection:
        return True
    steps = max(1, int(abs(angle) / settings.in_place_collision_resolution))
    outline = scene.footprint * 1.0
    for i in range(1, steps + 1):
        if touches(settings, scene, outline, 0.0, 0.0, i / steps * angle):
            return False
    return True


@njit(cache=True)
def following(drive, x, y, may_turn_first, safe_angle, near_goal):
    """Returns the Cycle that begins a free drive to (x, y), m, base frame."""
    return Cycle(
        drive.v,
        drive.w,
        FOLLOW,
        x,
        y,
        drive.target_yaw,
        drive.trajectory,
        may_turn_first,
        safe_angle,
        near_goal,
    )


@njit(cache=True)
def turning(w, yaw, may_turn_first, safe_angle, near_goal):
    """Returns the Cycle that turns in place to the goal's yaw, rad, base frame."""
    still = np.zeros((1, 3))
    return Cycle(
        0.0, w, ROTATE_TO_GOAL, 0.0, 0.0, yaw, still, may_turn_first, safe_angle, near_goal
    )


@njit(cache=True)
def blocked(may_turn_first, safe_angle, near_goal):
    """Returns the Cycle of a robot that stands because every way is blocked."""
    still = np.zeros((1, 3))
    return Cycle(0.0, 0.0, BLOCKED, 0.0, 0.0, 0.0, still, may_turn_first, safe_angle, near_goal)


@njit(cache=True)
def run_cycle(settings_record, scene, plan, goal_xy_reached, may_turn_first, safe_angle):
    """Returns the Cycle for one observation.

    settings_record: (1,) `parameters.as_record`; scene: Scene. plan: (M, 3) local plan in the
    odometry frame, M at least 1.
    """
    settings = settings_record[0]
    poses = to_robot_frame(plan, scene.x, scene.y, scene.yaw)
    orient(poses)
    plan_length = arc_length(poses)
    if goal_xy_reached and can_turn(settings, scene, poses[-1, 2]):
        w = turn_rate_to(settings, scene, poses[-1, 2])
        return turning(w, poses[-1, 2], may_turn_first, safe_angle, False)
    distances = distances_along(poses)
    is_approaching = plan_length < settings.max_lookahead and settings.prefer_final_rotation
    for i in range(poses.shape[0] - 1, -1, -1):
        if i == poses.shape[0] - 1:
            # The point ahead takes the place of the last pose.
            x, y, yaw, distance = point_ahead(poses, settings.max_lookahead)
        else:
            x, y, yaw, distance = poses[i, 0], poses[i, 1], poses[i, 2], distances[i]
        if is_approaching:
            yaw = math.atan2(y, x)
            drive = drive_to(settings, scene, x, y, yaw, distance, may_turn_first)
            may_turn_first = drive.may_turn_first
            if drive.is_free:
                margin_cost = largest_valid_cost(settings) - settings.obstacle_cost_margin
                if largest_cost(scene, drive.trajectory) >= margin_cost:
                    drive, may_turn_first, safe_angle = best_approach(
                        settings, scene, x, y, distance, drive, safe_angle
                    )
                return following(drive, x, y, may_turn_first, safe_angle, False)
            # As in Nav2 the second attempt starts from the heading of the first one.
            yaw = drive.target_yaw
        drive = drive_to(settings, scene, x, y, yaw, distance, may_turn_first)
        may_turn_first = drive.may_turn_first
        if drive.is_free:
            return following(drive, x, y, may_turn_first, safe_angle, False)
    return blocked(may_turn_first, safe_angle, False)
