"""The base's time constant and accelerations, learnt from its commands and measured velocities.

Each of them may differ by a given share from the robot's file. Candidates on a grid within this
share are simulated under the commands that were sent, from the first measured velocities on. A
candidate is possible if its velocities explain the measured ones as well as the best candidate's.
How far the possible candidates differ bounds the error of the prediction, at any speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.base_response import STEP_S, Response, answer
from drake_navbench.controllers.harmony.prediction import LEVER_M, Sent
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# The number of candidates' time constants and accelerations to either side of the given ones.
TIME_CONSTANTS, ACCELERATIONS = 6, 1
# A candidate is possible while its sum of squared errors exceeds the best one's by at most the
# square of DEVIATIONS times the variance. The variance is that of the best candidate's errors, but
# at least that of a deviation of LEAST_MPS, m/s.
DEVIATIONS, LEAST_MPS = 3.0, 0.002
# More than any base's acceleration; it stands for no limit, so that all accelerations are finite.
ENDLESS = 1e6


class Learnt(NamedTuple):
    """The candidates' errors up to the velocity measured at time_s, under one latency; both s.

    measured: the number of measured velocities. velocities: (K, 2) v m/s and w rad/s of each
    candidate. errors: (K,) its summed squared errors, (m/s)^2.
    """

    time_s: float
    latency_s: float
    velocities: Array
    errors: Array
    measured: int


def candidates_of(response: Response, share: float) -> Array:
    """Returns (K, 3) time constants s and accelerations m/s^2, rad/s^2; the first is as given.

    share: the largest relative error of each value.
    """
    sides = [share * np.linspace(-1.0, 1.0, 2 * n + 1) for n in (TIME_CONSTANTS, ACCELERATIONS)]
    slower, weaker = (part.ravel() for part in np.meshgrid(*sides, indexing="ij"))
    nearest_first = np.argsort(np.hypot(slower, weaker), kind="stable")
    ratios = 1.0 + np.column_stack([slower, weaker, weaker])[nearest_first]
    given = np.minimum(response[:3], ENDLESS)
    return read_only(given * (ratios if share > 0.0 else ratios[:1]))


@njit(cache=True)
def _answered(candidates, velocities, commands, begins, ends):
    """Returns the candidates' (K, 2) velocities after commands (H, 2).

    begins, ends: (H,) s, when each command begins and ends to act.
    """
    moved = velocities.copy()
    for k in range(candidates.shape[0]):
        base = Response(candidates[k, 0], candidates[k, 1], candidates[k, 2], np.inf, np.inf)
        for h in range(commands.shape[0]):
            left = ends[h] - begins[h]
            while left > 1e-9:
                step = min(left, STEP_S)
                moved[k, 0] = answer(base, moved[k, 0], commands[h, 0], base.acceleration, step)
                moved[k, 1] = answer(
                    base, moved[k, 1], commands[h, 1], base.angular_acceleration, step
                )
                left -= step
    return moved


def learnt(
    before: Learnt | None,
    candidates: Array,
    sent: Sent | None,
    *,
    twist: Array,
    time_s: float,
    latency_s: float,
) -> Learnt:
    """Returns the candidates' errors `before`, with that of a twist (2,) measured at time_s added.

    If the latency has changed, learning begins anew. sent: the commands until time_s; nothing can
    be learnt before the first of them acts.
    """
    known = sent is not None and sent.times_s[0] + latency_s <= time_s
    if before is None or before.latency_s != latency_s or not known:
        velocities = np.repeat(np.asarray(twist)[None], len(candidates), axis=0)
        return Learnt(time_s, latency_s, read_only(velocities), np.zeros(len(candidates)), 0)
    assert sent is not None
    begins = np.clip(sent.times_s + latency_s, before.time_s, time_s)
    velocities = _answered(
        candidates, before.velocities, sent.commands, begins, np.append(begins[1:], time_s)
    )
    off = (velocities - twist) * (1.0, LEVER_M)
    errors = before.errors + (off**2).sum(axis=1)
    return Learnt(time_s, latency_s, read_only(velocities), errors, before.measured + 1)


def possible_bases(learnt: Learnt, candidates: Array) -> Array:
    """Returns (M, 3) the candidates that explain what was measured, the best one first."""
    best = int(np.argmin(learnt.errors))
    variance = max(learnt.errors[best] / max(learnt.measured, 1), LEAST_MPS**2)
    worse = learnt.errors - learnt.errors[best]
    is_other = (worse <= DEVIATIONS**2 * variance) & (np.arange(len(candidates)) != best)
    return np.concatenate([candidates[best : best + 1], candidates[is_other]])


def prediction_error(possible: Array, velocities: Array, reach_m: float) -> Array:
    """Returns (K,) m: how far a point of the outline may lie from its prediction.

    The prediction takes the first candidate for the base; the error is the largest one that any
    other candidate would make. Driving and turning each add the larger of two ways: the way driven
    in the difference of the two time constants, and the difference of the two ways to rest.
    possible: (M, 3) candidates. velocities: (K, 2) largest speeds m/s and turn rates rad/s until
    rest. reach_m: distance of the farthest corner from the base.
    """
    lag_s = np.abs(possible[:, :1] - possible[0, 0])
    total = np.zeros((len(possible), len(velocities)))
    for axis, lever_m in ((1, 1.0), (2, reach_m)):
        most = velocities[:, axis - 1]
        ways = way_to_rest(possible, axis, most)
        total += lever_m * np.maximum(lag_s * most, np.abs(ways - ways[0]))
    return np.asarray(total.max(axis=0))


def way_to_rest(bases: Array, axis: int, speeds: Array) -> Array:
    """Returns (M, K) the ways, m or rad, from speeds (K,) to rest by the command 0.

    axis: the column of the acceleration a. With the time constant T, the speed falls by a until it
    is a T, then decays exponentially.
    """
    time_constants, limits = bases[:, :1], bases[:, axis, None]
    knee = np.minimum(speeds, limits * time_constants)
    return np.asarray(knee * time_constants + (speeds**2 - knee**2) / (2.0 * limits))
