"""Guesses of the plan besides the last one: a pursuit and a stop.

A guess is (N + 1, 2) velocities v m/s, w rad/s, one row a stage, and at rest at its end. Speeds and
accelerations are within the limits of the plan. Wheel speeds and the sideways acceleration may
exceed theirs for as long as a turn takes to slow down.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.controllers.harmony.motion import YAW, V, W, X, Y
from drake_navbench.controllers.harmony.scene import nearest_on_path
from drake_navbench.kernels.angles import wrap

# As in Regulated Pure Pursuit: the carrot's distance, m, and the angle, rad, beyond which the robot
# turns in place.
CARROT_DISTANCE_M = 0.6
TURN_IN_PLACE_RAD = 0.785
# A goal nearer than this is reached except for its heading, m.
AT_GOAL_M = 0.1
# The turn rate for each radian of error in heading, 1/s.
HEADING_GAIN = 1.5
# The share of the limits that guesses use; the rest is for the jerk.
GUESS_SHARE = 0.8


@njit(cache=True)
def _within_limits(limits, dt, left_s, v, w, wanted_v, wanted_w):
    """Returns (v, w) one step closer to those wanted, within the limits and able to stop.

    left_s: time until the end of the plan, at which the base must be at rest.
    """
    rate, angular_rate = (
        GUESS_SHARE * limits.acceleration,
        GUESS_SHARE * limits.angular_acceleration,
    )
    top = min(limits.forward_speed, rate * left_s)
    bottom = -min(limits.backward_speed, rate * left_s)
    most = min(limits.turn_rate, angular_rate * left_s)
    wanted_v, wanted_w = min(max(wanted_v, bottom), top), min(max(wanted_w, -most), most)
    # In a turn the limits of wheel speed and lateral acceleration allow less speed.
    turning = abs(wanted_w)
    fastest = max(limits.wheel_speed - limits.half_track * turning, 0.0)
    if turning * abs(wanted_v) > limits.lateral_acceleration:
        fastest = min(fastest, limits.lateral_acceleration / turning)
    wanted_v = min(max(wanted_v, -fastest), fastest)
    return (
        v + min(max(wanted_v - v, -dt * rate), dt * rate),
        w + min(max(wanted_w - w, -dt * angular_rate), dt * angular_rate),
    )


@njit(cache=True)
def _move(pose, v, w, dt):
    heading = pose[2] + 0.5 * w * dt
    pose[0] += v * dt * math.cos(heading)
    pose[1] += v * dt * math.sin(heading)
    pose[2] += w * dt


@njit(cache=True)
def _carrot(path, x, y, index):
    """Returns (x, y) m of the point CARROT_DISTANCE_M along the path from segment `index` on."""
    left = CARROT_DISTANCE_M
    for i in range(index, path.shape[0] - 1):
        length = math.hypot(path[i + 1, 0] - x, path[i + 1, 1] - y)
        if length >= left:
            share = left / length
            return x + share * (path[i + 1, 0] - x), y + share * (path[i + 1, 1] - y)
        left -= length
        x, y = path[i + 1, 0], path[i + 1, 1]
    return x, y


@njit(cache=True)
def pursuit(path, start, target, nears_goal, limits, dt, count, window):
    """Returns the velocities of a pure pursuit of the path (P, 3) that turns in place where needed.

    Near a goal it turns to its heading. Coulter, Implementation of the Pure Pursuit Path Tracking
    Algorithm (1992).
    """
    velocities = np.empty((count, 2))
    pose = np.array([start[X], start[Y], start[YAW]])
    v, w = start[V], start[W]
    index = np.int64(0)
    for k in range(count):
        velocities[k, 0], velocities[k, 1] = v, w
        _move(pose, v, w, dt)
        index, x, y, _ = nearest_on_path(path, pose[0], pose[1], index, window)
        carrot_x, carrot_y = _carrot(path, x, y, index)
        distance = math.hypot(target[0] - pose[0], target[1] - pose[1])
        error = wrap(math.atan2(carrot_y - pose[1], carrot_x - pose[0]) - pose[2])
        stoppable = math.sqrt(2.0 * GUESS_SHARE * limits.acceleration * distance)
        wanted_v = min(limits.forward_speed, stoppable)
        reach = max(math.hypot(carrot_x - pose[0], carrot_y - pose[1]), AT_GOAL_M)
        wanted_w = 2.0 * wanted_v * math.sin(error) / reach
        if nears_goal > 0.0 and distance < AT_GOAL_M:
            wanted_v, wanted_w = 0.0, HEADING_GAIN * wrap(target[2] - pose[2])
        elif abs(error) > TURN_IN_PLACE_RAD:
            wanted_v, wanted_w = 0.0, HEADING_GAIN * error
        v, w = _within_limits(limits, dt, (count - 2 - k) * dt, v, w, wanted_v, wanted_w)
    return velocities


@njit(cache=True)
def stop(start, limits, dt, count):
    """Returns the velocities of a stop within the limits, turning less and less."""
    velocities = np.empty((count, 2))
    v, w = start[V], start[W]
    for k in range(count):
        velocities[k, 0], velocities[k, 1] = v, w
        v, w = _within_limits(limits, dt, (count - 2 - k) * dt, v, w, 0.0, 0.0)
    return velocities
