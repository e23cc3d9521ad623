"""Walking by optimal reciprocal collision avoidance (ORCA).

Van den Berg, Guy, Lin, Manocha, "Reciprocal n-Body Collision Avoidance", 2011. A person takes the
velocity nearest to the preferred one within half-planes, one for each other person. A half-plane
avoids collisions with the other person for some time, if each of them does half of the avoiding;
from walls and other standing things a person keeps off alone. As in the authors' own library, the
half-plane of an edge touches its velocity obstacle at the point nearest to the person's present
velocity. Where the half-planes do not intersect, those of walls hold, and those of bodies are
violated as little as possible.

Edges are those of polygons, as in `kernels.orca_edges`. Discs are (M, 5) x m, y m, vx m/s, vy m/s,
radius m: bodies that do not give way. People are rows as in `kernels.walking`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.half_planes import HALF_PLANE_SIZE, allowed_velocity, cross
from drake_navbench.kernels.orca_edges import add_edges, unit
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

# The columns of the settings: the time horizons for bodies and for edges, s; the distance within
# which others count, m, and their largest number; the ratio of the largest to the preferred speed;
# the gap between two bodies, m.
HORIZON, EDGE_HORIZON, REACH, MOST, HASTE, MARGIN = range(6)
# The share of avoiding a body that does its part, and of one that does nothing.
HALF, WHOLE = 0.5, 1.0
# Numbers of a body that counts: its offset, m, radius, m, velocity, m/s, and the share of avoiding.
SEEN_SIZE = 6


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
        hard_count = add_edges(
            planes, after[i], traits[i, RADIUS], edges, settings[EDGE_HORIZON], top_speed
        )
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
    seen, found = _nearest_others(index, people, traits, world, settings)
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
def _nearest_others(index, people, traits, world, settings):
    """Returns (rows (S, 6), number of rows that count): the others in reach, the nearest first.

    world: discs and robot, as of `step_orca`. A row is an offset, m, a radius, m, a velocity, m/s,
    and the share of avoiding that falls to the person.
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
    return seen, found


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
    nx, ny = unit(wx, wy, -away_x, -away_y)
    depth = radius / within - math.hypot(wx, wy)
    return depth * nx, depth * ny, ny, -nx
