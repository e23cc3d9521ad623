"""Ways past obstacles: a graph of points between start and goal, and a walk of its simple paths.

The points are drawn at random in a box (a roadmap) or lie beside every obstacle (keypoints). As
teb_local_planner's ProbRoadmapGraph and lrKeyPointGraph (ros2-master).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array

# Obstacles get no keypoints where the cosine of their angle off the goal's direction is below this.
LEAST_KEYPOINT_COSINE = 0.1
# Edges of a keypoint graph pass between the keypoints, so that half the distance is enough.
KEYPOINT_CLEARANCE_RATIO = 0.5


class Graph(NamedTuple):
    """points: (K, 2) m, the start first and the goal last. edges: (K, K) whether i leads to j."""

    points: Array
    edges: NDArray[np.bool_]


def roadmap(
    start: Array,
    goal: Array,
    obstacles: Array,
    *,
    samples: Array,
    width_m: float,
    length_ratio: float,
    clearance_m: float,
    least_cosine: float,
) -> Graph:
    """Returns the graph of points drawn in a box about the line from start to goal.

    samples: (K, 2) uniform in [0, 1), along and across the box.
    """
    ahead = goal[:2] - start[:2]
    distance = math.hypot(ahead[0], ahead[1])
    ahead = ahead / distance
    normal = np.array([-ahead[1], ahead[0]])
    corner = start[:2] + 0.5 * (1.0 - length_ratio) * distance * ahead - 0.5 * width_m * normal
    drawn = (
        corner
        + samples[:, :1] * (distance * length_ratio) * ahead
        + samples[:, 1:] * width_m * normal
    )
    points = np.vstack([start[:2], drawn, goal[:2]])
    edges = forward_edges(points, obstacles, ahead, clearance_m, least_cosine)
    return Graph(points, edges)


def keypoint_graph(
    start: Array, goal: Array, obstacles: Array, *, clearance_m: float, least_cosine: float
) -> Graph:
    """Returns the graph of two points beside each obstacle ahead, `clearance_m` from it."""
    ahead = goal[:2] - start[:2]
    distance = math.hypot(ahead[0], ahead[1])
    ahead = ahead / distance
    normal = clearance_m * np.array([-ahead[1], ahead[0]])
    offsets = obstacles - start[:2]
    distances = np.hypot(offsets[:, 0], offsets[:, 1])
    # An obstacle at the start has no direction; the original keeps it.
    is_ahead = ~(offsets @ ahead < LEAST_KEYPOINT_COSINE * distances)
    kept = obstacles[is_ahead]
    beside = np.stack([kept + normal, kept - normal], axis=1).reshape(-1, 2)
    points = np.vstack([start[:2], beside, goal[:2]])
    edges = forward_edges(
        points, obstacles, ahead, KEYPOINT_CLEARANCE_RATIO * clearance_m, least_cosine
    )
    if len(kept) and least_cosine != 0.0:
        nearest = int(np.argmin(distances[is_ahead]))
        heading = np.array([math.cos(start[2]), math.sin(start[2])])
        for index in (1 + 2 * nearest, 2 + 2 * nearest):
            way = points[index] - start[:2]
            if heading @ way <= least_cosine * np.hypot(*way):
                edges[0, index] = False
    return Graph(points, edges)


@njit(cache=True, error_model="numpy")
def forward_edges(points, obstacles, ahead, clearance, least_cosine):
    """Returns (K, K): which points (K, 2) see which, forward and with clearance (m) on the way."""
    count = points.shape[0]
    edges = np.zeros((count, count), dtype=np.bool_)
    for i in range(count - 1):
        for j in range(count):
            dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            squared = dx * dx + dy * dy
            if i == j or squared == 0.0:
                continue
            if (dx * ahead[0] + dy * ahead[1]) / math.sqrt(squared) <= least_cosine:
                continue
            is_free = True
            for k in range(obstacles.shape[0]):
                to_x, to_y = obstacles[k, 0] - points[i, 0], obstacles[k, 1] - points[i, 1]
                share = min(max((to_x * dx + to_y * dy) / squared, 0.0), 1.0)
                away_x, away_y = to_x - share * dx, to_y - share * dy
                if away_x * away_x + away_y * away_y < clearance * clearance:
                    is_free = False
                    break
            edges[i, j] = is_free
    return edges


class Walk(NamedTuple):
    """A walk through all simple paths of a graph of K points, depth first; `walk_on` moves it.

    path: (K,) points it is on, the start first. following: (K,) the next neighbour to try at each
    point. visited: (K,) whether a point is on the path.
    """

    path: NDArray[np.int64]
    following: NDArray[np.int64]
    visited: NDArray[np.bool_]


def walk_of(graph: Graph) -> Walk:
    """Returns a walk that has not begun; the length of its path is 0."""
    count = len(graph.points)
    return Walk(np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count, np.bool_))


@njit(cache=True, error_model="numpy")
def walk_on(edges, walk, length):
    """Moves a walk on to its next path: adds the next point, after going back as far as needed.

    edges: (K, K) as a graph's. A path may end at each point that leads to the goal, but does not
    contain the goal. length: length of the path so far. Returns its new length, 0 at the end of the
    walk.
    """
    path, following, visited = walk.path, walk.following, walk.visited
    goal = path.shape[0] - 1
    if not visited[0]:
        visited[0] = True
        return 1
    while length > 0:
        here = path[length - 1]
        for point in range(following[here], goal):
            if edges[here, point] and not visited[point]:
                following[here] = point + 1
                following[point] = 0
                visited[point] = True
                path[length] = point
                return length + 1
        if length > 1:
            visited[here] = False
        length -= 1
    return 0
