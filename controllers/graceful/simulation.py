"""The simulated drive to a target: the control law's trajectory, and its collisions.

Source: nav2_graceful_controller (simulateTrajectory, validateTargetPose, inCollision,
findBestApproachTrajectory), branch lyrical. Targets and trajectories are in the base frame of the
robot; v is in m/s, w in rad/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.graceful.control_law import Law, velocity_to
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import (
    INSCRIBED,
    LETHAL,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    OFF_MAP,
    Grid,
    cost_at,
)
from drake_navbench.kernels.poses import place_point

# A simulation has at most this many steps for each cell on the straight line to its target.
STEPS_PER_CELL = 3.0
# An outline with fewer vertices is not widened.
LEAST_VERTICES_TO_SCALE = 4
# The approach's speed counts as no less than this, m/s.
LEAST_SPEED_MPS = 1e-3


class Scene(NamedTuple):
    """The inputs of one cycle: control law, speed limit max_v m/s, pose, costmap and outline."""

    law: Law
    max_v: float
    x: float
    y: float
    yaw: float
    grid: Grid
    tracks_unknown: bool
    footprint: NDArray[np.float64]


class Drive(NamedTuple):
    """A simulated drive to a target.

    is_free: nothing is in the way. v, w: its first command. trajectory: (N, 3) in the base frame.
    max_v: the largest speed it was allowed. may_turn_first: as in `GracefulMemory`.
    target_yaw: the heading at the target, turned round for a drive backwards.
    """

    is_free: bool
    v: float
    w: float
    trajectory: NDArray[np.float64]
    max_v: float
    may_turn_first: bool
    target_yaw: float


@njit(cache=True)
def largest_valid_cost(settings):
    """Returns the largest cost at the robot's centre that is no obstacle."""
    return MAX_NON_OBSTACLE if settings.is_circle else INSCRIBED


@njit(cache=True)
def touches(settings, scene, outline, x, y, yaw):
    """Tells whether the robot at a pose in the base frame would be in collision.

    outline: (K, 2) m. A circle is judged by the cost at its centre. As in Nav2, a pose whose centre
    is off the map is free, and so is unknown space where the costmap tracks it.
    """
    cos_yaw, sin_yaw = math.cos(scene.yaw), math.sin(scene.yaw)
    x_W, y_W = place_point(x, y, scene.x, scene.y, cos_yaw, sin_yaw)
    centre_cost = cost_at(scene.grid, x_W, y_W)
    if centre_cost == OFF_MAP:
        return False
    if settings.is_circle:
        cost = centre_cost
    else:
        cost = footprint_cost(scene.grid, outline, x_W, y_W, scene.yaw + yaw, True)
    if cost == INSCRIBED:
        return settings.is_circle
    if cost == NO_INFORMATION:
        return not scene.tracks_unknown
    return cost == LETHAL


@njit(cache=True)
def turn_rate_to(settings, scene, angle):
    """Returns w, rad/s, for turning in place by an angle, rad: proportional, with a least rate."""
    w = settings.rotation_scaling_factor * angle * scene.law.max_w
    return math.copysign(1.0, w) * max(abs(w), settings.v_angular_min_in_place)


@njit(cache=True)
def widened_outline(settings, scene, v):
    """Returns (K, 2) the outline, wider the faster the first command of a drive is."""
    scale = 1.0
    if v > settings.footprint_scaling_linear_vel:
        span = scene.max_v - settings.footprint_scaling_linear_vel
        if span > 0.0:
            ratio = (v - settings.footprint_scaling_linear_vel) / span
            scale += ratio * settings.footprint_scaling_factor
    if scene.footprint.shape[0] < LEAST_VERTICES_TO_SCALE:
        scale = 1.0
    return scene.footprint * scale


@njit(cache=True)
def simulate(settings, scene, target_x, target_y, target_yaw, max_v, backward, may_turn_first):
    """Returns the Drive to a target, up to a cell before it, at no more than `max_v`."""
    resolution = scene.grid.resolution
    bearing = math.atan2(target_y, target_x)
    is_turning = may_turn_first and settings.initial_rotation
    if abs(bearing) < settings.initial_rotation_tolerance:
        is_turning = may_turn_first = False
    dt = resolution / scene.max_v if scene.max_v > 0.0 else 0.0
    most = max(1, int(STEPS_PER_CELL * math.hypot(target_x, target_y) / resolution))
    trajectory = np.empty((most, 3))
    x = y = yaw = first_v = first_w = 0.0
    outline = scene.footprint * 1.0
    is_free = True
    count = 0
    while True:
        if is_turning:
            if count == 0:
                first_w = turn_rate_to(settings, scene, bearing - yaw)
            if abs(bearing - yaw) < settings.initial_rotation_tolerance:
                is_turning = False
            # The rate of the first cycle is kept, as in Nav2.
            yaw = wrap(yaw + first_w * dt)
        else:
            target = target_x, target_y, target_yaw
            v, w = velocity_to(scene.law, max_v, target, (x, y, yaw), backward)
            if count == 0:
                first_v, first_w = v, w
            x, y = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw)
            yaw = wrap(yaw + w * dt)
        # One by one: a tuple would have numba compile its strings, for an error message.
        trajectory[count, 0], trajectory[count, 1], trajectory[count, 2] = x, y, yaw
        count += 1
        if settings.use_collision_detection:
            if count == 1:
                outline = widened_outline(settings, scene, first_v)
            if touches(settings, scene, outline, x, y, yaw):
                is_free = False
                break
        distance = math.hypot(target_x - x, target_y - y)
        if not (distance > resolution and count < most):
            break
    return Drive(is_free, first_v, first_w, trajectory[:count], max_v, may_turn_first, target_yaw)


@njit(cache=True)
def drive_to(settings, scene, target_x, target_y, target_yaw, distance, may_turn_first):
    """Returns the fastest free Drive to a target; one with `is_free` False where there is none.

    distance: to the target along the plan, m; targets beyond max_lookahead are far.
    """
    if distance > settings.max_lookahead:
        return Drive(False, 0.0, 0.0, np.empty((0, 3)), 0.0, may_turn_first, target_yaw)
    backward = settings.allow_backward and target_x < 0.0
    if backward:
        target_yaw = wrap(target_yaw + math.pi)
    max_v = scene.max_v
    while True:
        drive = simulate(
            settings, scene, target_x, target_y, target_yaw, max_v, backward, may_turn_first
        )
        max_v -= settings.footprint_scaling_step
        if drive.is_free or not max_v >= settings.footprint_scaling_linear_vel:
            return drive
        may_turn_first = drive.may_turn_first


@njit(cache=True)
def largest_cost(scene, trajectory):
    """Returns the largest cost under the robot's centre along a trajectory, 0 off the map."""
    largest = 0
    cos_yaw, sin_yaw = math.cos(scene.yaw), math.sin(scene.yaw)
    for i in range(trajectory.shape[0]):
        x, y = place_point(trajectory[i, 0], trajectory[i, 1], scene.x, scene.y, cos_yaw, sin_yaw)
        largest = max(largest, cost_at(scene.grid, x, y, 0))
    return largest


@njit(cache=True)
def arrival_time(scene, drive, target_x, target_y, backward):
    """Returns the duration of a drive, s, with each step driven at the speed at its beginning."""
    time = 0.0
    poses = drive.trajectory
    target = target_x, target_y, drive.target_yaw
    for i in range(1, poses.shape[0]):
        pose = poses[i - 1, 0], poses[i - 1, 1], poses[i - 1, 2]
        v, _ = velocity_to(scene.law, drive.max_v, target, pose, backward)
        step = math.hypot(poses[i - 1, 0] - poses[i, 0], poses[i - 1, 1] - poses[i, 1])
        time += step / max(abs(v), LEAST_SPEED_MPS)
    return time


@njit(cache=True)
def best_approach(settings, scene, target_x, target_y, distance, drive, safe_angle):
    """Returns (Drive, may_turn_first, safe_angle): the fastest drive of all headings to arrive at.

    drive: returned where no heading is free and far enough from obstacles. safe_angle: the heading
    found in an earlier cycle, rad; NaN without one. As in Nav2, each heading found shifts those
    that are still to be tried, and a fast heading too near an obstacle keeps slower ones out.
    """
    backward = settings.allow_backward and target_x < 0.0
    least_time = math.inf
    may_turn_first = drive.may_turn_first
    i = 0
    while i < 2.0 * math.pi / settings.final_rotation_search_step:
        angle = i * settings.final_rotation_search_step
        i += 1
        if not math.isnan(safe_angle):
            angle += safe_angle
        candidate = drive_to(
            settings, scene, target_x, target_y, wrap(angle), distance, may_turn_first
        )
        may_turn_first = candidate.may_turn_first
        if not candidate.is_free:
            continue
        cost = largest_cost(scene, candidate.trajectory)
        time = arrival_time(scene, candidate, target_x, target_y, backward)
        if not time < least_time:
            continue
        least_time = time
        if cost < largest_valid_cost(settings):
            drive = candidate
            if safe_angle == angle:
                break
            safe_angle = angle
    return drive, may_turn_first, safe_angle
