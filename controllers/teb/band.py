"""The timed elastic band: its first guess, its warm start, its command.

A band is n poses joined by n - 1 circular arcs, each with its own time. Yaws are unwrapped along
the band, so that every turn is a plain difference of yaws.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.teb.arcs import band_geometry
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array

# Where the path leaves farther to the side than this, a first guess begins with a turn on the spot.
TURN_FIRST_ABOVE_RAD = math.pi / 4.0
# The offset between the measured pose and the old band fades out over this many poses.
BLEND_POSE_COUNT = 3
# Points closer than this are one point of a path, m.
SAME_POINT_M = 1e-6


class Band(NamedTuple):
    """A trajectory. poses: (n, 3) x m, y m, yaw rad (unwrapped). time_steps: (n - 1,) s."""

    poses: Array
    time_steps: Array

    @property
    def duration_s(self) -> float:
        """Time from the first to the last pose, s."""
        return float(self.time_steps.sum())


class Pace(NamedTuple):
    """The speed of a first guess, and the resolution of bands.

    speed m/s, turn_rate rad/s, acceleration m/s^2; dt_ref, dt_hysteresis s; fewest, most: numbers
    of intervals. turns_on_spot: whether the robot can, as no car can.
    """

    speed: float
    turn_rate: float
    acceleration: float
    dt_ref: float
    dt_hysteresis: float
    fewest: int
    most: int
    turns_on_spot: bool = True

    def interval_count(self, duration_s: float, current: int | None = None) -> int:
        """Returns the number of intervals for a duration; keeps `current` where it still fits."""
        if current is not None and self.fewest <= current <= self.most:
            step = duration_s / current
            if abs(step - self.dt_ref) <= self.dt_hysteresis:
                return current
        return int(min(max(round(duration_s / self.dt_ref), self.fewest), self.most))


def freeze(array: Array) -> Array:
    """Returns the array, made read-only."""
    array.flags.writeable = False
    return array


def initialise(path: Array, start: Array, goal: Array, *, pace: Pace, speed: float = 0.0) -> Band:
    """Returns a first guess: turn on the spot if need be, follow the path, turn at its end.

    path: (P, 2) m, from near the start to near the goal. start, goal: (3,). speed: at the start,
    m/s. The duration is that of the way at the limits: from that speed to full speed and to rest,
    longer by the turns that driving leaves no time for.
    """
    knots = _path_knots(_thinned(path, pace.speed * pace.dt_ref), start, goal, pace=pace)
    steps = np.diff(knots, axis=0)
    driving = np.hypot(steps[:, 0], steps[:, 1]) / pace.speed
    durations = np.maximum(driving, np.abs(steps[:, 2]) / pace.turn_rate)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    length = float(driving.sum()) * pace.speed
    turning = float(times[-1] - driving.sum())
    duration = trapezoid_duration(length, speed, pace.speed, pace.acceleration) + turning
    count = pace.interval_count(duration)
    # Times stretched, not delayed: evenly slower than the limits is easier to repair than too fast.
    samples = np.linspace(0.0, times[-1], count + 1)
    poses = _interpolate(samples, times, knots)
    poses[0], poses[-1] = knots[0], knots[-1]
    return Band(freeze(poses), freeze(np.full(count, duration / count)))


def trapezoid_duration(
    length: float, start_speed: float, full_speed: float, acceleration: float
) -> float:
    """Returns the least time (s) for a length (m) from a speed (m/s) to rest under limits.

    Where the length is too short to brake in, the time that braking takes.
    """
    speed = min(max(start_speed, 0.0), full_speed)
    if 2.0 * acceleration * length <= speed * speed:
        return speed / acceleration
    peak = min(full_speed, math.sqrt(acceleration * length + 0.5 * speed * speed))
    ramps = ((peak * peak - speed * speed) + peak * peak) / (2.0 * acceleration)
    return (2.0 * peak - speed) / acceleration + (length - ramps) / peak


def resampled(band: Band, count: int) -> Band:
    """Returns the same motion in `count` intervals of equal time."""
    times = np.concatenate([[0.0], np.cumsum(band.time_steps)])
    poses = _interpolate(np.linspace(0.0, times[-1], count + 1), times, band.poses)
    poses[0], poses[-1] = band.poses[0], band.poses[-1]
    return Band(freeze(poses), freeze(np.full(count, float(times[-1]) / count)))


def warm_start(band: Band, elapsed_s: float, start: Array, goal: Array, *, pace: Pace) -> Band:
    """Returns an older band cut off by the elapsed time and moved to a new start and goal.

    The offset of the start fades out over the first poses, that of the goal is spread evenly; the
    duration grows with a goal that moves on. The result has even time steps.
    """
    total = band.duration_s
    elapsed = min(elapsed_s, total)
    remaining = total - elapsed
    end = band.poses[-1]
    growth = math.hypot(goal[0] - end[0], goal[1] - end[1]) / pace.speed
    shortest = pace.fewest * (pace.dt_ref - pace.dt_hysteresis)
    duration = max(remaining + growth, shortest)
    count = pace.interval_count(duration, len(band.time_steps))
    poses = _carried_over(band.poses, band.time_steps, elapsed, remaining, count, start, goal)
    return Band(freeze(poses), freeze(np.full(count, duration / count)))


@register_jitable
def _wrapped(angle):
    """Returns the angle in [-pi, pi], rad."""
    return angle - 2.0 * math.pi * np.rint(angle / (2.0 * math.pi))


@njit(cache=True)
def _carried_over(poses, time_steps, elapsed, remaining, count, start, goal):
    """Returns (count + 1, 3) the rest of a band's poses, resampled for `warm_start`."""
    result = np.empty((count + 1, 3))
    here = np.empty(3)
    last = poses.shape[0] - 1
    i, begin = 0, 0.0
    for k in range(count + 1):
        sample = elapsed + k / count * remaining
        while i < last - 1 and sample > begin + time_steps[i]:
            begin += time_steps[i]
            i += 1
        share = min((sample - begin) / time_steps[i], 1.0)
        for axis in range(3):
            result[k, axis] = poses[i, axis] + share * (poses[i + 1, axis] - poses[i, axis])
            if k == 0:
                here[axis] = result[0, axis]
    for axis in range(3):
        start_offset, goal_offset = start[axis] - here[axis], goal[axis] - poses[last, axis]
        if axis == 2:
            start_offset, goal_offset = _wrapped(start_offset), _wrapped(goal_offset)
        for k in range(count + 1):
            fading = max(1.0 - k / BLEND_POSE_COUNT, 0.0)
            result[k, axis] += fading * start_offset + k / count * goal_offset
    # Whole turns, so that the yaw begins with that of the start.
    turns = start[2] - result[0, 2]
    turns -= _wrapped(turns)
    for k in range(count + 1):
        result[k, 2] += turns
    for axis in range(3):
        result[0, axis] = start[axis]
    result[count, 0], result[count, 1] = goal[0], goal[1]
    return result


def unwrapped_goal(goal: Array, guess: Band) -> Array:
    """Returns the goal (3,) with its yaw shifted by whole turns to that of the guess's end."""
    last_yaw = float(guess.poses[-1, 2])
    return np.array([goal[0], goal[1], last_yaw + wrap(float(goal[2]) - last_yaw)])


def next_twist(band: Band, twist: Array, period_s: float, look_ahead_poses: int = 1) -> Array:
    """Returns (2,) v m/s, w rad/s: the twist after a period of a band that starts with `twist`.

    The speed of an interval is that at its middle; between middles speeds change linearly, as the
    limits of the accelerations assume. look_ahead_poses: number of the first interval that counts.
    """
    first = min(max(look_ahead_poses, 1), len(band.time_steps)) - 1
    # A copy: for read-only poses the kernels that it calls would be compiled once more.
    poses = band.poses.copy()
    return _twist_after(poses, band.time_steps, twist[0], twist[1], period_s, first)


@njit(cache=True)
def _twist_after(poses, time_steps, speed_now, rate_now, period_s, first):
    """Returns (2,) the twist after a period, interpolated between the middles of intervals.

    The first interval that counts is `first`; the twist now is (speed_now, rate_now).
    """
    lengths, _, turns, _, _ = band_geometry(poses)
    count = time_steps.shape[0]
    before, after = 0.0, 0.0
    command = np.array([speed_now, rate_now])
    begin = 0.0
    for k in range(count):
        middle = begin + 0.5 * time_steps[k]
        begin += time_steps[k]
        if k < first:
            continue
        speed, rate = lengths[k] / time_steps[k], turns[k] / time_steps[k]
        after = middle
        if after >= period_s:
            share = (period_s - before) / (after - before)
            command[0] += share * (speed - command[0])
            command[1] += share * (rate - command[1])
            return command
        before = after
        command[0], command[1] = speed, rate
    return command


def braking_band(
    pose: Array, twist: Array, *, acceleration: float, angular_acceleration: float
) -> Band:
    """Returns the way to rest from a pose (3,) and twist (2,) that takes as long as it must.

    Both speeds fall evenly to zero, in two intervals of equal time.
    """
    duration = max(abs(twist[0]) / acceleration, abs(twist[1]) / angular_acceleration)
    poses = np.tile(np.asarray(pose, dtype=np.float64), (3, 1))
    # The shares of the twist's whole way: 3/8 in the first half, 1/8 in the second.
    for i, share in ((1, 0.375), (2, 0.125)):
        length, turn = share * duration * twist
        middle = poses[i - 1, 2] + 0.5 * turn
        step = [length * math.cos(middle), length * math.sin(middle), turn]
        poses[i] = poses[i - 1] + step
    return Band(freeze(poses), freeze(np.full(2, 0.5 * duration)))


def _thinned(path: Array, spacing: float) -> Array:
    """Returns the points (P, 2) of a path that are `spacing` m apart or more.

    Closer ones follow the cells of a grid, in steps that no robot would turn for.
    """
    kept: list[int] = []
    for i in range(len(path)):
        if not kept or math.hypot(*(path[i, :2] - path[kept[-1], :2])) >= spacing:
            kept.append(i)
    return path[kept, :2]


def drop_repeated_points(path: Array) -> Array:
    """Returns the points (P, 2) of a path without those that repeat their predecessor."""
    moved = np.hypot(*np.diff(path, axis=0).T) > SAME_POINT_M
    return path[np.concatenate([[True], moved])]


def _path_knots(path: Array, start: Array, goal: Array, *, pace: Pace) -> Array:
    """Returns (K, 3) unwrapped poses: start, headings along the path, goal."""
    points = drop_repeated_points(np.vstack([start[:2], path[:, :2], goal[:2]]))
    if len(points) < 2:
        turned = start[2] + wrap(float(goal[2] - start[2]))
        return np.array([start, [goal[0], goal[1], turned]])
    headings = np.arctan2(*np.diff(points, axis=0).T[::-1])
    yaws = np.unwrap(np.concatenate([[start[2]], headings, [goal[2]]]))
    knots = [np.array([points[0, 0], points[0, 1], yaws[0]])]
    if pace.turns_on_spot and abs(yaws[1] - yaws[0]) > TURN_FIRST_ABOVE_RAD:
        knots.append(np.array([points[0, 0], points[0, 1], yaws[1]]))
    middle_yaws = 0.5 * (yaws[1:-2] + yaws[2:-1])
    knots.extend(np.column_stack([points[1:-1], middle_yaws]))
    if pace.turns_on_spot and abs(yaws[-1] - yaws[-2]) > TURN_FIRST_ABOVE_RAD:
        knots.append(np.array([points[-1, 0], points[-1, 1], yaws[-2]]))
    knots.append(np.array([points[-1, 0], points[-1, 1], yaws[-1]]))
    return np.array(knots)


def _interpolate(samples: Array, times: Array, poses: Array) -> Array:
    """Returns (S, 3) poses at the sample times, linear in time."""
    return np.column_stack([np.interp(samples, times, poses[:, i]) for i in range(3)])


def shift(band: Band, elapsed_s: float) -> Band | None:
    """Returns the rest of a band after the elapsed time, or None where nothing is left."""
    times = np.concatenate([[0.0], np.cumsum(band.time_steps)])
    left = times > elapsed_s
    if left.sum() < 2:
        return None
    here = _interpolate(np.array([elapsed_s]), times, band.poses)
    poses = np.vstack([here, band.poses[left]])
    steps = np.diff(np.concatenate([[elapsed_s], times[left]]))
    return Band(freeze(poses), freeze(steps))
