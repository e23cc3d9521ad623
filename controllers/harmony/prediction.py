"""The base's pose and speed when the next command takes effect, and the latency until then.

A measured pose is old when it arrives, a cycle takes time, and a command takes time on its way.
Only the sum counts: the latency from a pose to the effect of the command computed from it. Several
latencies are compared, and the controller assumes the one with which the commands best explain the
measured motion. Until then it assumes 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.controllers.harmony.base_response import Response, after_latency, answer
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# The latencies that are compared, s.
LATENCIES_S = read_only(np.arange(0.0, 0.51, 0.05))
# MEMORY: the weight that errors keep from one cycle to the next. BETTER_RATIO: another latency is
# assumed if its error is below this share of the present one's. EXPLAINED: smaller errors count as
# none, (m/s)^2.
MEMORY, BETTER_RATIO, EXPLAINED = 0.95, 0.5, 2e-3
# Turn rates are compared by the speed of a point at this distance from the axle's middle, m.
LEVER_M = 0.3
# Commands older than this are forgotten, s.
OLDEST_S = 2.0


class Sent(NamedTuple):
    """The last commands (H, 2), the oldest first, sent at times_s, and the errors of each latency.

    twist: (2,) measured in the last cycle, at time_s. errors: (L,) prediction error so far under
    each of LATENCIES_S. latency: index of the latency assumed.
    """

    commands: Array
    times_s: Array
    twist: Array
    time_s: float
    errors: Array
    latency: int


@njit(cache=True)
def _explained(response, twist, commands, times_s, begin_s, end_s, latency):
    """Returns (v, w) predicted from a twist by commands that act `latency` s after being sent."""
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
    """Returns (L,) the latencies' squared errors, updated by the base's motion since begin_s."""
    updated = MEMORY * errors
    for k in range(latencies.shape[0]):
        v, w = _explained(response, twist, commands, times_s, begin_s, end_s, latencies[k])
        updated[k] += (now[0] - v) ** 2 + (LEVER_M * (now[1] - w)) ** 2
    return updated


def observed(sent: Sent | None, response: Response, twist: Array, time_s: float) -> Sent | None:
    """Returns `sent` with the errors updated by a twist (2,) measured at time_s."""
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
    """Returns `sent` with one more command (2,), and without those older than OLDEST_S."""
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

    Until the first known command acts, the base keeps its twist.
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
