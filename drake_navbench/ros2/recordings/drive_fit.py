"""Finds lag, acceleration limits, deadband and dead time of a drive from a recording of it.

The model is the drive of a robot file with two further parts, which real drives have: a command
takes effect after a dead time, and one within the deadband does not move the robot at all.

    u = command(t - dead time), 0 where |u| < deadband
    dv/dt = (u - v) / tau, cut to the acceleration limit

Forward and turning motion are fitted together, since they share lag and dead time, by the least
squares of the velocities: a search over the whole range of the parameters (differential evolution,
always with the same seed) and then the simplex of Nelder and Mead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

import drake_navbench.kernels  # noqa: F401, before numba looks for what is compiled
from drake_navbench.errors import InputError
from drake_navbench.inputs.drive import LEAST_LAG_S
from drake_navbench.kernels.arrays import Array
from drake_navbench.ros2.recordings.drive_data import DriveData

STEP_S = 0.005
# The longest drive that is fitted, from the beginning of the recording, s.
LONGEST_S = 300.0
SHORTEST_S = 5.0
# The ranges of the search: lag s, dead time s, then for each axis the time in which it reaches its
# largest command, s, and the deadband as a share of that command.
LAGS_S, DEAD_TIMES_S = (LEAST_LAG_S, 1.5), (0.0, 0.5)
FASTEST_RISE_S, SLOWEST_RISE_S = 0.02, 10.0
DEADBAND_SHARES = (0.0, 0.6)
SEED = 0
# A part that explains less than this share of the squared error is not seen in the recording.
LEAST_GAIN = 0.02
MIN_COMMAND = 1e-3


@dataclass(frozen=True)
class AxisFit:
    """The fit of one axis, forward (m, s) or turning (rad, s); None: not seen in the recording.

    rms: root mean square of the velocity's error after the fit. least_command: the smallest command
    in the recording. explained: share of the velocities' variance that the fit explains; 1 for an
    axis that no command moves.
    """

    acceleration: float | None
    deadband: float | None
    rms: float
    least_command: float
    explained: float = 1.0


@dataclass(frozen=True)
class DriveFit:
    """The fitted parameters of a drive."""

    response_time_constant_s: float
    dead_time_s: float
    linear: AxisFit
    angular: AxisFit


@dataclass(frozen=True, eq=False)
class _Axis:
    """Commands and velocities of one axis on a grid of STEP_S, from 0.

    commands: (G,) held. samples: (N,) measured velocities. steps: (N,) the grid's step of each
    sample.
    """

    commands: Array
    samples: Array
    steps: NDArray[np.int64]
    largest: float

    def squared_error(self, lag_s: float, dead_s: float, rate: float, deadband: float) -> float:
        """Returns the mean squared error of the model's velocity."""
        velocity = _velocities(
            self.commands, self.samples[0], lag_s, dead_s / STEP_S, rate, deadband, STEP_S
        )
        return float(np.mean((velocity[self.steps] - self.samples) ** 2))


def fit_drive(data: DriveData) -> DriveFit:
    """Returns the parameters of the drive that fit a recording best.

    Raises InputError where the recording is too short or its commands do not move the robot.
    """
    axes = [_axis(data, index) for index in range(2)]
    if data.time_s[-1] - data.time_s[0] < SHORTEST_S or not any(axis.largest for axis in axes):
        raise InputError(
            f"--fit-drive: the commands last {data.time_s[-1] - data.time_s[0]:.1f} s and reach "
            f"{axes[0].largest:g} m/s and {axes[1].largest:g} rad/s; expected "
            f"{SHORTEST_S:g} s with changing commands at least"
        )
    moved = [axis for axis in axes if axis.largest]
    # Errors are scaled by the variance, so that fast turning does not outweigh slow driving.
    scales = [float(np.var(axis.samples)) or 1.0 for axis in moved]

    def cost(parameters: Array) -> float:
        lag_s, dead_s = parameters[:2]
        total = 0.0
        for k, (axis, scale) in enumerate(zip(moved, scales, strict=True)):
            rise_s, share = math.exp(parameters[2 + 2 * k]), parameters[3 + 2 * k]
            rate, deadband = axis.largest / rise_s, share * axis.largest
            total += axis.squared_error(math.exp(lag_s), dead_s, rate, deadband) / scale
        return total

    rises = (math.log(FASTEST_RISE_S), math.log(SLOWEST_RISE_S))
    bounds = [(math.log(LAGS_S[0]), math.log(LAGS_S[1])), DEAD_TIMES_S]
    bounds += [rises, DEADBAND_SHARES] * len(moved)
    found = differential_evolution(
        cost, bounds, seed=SEED, tol=1e-6, maxiter=150, popsize=10, polish=False
    )
    best = minimize(cost, found.x, method="Nelder-Mead", bounds=bounds, options={"maxiter": 800}).x
    lag_s, dead_s = math.exp(best[0]), float(best[1])
    fits = iter(
        _axis_fit(axis, lag_s, dead_s, math.exp(best[2 + 2 * k]), float(best[3 + 2 * k]))
        for k, axis in enumerate(moved)
    )
    still = AxisFit(None, None, 0.0, 0.0)
    linear, angular = (next(fits) if axis.largest else still for axis in axes)
    return DriveFit(lag_s, dead_s, linear, angular)


def as_yaml(fit: DriveFit, source: str) -> str:
    """Returns a fit as YAML for a robot file.

    Values for which a robot file has no field become remarks. Values that the recording does not
    show are left out with a remark.
    """
    lines = [
        f"# Fitted to {source}.",
        "drive:",
        f"  response_time_constant_s: {fit.response_time_constant_s:.4g}",
    ]
    remarks = [f"  # dead time before a command takes effect: {fit.dead_time_s:.3f} s"]
    for axis, field, unit in (
        (fit.linear, "max_linear_acceleration_mps2", "m/s"),
        (fit.angular, "max_angular_acceleration_radps2", "rad/s"),
    ):
        if axis.acceleration is None:
            remarks.append(f"  # {field}: no limit was reached")
        else:
            lines.append(f"  {field}: {axis.acceleration:.4g}")
        if axis.deadband is None:
            remarks.append(f"  # no deadband seen down to {axis.least_command:.3g} {unit}")
        else:
            remarks.append(f"  # deadband: commands below {axis.deadband:.3g} {unit} do nothing")
        remarks.append(f"  # the fit leaves {axis.rms:.3g} {unit} (root mean square)")
    return "\n".join([*lines, *remarks]) + "\n"


def _axis_fit(axis: _Axis, lag_s: float, dead_s: float, rise_s: float, share: float) -> AxisFit:
    """Returns the fit of an axis, without the parts that the recording does not show."""
    rate, deadband = axis.largest / rise_s, share * axis.largest
    error = axis.squared_error(lag_s, dead_s, rate, deadband)

    def matters(without: float) -> bool:
        return without > error * (1.0 + LEAST_GAIN)

    unlimited = axis.squared_error(lag_s, dead_s, math.inf, deadband)
    everything_moves = axis.squared_error(lag_s, dead_s, rate, 0.0)
    given = np.abs(axis.commands[np.abs(axis.commands) > MIN_COMMAND])
    inside, outside = given[given < deadband], given[given >= deadband]
    if len(inside) and len(outside):
        # The deadband lies between the largest command without effect and the least one with an
        # effect.
        deadband = 0.5 * float(inside.max() + outside.min())
    # A rise at the fast end of the search is no limit of the base.
    is_limit = rise_s > 1.05 * FASTEST_RISE_S and matters(unlimited)
    return AxisFit(
        acceleration=rate if is_limit else None,
        deadband=deadband if len(inside) and matters(everything_moves) else None,
        rms=math.sqrt(error),
        least_command=float(given.min()) if len(given) else 0.0,
        explained=1.0 - error / max(float(np.var(axis.samples)), 1e-12),
    )


def _axis(data: DriveData, index: int) -> _Axis:
    since_s = data.time_s - data.time_s[0]
    rows = since_s <= LONGEST_S
    steps = np.rint(since_s[rows] / STEP_S).astype(np.int64)
    grid = data.time_s[0] + STEP_S * np.arange(steps[-1] + 1)
    last = np.searchsorted(data.command_time_s, grid + 1e-9, side="right") - 1
    held = np.where(last >= 0, data.commands[np.maximum(last, 0), index], 0.0)
    largest = float(np.abs(held).max())
    return _Axis(
        np.ascontiguousarray(held),
        np.ascontiguousarray(data.twist[rows, index]),
        steps,
        largest if largest > MIN_COMMAND else 0.0,
    )


@njit(cache=True)
def _velocities(
    commands: Array,
    first: float,
    lag_s: float,
    dead_steps: float,
    rate: float,
    deadband: float,
    step_s: float,
) -> Array:
    """Returns (G,) the velocity on the grid of the commands; dead_steps may be no whole number.

    Within a step the command is held: an exponential, or where that is too steep a straight line.
    """
    velocity = np.empty(len(commands))
    decay = math.exp(-step_s / lag_s)
    whole = int(dead_steps)
    part = dead_steps - whole
    v = first
    velocity[0] = v
    for k in range(1, len(commands)):
        later, earlier = max(k - 1 - whole, 0), max(k - 2 - whole, 0)
        u, before = commands[later], commands[earlier]
        u = 0.0 if abs(u) < deadband else u
        before = 0.0 if abs(before) < deadband else before
        target = (1.0 - part) * u + part * before
        change = (target - v) * (1.0 - decay)
        if abs(target - v) > rate * lag_s:
            change = min(max(change, -rate * step_s), rate * step_s)
        v += change
        velocity[k] = v
    return velocity
