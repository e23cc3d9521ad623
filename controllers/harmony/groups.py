"""The side on which a motion passes each obstacle, by which samples are grouped.

Obstacles that the robot cannot pass between are one cluster with an anchor inside. A motion is
closed by the straight line to a point ahead that all motions share. It crosses the ray from an
anchor to the left of the way some number of times. Two motions with equal counts for all anchors
pass every cluster on the same side. Counting crossings needs no threshold and no angle.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A count is one of -1, 0 and 1; an integer holds this many of them as digits.
MOST_ANCHORS = 24
BASE = 3


def nearest_anchors(anchors: Array, pose: Array) -> Array:
    """Returns the MOST_ANCHORS anchors (C, 2) nearest to a pose (3,), the nearest first."""
    squared = np.sum((anchors - pose[:2]) ** 2, axis=1)
    return np.ascontiguousarray(anchors[np.argsort(squared, kind="stable")[:MOST_ANCHORS]])


@njit(cache=True)
def group_of(points, stride, anchors, beyond):
    """Returns the number of the group of a motion (M, 2+) m; looks at every stride-th point.

    anchors: (C, 2) m. beyond: (2,) m, where all motions of a cycle are led to in the end. The last
    point counts.
    """
    last = points.shape[0] - 1
    count = (last + stride - 1) // stride
    along_x, along_y = beyond[0] - points[0, 0], beyond[1] - points[0, 1]
    group, digit = 0, 1
    for c in range(anchors.shape[0]):
        anchor_x, anchor_y = anchors[c, 0], anchors[c, 1]
        crossings = 0
        x, y = points[0, 0] - anchor_x, points[0, 1] - anchor_y
        before_along, before_left = x * along_x + y * along_y, y * along_x - x * along_y
        for i in range(1, count + 2):
            if i <= count:
                place = min(i * stride, last)
                x, y = points[place, 0] - anchor_x, points[place, 1] - anchor_y
            else:
                x, y = beyond[0] - anchor_x, beyond[1] - anchor_y
            now_along, now_left = x * along_x + y * along_y, y * along_x - x * along_y
            if (before_along < 0.0) != (now_along < 0.0):
                share = before_along / (before_along - now_along)
                if before_left + share * (now_left - before_left) > 0.0:
                    crossings += 1 if now_along >= 0.0 else -1
            before_along, before_left = now_along, now_left
        group += digit * (min(max(crossings, -1), 1) + 1)
        digit *= BASE
    return group
