"""The parts that all bases share: ports, a footprint in SceneGraph, a velocity response."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.common.value import AbstractValue
from pydrake.geometry import FramePoseVector, SceneGraph
from pydrake.systems.framework import Context, InputPort, OutputPort
from pydrake.systems.primitives import SymbolicVectorSystem

from drake_navbench.kernels.arrays import Array
from drake_navbench.trial.systems.footprint import planar_pose, register_footprint
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import COMMAND_SIZE


class BasePorts:
    """The ports of every base: `command`; `state` and `geometry_pose`, in this order."""

    def get_command_input_port(self: Any) -> InputPort:
        """Returns the port of the command [v m/s, w rad/s, vy m/s]."""
        return self.get_input_port(0)

    def get_state_output_port(self: Any) -> OutputPort:
        """Returns the port of the state [x m, y m, yaw rad, v m/s, w rad/s, vy m/s]."""
        return self.get_output_port(0)

    def get_geometry_pose_output_port(self: Any) -> OutputPort:
        """Returns the port for SceneGraph's source pose port."""
        return self.get_output_port(1)


class MobileBase(BasePorts, SymbolicVectorSystem):
    """Base of the bases: equations of motion that a subclass gives, and its footprint.

    Input port `command` [v m/s, w rad/s, vy m/s]. Output port `state` [x m, y m, yaw rad, v m/s,
    w rad/s, vy m/s] in the world frame; vy is the velocity to the left. The continuous state begins
    with [x m, y m, yaw rad]. Output port `geometry_pose` places the frame that carries the
    footprint in SceneGraph. The equations of motion are symbolic: Drake evaluates them without
    calling Python.

    own_state: symbolic, the continuous state. command: symbolic (3,). dynamics: time derivative of
    the state. state: symbolic (6,), the value of the output port `state`.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        *,
        footprint: Array,
        own_state: NDArray[np.object_],
        command: NDArray[np.object_],
        dynamics: list[Any],
        state: list[Any],
    ) -> None:
        super().__init__(state=own_state, input=command, dynamics=dynamics, output=state)
        self.source_id, self.frame_id = register_footprint(scene_graph, footprint)
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc={self.xc_ticket()},
        )

    def set_pose(self, context: Context, pose: Array) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad."""
        state = np.zeros(context.num_continuous_states())
        state[:3] = pose
        context.SetContinuousState(state)

    def set_state(self, context: Context, state: Array) -> None:
        """Sets the robot's state such that the output `state` equals `state` (6,)."""
        raise NotImplementedError

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw = context.get_continuous_state_vector().CopyToVector()[:3].tolist()
        output.get_mutable_value().set_value(self.frame_id, planar_pose(x, y, yaw))


def command_variables() -> NDArray[np.object_]:
    """Returns symbolic (3,) v m/s, w rad/s, vy m/s."""
    return np.asarray(symbolic.MakeVectorVariable(COMMAND_SIZE, "command"))


def response(wanted: Any, value: Any, time_constant_s: float, max_rate: float | None) -> Any:
    """Returns the rate of a value that follows `wanted`: (wanted - value) / tau, limited.

    max_rate: None for no limit.
    """
    limit = max_rate or math.inf
    return clamped((wanted - value) / time_constant_s, -limit, limit)


def clamped(value: Any, low: float, high: float) -> Any:
    """Returns a symbolic value within limits."""
    return symbolic.min(symbolic.max(value, low), high)
