"""The band of the original: first guess, warm start, resizing, command.

Formulas of teb_local_planner's TimedElasticBand (ros2-master). A band is n poses, yaws in
[-pi, pi), and n - 1 time steps; its first and last pose are fixed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.arrays import Array

# Warm starts drop at most this many passed poses.
MOST_PASSED_POSES = 10
# Sweeps of the resizing that repeats until nothing changes.
MOST_SWEEPS = 100
# Time step where the speed limit is no limit, s.
DEFAULT_STEP_S = 0.1
# Time step of a way on the roadmap that does not move, s.
RESTING_STEP_S = 0.2


class Band(NamedTuple):
    """A trajectory. poses: (n, 3) x m, y m, yaw rad. time_steps: (n - 1,) s. Read-only."""

    poses: Array
    time_steps: Array


@njit(cache=True, error_model="numpy")
def normalize(angle):
    """Returns the angle in [-pi, pi), bit for bit where it is inside already."""
    if -math.pi <= angle < math.pi:
        return angle
    angle -= math.floor(angle / (2.0 * math.pi)) * 2.0 * math.pi
    if angle >= math.pi:
        angle -= 2.0 * math.pi
    if angle < -math.pi:
        angle += 2.0 * math.pi
    return angle


@register_jitable(error_model="numpy")
def mean_angle(first, second):
    """Returns the circular mean of two angles."""
    x, y = math.cos(first) + math.cos(second), math.sin(first) + math.sin(second)
    if x == 0.0 and y == 0.0:
        return 0.0
    return math.atan2(y, x)


@register_jitable(error_model="numpy")
def step_time(start, end, max_speed, max_turn_rate):
    """Returns the time between two poses (3,) at constant speed, s; no acceleration, no reverse."""
    time = DEFAULT_STEP_S
    if max_speed > 0.0:
        time = math.hypot(end[0] - start[0], end[1] - start[1]) / max_speed
    if max_turn_rate > 0.0:
        time = max(time, abs(normalize(end[2] - start[2])) / max_turn_rate)
    return time


@register_jitable(error_model="numpy")
def put(poses, i, pose):
    """Writes a pose (3,) into row i, a number at a time.

    For an array that is assigned to a row or a slice numba would also compile its error message,
    for seconds.
    """
    for axis in range(3):
        poses[i, axis] = pose[axis]


@register_jitable(error_model="numpy")
def copy_band(poses, steps, count, to_poses, to_steps):
    """Copies the first `count` poses and the time steps between them, a number at a time."""
    for i in range(count):
        put(to_poses, i, poses[i])
    for i in range(count - 1):
        to_steps[i] = steps[i]


@njit(cache=True, error_model="numpy")
def band_from_plan(plan, headings_from_path, backwards, fewest, max_speed, max_turn_rate):
    """Returns (poses, time steps) of a band along a plan (P, 3), its ends included.

    headings_from_path: inner yaws point to the next point, turned about where the band starts
    backwards; otherwise they are the plan's. fewest: poses are added until min_samples is met.
    """
    count = plan.shape[0]
    inner = count - 2
    size = max(inner + 2, fewest)
    poses = np.empty((size, 3))
    steps = np.empty(size - 1)
    put(poses, np.int64(0), plan[0])
    last = 0
    for i in range(1, count - 1):
        put(poses, last + 1, plan[i])
        if headings_from_path:
            yaw = math.atan2(plan[i + 1, 1] - plan[i, 1], plan[i + 1, 0] - plan[i, 0])
            poses[last + 1, 2] = normalize(yaw + math.pi) if backwards else yaw
        steps[last] = step_time(poses[last], poses[last + 1], max_speed, max_turn_rate)
        last += 1
    goal = plan[count - 1]
    while last + 1 < fewest - 1:
        for axis in range(2):
            poses[last + 1, axis] = (poses[last, axis] + goal[axis]) / 2.0
        poses[last + 1, 2] = mean_angle(poses[last, 2], goal[2])
        steps[last] = step_time(poses[last], poses[last + 1], max_speed, max_turn_rate)
        last += 1
    put(poses, last + 1, goal)
    steps[last] = step_time(poses[last], goal, max_speed, max_turn_rate)
    return poses[: last + 2].copy(), steps[: last + 1].copy()


@njit(cache=True, error_model="numpy")
def band_from_points(points, start_yaw, goal_yaw, backwards, fewest, max_speed, max_acceleration):
    """Returns (poses, time steps) of a band along points (P, 2) m of a roadmap.

    Inner yaws are those of the way that leads to the point; each step takes the longer of driving
    at full speed and speeding up from rest.
    """
    count = points.shape[0]
    size = max(count, fewest)
    poses = np.empty((size, 3))
    steps = np.empty(size - 1)
    poses[0, 0], poses[0, 1], poses[0, 2] = points[0, 0], points[0, 1], start_yaw
    last = 0
    for i in range(1, count):
        dx, dy = points[i, 0] - poses[last, 0], points[i, 1] - poses[last, 1]
        length = math.hypot(dx, dy)
        time = max(length / max_speed, math.sqrt(2.0 * length / max_acceleration))
        if i == count - 1:
            break
        yaw = math.atan2(dy, dx)
        poses[last + 1, 0], poses[last + 1, 1] = points[i, 0], points[i, 1]
        poses[last + 1, 2] = normalize(yaw + math.pi) if backwards else yaw
        steps[last] = time if time > 0.0 else RESTING_STEP_S
        last += 1
    while last + 1 < fewest - 1:
        time /= 2.0
        for axis in range(2):
            poses[last + 1, axis] = (poses[last, axis] + points[-1, axis]) / 2.0
        poses[last + 1, 2] = mean_angle(poses[last, 2], goal_yaw)
        steps[last] = time
        last += 1
    poses[last + 1, 0], poses[last + 1, 1] = points[-1, 0], points[-1, 1]
    poses[last + 1, 2] = goal_yaw
    steps[last] = time
    return poses[: last + 2].copy(), steps[: last + 1].copy()


@njit(cache=True, error_model="numpy")
def warm_start(poses, steps, start, goal, fewest):
    """Returns (poses, time steps) of the old band without its passed poses, ends moved.

    As in the original, the first time step stays that of the old band, whatever poses are dropped.
    """
    passed = 0
    nearest = math.hypot(start[0] - poses[0, 0], start[1] - poses[0, 1])
    for i in range(1, min(poses.shape[0] - fewest, MOST_PASSED_POSES) + 1):
        distance = math.hypot(start[0] - poses[i, 0], start[1] - poses[i, 1])
        if distance >= nearest:
            break
        nearest = distance
        passed = i
    count = poses.shape[0] - passed
    kept_poses, kept_steps = np.empty((count, 3)), np.empty(count - 1)
    copy_band(poses[passed:], steps[passed:], count, kept_poses, kept_steps)
    kept_steps[0] = steps[0]
    put(kept_poses, np.int64(0), start)
    put(kept_poses, count - 1, goal)
    return kept_poses, kept_steps


@njit(cache=True, error_model="numpy")
def resize(poses, steps, count, dt_ref, dt_hysteresis, fewest, most, once):
    """Halves time steps that are too long and merges those too short, in place.

    poses: (C, 3), steps: (C,), of which the first `count` poses are the band's; C is at least
    most + 2. once: one sweep in place of as many as change something. Returns the new count.
    """
    for _ in range(MOST_SWEEPS):
        changed = False
        i = 0
        while i < count - 1:
            if steps[i] > dt_ref + dt_hysteresis and count - 1 < most:
                half = 0.5 * steps[i]
                for k in range(count, i + 1, -1):
                    put(poses, k, poses[k - 1])
                for k in range(count - 1, i + 1, -1):
                    steps[k] = steps[k - 1]
                poses[i + 1, 0] = (poses[i, 0] + poses[i + 2, 0]) / 2.0
                poses[i + 1, 1] = (poses[i, 1] + poses[i + 2, 1]) / 2.0
                poses[i + 1, 2] = mean_angle(poses[i, 2], poses[i + 2, 2])
                steps[i] = steps[i + 1] = half
                count += 1
                changed = True
            elif steps[i] < dt_ref - dt_hysteresis and count - 1 > fewest:
                is_last = i == count - 2
                dropped_pose = i if is_last else i + 1
                steps[i - 1 if is_last else i + 1] += steps[i]
                for k in range(dropped_pose, count - 1):
                    put(poses, k, poses[k + 1])
                for k in range(i, count - 2):
                    steps[k] = steps[k + 1]
                count -= 1
                changed = True
            i += 1
        if once or not changed:
            break
    return count


@njit(cache=True, error_model="numpy")
def band_command(poses, steps, look_ahead_poses, dt_ref):
    """Returns (is valid, v m/s, w rad/s): displacement up to a pose over the time until it.

    The speed is the straight distance with the sign of its component along the first heading.
    """
    if poses.shape[0] < 2:
        return False, 0.0, 0.0
    look_ahead = max(1, min(look_ahead_poses, poses.shape[0] - 1))
    time = 0.0
    for i in range(look_ahead):
        time += steps[i]
        if time >= dt_ref * look_ahead:
            look_ahead = i + 1
            break
    if not time > 0.0:
        return False, 0.0, 0.0
    dx, dy = poses[look_ahead, 0] - poses[0, 0], poses[look_ahead, 1] - poses[0, 1]
    along = dx * math.cos(poses[0, 2]) + dy * math.sin(poses[0, 2])
    speed = math.sqrt(dx * dx + dy * dy) / time
    turn = normalize(poses[look_ahead, 2] - poses[0, 2])
    return True, speed * float(np.sign(along)), turn / time
