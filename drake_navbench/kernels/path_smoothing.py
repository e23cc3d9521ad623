"""The two simple path smoothers of Nav2 and the heading rule they share.

Both relax a path by Gauss-Seidel sweeps, x and y apart, end points fixed:

    y_i <- y_i + w_data (x_i - y_i) + w_smooth (y_(i+1) + y_(i-1) - 2 y_i)

which converges to the minimum of w_data/2 sum |y - x|^2 + w_smooth/2 sum |y_(i+1) - y_i|^2. A sweep
that runs into an obstacle ends the smoothing at the sweep before it.
Source: nav2_smac_planner (Smoother), nav2_smoother (SimpleSmoother), nav2_util (smoother_utils).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import LETHAL, MAX_NON_OBSTACLE, NO_INFORMATION, cost_at

# Points closer than this in x and in y have no direction between them; a turn by less is no turn.
COINCIDENT_M = 1e-4
IN_PLACE_TURN_RAD = 1e-4
# Nav2 leaves shorter paths as they are: index span from the first pose to the last.
MIN_SPAN_OF_GRID_PATH = 10


@njit(cache=True)
def _is_in_collision(cost):
    """Tells whether a cost stops the smoothing: inscribed or lethal, but not unknown."""
    return cost > MAX_NON_OBSTACLE and cost != NO_INFORMATION


@njit(cache=True)
def _are_apart(path, i):
    """Tells whether a pose of a path has a direction to the next one."""
    delta_x = path[i + 1, 0] - path[i, 0]
    delta_y = path[i + 1, 1] - path[i, 1]
    return abs(delta_x) >= COINCIDENT_M or abs(delta_y) >= COINCIDENT_M


@njit(cache=True)
def _gives_all_headings(path):
    """Tells whether `assign_headings` turns every pose but the last, whatever its heading was."""
    all_are_apart = True
    for i in range(path.shape[0] - 1):
        all_are_apart &= _are_apart(path, i)
    return all_are_apart


@njit(cache=True)
def assign_headings(path, offset):
    """Turns each pose of `path` but the last towards the next pose, plus `offset` rad."""
    for i in range(path.shape[0] - 1):
        if _are_apart(path, i):
            delta_x = path[i + 1, 0] - path[i, 0]
            delta_y = path[i + 1, 1] - path[i, 1]
            path[i, 2] = wrap(math.atan2(delta_y, delta_x) + offset)


@njit(cache=True)
def heading_offset(path):
    """Returns pi for a path that its heading at index 1 shows to be driven backwards, else 0."""
    if path.shape[0] < 3:
        return 0.0
    direction = math.atan2(path[2, 1] - path[1, 1], path[2, 0] - path[1, 0])
    return math.pi if abs(wrap(direction - path[1, 2])) > math.pi / 2 else 0.0


def with_headings(path: NDArray[np.float64], is_holonomic: bool) -> NDArray[np.float64]:
    """Returns the path with each pose headed for the next one; the last pose keeps its heading.

    path: (N, 3) x m, y m, yaw rad. A pose that coincides with the next one keeps its heading.
    Unless `is_holonomic`, a path of three poses or more whose heading at index 1 points more than
    90 degrees away from the direction 1 -> 2 is driven backwards: all headings point backwards.
    """
    headed = path.copy()
    assign_headings(headed, 0.0 if is_holonomic else heading_offset(path))
    return headed


@njit(cache=True)
def copy_into(source, target):
    """Copies a path (N, 3) into another, a number at a time.

    For a slice numba would also compile its error message, for seconds.
    """
    for i in range(source.shape[0]):
        for axis in range(source.shape[1]):
            target[i, axis] = source[i, axis]


@njit(cache=True)
def _copied(path):
    """Returns a copy of a path (N, 3)."""
    copy = np.empty_like(path)
    copy_into(path, copy)
    return copy


@njit(cache=True)
def relax_point(original, path, i, w_data, w_smooth):
    """Moves pose `i` of `path` by one Gauss-Seidel step; returns |change in x| + |change in y|."""
    change = 0.0
    for axis in range(2):
        before = path[i, axis]
        pull = w_data * (original[i, axis] - before)
        pull += w_smooth * (path[i + 1, axis] + path[i - 1, axis] - 2.0 * before)
        path[i, axis] = before + pull
        change += abs(path[i, axis] - before)
    return change


@njit(cache=True)
def is_path_free(grid, path, footprint):
    """Tells whether no inner pose is in collision, by its cell or (K > 0) by its footprint."""
    for i in range(1, path.shape[0] - 1):
        x, y, yaw = path[i, 0], path[i, 1], path[i, 2]
        if footprint.shape[0] == 0:
            cost = cost_at(grid, x, y, LETHAL)
        else:
            cost = footprint_cost(grid, footprint, x, y, yaw, True)
        if _is_in_collision(cost):
            return False
    return True


@njit(cache=True)
def smooth_grid_path(
    path,
    grid,
    footprint,
    tolerance,
    max_iterations,
    w_data,
    w_smooth,
    refinement_num,
):
    """Smooths the raw path of a grid planner, as Nav2's 2D planner does itself.

    path: (N, 3) x m, y m, yaw rad; returned as it is where it has eleven poses or fewer.
    grid: `Grid` of uint8 costs. footprint: (K, 2) m whose outline is tested at every inner pose
    after each sweep; K = 0 tests the cell under the pose.
    tolerance: a pass ends when a sweep changes the coordinates by less in sum, m.
    max_iterations: a pass ends before this sweep. refinement_num: passes after the first one, each
    starting from the result of the one before; a pass that was cut short is the last.
    Every sweep assigns headings (holonomic), so a first sweep that collides leaves those of `path`.
    They are computed at the end where no outline needs them and no pose keeps one of before.
    """
    result = _copied(path)
    if path.shape[0] - 1 <= MIN_SPAN_OF_GRID_PATH:
        return result
    is_headed = True
    for _ in range(refinement_num + 1):
        original = _copied(result)
        trial = _copied(result)
        sweeps = 0
        change = tolerance
        while change >= tolerance:
            sweeps += 1
            if sweeps >= max_iterations:
                assign_headings(result, 0.0)
                return result
            change = 0.0
            for i in range(1, path.shape[0] - 1):
                change += relax_point(original, trial, i, w_data, w_smooth)
            was_headed = is_headed
            is_headed = footprint.shape[0] > 0 or not _gives_all_headings(trial)
            if is_headed:
                if not was_headed:
                    _give_headings(result, trial)
                assign_headings(trial, 0.0)
            if not is_path_free(grid, trial, footprint):
                if not was_headed:
                    assign_headings(result, 0.0)
                return result
            copy_into(trial, result)
    if not is_headed:
        assign_headings(result, 0.0)
    return result


@njit(cache=True)
def _give_headings(path, other):
    """Gives each pose of a path its heading, and that of another path the same."""
    assign_headings(path, 0.0)
    for i in range(path.shape[0]):
        other[i, 2] = path[i, 2]


@njit(cache=True)
def smooth_segment(
    path,
    grid,
    tolerance,
    max_iterations,
    w_data,
    w_smooth,
    refinement_num,
    off_map=LETHAL,
):
    """Smooths a path driven in one direction, as Nav2's standalone simple smoother does.

    Like `smooth_grid_path`, but the cell under a point is tested as soon as the point has moved,
    no footprint is, any path of three poses or more is taken, and headings are assigned at the end,
    by the non-holonomic rule: those of `path` tell whether it is driven backwards. off_map: the
    cost off the map. The smoothers of Nav2's Smac planners do the same up to Kilted.
    Returns the path, the number of passes that were begun, and whether the last was cut short.
    """
    result = _copied(path)
    if path.shape[0] <= 2:
        return result, 0, False
    is_cut_short = False
    begun = 0
    while begun <= refinement_num and not is_cut_short:
        begun += 1
        original = _copied(result)
        trial = _copied(result)
        sweeps = 0
        change = tolerance
        while change >= tolerance and not is_cut_short:
            sweeps += 1
            if sweeps >= max_iterations:
                is_cut_short = True
                break
            change = 0.0
            for i in range(1, path.shape[0] - 1):
                change += relax_point(original, trial, i, w_data, w_smooth)
                x, y = trial[i, 0], trial[i, 1]
                if _is_in_collision(cost_at(grid, x, y, off_map)):
                    is_cut_short = True
                    break
            if not is_cut_short:
                copy_into(trial, result)
    assign_headings(result, heading_offset(result))
    return result, begun, is_cut_short


def directional_segments(path: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Returns the (start, end) index pairs of the parts of a path that are driven in one direction.

    path: (N, 3). A part ends where the path turns back (the directions before and after a pose
    have a negative scalar product) and before a turn in place (the next pose coincides, with
    another heading). Neighbouring parts share the pose between them.
    """
    last = len(path) - 1
    steps = np.diff(path[:, :2], axis=0)
    turns_back = np.sum(steps[:-1] * steps[1:], axis=1) < 0.0
    stands = np.all(np.abs(steps[1:]) < COINCIDENT_M, axis=1)
    yaw_steps = np.array([wrap(angle) for angle in np.diff(path[1:, 2])])
    turns_in_place = stands & (np.abs(yaw_steps) > IN_PLACE_TURN_RAD)
    cuts = [int(i) + 1 for i in np.flatnonzero(turns_back | turns_in_place)]
    return list(zip([0, *cuts], [*cuts, last], strict=True))
