"""The differential base and its outline in SceneGraph."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, InputPort, OutputPort
from pydrake.systems.primitives import SymbolicVectorSystem

from drake_navbench.inputs.robot import Drive
from drake_navbench.inputs.world_geometry import convex_pieces, prism
from drake_navbench.systems.lifetime import weakly_bound

STATE_SIZE = 5
# Only to be seen: contact is judged in the plane, whatever the heights.
FOOTPRINT_HEIGHT_M = 1.0
FOOTPRINT_COLOR = (0.0, 0.45, 0.7, 0.8)


class Wheelchair(SymbolicVectorSystem):
    """A differential base with a first-order velocity response, and its footprint in SceneGraph.

    Input port `command` [v m/s, w rad/s], saturated to the drive's limits. Continuous state and
    output port `state` [x m, y m, yaw rad, v m/s, w rad/s] in the world frame. Output port
    `geometry_pose` places the frame that carries the footprint in SceneGraph. The equations of
    motion are symbolic: Drake evaluates them without calling Python.
    """

    def __init__(
        self, drive: Drive, scene_graph: SceneGraph, *, footprint: NDArray[np.float64]
    ) -> None:
        state = symbolic.MakeVectorVariable(STATE_SIZE, "state")
        command = symbolic.MakeVectorVariable(2, "command")
        super().__init__(
            state=state, input=command, dynamics=_dynamics(drive, state, command), output=state
        )
        self.source_id = scene_graph.RegisterSource("wheelchair")
        self.frame_id = scene_graph.RegisterFrame(self.source_id, GeometryFrame("base_link"))
        self._register_footprint(scene_graph, footprint)
        self._geometry_pose_port = self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc={self.xc_ticket()},
        )

    def get_command_input_port(self) -> InputPort:
        """Returns the port of the command [v m/s, w rad/s]."""
        return self.get_input_port(0)

    def get_state_output_port(self) -> OutputPort:
        """Returns the port of the state [x m, y m, yaw rad, v m/s, w rad/s]."""
        return self.get_output_port(0)

    def get_geometry_pose_output_port(self) -> OutputPort:
        """Returns the port for SceneGraph's source pose port."""
        return self._geometry_pose_port

    def _register_footprint(self, scene_graph: SceneGraph, footprint: NDArray[np.float64]) -> None:
        for index, piece in enumerate(convex_pieces(footprint)):
            shape = prism(piece, FOOTPRINT_HEIGHT_M)
            instance = GeometryInstance(RigidTransform(), shape, f"footprint_{index}")
            geometry_id = scene_graph.RegisterGeometry(self.source_id, self.frame_id, instance)
            scene_graph.AssignRole(
                self.source_id, geometry_id, MakePhongIllustrationProperties(FOOTPRINT_COLOR)
            )

    def set_pose(self, context: Context, pose: NDArray[np.float64]) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad."""
        context.SetContinuousState(np.concatenate([pose, [0.0, 0.0]]))

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw, _, _ = context.get_continuous_state_vector().CopyToVector().tolist()
        pose = RigidTransform(RotationMatrix.MakeZRotation(yaw), np.array([x, y, 0.0]))
        output.get_mutable_value().set_value(self.frame_id, pose)


def _dynamics(
    drive: Drive, state: NDArray[np.object_], command: NDArray[np.object_]
) -> list[symbolic.Expression]:
    """Returns the time derivative of the state.

    dx = v cos(yaw), dy = v sin(yaw), dyaw = w, and for u in (v, w): du = (u_command - u) / tau,
    cut to the acceleration limit; the command is cut to the velocity limits before.
    """
    _, _, yaw, v, w = state
    v_command = _clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    w_limit = drive.max_angular_velocity_radps
    w_command = _clamped(command[1], -w_limit, w_limit)
    tau = drive.response_time_constant_s
    v_rate = drive.max_linear_acceleration_mps2 or math.inf
    w_rate = drive.max_angular_acceleration_radps2 or math.inf
    return [
        v * symbolic.cos(yaw),
        v * symbolic.sin(yaw),
        w,
        _clamped((v_command - v) / tau, -v_rate, v_rate),
        _clamped((w_command - w) / tau, -w_rate, w_rate),
    ]


def _clamped(value: symbolic.Expression, low: float, high: float) -> symbolic.Expression:
    return symbolic.min(symbolic.max(value, low), high)
