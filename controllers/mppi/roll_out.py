"""Roll-out of a chunk of samples, and the softmax average of the sampled controls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from drake_navbench.controllers.mppi.critics.batch import length_lanes
from drake_navbench.controllers.mppi.float32_math import ZERO
from drake_navbench.controllers.mppi.lanes import LANES
from drake_navbench.controllers.mppi.motion_models import (
    AXES,
    VY,
    clamp_noise_lanes,
    delay_lanes,
    pose_lanes,
    velocity_lanes,
)


class RollOutSetting(NamedTuple):
    """The settings for rolling out a batch; numbers are float32.

    pose: (3,) m, m, rad. speed, rise, fall: (3,) by axis, see `velocity_lanes`. cost_factors:
    (3,) gamma / sigma^2 by axis, 0 where the axis has no control cost. delayed: (3, D) earlier
    commands; delays: (3,) how many of them (the last ones) each axis uses. column_step: distance of
    the columns kept for path alignment.
    """

    pose: NDArray[np.float32]
    speed: NDArray[np.float32]
    rise: NDArray[np.float32]
    fall: NDArray[np.float32]
    cost_factors: NDArray[np.float32]
    delayed: NDArray[np.float32]
    delays: NDArray[np.int64]
    dt: np.float32
    holonomic: bool
    clamp_raw_controls: bool
    column_step: int


@register_jitable
def _roll_axis(setting, axis, controls, noise, clamped, velocities, costs):
    """Rolls out one axis of one block: velocities (N, LANES) and control costs (LANES,)."""
    velocity_lanes(
        setting.speed[axis], setting.rise[axis], setting.fall[axis], controls, noise, velocities
    )
    if setting.clamp_raw_controls:
        clamp_noise_lanes(controls, velocities, noise, clamped)
    source = clamped if setting.clamp_raw_controls else noise
    _control_cost_lanes(setting.cost_factors[axis], controls, source, costs)
    used = setting.delays[axis]
    delay_lanes(velocities, setting.delayed[axis, setting.delayed.shape[1] - used :])


@register_jitable
def _control_cost_lanes(factor, controls, noise, costs):
    """Writes factor sum of u (c - u) to `costs` (LANES,), with the sampled controls c = u + noise.

    The difference is taken from c as it was rounded to float32.
    """
    for lane in range(LANES):
        costs[lane] = ZERO
    for t in range(noise.shape[0]):
        control = controls[t]
        for lane in range(LANES):
            costs[lane] += control * ((control + noise[t, lane]) - control)
    for lane in range(LANES):
        costs[lane] *= factor


@register_jitable
def _keep_reach(column_step, block, x, y, yaw, reach):
    last = x.shape[0] - 1
    for lane in range(LANES):
        reach.end_x[block, lane] = x[last, lane]
        reach.end_y[block, lane] = y[last, lane]
        reach.end_yaw[block, lane] = yaw[last, lane]
        reach.length[block, lane] = ZERO
    length_lanes(x, y, reach.length[block])
    for k in range(reach.column_x.shape[1]):
        t = k * column_step
        for lane in range(LANES):
            reach.column_x[block, k, lane] = x[t, lane]
            reach.column_y[block, k, lane] = y[t, lane]
            reach.column_yaw[block, k, lane] = yaw[t, lane]


@njit(cache=True)
def roll_out(setting, controls, noise, clamped, first_block, chunk, reach, control_costs):
    """Rolls out the samples from block `first_block` on, as many as `chunk` has room for.

    controls: (3, N) mean sequence. noise: Noise. clamped: Noise, written where
    `clamp_raw_controls`, else not touched. chunk: Trajectories, reach: Reach of the whole batch
    and control_costs (3, blocks, LANES) by axis are written.
    """
    for slot in range(chunk.x.shape[0]):
        block = first_block + slot
        vx, vy, wz = chunk.vx[slot], chunk.vy[slot], chunk.wz[slot]
        x, y, yaw = chunk.x[slot], chunk.y[slot], chunk.yaw[slot]
        velocities = (vx, vy, wz)
        for axis in range(AXES):
            if axis == VY and not setting.holonomic:
                continue
            _roll_axis(
                setting,
                axis,
                controls[axis],
                noise[axis][block],
                clamped[axis][block],
                velocities[axis],
                control_costs[axis, block],
            )
        pose_lanes(setting.pose, setting.dt, setting.holonomic, vx, vy, wz, x, y, yaw)
        _keep_reach(setting.column_step, block, x, y, yaw, reach)


@njit(cache=True)
def softmax_weights(costs, temperature):
    """Returns exp(-(J - min J) / temperature) over its sum: costs, weights (B,) float32."""
    least = costs[0]
    for cost in costs:
        least = min(least, cost)
    weights = np.empty_like(costs)
    total = ZERO
    for b in range(costs.shape[0]):
        weights[b] = np.exp(-(costs[b] - least) / temperature)
        total += weights[b]
    for b in range(costs.shape[0]):
        weights[b] /= total
    return weights


@njit(cache=True)
def average_controls(weights, controls, noise):
    """Returns the weighted mean (N,) of the sampled controls of one axis.

    weights: (blocks, LANES), 0 in the padding. controls: (N,). noise: (blocks, N, LANES).
    """
    steps = controls.shape[0]
    sums = np.zeros((steps, LANES), np.float32)
    for block in range(noise.shape[0]):
        weight = weights[block]
        for t in range(steps):
            control = controls[t]
            row = noise[block, t]
            total = sums[t]
            for lane in range(LANES):
                total[lane] += weight[lane] * (control + row[lane])
    averages = np.empty(steps, np.float32)
    for t in range(steps):
        total = ZERO
        for lane in range(LANES):
            total += sums[t, lane]
        averages[t] = total
    return averages
