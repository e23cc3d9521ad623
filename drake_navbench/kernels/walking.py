"""The parts that all models of walking people share: states, personal traits, goals, headings.

A person is a row: x m, y m, yaw rad, vx m/s, vy m/s, walked way m, number of the goal, and for how
long the reaction has lasted, s.
"""

from __future__ import annotations

import math

from numba import njit

from drake_navbench.kernels.angles import wrap

X, Y, YAW, VX, VY, WALKED, GOAL, REACTED = range(8)
STATE_SIZE = 8
# The columns of a person's traits: desired speed m/s, body radius m, reaction, number of the group
# (-1: none), first and past-the-last row of the goals, whether they repeat, the angle between the
# desired direction and that to the goal, rad, and the time gap to the person ahead, s, 0 for none.
SPEED, RADIUS, REACTION, GROUP, FIRST_GOAL, PAST_GOAL, REPEATS, ASIDE, TIME_GAP = range(9)
TRAIT_SIZE = 9
REGULAR, IMPASSIVE, SURPRISED, SCARED, CURIOUS, THREATENING, OBLIVIOUS = range(7)

# The largest speed of people in all models, m/s.
TOP_SPEED_MPS = 2.5
GOAL_RADIUS_M = 0.3
TURN_RATE_RADPS = math.pi
# The length of a person in a queue, and half the width of the way ahead in which others count, m.
QUEUE_LENGTH_M = 0.3
# A person's heading follows the motion from this speed on, m/s.
WALKING_MPS = 0.05


@njit(cache=True)
def turned_towards(yaw, wanted, step):
    """Returns a heading turned towards another by no more than the turn rate allows."""
    turn = wrap(wanted - yaw)
    limit = TURN_RATE_RADPS * step
    return yaw + min(max(turn, -limit), limit)


@njit(cache=True)
def own_goal(person, traits, goals):
    """Returns the present goal (x, y) m of a person; switches to the next where it is reached."""
    first, past = int(traits[FIRST_GOAL]), int(traits[PAST_GOAL])
    goal = first + int(person[GOAL])
    if math.hypot(goals[goal, 0] - person[X], goals[goal, 1] - person[Y]) <= GOAL_RADIUS_M:
        if goal + 1 < past:
            person[GOAL] += 1
        elif traits[REPEATS] > 0.0:
            person[GOAL] = 0
        goal = first + int(person[GOAL])
    return goals[goal, 0], goals[goal, 1]


@njit(cache=True)
def pace_behind_others(index, people, time_gap, to_x, to_y, speed):
    """Returns the speed m/s at which a person keeps a time gap, s, to the one ahead.

    The speed of the collision-free speed model of Tordeux, Chraibi, Seyfried 2016: (d - l) /
    time_gap, with d the distance to the nearest centre ahead and l a length. to_x, to_y: unit
    vector to the person's goal, or zeros. speed: the speed without anyone ahead.
    """
    if time_gap <= 0.0:
        return speed
    nearest = math.inf
    for other in range(people.shape[0]):
        off_x, off_y = people[other, X] - people[index, X], people[other, Y] - people[index, Y]
        ahead = off_x * to_x + off_y * to_y
        if other != index and ahead > 0.0 and abs(off_x * to_y - off_y * to_x) <= QUEUE_LENGTH_M:
            nearest = min(nearest, math.hypot(off_x, off_y))
    return min(speed, max(0.0, (nearest - QUEUE_LENGTH_M) / time_gap))


@njit(cache=True)
def people_after(people, step):
    """Returns the people (P, 8) moved on by `step`, s, at their velocities."""
    after = people.copy()
    for i in range(people.shape[0]):
        after[i, X] += step * people[i, VX]
        after[i, Y] += step * people[i, VY]
        after[i, WALKED] += step * math.hypot(people[i, VX], people[i, VY])
    return after


@njit(cache=True)
def put_velocities(people, velocities):
    """Writes velocities (P, 2) m/s into the rows of people (P, 8).

    One number at a time: for a slice numba would also compile its error message, for seconds.
    """
    for i in range(people.shape[0]):
        people[i, VX], people[i, VY] = velocities[i, 0], velocities[i, 1]
