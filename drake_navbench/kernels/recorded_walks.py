"""The states of recorded people at a time, in the form of `kernels.walking`.

A knot is a row: time s, x m, y m, yaw rad and walked way m. Between two knots of a person all of
them are linear in time. The times of a person's knots rise. A knot at FAR_AWAY_M says that the
person is absent between the knot before it and the knot after it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.moving_bodies import FAR_AWAY_M, first_later_row
from drake_navbench.kernels.walking import STATE_SIZE, VX, VY, WALKED, WALKING_MPS, YAW, X, Y

KNOT_SIZE = 5


@njit(cache=True)
def people_on_tracks(knots, firsts, time):
    """Returns (P, 8) the states of all people at a time, s; absent ones are at FAR_AWAY_M, at rest.

    knots: (K, 5) of all. firsts: (P + 1,) the first row of each person.
    """
    people = np.zeros((firsts.shape[0] - 1, STATE_SIZE))
    for person in range(people.shape[0]):
        low = first_later_row(knots, firsts[person], firsts[person + 1], time)
        is_there = low not in (firsts[person], firsts[person + 1])
        if not is_there or knots[low, 1] >= FAR_AWAY_M or knots[low - 1, 1] >= FAR_AWAY_M:
            people[person, X], people[person, Y] = FAR_AWAY_M, FAR_AWAY_M
            continue
        here, there = knots[low - 1], knots[low]
        duration = there[0] - here[0]
        share = (time - here[0]) / duration
        people[person, X] = (1.0 - share) * here[1] + share * there[1]
        people[person, Y] = (1.0 - share) * here[2] + share * there[2]
        people[person, YAW] = (1.0 - share) * here[3] + share * there[3]
        people[person, VX] = (there[1] - here[1]) / duration
        people[person, VY] = (there[2] - here[2]) / duration
        people[person, WALKED] = (1.0 - share) * here[4] + share * there[4]
    return people


def headings(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the heading (K,) rad at each row (K, 3) of time s, x m, y m.

    It is the direction from the row before to the row after. A person who hardly moves keeps the
    last heading. Headings are not wrapped: no step turns by more than pi.
    """
    before, after = np.vstack([rows[:1], rows[:-1]]), np.vstack([rows[1:], rows[-1:]])
    way = after - before
    yaws = np.arctan2(way[:, 2], way[:, 1])
    walks = np.hypot(way[:, 1], way[:, 2]) > WALKING_MPS * way[:, 0]
    if not walks.any():
        return np.zeros(len(rows))
    last = np.maximum.accumulate(np.where(walks, np.arange(len(rows)), np.argmax(walks)))
    return np.unwrap(yaws[last], period=2.0 * math.pi)
