"""The dynamic window: the velocities that are tried (Nav2's dwb_plugins, XYThetaIterator).

An axis covers the velocities that the base can reach within the window time, from the lowest to the
highest velocity; the twists are the product of the axes, less those that the planar speed limits
exclude.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

if TYPE_CHECKING:
    from drake_navbench.controllers.dwb.kinematics import Kinematics

# Nav2's tolerance: a narrower axis has one sample; the last sample may pass the end by as much.
AXIS_TOLERANCE = 1e-5
FEWEST_SAMPLES = 2


@njit(cache=True)
def project_velocity(velocity, accel, decel, duration_s, target):
    """Returns the velocity after `duration_s` of changing towards `target`; decel is negative."""
    if velocity < target:
        return min(target, velocity + accel * duration_s)
    return max(target, velocity + decel * duration_s)


@njit(cache=True)
def sample_axis(current, minimum, maximum, accel, decel, window_s, sample_count, samples):
    """Writes the velocities tried on one axis, ascending; returns how many.

    There are none where the lowest is above the highest, as with limits of the wrong sign or order.
    samples: (2 * max(2, sample_count) + 1,) output; the longest list occurs on an axis barely
    wider than AXIS_TOLERANCE. Samples come from repeated addition, as in Nav2, and between the
    last negative and the first positive one an exact zero is put in, so that standing still on
    this axis is always tried.
    """
    if current < minimum:
        current = minimum
    elif current > maximum:
        current = maximum
    highest = project_velocity(current, accel, decel, window_s, maximum)
    lowest = project_velocity(current, accel, decel, window_s, minimum)
    samples[0] = lowest
    if abs(lowest - highest) < AXIS_TOLERANCE:
        return 1
    if lowest > highest:
        return 0
    increment = (highest - lowest) / (max(FEWEST_SAMPLES, sample_count) - 1)
    end = highest + AXIS_TOLERANCE
    count = 0
    velocity = lowest
    while velocity <= end:
        samples[count] = velocity
        count += 1
        following = velocity + increment
        if velocity < 0.0 < following <= end:
            samples[count] = 0.0
            count += 1
        velocity = following
    return count


@njit(cache=True)
def is_valid_speed(kinematics, vx, vy, wz):
    """Tells whether the planar speed limits admit a twist; a full stop is never admitted."""
    speed_squared = vx * vx + vy * vy
    fastest, slowest = kinematics.max_speed_xy, kinematics.min_speed_xy
    tolerance = kinematics.speed_tolerance
    if fastest >= 0.0 and speed_squared > fastest * fastest + tolerance:
        return False
    is_slow = slowest >= 0.0 and speed_squared + tolerance < slowest * slowest
    slowest_turn = kinematics.min_speed_theta
    turns_slowly = slowest_turn >= 0.0 and abs(wz) + tolerance < slowest_turn
    if is_slow and turns_slowly:
        return False
    return speed_squared != 0.0 or wz != 0.0


def sample_axes(
    kinematics: Kinematics,
    twist: tuple[float, float, float],
    window_s: float,
    *,
    sample_counts: tuple[int, int, int],
    axes: NDArray[np.float64],
) -> tuple[int, int, int]:
    """Writes the samples of x, y and theta into the rows of `axes`; returns the three counts.

    twist: measured vx, vy m/s, wz rad/s. sample_counts: wanted numbers of samples.
    """
    limits = kinematics
    x = (limits.min_vel_x, limits.max_vel_x, limits.acc_lim_x, limits.decel_lim_x)
    y = (limits.min_vel_y, limits.max_vel_y, limits.acc_lim_y, limits.decel_lim_y)
    top = limits.max_vel_theta
    theta = (-top, top, limits.acc_lim_theta, limits.decel_lim_theta)
    count_x, count_y, count_theta = (
        sample_axis(twist[i], *axis, window_s, sample_counts[i], axes[i])
        for i, axis in enumerate((x, y, theta))
    )
    # Nav2 reads an inner axis before it asks whether it has ended: of an axis without samples, as
    # by a speed limit below min_vel_y, it tries the lowest velocity.
    return count_x, max(1, count_y), max(1, count_theta)


@njit(cache=True)
def combine_axes(kinematics, axes, counts, twists):
    """Writes the admitted twists, x outermost and theta innermost; returns how many.

    axes, counts: from `sample_axes`. twists: (at least the product of counts, 3) output.
    """
    count = 0
    for i in range(counts[0]):
        for j in range(counts[1]):
            for k in range(counts[2]):
                vx, vy, wz = axes[0, i], axes[1, j], axes[2, k]
                if is_valid_speed(kinematics, vx, vy, wz):
                    twists[count, 0] = vx
                    twists[count, 1] = vy
                    twists[count, 2] = wz
                    count += 1
    return count
