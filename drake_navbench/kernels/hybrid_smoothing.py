"""The smoothing of paths by Nav2's planners of cars: in parts of one direction, with feasible ends.

Source: nav2_smac_planner (Smoother, not holonomic), branches humble to lyrical.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.car_curves import curve_knots, pose_on_curve, shortest_curve
from drake_navbench.kernels.curve_pieces import PIECES
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, cost_at
from drake_navbench.kernels.hybrid_releases import HUMBLE, LYRICAL
from drake_navbench.kernels.path_smoothing import (
    MIN_SPAN_OF_GRID_PATH,
    assign_headings,
    copy_into,
    directional_segments,
    heading_offset,
    is_path_free,
    relax_point,
    smooth_segment,
)

# The distance from the ends of a part up to which curves are tried, in turning radii.
REACHES = np.array([1.0, 2.0, math.pi, 2.0 * math.pi])
# A curve that is this much longer than the part that it replaces is a loop.
LOOP_RATIO = 2.0
# The end of a part; numba would compile `_meet` anew for each plain constant.
AT_START, AT_END = np.bool_(False), np.bool_(True)
NEVER_REVERSES = np.bool_(False)
# The cost of a point off the map: lethal since Lyrical. Before, Nav2 reads the cell of the point
# before it once more, which was free.
BLOCKED, AS_BEFORE = np.int64(LETHAL), np.int64(FREE)


def smooth_car_path(path, grid, footprint, radius, smoother, release):
    """Returns a path (N, 3) x m, y m, yaw rad smoothed part by part; short parts stay.

    grid: `Grid` of uint8 costs. footprint: (K, 2) m whose outline is tested; K = 0 tests the cell
    under the pose. radius: radius of the tightest turn, m. smoother: Nav2's parameters by their
    names. release: the release of Nav2 that smooths: before Lyrical the cell under the pose is
    tested whatever the footprint; in Humble all parts together have the refinements that each has
    since.
    """
    result = path.copy()
    rules = (smoother.tolerance, smoother.max_iterations, smoother.w_data, smoother.w_smooth)
    refinements = smoother.refinement_num if smoother.do_refinement else 0
    for start, end in directional_segments(path):
        if end - start <= MIN_SPAN_OF_GRID_PATH:
            continue
        part = result[start : end + 1]
        if release >= LYRICAL:
            smoothed = smooth_car_part(part, grid, footprint, radius, rules, refinements)
        else:
            smoothed, spent = smooth_part_by_cells(part, grid, radius, rules, refinements)
            refinements -= spent if release == HUMBLE else 0
        result[start : end + 1] = smoothed
    return result


@njit(cache=True)
def smooth_part_by_cells(part, grid, radius, rules, refinement_num):
    """Returns a part (N, 3) smoothed as before Lyrical, and the number of refinements begun.

    rules: as of `smooth_car_part`.
    """
    tolerance, max_iterations, w_data, w_smooth = rules
    result, begun, is_cut_short = smooth_segment(
        part, grid, tolerance, max_iterations, w_data, w_smooth, refinement_num, FREE
    )
    if begun > 1 or not is_cut_short:
        is_backward = np.bool_(heading_offset(result) != 0.0)
        _meet(result, part[0].copy(), is_backward, AT_START, grid, radius, AS_BEFORE)
        _meet(result, part[-1].copy(), is_backward, AT_END, grid, radius, AS_BEFORE)
    return result, begun - 1


@njit(cache=True)
def smooth_car_part(part, grid, footprint, radius, rules, refinement_num):
    """Returns a part (N, 3) driven in one direction, smoothed; see `smooth_car_path`.

    rules: tolerance, max_iterations, w_data and w_smooth.
    """
    # A bool of numpy, which is no constant: for one numba would compile the call a second time.
    result, is_backward, succeeded = part.copy(), np.bool_(False), False
    for round_ in range(refinement_num + 1):
        trial, ended, is_backward = _relaxed(result, is_backward, grid, footprint, rules)
        result = trial
        if round_ == 0:
            succeeded = ended
        if not ended:
            break
    if succeeded:
        start, end = part[0].copy(), part[-1].copy()
        _meet(result, start, is_backward, AT_START, grid, radius, BLOCKED)
        _meet(result, end, is_backward, AT_END, grid, radius, BLOCKED)
    return result


@njit(cache=True)
def _relaxed(path, is_backward, grid, footprint, rules):
    """Returns (path, is_finished, is_backward): a path after sweeps until the points hardly move.

    A sweep after which the path collides is undone, and is the last one; then, and after
    max_iterations, is_finished is False.
    """
    tolerance, max_iterations, w_data, w_smooth = rules
    trial, result = path.copy(), path.copy()
    sweeps, change = 0, tolerance
    while change >= tolerance:
        sweeps += 1
        if sweeps >= max_iterations:
            offset = heading_offset(result)
            assign_headings(result, offset)
            return result, False, offset != 0.0
        change = 0.0
        for i in range(1, path.shape[0] - 1):
            change += relax_point(path, trial, i, w_data, w_smooth)
        offset = heading_offset(trial)
        is_backward = offset != 0.0
        assign_headings(trial, offset)
        if not is_path_free(grid, trial, footprint):
            return result, False, is_backward
        copy_into(trial, result)
    return result, True, is_backward


@njit(cache=True)
def _meet(path, pose, is_backward, is_end, grid, radius, off_map):
    """Joins a path's start or end to a pose by a curve that a car can drive, in place."""
    n = path.shape[0]
    best_length, best_index = 1e9, 0
    best = np.empty((0, 3))
    driven, reach = 0.0, 0
    for k in range(n):
        here = n - 1 - k if is_end else k
        if k > 0:
            before = here + 1 if is_end else here - 1
            driven += math.hypot(path[here, 0] - path[before, 0], path[here, 1] - path[before, 1])
        if reach == REACHES.size:
            break
        if driven < REACHES[reach] * radius:
            continue
        reach += 1
        if k == 0:
            continue
        other = path[here]
        runs_to_pose = is_end != is_backward
        points, length, is_free = _curve(
            other if runs_to_pose else pose,
            pose if runs_to_pose else other,
            k,
            driven,
            grid,
            radius,
            off_map,
        )
        if is_free and 0.0 < length < best_length:
            best_length, best_index, best = length, k, points
    count = best.shape[0]
    first = n - 1 - best_index if is_end else 0
    for i in range(count):
        source = count - 1 - i if is_backward else i
        # For a row that is set as a whole numba compiles strings of an error message.
        for j in range(best.shape[1]):
            path[first + i, j] = best[source, j]


@njit(cache=True)
def _curve(start_pose, end_pose, count, replaced, grid, radius, off_map):
    """Returns (points (count + 1, 3), length, is_free) of Dubins' curve between poses (3,).

    There are no points where the curve is a loop, compared to the length that it replaces. off_map:
    the cost off the map.
    """
    kinds, lengths = np.empty(PIECES, np.int64), np.empty(PIECES)
    start = start_pose[0], start_pose[1], start_pose[2]
    end = end_pose[0], end_pose[1], end_pose[2]
    distance = shortest_curve(start, end, radius, NEVER_REVERSES, kinds, lengths)
    if distance > LOOP_RATIO * replaced:
        return np.empty((0, 3)), 0.0, False
    knots = curve_knots(start[2], kinds, lengths)
    points = np.empty((count + 1, 3))
    length, is_free = 0.0, True
    x, y = start[0], start[1]
    for i in range(count + 1):
        pose_on_curve(start, end, radius, kinds, lengths, knots, i / count, points[i])
        if cost_at(grid, points[i, 0], points[i, 1], off_map) >= INSCRIBED:
            is_free = False
        length += math.hypot(points[i, 0] - x, points[i, 1] - y)
        x, y = points[i, 0], points[i, 1]
    return points, length, is_free
