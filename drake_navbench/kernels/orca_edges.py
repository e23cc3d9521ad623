"""The half-planes of velocities that keep a walking person off edges; see `kernels.orca`.

Edges are those of polygons, in the columns below, with the solid side to their left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.half_planes import cross
from drake_navbench.kernels.walking import VX, VY, X, Y

# The columns of an edge: its start, m, the unit vector along it, the rows of the next and of the
# last edge, whether its start is a convex corner, and its velocity, m/s.
EDGE_X, EDGE_Y, ALONG_X, ALONG_Y, NEXT, BEFORE, CONVEX, EDGE_VX, EDGE_VY = range(9)
EDGE_SIZE = 9
# The side of a tangent; numba would compile it anew for each plain constant.
TO_LEFT, TO_RIGHT = np.bool_(True), np.bool_(False)
ROUNDING = 1e-5


def linked_edges(
    rings: Sequence[NDArray[np.float64]], velocities: Sequence[Sequence[float]] = ()
) -> NDArray[np.float64]:
    """Returns (N, 9) the edges of polygons (K, 2), m, with the solid side to the left of each.

    velocities: (vx, vy) m/s of each polygon; by default they stand.
    """
    rows, first = [np.empty((0, EDGE_SIZE))], 0
    for index, ring in enumerate(rings):
        count = len(ring)
        own = np.zeros((count, EDGE_SIZE))
        steps = np.roll(ring, -1, axis=0) - ring
        own[:, :2] = ring
        own[:, 2:4] = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
        own[:, NEXT] = first + (np.arange(count) + 1) % count
        own[:, BEFORE] = first + (np.arange(count) - 1) % count
        before = np.roll(own[:, 2:4], 1, axis=0)
        own[:, CONVEX] = before[:, 0] * own[:, 3] - before[:, 1] * own[:, 2] >= 0.0
        if len(velocities):
            own[:, EDGE_VX:] = velocities[index]
        rows.append(own)
        first += count
    return np.vstack(rows)


@njit(cache=True)
def unit(x, y, else_x, else_y):
    """Returns a vector's direction, or that of another vector where its length is 0."""
    size = math.hypot(x, y)
    if size < ROUNDING * ROUNDING:
        x, y = else_x, else_y
        size = math.hypot(x, y)
    if size == 0.0:
        return 1.0, 0.0
    return x / size, y / size


@njit(cache=True)
def add_edges(planes, person, radius, edges, horizon, top_speed):
    """Puts the half-planes of the edges in reach into `planes`; returns how many they are.

    horizon: the time for which the person keeps off edges, s.
    """
    near = np.empty(edges.shape[0], dtype=np.int64)
    squared = np.empty(edges.shape[0])
    found, count = 0, np.int64(0)
    for row in range(edges.shape[0]):
        x, y = edges[row, EDGE_X] - person[X], edges[row, EDGE_Y] - person[Y]
        # An edge counts for persons on its outer side alone.
        if cross(edges[row, ALONG_X], edges[row, ALONG_Y], x, y) <= 0.0:
            continue
        after = int(edges[row, NEXT])
        past_x, past_y = edges[after, EDGE_X] - person[X], edges[after, EDGE_Y] - person[Y]
        reach = horizon * (top_speed + math.hypot(edges[row, EDGE_VX], edges[row, EDGE_VY]))
        reach += radius
        if min(x, past_x) > reach or max(x, past_x) < -reach:
            continue
        if min(y, past_y) > reach or max(y, past_y) < -reach:
            continue
        away = _squared_to_segment(x, y, past_x, past_y)
        if away >= reach * reach:
            continue
        place = found
        while place > 0 and squared[place - 1] > away:
            near[place], squared[place] = near[place - 1], squared[place - 1]
            place -= 1
        near[place], squared[place] = row, away
        found += 1
    for place in range(found):
        row = near[place]
        if _is_covered(planes, count, person, radius, edges, row, horizon):
            continue
        evx, evy = edges[row, EDGE_VX], edges[row, EDGE_VY]
        is_one, px, py, dx, dy = _edge_half_plane(
            person[X], person[Y], person[VX] - evx, person[VY] - evy, radius, edges, row, horizon
        )
        if is_one:
            planes[count, 0], planes[count, 1] = px + evx, py + evy
            planes[count, 2], planes[count, 3] = dx, dy
            count += 1
    return count


@njit(cache=True)
def _squared_to_segment(x0, y0, x1, y1):
    """Returns the squared distance of the origin to a segment."""
    along_x, along_y = x1 - x0, y1 - y0
    share = -(x0 * along_x + y0 * along_y) / (along_x * along_x + along_y * along_y)
    share = min(max(share, 0.0), 1.0)
    return (x0 + share * along_x) ** 2 + (y0 + share * along_y) ** 2


@njit(cache=True)
def _is_covered(planes, count, person, radius, edges, row, horizon):
    """Tells whether an earlier half-plane already forbids every velocity that an edge would."""
    after = int(edges[row, NEXT])
    evx, evy = edges[row, EDGE_VX], edges[row, EDGE_VY]
    x0 = (edges[row, EDGE_X] - person[X]) / horizon + evx
    y0 = (edges[row, EDGE_Y] - person[Y]) / horizon + evy
    x1 = (edges[after, EDGE_X] - person[X]) / horizon + evx
    y1 = (edges[after, EDGE_Y] - person[Y]) / horizon + evy
    for plane in range(count):
        px, py, dx, dy = planes[plane]
        margin = radius / horizon - ROUNDING
        if cross(x0 - px, y0 - py, dx, dy) >= margin and cross(x1 - px, y1 - py, dx, dy) >= margin:
            return True
    return False


@njit(cache=True)
def _tangent(x, y, radius, to_left):
    """Returns the direction from the origin along a tangent of a disc at (x, y)."""
    squared = x * x + y * y
    leg = math.sqrt(max(squared - radius * radius, 0.0))
    if to_left:
        return (x * leg - y * radius) / squared, (x * radius + y * leg) / squared
    return (x * leg + y * radius) / squared, (-x * radius + y * leg) / squared


@njit(cache=True)
def _edge_half_plane(x, y, vx, vy, radius, edges, row, horizon):
    """Returns (exists, px, py, dx, dy): the half-plane of an edge for a person at (x, y).

    vx, vy: the person's velocity relative to the edge. Where the body overlaps the edge, only
    velocities away from the edge are allowed. No half-plane exists where that of a neighbouring
    edge suffices.
    """
    left, right = row, int(edges[row, NEXT])
    ex, ey = edges[row, ALONG_X], edges[row, ALONG_Y]
    x0, y0 = edges[left, EDGE_X] - x, edges[left, EDGE_Y] - y
    x1, y1 = edges[right, EDGE_X] - x, edges[right, EDGE_Y] - y
    # The person's place along the edge, as a share of its length, and the distance from its line.
    length = (x1 - x0) * ex + (y1 - y0) * ey
    share = -(x0 * ex + y0 * ey) / length
    aside = abs(cross(ex, ey, x0, y0))
    if share < 0.0 and x0 * x0 + y0 * y0 <= radius * radius:
        dx, dy = unit(-y0, x0, -ex, -ey)
        return edges[left, CONVEX] > 0.0, 0.0, 0.0, dx, dy
    if share > 1.0 and x1 * x1 + y1 * y1 <= radius * radius:
        dx, dy = unit(-y1, x1, -ex, -ey)
        is_own = cross(x1, y1, edges[right, ALONG_X], edges[right, ALONG_Y]) >= 0.0
        return edges[right, CONVEX] > 0.0 and is_own, 0.0, 0.0, dx, dy
    if 0.0 <= share < 1.0 and aside <= radius:
        return True, 0.0, 0.0, -ex, -ey

    # The legs of the velocity obstacle; for a person beyond an end, this end hides the other one.
    if share < 0.0 and aside <= radius:
        if edges[left, CONVEX] <= 0.0:
            return False, 0.0, 0.0, 0.0, 0.0
        right, x1, y1 = left, x0, y0
    elif share > 1.0 and aside <= radius:
        if edges[right, CONVEX] <= 0.0:
            return False, 0.0, 0.0, 0.0, 0.0
        left, x0, y0 = right, x1, y1
    left_x, left_y, left_is_own, right_x, right_y, right_is_own = _legs(
        edges, left, right, (x0, y0), (x1, y1), radius, (ex, ey)
    )
    return _half_plane_at_nearest(
        vx,
        vy,
        radius / horizon,
        (x0 / horizon, y0 / horizon, left_x, left_y, left_is_own),
        (x1 / horizon, y1 / horizon, right_x, right_y, right_is_own),
        left == right,
        (edges[left, ALONG_X], edges[left, ALONG_Y]),
    )


@njit(cache=True)
def _legs(edges, left, right, left_end, right_end, radius, along):
    """Returns (x, y, whether it is this edge's own): the directions of the left and the right leg.

    left, right: rows of the ends. left_end, right_end: m, relative to the person. along: direction
    of the edge.
    """
    x0, y0 = left_end
    x1, y1 = right_end
    ex, ey = along
    if edges[left, CONVEX] > 0.0:
        left_x, left_y = _tangent(x0, y0, radius, TO_LEFT)
    else:
        left_x, left_y = -ex, -ey
    if edges[right, CONVEX] > 0.0:
        right_x, right_y = _tangent(x1, y1, radius, TO_RIGHT)
    else:
        right_x, right_y = ex, ey
    # A leg that would lead into the neighbouring edge belongs to that edge.
    before = int(edges[left, BEFORE])
    left_is_own, right_is_own = True, True
    if edges[left, CONVEX] > 0.0:
        back_x, back_y = -edges[before, ALONG_X], -edges[before, ALONG_Y]
        if cross(left_x, left_y, back_x, back_y) >= 0.0:
            left_x, left_y, left_is_own = back_x, back_y, False
    if edges[right, CONVEX] > 0.0:
        ahead_x, ahead_y = edges[right, ALONG_X], edges[right, ALONG_Y]
        if cross(right_x, right_y, ahead_x, ahead_y) <= 0.0:
            right_x, right_y, right_is_own = ahead_x, ahead_y, False
    return left_x, left_y, left_is_own, right_x, right_y, right_is_own


@njit(cache=True)
def _half_plane_at_nearest(vx, vy, radius, left, right, is_point, along):
    """Returns (exists, px, py, dx, dy): the half-plane at the border's point nearest to v.

    The border is that of the velocity obstacle.

    left, right: x, y of the end of the cut-off, m/s, the direction of the leg from there, and
    whether it is this edge's own. is_point: both ends are one. along: direction of the edge.
    """
    x0, y0, left_x, left_y, left_is_own = left
    x1, y1, right_x, right_y, right_is_own = right
    cut_x, cut_y = x1 - x0, y1 - y0
    share = 0.5
    if not is_point:
        share = ((vx - x0) * cut_x + (vy - y0) * cut_y) / (cut_x * cut_x + cut_y * cut_y)
    on_left = (vx - x0) * left_x + (vy - y0) * left_y
    on_right = (vx - x1) * right_x + (vy - y1) * right_y
    if (share < 0.0 and on_left < 0.0) or (is_point and on_left < 0.0 and on_right < 0.0):
        nx, ny = unit(vx - x0, vy - y0, -x0, -y0)
        return True, x0 + radius * nx, y0 + radius * ny, ny, -nx
    if share > 1.0 and on_right < 0.0:
        nx, ny = unit(vx - x1, vy - y1, -x1, -y1)
        return True, x1 + radius * nx, y1 + radius * ny, ny, -nx
    to_cut, to_left, to_right = math.inf, math.inf, math.inf
    if 0.0 <= share <= 1.0 and not is_point:
        to_cut = (vx - x0 - share * cut_x) ** 2 + (vy - y0 - share * cut_y) ** 2
    if on_left >= 0.0:
        to_left = (vx - x0 - on_left * left_x) ** 2 + (vy - y0 - on_left * left_y) ** 2
    if on_right >= 0.0:
        to_right = (vx - x1 - on_right * right_x) ** 2 + (vy - y1 - on_right * right_y) ** 2
    if to_cut <= to_left and to_cut <= to_right:
        dx, dy, is_own = -along[0], -along[1], True
        x, y = x0, y0
    elif to_left <= to_right:
        dx, dy, is_own = left_x, left_y, left_is_own
        x, y = x0, y0
    else:
        dx, dy, is_own = -right_x, -right_y, right_is_own
        x, y = x1, y1
    return is_own, x - radius * dy, y + radius * dx, dx, dy
