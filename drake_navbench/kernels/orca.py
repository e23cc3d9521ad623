"""Walking by optimal reciprocal collision avoidance (ORCA).

Van den Berg, Guy, Lin, Manocha, "Reciprocal n-Body Collision Avoidance", 2011. A person takes the
velocity nearest to the preferred one within half-planes, one for each other person. A half-plane
avoids collisions with the other person for some time, if each of them does half of the avoiding;
from walls and other standing things a person keeps off alone. As in the authors' own library, the
half-plane of an edge touches its velocity obstacle at the point nearest to the person's present
velocity. Where the half-planes do not intersect, those of walls hold, and those of bodies are
violated as little as possible.

Edges are those of polygons, in the columns below, with the solid side to their left. Discs are
(M, 5) x m, y m, vx m/s, vy m/s, radius m: bodies that do not give way. People are rows as in
`kernels.walking`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.half_planes import HALF_PLANE_SIZE, allowed_velocity, cross
from drake_navbench.kernels.walking import (
    ASIDE,
    GOAL_RADIUS_M,
    OBLIVIOUS,
    RADIUS,
    REACTION,
    REGULAR,
    SPEED,
    TIME_GAP,
    TOP_SPEED_MPS,
    VX,
    VY,
    WALKING_MPS,
    YAW,
    X,
    Y,
    own_goal,
    pace_behind_others,
    people_after,
    put_velocities,
    turned_towards,
)

# The columns of an edge: its start, m, the unit vector along it, the rows of the next and of the
# last edge, whether its start is a convex corner, and its velocity, m/s.
EDGE_X, EDGE_Y, ALONG_X, ALONG_Y, NEXT, BEFORE, CONVEX, EDGE_VX, EDGE_VY = range(9)
EDGE_SIZE = 9
# The columns of the settings: the time horizons for bodies and for edges, s; the distance within
# which others count, m, and their largest number; the ratio of the largest to the preferred speed;
# the gap between two bodies, m.
HORIZON, EDGE_HORIZON, REACH, MOST, HASTE, MARGIN = range(6)
# The share of avoiding a body that does its part, and of one that does nothing.
HALF, WHOLE = 0.5, 1.0
# The side of a tangent; numba would compile it anew for each plain constant.
TO_LEFT, TO_RIGHT = np.bool_(True), np.bool_(False)
ROUNDING = 1e-5
# Numbers of a body that counts: its offset, m, radius, m, velocity, m/s, and the share of avoiding.
SEEN_SIZE = 6


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
def step_orca(people, traits, goals, world, robot, settings, step, period):
    """Returns (P, 8) the people `step` s later, with the velocities that they then choose.

    people: (P, 8), traits: (P, 9), goals: (G, 2) m of all. world: edges (N, 9) and discs (M, 5),
    see the module. robot: (5,) x m, y m, vx m/s, vy m/s and radius m of a disc around the robot.
    Regular people expect that it avoids them by half, impassive people that it does nothing.
    settings: (6,). period: the time for which they will keep the velocity that they choose, s.
    """
    edges, discs = world
    after = people_after(people, step)
    chosen = np.empty((people.shape[0], 2))
    others = people.shape[0] + discs.shape[0] + 1
    planes = np.empty((edges.shape[0] + others, HALF_PLANE_SIZE))
    for i in range(people.shape[0]):
        wished_x, wished_y, speed = _wished(i, after, traits[i], goals, period)
        top_speed = min(settings[HASTE] * speed, TOP_SPEED_MPS)
        hard_count = _add_edges(planes, after[i], traits[i, RADIUS], edges, settings, top_speed)
        count = _add_others(planes, hard_count, i, after, traits, (discs, robot), settings, period)
        vx, vy = allowed_velocity(planes, count, hard_count, top_speed, wished_x, wished_y)
        chosen[i, 0], chosen[i, 1] = vx, vy
        if math.hypot(vx, vy) > WALKING_MPS:
            after[i, YAW] = turned_towards(after[i, YAW], math.atan2(vy, vx), step)
    put_velocities(after, chosen)
    return after


@njit(cache=True)
def _wished(index, people, traits, goals, period):
    """Returns (vx, vy, speed) m/s: a person's preferred velocity, and the walking speed."""
    person = people[index]
    goal_x, goal_y = own_goal(person, traits, goals)
    to_x, to_y = goal_x - person[X], goal_y - person[Y]
    distance = math.hypot(to_x, to_y)
    speed = traits[SPEED]
    if distance <= GOAL_RADIUS_M:
        return 0.0, 0.0, speed
    pace = pace_behind_others(
        index, people, traits[TIME_GAP], to_x / distance, to_y / distance, speed
    )
    pace = min(pace, distance / period) / distance
    cos_aside, sin_aside = math.cos(traits[ASIDE]), math.sin(traits[ASIDE])
    wished_x = pace * (to_x * cos_aside - to_y * sin_aside)
    wished_y = pace * (to_x * sin_aside + to_y * cos_aside)
    return wished_x, wished_y, speed


@njit(cache=True)
def _add_others(planes, count, index, people, traits, world, settings, period):
    """Adds the half-planes of the nearest others to `planes`; returns how many there are then.

    world: discs and robot, as of `step_orca`.
    """
    discs, robot = world
    others = people.shape[0] + discs.shape[0] + 1
    seen = np.empty((others, SEEN_SIZE))
    squared = np.empty(others)
    found = 0
    x, y = people[index, X], people[index, Y]
    for other in range(others):
        share = HALF
        if other < people.shape[0]:
            if other == index:
                continue
            ox, oy = people[other, X], people[other, Y]
            ovx, ovy = people[other, VX], people[other, VY]
            radius = traits[other, RADIUS]
        elif other < people.shape[0] + discs.shape[0]:
            ox, oy, ovx, ovy, radius = discs[other - people.shape[0]]
            share = WHOLE
        elif traits[index, REACTION] != OBLIVIOUS:
            ox, oy, ovx, ovy, radius = robot
            share = HALF if traits[index, REACTION] == REGULAR else WHOLE
        else:
            continue
        away = (ox - x) ** 2 + (oy - y) ** 2
        if away >= settings[REACH] ** 2:
            continue
        # By distance, the nearest first; at most MOST of them.
        place = found
        while place > 0 and squared[place - 1] > away:
            place -= 1
        most = int(settings[MOST])
        if place >= most:
            continue
        for later in range(min(found, most - 1), place, -1):
            squared[later] = squared[later - 1]
            # One by one: a row would have numba compile its strings, for an error message.
            for column in range(SEEN_SIZE):
                seen[later, column] = seen[later - 1, column]
        squared[place] = away
        seen[place, 0], seen[place, 1], seen[place, 2] = ox - x, oy - y, radius
        seen[place, 3], seen[place, 4], seen[place, 5] = ovx, ovy, share
        found = min(found + 1, most)
    vx, vy = people[index, VX], people[index, VY]
    for row in range(found):
        away_x, away_y, radius, ovx, ovy, share = seen[row]
        ux, uy, dx, dy = _way_out(
            away_x,
            away_y,
            vx - ovx,
            vy - ovy,
            radius + traits[index, RADIUS] + settings[MARGIN],
            settings[HORIZON],
            period,
        )
        planes[count, 0], planes[count, 1] = vx + share * ux, vy + share * uy
        planes[count, 2], planes[count, 3] = dx, dy
        count += 1
    return count


@njit(cache=True)
def _unit(x, y, else_x, else_y):
    """Returns a vector's direction, or that of another vector where its length is 0."""
    size = math.hypot(x, y)
    if size < ROUNDING * ROUNDING:
        x, y = else_x, else_y
        size = math.hypot(x, y)
    if size == 0.0:
        return 1.0, 0.0
    return x / size, y / size


@njit(cache=True)
def _way_out(away_x, away_y, vx, vy, radius, horizon, period):
    """Returns (ux, uy, dx, dy): from a relative velocity the least change, m/s, to the edge of the
    velocity obstacle of a disc, and the direction of that edge.

    away_x, away_y: centre of the other relative to the person's, m. radius: sum of both radii.
    Bodies that overlap already have to be apart after a period.
    """
    squared = away_x * away_x + away_y * away_y
    if squared > radius * radius:
        wx, wy = vx - away_x / horizon, vy - away_y / horizon
        towards = wx * away_x + wy * away_y
        w_squared = wx * wx + wy * wy
        if not (towards < 0.0 and towards * towards > radius * radius * w_squared):
            leg = math.sqrt(squared - radius * radius)
            if cross(away_x, away_y, wx, wy) > 0.0:
                dx = (away_x * leg - away_y * radius) / squared
                dy = (away_x * radius + away_y * leg) / squared
            else:
                dx = -(away_x * leg + away_y * radius) / squared
                dy = -(-away_x * radius + away_y * leg) / squared
            along = vx * dx + vy * dy
            return along * dx - vx, along * dy - vy, dx, dy
        within = horizon
    else:
        within = period
        wx, wy = vx - away_x / within, vy - away_y / within
    nx, ny = _unit(wx, wy, -away_x, -away_y)
    depth = radius / within - math.hypot(wx, wy)
    return depth * nx, depth * ny, ny, -nx


@njit(cache=True)
def _add_edges(planes, person, radius, edges, settings, top_speed):
    """Puts the half-planes of the edges in reach into `planes`; returns how many they are."""
    near = np.empty(edges.shape[0], dtype=np.int64)
    squared = np.empty(edges.shape[0])
    found, count = 0, np.int64(0)
    horizon = settings[EDGE_HORIZON]
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
        dx, dy = _unit(-y0, x0, -ex, -ey)
        return edges[left, CONVEX] > 0.0, 0.0, 0.0, dx, dy
    if share > 1.0 and x1 * x1 + y1 * y1 <= radius * radius:
        dx, dy = _unit(-y1, x1, -ex, -ey)
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
        nx, ny = _unit(vx - x0, vy - y0, -x0, -y0)
        return True, x0 + radius * nx, y0 + radius * ny, ny, -nx
    if share > 1.0 and on_right < 0.0:
        nx, ny = _unit(vx - x1, vy - y1, -x1, -y1)
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
