"""The constraints of a band with their Jacobian, in one kernel.

Rows are physical quantities (m/s, rad/s, m/s^2, rad/s^2, m); the limits are the rows' bounds, so
that a new speed limit changes no code and no sparsity. layout.py gives the order of rows and
columns. Formulas: TEB's terms (Roesmann et al. 2012 and 2013) on exact arcs, with the first and
last acceleration measured over half an interval, because speeds belong to interval middles.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.teb.arcs import band_geometry, band_rates
from drake_navbench.controllers.teb.layout import (
    pose_columns,
    row_count,
    unpack_poses,
    variable_count,
)
from drake_navbench.controllers.teb.predicted import NO_ENCOUNTERS, Encounters, field_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField, sample_distance

NO_DIRECTIONS: Array = np.empty(0)

ALL_AXES, YAW_ALONE = (0, 1, 2), (2,)
# Rows of each interval: offsets, speeds, turn rates; and of each two, accelerations of both kinds:
# how many intervals they span, whether times matter, which axes of the poses do.
PATH_ROWS = (
    (1, False, ALL_AXES),
    (1, True, ALL_AXES),
    (1, True, YAW_ALONE),
    (2, True, ALL_AXES),
    (2, True, YAW_ALONE),
)


class BandScene(NamedTuple):
    """The constraints of a band in one cycle.

    start, goal: (3,) first and last pose, x m, y m, yaw rad, yaws unwrapped along the band.
    start_twist, goal_twist: (2,) v m/s, w rad/s before the first and after the last interval.
    discs: (D, 2) offset along x and radius of the robot's discs, m.
    field: signed distance field of the obstacles.
    clearance_shares: (m - 1,) the share of the wanted clearance that each inner pose shall keep; it
        gives up as large a share of the slack.
    via_points: (V, 2) m, points that attract the band. via_poses: (V,) index of the attracted pose.
    turning_radius: least turning radius of a car, m; 0 without a bound. directions: (m,) in which a
        car drives through each interval, 1 forward, -1 backward.
    encounters: with moving obstacles.
    """

    start: Array
    goal: Array
    start_twist: Array
    goal_twist: Array
    discs: Array
    field: DistanceField
    clearance_shares: Array
    via_points: Array
    via_poses: NDArray[np.int64]
    turning_radius: float = 0.0
    directions: Array = NO_DIRECTIONS
    encounters: Encounters = NO_ENCOUNTERS


@register_jitable
def _add_interval_slopes(row, slopes, scale, k, m):
    """Adds scale * slopes (6,) of interval k to the pose columns of one Jacobian row."""
    x, y, yaw = pose_columns(k, m)
    if x >= 0:
        row[x] += scale * slopes[0]
        row[y] += scale * slopes[1]
        row[yaw] += scale * slopes[2]
    x, y, yaw = pose_columns(k + 1, m)
    if x >= 0:
        row[x] += scale * slopes[3]
        row[y] += scale * slopes[4]
        row[yaw] += scale * slopes[5]


@register_jitable
def _fill_rates(first_row, rates, slopes, time_steps, values, jacobian):
    """Fills m rows with rates (m,) = path / time; slopes (m, 6) are those of the path."""
    m = time_steps.shape[0]
    for k in range(m):
        row = first_row + k
        values[row] = rates[k]
        _add_interval_slopes(jacobian[row], slopes[k], 1.0 / time_steps[k], k, m)
        jacobian[row, k] = -rates[k] / time_steps[k]


@register_jitable
def _fill_accelerations(first_row, rates, start, end, slopes, time_steps, values, jacobian):
    """Fills m + 1 rows with the change of rates (m,) over the time between interval middles.

    start, end: the rates before the first and after the last interval.
    """
    m = time_steps.shape[0]
    for k in range(m + 1):
        row = first_row + k
        before = rates[k - 1] if k > 0 else start
        after = rates[k] if k < m else end
        span = 0.5 * ((time_steps[k - 1] if k > 0 else 0.0) + (time_steps[k] if k < m else 0.0))
        acceleration = (after - before) / span
        values[row] = acceleration
        if k > 0:
            step = time_steps[k - 1]
            _add_interval_slopes(jacobian[row], slopes[k - 1], -1.0 / (step * span), k - 1, m)
            jacobian[row, k - 1] = before / (step * span) - 0.5 * acceleration / span
        if k < m:
            step = time_steps[k]
            _add_interval_slopes(jacobian[row], slopes[k], 1.0 / (step * span), k, m)
            jacobian[row, k] = -after / (step * span) - 0.5 * acceleration / span


@register_jitable(forceinline=True)
def _fill_pose_clearances(first_row, i, poses, discs, obstacles, share, slack, rows):
    """Fills one row for each disc at pose i: its distance to obstacles plus its slack.

    obstacles: their distance field, and their shift (x, y) from where it has them, m. rows: all
    values and the Jacobian.
    """
    (field, shift), (values, jacobian) = obstacles, rows
    slack_column = jacobian.shape[1] - 1
    x_column, y_column, yaw_column = pose_columns(i, poses.shape[0] - 1)
    cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
    for disc in range(discs.shape[0]):
        row = first_row + disc
        arm_x, arm_y = discs[disc, 0] * cos_yaw, discs[disc, 0] * sin_yaw
        distance, slope_x, slope_y = sample_distance(
            field, poses[i, 0] - shift[0] + arm_x, poses[i, 1] - shift[1] + arm_y
        )
        values[row] = distance - discs[disc, 1] + share * slack
        jacobian[row, x_column] = slope_x
        jacobian[row, y_column] = slope_y
        jacobian[row, yaw_column] = slope_y * arm_x - slope_x * arm_y
        jacobian[row, slack_column] = share


@register_jitable
def _fill_clearances(first_row, poses, scene, slack, rows):
    """Fills the rows of all inner poses and discs, then those for moving obstacles."""
    m, disc_count = poses.shape[0] - 1, scene.discs.shape[0]
    for i in range(1, m):
        row = first_row + (i - 1) * disc_count
        share = scene.clearance_shares[i - 1]
        _fill_pose_clearances(
            row, i, poses, scene.discs, (scene.field, (0.0, 0.0)), share, slack, rows
        )
    encounters = scene.encounters
    for i in range(1, encounters.things.shape[0] + 1):
        row = first_row + (m - 1 + i - 1) * disc_count
        field = field_of(encounters.fields, encounters.things[i - 1])
        shift = (encounters.shifts[i - 1, 0], encounters.shifts[i - 1, 1])
        _fill_pose_clearances(row, i, poses, scene.discs, (field, shift), 1.0, slack, rows)


@register_jitable
def _fill_turnings(first_row, speeds, turn_rates, slopes, turn_slopes, time_steps, scene, rows):
    """Fills two rows for each interval: speed along its direction, less radius times turn rate.

    Once for either way of turning; none may be negative. slopes, turn_slopes (m, 6): of the paths.
    rows: all values and the Jacobian.
    """
    values, jacobian = rows
    m = time_steps.shape[0]
    for k in range(m):
        for way in range(2):
            row = first_row + 2 * k + way
            radius = scene.turning_radius if way == 0 else -scene.turning_radius
            direction = scene.directions[k]
            values[row] = direction * speeds[k] - radius * turn_rates[k]
            _add_interval_slopes(jacobian[row], slopes[k], direction / time_steps[k], k, m)
            _add_interval_slopes(jacobian[row], turn_slopes[k], -radius / time_steps[k], k, m)
            jacobian[row, k] = -values[row] / time_steps[k]


@njit(cache=True)
def band_constraints(z, interval_count, scene):
    """Returns (values (R,), Jacobian (R, N)) of all rows at the variables z (N,).

    The rows' bounds are the caller's: see program.py.
    """
    m = interval_count
    time_steps = z[:m]
    poses = unpack_poses(z, scene.start, scene.goal, m)
    lengths, offsets, turns, length_slopes, offset_slopes = band_geometry(poses)
    speeds, turn_rates, turn_slopes = band_rates(lengths, turns, time_steps)
    is_car = scene.turning_radius > 0.0
    meets_moving = scene.encounters.things.shape[0] > 0
    values = np.empty(row_count(m, scene.discs.shape[0], is_car, meets_moving))
    jacobian = np.zeros((values.shape[0], variable_count(m)))
    for k in range(m):
        values[k] = offsets[k]
        _add_interval_slopes(jacobian[k], offset_slopes[k], 1.0, k, m)
    _fill_rates(m, speeds, length_slopes, time_steps, values, jacobian)
    _fill_rates(2 * m, turn_rates, turn_slopes, time_steps, values, jacobian)
    _fill_accelerations(
        3 * m,
        speeds,
        scene.start_twist[0],
        scene.goal_twist[0],
        length_slopes,
        time_steps,
        values,
        jacobian,
    )
    _fill_accelerations(
        4 * m + 1,
        turn_rates,
        scene.start_twist[1],
        scene.goal_twist[1],
        turn_slopes,
        time_steps,
        values,
        jacobian,
    )
    _fill_clearances(5 * m + 2, poses, scene, z[-1], (values, jacobian))
    if is_car:
        _fill_turnings(
            values.shape[0] - 2 * m,
            speeds,
            turn_rates,
            length_slopes,
            turn_slopes,
            time_steps,
            scene,
            (values, jacobian),
        )
    return values, jacobian


@cache
def sparsity_pattern(
    interval_count: int, disc_count: int, is_car: bool = False, meets_moving: bool = False
) -> NDArray[np.int64]:
    """Returns (K, 2) the rows and columns of `band_constraints` that may be non-zero, by rows.

    The columns of a row ascend. Read-only.
    """
    m = interval_count
    rows = [
        _interval_columns(max(k + 1 - spanned, 0), min(k + 1, m), m, with_times, axes)
        for spanned, with_times, axes in PATH_ROWS
        for k in range(m + spanned - 1)
    ]
    slack = variable_count(m) - 1
    for _ in range(2 if meets_moving else 1):
        for i in range(1, m):
            rows += disc_count * [[*pose_columns(i, m), slack]]
    if is_car:
        for k in range(m):
            rows += 2 * [_interval_columns(k, k + 1, m, True, ALL_AXES)]
    pattern = np.array([(row, column) for row, columns in enumerate(rows) for column in columns])
    pattern.flags.writeable = False
    return pattern


def _interval_columns(
    first: int, end: int, m: int, with_times: bool, axes: tuple[int, ...]
) -> list[int]:
    """Returns the columns of the intervals from first to before end: times, then poses by axis."""
    poses = [pose_columns(i, m) for i in range(first, end + 1)]
    times = list(range(first, end)) if with_times else []
    return times + [pose[axis] for axis in axes for pose in poses if pose[axis] >= 0]
