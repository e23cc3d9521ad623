"""The distance between an outline and many straight edges or circles, in the plane."""

from __future__ import annotations

import math

from numba import njit
from numba.extending import register_jitable


@njit(cache=True)
def outline_to_edges(outline, edges, limit):
    """Returns the distance from an outline to the nearest of many edges, m; inf beyond `limit` m.

    outline: (K, 2) corners of a polygon, m. edges: (N, 4) x0, y0, x1, y1 m. An edge that crosses
    the outline or lies inside it is at 0.
    """
    nearest_squared = limit * limit
    found = False
    # A column's .min() would take numba half a second to compile.
    min_x, min_y = max_x, max_y = outline[0, 0], outline[0, 1]
    for k in range(1, outline.shape[0]):
        min_x, max_x = min(min_x, outline[k, 0]), max(max_x, outline[k, 0])
        min_y, max_y = min(min_y, outline[k, 1]), max(max_y, outline[k, 1])
    for n in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[n, 0], edges[n, 1], edges[n, 2], edges[n, 3]
        gap_x = max(0.0, min(x0, x1) - max_x, min_x - max(x0, x1))
        gap_y = max(0.0, min(y0, y1) - max_y, min_y - max(y0, y1))
        if gap_x * gap_x + gap_y * gap_y > nearest_squared:
            continue
        squared = _outline_to_edge_squared(outline, x0, y0, x1, y1)
        if squared <= nearest_squared:
            nearest_squared, found = squared, True
    return math.sqrt(nearest_squared) if found else math.inf


@njit(cache=True)
def outline_to_circles(outline, circles, limit):
    """Returns the distance from an outline to the nearest of many discs, m; inf beyond `limit` m.

    outline: (K, 2) corners of a polygon, m. circles: (M, 3) x, y, radius m. A disc that overlaps
    the outline, or lies inside it, is at 0.
    """
    nearest = math.inf
    for m in range(circles.shape[0]):
        x, y, radius = circles[m, 0], circles[m, 1], circles[m, 2]
        squared = _outline_to_edge_squared(outline, x, y, x, y)
        nearest = min(nearest, max(0.0, math.sqrt(squared) - radius))
    return nearest if nearest <= limit else math.inf


@register_jitable
def _outline_to_edge_squared(outline, x0, y0, x1, y1):
    """Returns the squared distance from an outline to one edge."""
    is_inside = False
    nearest = math.inf
    count = outline.shape[0]
    for k in range(count):
        ax, ay = outline[k, 0], outline[k, 1]
        bx, by = outline[(k + 1) % count, 0], outline[(k + 1) % count, 1]
        if _cross(ax, ay, bx, by, x0, y0, x1, y1):
            return 0.0
        if (ay > y0) != (by > y0) and x0 < ax + (y0 - ay) * (bx - ax) / (by - ay):
            is_inside = not is_inside
        nearest = min(
            nearest,
            _point_to_edge_squared(ax, ay, x0, y0, x1, y1),
            _point_to_edge_squared(x0, y0, ax, ay, bx, by),
            _point_to_edge_squared(x1, y1, ax, ay, bx, by),
        )
    return 0.0 if is_inside else nearest


@register_jitable
def _side(ax, ay, bx, by, x, y):
    """Returns the side of the line from a to b on which a point lies: positive to the left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@register_jitable
def _cross(ax, ay, bx, by, x0, y0, x1, y1):
    """Returns whether two segments cross, ends that only touch excepted."""
    side_0, side_1 = _side(ax, ay, bx, by, x0, y0), _side(ax, ay, bx, by, x1, y1)
    side_a, side_b = _side(x0, y0, x1, y1, ax, ay), _side(x0, y0, x1, y1, bx, by)
    return side_0 * side_1 < 0.0 and side_a * side_b < 0.0


@register_jitable
def _point_to_edge_squared(x, y, x0, y0, x1, y1):
    """Returns the squared distance from a point to a segment."""
    along_x, along_y = x1 - x0, y1 - y0
    length_squared = along_x * along_x + along_y * along_y
    share = 0.0
    if length_squared > 0.0:
        share = ((x - x0) * along_x + (y - y0) * along_y) / length_squared
        share = min(max(share, 0.0), 1.0)
    gap_x, gap_y = x - (x0 + share * along_x), y - (y0 + share * along_y)
    return gap_x * gap_x + gap_y * gap_y
