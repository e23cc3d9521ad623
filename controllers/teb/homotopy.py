"""Topologies: which obstacles a band leaves to its left and which to its right.

Obstacles that the robot cannot pass between form one cluster, with one anchor point inside it. Two
paths with the same ends belong to one class where they sweep the same angle about every anchor:
otherwise the angles differ by whole turns. That is exact in the plane, where TEB's H-signature
(Bhattacharya et al. 2012; Roesmann et al. 2017) needs a threshold. Paths past the other side of a
cluster come from a grid search that may not cross a cut from the anchor to the edge of the map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.distance_field import DistanceField
from drake_navbench.kernels.pair_heap import pop_pair, push_pair

# The grid search looks at every second cell: 0.1 m is enough for a first guess.
SEARCH_STRIDE_CELLS = 2
# How far from a blocked pose the cluster that blocks it is looked for: the robot's front, m.
LABEL_SEARCH_M = 1.0
DIAGONAL = math.sqrt(2.0)
LEFT, RIGHT = 1.0, -1.0
NO_CLUSTER = -1


class Clusters(NamedTuple):
    """Groups of obstacles that the robot cannot pass between.

    labels: (rows, columns) index of the cluster, or NO_CLUSTER where the robot's centre may be.
    anchors: (C, 2) m, the centre of the cell deepest inside each cluster.
    """

    labels: NDArray[np.int64]
    anchors: Array

    def label_near(self, point: Array, field: DistanceField) -> int | None:
        """Returns the cluster at a point (2,) m or in the cells around it, or None."""
        rows, columns = self.labels.shape
        column = int((point[0] - field.origin_x) / field.resolution)
        row = int((point[1] - field.origin_y) / field.resolution)
        reach = int(LABEL_SEARCH_M / field.resolution)
        window = self.labels[
            max(row - reach, 0) : min(row + reach + 1, rows),
            max(column - reach, 0) : min(column + reach + 1, columns),
        ]
        labelled = window[window != NO_CLUSTER]
        return int(np.bincount(labelled).argmax()) if labelled.size else None

    def labels_beside(self, point: Array, field: DistanceField, reach_m: float) -> list[int]:
        """Returns the clusters with cells within reach of a point (2,) m along both axes."""
        rows, columns = self.labels.shape
        column = int((point[0] - field.origin_x) / field.resolution)
        row = int((point[1] - field.origin_y) / field.resolution)
        reach = int(reach_m / field.resolution) + 1
        window = self.labels[
            max(row - reach, 0) : min(row + reach + 1, rows),
            max(column - reach, 0) : min(column + reach + 1, columns),
        ]
        return [int(label) for label in np.unique(window) if label != NO_CLUSTER]


@njit(cache=True)
def _flood(distances, clearance):
    """Returns (labels, deepest cell (C, 2) row and column) of 8-connected cells below clearance."""
    rows, columns = distances.shape
    labels = np.empty((rows, columns), dtype=np.int64)
    labels[:] = NO_CLUSTER
    deepest = np.empty((rows * columns, 2), dtype=np.int64)
    stack = np.empty(rows * columns, dtype=np.int64)
    count = 0
    for first in range(rows * columns):
        first_row, first_column = first // columns, first % columns
        if labels[first_row, first_column] >= 0 or distances[first_row, first_column] >= clearance:
            continue
        labels[first_row, first_column] = count
        stack[0] = first
        height = 1
        best_row, best_column = first_row, first_column
        while height > 0:
            height -= 1
            row, column = stack[height] // columns, stack[height] % columns
            if distances[row, column] < distances[best_row, best_column]:
                best_row, best_column = row, column
            for near_row in range(max(row - 1, 0), min(row + 2, rows)):
                for near_column in range(max(column - 1, 0), min(column + 2, columns)):
                    if (
                        labels[near_row, near_column] == NO_CLUSTER
                        and distances[near_row, near_column] < clearance
                    ):
                        labels[near_row, near_column] = count
                        stack[height] = near_row * columns + near_column
                        height += 1
        deepest[count, 0], deepest[count, 1] = best_row, best_column
        count += 1
    return labels, deepest[:count]


def find_clusters(field: DistanceField, clearance_m: float) -> Clusters:
    """Returns the clusters of obstacles closer together than twice the clearance."""
    labels, deepest = _flood(field.distances, clearance_m)
    anchors = np.empty((len(deepest), 2))
    anchors[:, 0] = field.origin_x + (deepest[:, 1] + 0.5) * field.resolution
    anchors[:, 1] = field.origin_y + (deepest[:, 0] + 0.5) * field.resolution
    return Clusters(labels, anchors)


@njit(cache=True)
def swept_angles(path, anchors):
    """Returns (C,) rad: the signed angle that a path (P, 2+) sweeps about each anchor (C, 2)."""
    angles = np.zeros(anchors.shape[0])
    for c in range(anchors.shape[0]):
        for i in range(path.shape[0] - 1):
            x0, y0 = path[i, 0] - anchors[c, 0], path[i, 1] - anchors[c, 1]
            x1, y1 = path[i + 1, 0] - anchors[c, 0], path[i + 1, 1] - anchors[c, 1]
            angles[c] += math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    return angles


def same_class(first_angles: Array, second_angles: Array) -> bool:
    """Whether two paths with common ends pass every cluster on the same side."""
    return bool(np.all(np.abs(first_angles - second_angles) < math.pi))


def class_name(angles: Array, reference: Array) -> str:
    """Returns the class as turns about each cluster against a reference, such as '0 -1 0'."""
    turns = np.rint((angles - reference) / (2.0 * math.pi)).astype(int)
    return " ".join(str(turn) for turn in turns)


@njit(cache=True)
def _cut(passable, row, column, step_row, step_column):
    """Blocks the coarse cells on a ray; two cells thick, so that no diagonal slips through."""
    rows, columns = passable.shape
    r, c = row, column
    while True:
        i, j = math.floor(r), math.floor(c)
        if not (0 <= i < rows and 0 <= j < columns):
            return
        passable[i, j] = False
        passable[min(i + 1, rows - 1), j] = False
        passable[i, min(j + 1, columns - 1)] = False
        r += 0.5 * step_row
        c += 0.5 * step_column


@njit(cache=True)
def _shortest_path(passable, start_row, start_column, goal_row, goal_column):
    """A* over 8-connected cells; returns (P, 2) rows and columns, empty where there is no path."""
    rows, columns = passable.shape
    cost = np.full(rows * columns, math.inf)
    parent = np.full(rows * columns, -1)
    start, goal = start_row * columns + start_column, goal_row * columns + goal_column
    cost[start] = 0.0
    keys, nodes = np.zeros(rows * columns), np.full(rows * columns, start)
    size = 1
    while size > 0:
        size -= 1
        node = pop_pair(keys, nodes, size + 1)
        if node == goal:
            break
        row, column = node // columns, node % columns
        for near_row in range(max(row - 1, 0), min(row + 2, rows)):
            for near_column in range(max(column - 1, 0), min(column + 2, columns)):
                near = near_row * columns + near_column
                if not passable[near_row, near_column] and near != goal:
                    continue
                step = DIAGONAL if near_row != row and near_column != column else 1.0
                if cost[node] + step < cost[near]:
                    cost[near] = cost[node] + step
                    parent[near] = node
                    ahead = math.hypot(near_row - goal_row, near_column - goal_column)
                    keys, nodes = push_pair(keys, nodes, size, cost[near] + ahead, near)
                    size += 1
    if not math.isfinite(cost[goal]):
        return np.empty((0, 2), dtype=np.int64)
    length = 1
    node = goal
    while parent[node] >= 0:
        node = parent[node]
        length += 1
    cells = np.empty((length, 2), dtype=np.int64)
    node = goal
    for i in range(length - 1, -1, -1):
        # One by one: a tuple would draw in the compiler's strings, for an error that cannot occur.
        cells[i, 0], cells[i, 1] = node // columns, node % columns
        node = parent[node]
    return cells


def path_past_cluster(
    field: DistanceField,
    clusters: Clusters,
    *,
    cluster: int,
    side: float,
    start: Array,
    goal: Array,
) -> Array | None:
    """Returns (P, 2) m, the shortest free path that passes a cluster on the given side, or None.

    side: LEFT leaves the cluster to the right of the straight line from start to goal.
    """
    passable = clusters.labels[::SEARCH_STRIDE_CELLS, ::SEARCH_STRIDE_CELLS] == NO_CLUSTER
    passable = np.ascontiguousarray(passable)
    cell = field.resolution * SEARCH_STRIDE_CELLS
    origin = np.array([field.origin_x, field.origin_y])

    def to_cell(point: Array) -> tuple[int, int]:
        column, row = np.floor((point[:2] - origin) / cell).astype(int)
        return (
            int(np.clip(row, 0, passable.shape[0] - 1)),
            int(np.clip(column, 0, passable.shape[1] - 1)),
        )

    ahead = goal[:2] - start[:2]
    distance = math.hypot(*ahead)
    if distance < cell:
        # Nothing lies between, and a cut without a direction would have no end.
        return None
    ahead = ahead / distance
    # The way past the left is open when the cut runs to the right, and the other way round.
    cut_direction = -side * np.array([-ahead[1], ahead[0]])
    anchor = (clusters.anchors[cluster] - origin) / cell
    _cut(passable, anchor[1], anchor[0], cut_direction[1], cut_direction[0])
    cells = _shortest_path(passable, *to_cell(start), *to_cell(goal))
    if len(cells) == 0:
        return None
    points = origin + (cells[:, ::-1] + 0.5) * cell
    return straighten(points, clusters, field)


def straighten(points: Array, clusters: Clusters, field: DistanceField) -> Array:
    """Returns the corners (P, 2) of a path: points that the free line of sight cannot skip."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        for j in range(len(points) - 1, kept[-1], -1):
            adjacent = j == kept[-1] + 1
            if adjacent or _sees(points[kept[-1]], points[j], clusters.labels, field):
                kept.append(j)
                break
    return points[kept]


@njit(cache=True)
def _line_is_free(x0, y0, x1, y1, labels, origin_x, origin_y, resolution):
    rows, columns = labels.shape
    steps = int(math.hypot(x1 - x0, y1 - y0) / (0.5 * resolution)) + 1
    for k in range(steps + 1):
        share = k / steps
        column = int((x0 + share * (x1 - x0) - origin_x) / resolution)
        row = int((y0 + share * (y1 - y0) - origin_y) / resolution)
        if labels[min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)] != NO_CLUSTER:
            return False
    return True


def _sees(a: Array, b: Array, labels: NDArray[np.int64], field: DistanceField) -> bool:
    return _line_is_free(
        a[0], a[1], b[0], b[1], labels, field.origin_x, field.origin_y, field.resolution
    )
