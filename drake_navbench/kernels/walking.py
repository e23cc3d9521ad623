"""What every model of walking people has: their state, what each is like, goals and headings.

A person is a row: x m, y m, yaw rad, vx m/s, vy m/s, walked way m, number of the goal, and for how
long the reaction has lasted, s.
"""

from __future__ import annotations

import math

from numba import njit

from drake_navbench.kernels.angles import wrap

X, Y, YAW, VX, VY, WALKED, GOAL, REACTED = range(8)
STATE_SIZE = 8
# The columns of what each person is like: desired speed m/s, body radius m, reaction, number of
# the group (-1 none), first and past-the-last row of the goals, whether they repeat, and by what
# angle the direction that one wishes is off that to the goal, rad.
SPEED, RADIUS, REACTION, GROUP, FIRST_GOAL, PAST_GOAL, REPEATS, ASIDE = range(8)
TRAIT_SIZE = 8
REGULAR, IMPASSIVE, SURPRISED, SCARED, CURIOUS, THREATENING, OBLIVIOUS = range(7)

# Nobody walks faster, whatever the model.
TOP_SPEED_MPS = 2.5
GOAL_RADIUS_M = 0.3
TURN_RATE_RADPS = math.pi
# Slower than this nobody's heading follows the way.
WALKING_MPS = 0.05


@njit(cache=True)
def turned_towards(yaw, wanted, step):
    """Returns a heading turned towards another by no more than the turn rate allows."""
    turn = wrap(wanted - yaw)
    limit = TURN_RATE_RADPS * step
    return yaw + min(max(turn, -limit), limit)


@njit(cache=True)
def own_goal(person, traits, goals):
    """Returns (x, y) m of the goal on one's list, the next one where this one is reached."""
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
def people_after(people, step):
    """Returns (P, 8) the people where they are `step` s later, at the velocities that they had."""
    after = people.copy()
    for i in range(people.shape[0]):
        after[i, X] += step * people[i, VX]
        after[i, Y] += step * people[i, VY]
        after[i, WALKED] += step * math.hypot(people[i, VX], people[i, VY])
    return after
