"""The differential base."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import Context

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.kernels.arrays import Array
from drake_navbench.trial.systems.mobile_base import (
    MobileBase,
    clamped,
    command_variables,
    response,
)

OWN_STATE_SIZE = 5


class Wheelchair(MobileBase):
    """A differential base with a first-order velocity response; see MobileBase for its ports.

    Continuous state [x m, y m, yaw rad, v m/s, w rad/s] in the world frame. The command is
    saturated to the drive's limits; its vy has no effect, and the state's vy is 0.
    """

    def __init__(
        self, drive: DifferentialDrive, scene_graph: SceneGraph, *, footprint: Array
    ) -> None:
        own_state = symbolic.MakeVectorVariable(OWN_STATE_SIZE, "state")
        command = command_variables()
        super().__init__(
            scene_graph,
            footprint=footprint,
            own_state=own_state,
            command=command,
            dynamics=_dynamics(drive, own_state, command),
            state=[*own_state, symbolic.Expression(0.0)],
        )

    def set_state(self, context: Context, state: Array) -> None:
        """See `MobileBase.set_state`."""
        context.SetContinuousState(state[:OWN_STATE_SIZE])


def _dynamics(
    drive: DifferentialDrive, state: NDArray[np.object_], command: NDArray[np.object_]
) -> list[symbolic.Expression]:
    """Returns the time derivative of the state.

    dx = v cos(yaw), dy = v sin(yaw), dyaw = w, and for u in (v, w): du = (u_command - u) / tau,
    cut to the acceleration limit; the command is cut to the velocity limits before.
    """
    _, _, yaw, v, w = state
    v_command = clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    w_limit = drive.max_angular_velocity_radps
    w_command = clamped(command[1], -w_limit, w_limit)
    tau = drive.response_time_constant_s
    return [
        v * symbolic.cos(yaw),
        v * symbolic.sin(yaw),
        w,
        response(v_command, v, tau, drive.max_linear_acceleration_mps2),
        response(w_command, w, tau, drive.max_angular_acceleration_radps2),
    ]
