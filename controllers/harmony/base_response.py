"""The base's response to commands, on which the gatekeeper's prediction rests.

A first-order response with limited accelerations, dv/dt = (command - v) / time constant, and a
latency before it. Braking is the command 0, which is also what the controller server sends when
the controller gives up, so that the stop plan needs no controller.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.controller import ControllerSetup
from drake_navbench.controllers.harmony.motion import V, W, fill, stage_at

# The step of the prediction, s: a fifth of the shortest usual time constant.
STEP_S = 0.01
# A robot's own time constant counts only above this: where motors are simulated, they add to it.
LEAST_RESPONSE_S = 0.1
# A base slower than this is at rest, m/s and rad/s.
REST_MPS, REST_RADPS = 1e-3, 1e-3
# A base that brakes for longer than this, s, counts as unable to stop.
LONGEST_STOP_S = 5.0


class Response(NamedTuple):
    """The base's response: time constant s, largest accelerations m/s^2 and rad/s^2.

    most_v m/s, most_w rad/s: the largest commands that the base gets.
    """

    time_constant_s: float
    acceleration: float
    angular_acceleration: float
    most_v: float = math.inf
    most_w: float = math.inf


def response_of(setup: ControllerSetup) -> Response:
    """Returns the base's response to commands, by the robot's setup."""
    return Response(
        max(setup.response_time_constant_s, LEAST_RESPONSE_S),
        setup.max_linear_acceleration_mps2,
        setup.max_angular_acceleration_radps2,
        setup.max_linear_velocity_mps,
        setup.max_angular_velocity_radps,
    )


@njit(cache=True)
def answer(response, velocity, command, limit, duration_s):
    """Returns a velocity after some time under a constant command; limit: of the acceleration."""
    change = command - velocity
    if response.time_constant_s > 0.0:
        change *= 1.0 - math.exp(-duration_s / response.time_constant_s)
    reach = limit * duration_s
    return velocity + min(max(change, -reach), reach)


def braking_time(response: Response, speed: float, turn_rate: float) -> float:
    """Returns the time, s, for braking from a speed m/s and a turn rate rad/s to rest."""
    time_constant_s = response.time_constant_s
    return max(
        _time_to_rest(time_constant_s, response.acceleration, speed, REST_MPS),
        _time_to_rest(time_constant_s, response.angular_acceleration, turn_rate, REST_RADPS),
    )


def _time_to_rest(time_constant_s: float, limit: float, speed: float, rest: float) -> float:
    # The limit holds until the response asks for less than the limit; then the velocity decays.
    knee = min(speed, limit * time_constant_s) if time_constant_s > 0.0 else 0.0
    decay_s = time_constant_s * math.log(knee / rest) if knee > rest else 0.0
    return (speed - knee) / limit + decay_s


@njit(cache=True)
def follow(response, state, v, w, duration_s):
    """Moves `state` (5,) x, y, yaw, v, w in place by some time under a constant command."""
    next_v = answer(response, state[3], v, response.acceleration, duration_s)
    next_w = answer(response, state[4], w, response.angular_acceleration, duration_s)
    path = 0.5 * (state[3] + next_v) * duration_s
    turn = 0.5 * (state[4] + next_w) * duration_s
    heading = state[2] + 0.5 * turn
    state[0] += path * math.cos(heading)
    state[1] += path * math.sin(heading)
    state[2] += turn
    state[3], state[4] = next_v, next_w


@njit(cache=True)
def after_latency(response, pose, twist, sent, ages_s):
    """Returns (5,) the state when the next command will arrive, by the commands on their way.

    sent: (H, 2) commands, the oldest first. ages_s: (H,) the time for which each of them acts until
    then, s.
    """
    state = np.array([pose[0], pose[1], pose[2], twist[0], twist[1]])
    for h in range(sent.shape[0]):
        left = ages_s[h]
        while left > 1e-9:
            follow(response, state, sent[h, 0], sent[h, 1], min(left, STEP_S))
            left -= STEP_S
    return state


@njit(cache=True)
def command_of(response, plan, dt, period_s, cycle):
    """Returns the command (v, w) of a plan in cycle number `cycle`, from 0.

    A base that has the plan's velocities at the beginning of the cycle also has them at its end:
    the command makes up for the time constant, so that the base drives the plan itself.
    """
    before, after = stage_at(plan, dt, cycle * period_s), stage_at(plan, dt, (cycle + 1) * period_s)
    share = 1.0
    if response.time_constant_s > 0.0:
        share = 1.0 - math.exp(-period_s / response.time_constant_s)
    v = before[V] + (after[V] - before[V]) / share
    w = before[W] + (after[W] - before[W]) / share
    return (
        min(max(v, -response.most_v), response.most_v),
        min(max(w, -response.most_w), response.most_w),
    )


@njit(cache=True)
def steps_in(period_s):
    """Returns the number of steps of the prediction in a control period."""
    return max(math.ceil(period_s / STEP_S - 1e-9), 1)


@njit(cache=True)
def follow_then_brake(response, state, plan, dt, period_s, cycles):
    """Returns (M, 3) the poses of a base that follows a plan for some cycles and then brakes.

    state: (5,) x, y, yaw, v, w at the start. One pose each STEP_S until rest; no poses if the base
    does not come to rest within LONGEST_STOP_S.
    """
    moving = state.copy()
    steps_a_cycle = steps_in(period_s)
    step_s = period_s / steps_a_cycle
    most = cycles * steps_a_cycle + int(LONGEST_STOP_S / step_s) + 1
    poses = np.empty((most, 3))
    fill(poses[0], moving)
    count = 1
    for cycle in range(cycles):
        v, w = command_of(response, plan, dt, period_s, cycle)
        for _ in range(steps_a_cycle):
            follow(response, moving, v, w, step_s)
            fill(poses[count], moving)
            count += 1
    while count < most and (abs(moving[3]) > REST_MPS or abs(moving[4]) > REST_RADPS):
        follow(response, moving, 0.0, 0.0, step_s)
        fill(poses[count], moving)
        count += 1
    is_at_rest = abs(moving[3]) <= REST_MPS and abs(moving[4]) <= REST_RADPS
    return poses[:count] if is_at_rest else poses[:0]
