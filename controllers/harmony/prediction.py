"""Where the base will be when the next command arrives, and how long that takes.

A measured pose is old when it arrives, a cycle takes its time, and so does a command on its way.
Only the sum counts, from the pose to what the command answering it does; where it is not given it
is found by comparing what the base did with what its commands explain, for a few latencies. It is
taken to be none until then.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.base_response import Response, after_latency, answer
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# What is compared, s.
LATENCIES_S = read_only(np.arange(0.0, 0.51, 0.05))
# How much of the errors before counts a cycle later, and which part of the error of the latency
# assumed another one must have; below the last figure, (m/s)^2, nothing needs an explanation.
MEMORY, BETTER_RATIO, EXPLAINED = 0.95, 0.5, 2e-3
# A turn rate counts by the speed of a point so far from the axle, m.
LEVER_M = 0.3
# Commands older than this are forgotten, s.
OLDEST_S = 2.0


class Sent(NamedTuple):
    """What was commanded and what the base did: commands (H, 2), the oldest first, sent at times_s.

    twist: (2,) measured in the cycle before, at time_s. errors: (L,) of each of LATENCIES_S so far.
    latency: index of the one assumed.
    """

    commands: Array
    times_s: Array
    twist: Array
    time_s: float
    errors: Array
    latency: int


@njit(cache=True)
def _explained(response, twist, commands, times_s, begin_s, end_s, latency):
    """Returns (v, w) that commands sent `latency` s before they act make of a twist."""
    v, w = twist[0], twist[1]
    for h in range(commands.shape[0]):
        since = max(times_s[h] + latency, begin_s)
        until = end_s if h + 1 == commands.shape[0] else min(times_s[h + 1] + latency, end_s)
        if until > since:
            duration = until - since
            v = answer(response, v, commands[h, 0], response.acceleration, duration)
            w = answer(response, w, commands[h, 1], response.angular_acceleration, duration)
    return v, w


@njit(cache=True)
def _updated_errors(response, errors, latencies, twist, commands, times_s, begin_s, end_s, now):
    """Returns (L,) the squared errors of latencies, with what the base has done since begin_s."""
    updated = MEMORY * errors
    for k in range(latencies.shape[0]):
        v, w = _explained(response, twist, commands, times_s, begin_s, end_s, latencies[k])
        updated[k] += (now[0] - v) ** 2 + (LEVER_M * (now[1] - w)) ** 2
    return updated


def observed(sent: Sent | None, response: Response, twist: Array, time_s: float) -> Sent | None:
    """Returns what is known after a new measured twist (2,), at time_s."""
    if sent is None:
        return None
    errors = _updated_errors(
        response,
        sent.errors,
        LATENCIES_S,
        sent.twist,
        sent.commands,
        sent.times_s,
        sent.time_s,
        time_s,
        read_only(twist),
    )
    latency = sent.latency
    best = int(np.argmin(errors))
    assumed = errors[latency]
    if assumed > EXPLAINED and errors[best] < BETTER_RATIO * assumed:
        latency = best
    return sent._replace(
        errors=read_only(errors), latency=latency, twist=read_only(twist), time_s=time_s
    )


def with_command(sent: Sent | None, twist: Array, time_s: float, command: Array) -> Sent:
    """Returns what is known after a command (2,) more."""
    if sent is None:
        sent = Sent(
            np.zeros((0, 2)),
            np.zeros(0),
            read_only(twist),
            time_s,
            read_only(np.zeros(len(LATENCIES_S))),
            0,
        )
    keep = int(np.sum(sent.times_s < time_s - OLDEST_S))
    return sent._replace(
        commands=read_only(np.vstack([sent.commands[keep:], command[None]])),
        times_s=read_only(np.append(sent.times_s[keep:], time_s)),
    )


def predicted(
    sent: Sent | None,
    response: Response,
    *,
    pose: Array,
    twist: Array,
    time_s: float,
    latency_s: float,
) -> Array:
    """Returns (5,) x, y, yaw, v, w of the base `latency_s` after its pose (3,) and twist (2,).

    Until the first known command acts it goes on as it does.
    """
    if latency_s <= 0.0:
        return np.array([*pose, *twist])
    commands, times_s = np.asarray(twist)[None], np.array([-np.inf])
    if sent is not None:
        commands = np.concatenate([commands, sent.commands])
        times_s = np.concatenate([times_s, sent.times_s])
    begins = np.clip(times_s + latency_s, time_s, time_s + latency_s)
    durations = np.diff(begins, append=time_s + latency_s)
    return after_latency(
        response, read_only(pose), read_only(twist), read_only(commands), read_only(durations)
    )
