"""The part of a global plan that a controller follows now.

A plan is (N, 3) float64: x m, y m, yaw rad. Source: Nav2's FeasiblePathHandler and
nav2_util (path_utils, geometry_utils), branch lyrical.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.grid import world_to_cell

# Below this length a segment has no direction, and poses count as turning in place.
IN_PLACE_LENGTH_M = 1e-4
# A smaller rotation threshold switches the search for turns in place off.
NO_ROTATION_THRESHOLD_RAD = 1e-6
# With fewer poses there is no corner to look at.
LEAST_POSES_WITH_CONSTRAINT = 3


@njit(cache=True)
def arc_length(plan):
    """Returns the length of a plan (N, 3), summed segment by segment, m; 0 below two poses.

    Adds in order, as Nav2's calculate_path_length; elsewhere `path_geometry.path_length` serves.
    """
    length = 0.0
    for i in range(plan.shape[0] - 1):
        length += math.hypot(plan[i + 1, 0] - plan[i, 0], plan[i + 1, 1] - plan[i, 1])
    return length


@register_jitable
def first_pose_beyond(plan, begin, end, distance):
    """Returns the first index in begin..end whose arc length from `begin` exceeds `distance` m.

    Returns `end` where there is none.
    """
    travelled = 0.0
    for i in range(begin, end - 1):
        travelled += math.hypot(plan[i + 1, 0] - plan[i, 0], plan[i + 1, 1] - plan[i, 1])
        if travelled > distance:
            return i + 1
    return end


@register_jitable
def closest_pose(plan, begin, end, x, y):
    """Returns the index in begin..end of the pose nearest to (x, y) m; the last one on ties."""
    closest = begin
    least = math.inf
    for i in range(begin, end):
        distance = math.hypot(plan[i, 0] - x, plan[i, 1] - y)
        if distance <= least:
            least = distance
            closest = i
    return closest


@njit(cache=True)
def first_closest_pose(plan, begin, end, x, y):
    """Returns the index in begin..end of the pose nearest to (x, y) m; the first one on ties."""
    last = closest_pose(plan, begin, end, x, y)
    least = math.hypot(plan[last, 0] - x, plan[last, 1] - y)
    for i in range(begin, last):
        if math.hypot(plan[i, 0] - x, plan[i, 1] - y) == least:
            return i
    return last


@register_jitable
def first_pose_off_grid(plan, begin, end, grid):
    """Returns the index in begin..end of the first pose off a `Grid`; `end` if there is none."""
    rows, columns = grid.costs.shape
    for i in range(begin, end):
        column, _ = world_to_cell(
            plan[i, 0], plan[i, 1], grid.origin_x, grid.origin_y, grid.resolution, columns, rows
        )
        if column < 0:
            return i
    return end


@njit(cache=True)
def local_plan_range(
    plan,
    begin,
    end,
    x,
    y,
    search_distance,
    prune_distance,
    grid,
):
    """Returns (first, stop): the poses plan[first:stop] that make the local plan.

    begin, end: part of the plan that is being worked on, end exclusive. x, y: robot, m.
    search_distance: arc length from `begin` within which the closest pose is looked for, m.
    prune_distance: arc length of the local plan, m. It also stops before the first pose off the
    `Grid`. At least two poses are kept, so that the end of the plan has a direction.
    """
    search_end = first_pose_beyond(plan, begin, end, search_distance)
    first = closest_pose(plan, begin, search_end, x, y)
    if end - begin > 1 and first == end - 1:
        first -= 1
    stop = first_pose_beyond(plan, first, end, prune_distance)
    return first, first_pose_off_grid(plan, first, stop, grid)


@njit(cache=True)
def range_in_circle(plan, begin, x, y, searched, reach, takes_first, keeps_two):
    """Returns (first, stop): the poses plan[first:stop] that controllers up to Kilted follow.

    The first is the closest to the robot (x, y), m, within the arc length `searched` m from `begin`
    on; takes_first: of equally close poses the first, otherwise the last. keeps_two: where the last
    pose within `searched` is the closest, the one before it is the first. The part stops before the
    first pose, from there on, that is farther than `reach` m from the robot.
    """
    count = plan.shape[0]
    end = first_pose_beyond(plan, begin, count, searched)
    if takes_first:
        first = first_closest_pose(plan, begin, end, x, y)
    else:
        first = closest_pose(plan, begin, end, x, y)
    if keeps_two and first == end - 1 and first > begin:
        first -= 1
    for i in range(first, count):
        if math.hypot(plan[i, 0] - x, plan[i, 1] - y) > reach:
            return first, i
    return first, count


@njit(cache=True)
def _turn_in_place_end(plan, start, threshold):
    """Returns the pose after which a turn in place exceeds `threshold` rad, or -1.

    Angles are added up in float32, as Nav2 does.
    """
    count = plan.shape[0]
    turned = np.float32(0.0)
    for i in range(start, count - 1):
        turn = wrap(np.float64(np.float32(plan[i + 1, 2])) - np.float64(np.float32(plan[i, 2])))
        turned = np.float32(turned + abs(turn))
        if turned > threshold:
            return i
        if i + 2 >= count or _segment_length(plan, i + 1) > IN_PLACE_LENGTH_M:
            return -1
    return -1


@njit(cache=True)
def _segment_length(plan, i):
    """Returns the length of segment i -> i+1 from float32 differences, m."""
    delta_x = np.float32(plan[i + 1, 0] - plan[i, 0])
    delta_y = np.float32(plan[i + 1, 1] - plan[i, 1])
    return np.float32(math.hypot(delta_x, delta_y))


@njit(cache=True)
def first_constraint_end(plan, begin, enforce_inversion, rotation_threshold):
    """Returns the end (exclusive) of the first part of a plan, from `begin` on, to be driven whole.

    enforce_inversion: a cusp ends the part, that is a pose where the direction of travel turns by
    more than a right angle. rotation_threshold: a turn in place by more than this ends the part
    before the step that exceeds it, rad; 0 means never. The last such pose belongs to the part.
    Returns N where there is neither.
    """
    count = plan.shape[0]
    if count - begin < LEAST_POSES_WITH_CONSTRAINT:
        return count
    threshold = np.float32(rotation_threshold)
    previous_x, previous_y = np.float32(0.0), np.float32(0.0)
    for i in range(begin, count - 1):
        length = _segment_length(plan, i)
        if enforce_inversion and length > IN_PLACE_LENGTH_M:
            delta_x = np.float32(plan[i + 1, 0] - plan[i, 0])
            delta_y = np.float32(plan[i + 1, 1] - plan[i, 1])
            if previous_x * delta_x + previous_y * delta_y < 0.0:
                return i + 1
            previous_x, previous_y = delta_x, delta_y
        if threshold >= NO_ROTATION_THRESHOLD_RAD and length < IN_PLACE_LENGTH_M:
            turn_end = _turn_in_place_end(plan, i, threshold)
            if turn_end >= 0:
                return turn_end + 1
    return count


@njit(cache=True)
def is_within_tolerances(plan, index, x, y, yaw, xy_tolerance, yaw_tolerance):
    """Tells whether a pose is near plan[index]; both bounds inclusive, compared in float32."""
    distance = np.float32(
        math.hypot(np.float32(x - plan[index, 0]), np.float32(y - plan[index, 1]))
    )
    angle = np.float32(wrap(plan[index, 2] - yaw))
    return distance <= np.float32(xy_tolerance) and abs(angle) <= np.float32(yaw_tolerance)
