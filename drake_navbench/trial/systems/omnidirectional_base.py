"""The omnidirectional base: mecanum wheels, or others that move it sideways."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import Context

from drake_navbench.inputs.drive import OmnidirectionalDrive
from drake_navbench.kernels.arrays import Array
from drake_navbench.trial.systems.mobile_base import (
    MobileBase,
    clamped,
    command_variables,
    response,
)
from drake_navbench.trial.systems.ports import STATE_SIZE


class OmnidirectionalBase(MobileBase):
    """A base whose v, w and vy answer their commands separately; see MobileBase for the ports.

    Continuous state [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] in the world frame. The command is
    saturated axis by axis to the drive's limits.
    """

    def __init__(
        self, drive: OmnidirectionalDrive, scene_graph: SceneGraph, *, footprint: Array
    ) -> None:
        own_state = symbolic.MakeVectorVariable(STATE_SIZE, "state")
        command = command_variables()
        super().__init__(
            scene_graph,
            footprint=footprint,
            own_state=own_state,
            command=command,
            dynamics=_dynamics(drive, own_state, command),
            state=[1.0 * variable for variable in own_state],
        )

    def set_state(self, context: Context, state: Array) -> None:
        """See `MobileBase.set_state`."""
        context.SetContinuousState(state)


def _dynamics(
    drive: OmnidirectionalDrive, state: NDArray[np.object_], command: NDArray[np.object_]
) -> list[symbolic.Expression]:
    """Returns the time derivative of the state.

    dx = v cos(yaw) - vy sin(yaw), dy = v sin(yaw) + vy cos(yaw), dyaw = w, and for u in (v, w, vy):
    du = (u_command - u) / tau, cut to the acceleration limit; the command is cut to the velocity
    limits before. u is the velocity in the base frame, as at the wheels: the acceleration from the
    turning of that frame is not limited.
    """
    _, _, yaw, v, w, vy = state
    v_command = clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    w_limit, vy_limit = drive.max_angular_velocity_radps, drive.max_lateral_velocity_mps
    w_command = clamped(command[1], -w_limit, w_limit)
    vy_command = clamped(command[2], -vy_limit, vy_limit)
    tau = drive.response_time_constant_s
    return [
        v * symbolic.cos(yaw) - vy * symbolic.sin(yaw),
        v * symbolic.sin(yaw) + vy * symbolic.cos(yaw),
        w,
        response(v_command, v, tau, drive.max_linear_acceleration_mps2),
        response(w_command, w, tau, drive.max_angular_acceleration_radps2),
        response(vy_command, vy, tau, drive.max_lateral_acceleration_mps2),
    ]
