"""Oscillation: a robot that turns to and fro on the spot must then turn to one side only.

teb_local_planner's FailureDetector and configureBackupModes (ros2-master); its shorter horizon
after failures is left out, because a comparison of two kinds of index never lets it begin.
"""

from __future__ import annotations

import numpy as np

from drake_navbench.controllers.teb_upstream.memory import TebUpstreamMemory
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.kernels.arrays import Array


def remember_command(
    memory: TebUpstreamMemory, parameters: TebUpstreamParameters, length: int
) -> Array:
    """Returns (K, 2) the history with the last command over its limits; `length` at most."""
    speed, rate = memory.last_command
    forward, backward = parameters.max_vel_x, parameters.max_vel_x_backwards
    limit = forward if speed >= 0.0 else backward
    turning = parameters.max_vel_theta
    if parameters.min_turning_radius > 0.0 and limit > 0.0:
        turning = max(limit / parameters.min_turning_radius, turning)
    share = speed / limit if limit > 0.0 else speed
    history = np.vstack([memory.history, [share, rate / turning]])[
        max(0, len(memory.history) + 1 - length) :
    ]
    history.flags.writeable = False
    return history


def is_oscillating(history: Array, parameters: TebUpstreamParameters, length: int) -> bool:
    """Whether the commands cancel out on average and turn to and fro more than once."""
    if len(history) < length // 2 or len(history) == 0:
        return False
    signs = np.sign(history[:, 1])
    mean_speed, mean_rate = np.abs(history.mean(axis=0))
    return bool(
        mean_speed < parameters.oscillation_v_eps
        and mean_rate < parameters.oscillation_omega_eps
        and np.count_nonzero(signs[1:] != signs[:-1]) > 1
    )


def update_preference(
    memory: TebUpstreamMemory,
    parameters: TebUpstreamParameters,
    *,
    time_s: float,
    turn_rate: float,
    length: int,
) -> TebUpstreamMemory:
    """Returns the memory with the side to turn to; only the present bands prefer it.

    turn_rate: measured, rad/s. length: length of the history.
    """
    if not parameters.oscillation_recovery or length == 0:
        return memory
    history = remember_command(memory, parameters, length)
    memory = memory._replace(history=history)
    lately = time_s - memory.oscillated_s < parameters.oscillation_recovery_min_duration
    if is_oscillating(history, parameters, length):
        turn = memory.preferred_turn
        if not lately:
            turn = 1.0 if turn_rate > 0.0 else -1.0
        memory = memory._replace(oscillated_s=time_s, preferred_turn=turn)
    elif not lately and memory.preferred_turn != 0.0:
        memory = memory._replace(preferred_turn=0.0)
    else:
        return memory
    told = tuple(
        band._replace(preferred_turn=memory.preferred_turn) for band in memory.planner.trajectories
    )
    return memory._replace(planner=memory.planner._replace(trajectories=told))
