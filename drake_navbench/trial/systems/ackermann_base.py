"""The car-like base: steered front wheels, which need time to turn."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import Context

from drake_navbench.inputs.drive import AckermannDrive
from drake_navbench.kernels.arrays import Array
from drake_navbench.trial.systems.mobile_base import (
    MobileBase,
    clamped,
    command_variables,
    response,
)

OWN_STATE_SIZE = 5
# Below this speed the curvature w / v loses its meaning; the wheels go straight, as
# the usual converters from twists to steering angles have it for a command of v = 0.
STANDSTILL_MPS = 1e-3


class AckermannBase(MobileBase):
    """A car as a bicycle; see MobileBase for its ports.

    Continuous state [x m, y m, yaw rad, v m/s, steering angle rad] with v along the heading; the
    yaw rate in the port `state` is w = v tan(steering angle) / wheelbase, and its vy is -a w, with
    the middle of the rear axle a m ahead of the origin (`rear_axle_x_m`), where nothing slips
    sideways. A command asks for the curvature w / v, and so for a steering angle, cut to full lock;
    its vy has no effect. Commanded to turn in place it stands still.
    """

    def __init__(self, drive: AckermannDrive, scene_graph: SceneGraph, *, footprint: Array) -> None:
        self._wheelbase_m = drive.wheelbase_m
        own_state = symbolic.MakeVectorVariable(OWN_STATE_SIZE, "state")
        command = command_variables()
        x, y, yaw, v, steering = own_state
        w = v * symbolic.tan(steering) / drive.wheelbase_m
        super().__init__(
            scene_graph,
            footprint=footprint,
            own_state=own_state,
            command=command,
            dynamics=_dynamics(drive, own_state, command),
            state=[1.0 * x, 1.0 * y, 1.0 * yaw, 1.0 * v, w, _sideways(drive, w)],
        )

    def set_state(self, context: Context, state: Array) -> None:
        """See `MobileBase.set_state`; at rest the wheels stay as they are in the context."""
        x, y, yaw, v, w, _ = state.tolist()
        steering = context.get_continuous_state_vector().CopyToVector()[4]
        if v != 0.0:
            steering = math.atan(w * self._wheelbase_m / v)
        context.SetContinuousState([x, y, yaw, v, steering])


def _sideways(drive: AckermannDrive, w: symbolic.Expression) -> symbolic.Expression:
    """Returns the velocity of the base origin to the left, m/s."""
    return -drive.rear_axle_x_m * w if drive.rear_axle_x_m else symbolic.Expression(0.0)


def _dynamics(
    drive: AckermannDrive, state: NDArray[np.object_], command: NDArray[np.object_]
) -> list[symbolic.Expression]:
    """Returns the time derivative of the state.

    dx = v cos(yaw) - vy sin(yaw), dy = v sin(yaw) + vy cos(yaw), dyaw = w = v tan(s) / L with s the
    steering angle, L the wheelbase, vy = -a w, a the place of the rear axle; dv = (v_command - v) /
    tau and ds = (s_command - s) / tau, cut to the limits on the acceleration and on the steering
    rate. s_command = atan(L w_command / v_command).
    Source: S. M. LaValle, Planning Algorithms, 2006, 13.1.2.1.
    """
    _, _, yaw, v, steering = state
    v_command = clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    speed_squared = symbolic.max(command[0] * command[0], STANDSTILL_MPS**2)
    sharpest = 1.0 / drive.min_turning_radius_m
    curvature = clamped(command[1] * command[0] / speed_squared, -sharpest, sharpest)
    steering_command = symbolic.atan(drive.wheelbase_m * curvature)
    tau = drive.response_time_constant_s
    w = v * symbolic.tan(steering) / drive.wheelbase_m
    vy = _sideways(drive, w)
    return [
        v * symbolic.cos(yaw) - vy * symbolic.sin(yaw),
        v * symbolic.sin(yaw) + vy * symbolic.cos(yaw),
        w,
        response(v_command, v, tau, drive.max_linear_acceleration_mps2),
        response(steering_command, steering, tau, drive.max_steering_rate_radps),
    ]
