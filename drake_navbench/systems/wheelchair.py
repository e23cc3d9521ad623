"""The differential base and its outline in SceneGraph."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    ProximityProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import SymbolicVectorSystem

from drake_navbench.robot import Drive
from drake_navbench.world_geometry import prism

STATE_SIZE = 5
# Tall enough to meet every obstacle, whatever its height: contact is judged in the plane.
FOOTPRINT_HEIGHT_M = 1.0
FOOTPRINT_COLOR = (0.0, 0.45, 0.7, 0.8)


class Wheelchair(Diagram):
    """A differential base with a first-order velocity response, and its footprint in SceneGraph.

    Input `command` [v m/s, w rad/s], saturated to the drive's limits. Continuous state and output
    `state` [x m, y m, yaw rad, v m/s, w rad/s] in the world frame. Output `geometry_pose` places
    the frame that carries the footprint in SceneGraph.
    """

    def __init__(
        self, drive: Drive, scene_graph: SceneGraph, *, footprint: NDArray[np.float64]
    ) -> None:
        super().__init__()
        self.source_id = scene_graph.RegisterSource("wheelchair")
        self.frame_id = scene_graph.RegisterFrame(self.source_id, GeometryFrame("base_link"))
        self.footprint_id = self._register_footprint(scene_graph, footprint)
        builder = DiagramBuilder()
        dynamics = builder.AddNamedSystem("dynamics", make_dynamics(drive))
        base_link = builder.AddNamedSystem("base_link", _BaseLink(self.frame_id))
        builder.Connect(dynamics.get_output_port(), base_link.get_input_port())
        builder.ExportInput(dynamics.get_input_port(), "command")
        builder.ExportOutput(dynamics.get_output_port(), "state")
        builder.ExportOutput(base_link.get_output_port(), "geometry_pose")
        builder.BuildInto(self)

    def _register_footprint(self, scene_graph: SceneGraph, footprint: NDArray[np.float64]):
        shape = prism(footprint, FOOTPRINT_HEIGHT_M)
        instance = GeometryInstance(RigidTransform(), shape, "footprint")
        geometry_id = scene_graph.RegisterGeometry(self.source_id, self.frame_id, instance)
        scene_graph.AssignRole(self.source_id, geometry_id, ProximityProperties())
        scene_graph.AssignRole(
            self.source_id, geometry_id, MakePhongIllustrationProperties(FOOTPRINT_COLOR)
        )
        return geometry_id

    def set_pose(self, context: Context, pose: NDArray[np.float64]) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad."""
        context.SetContinuousState(np.concatenate([pose, [0.0, 0.0]]))


def make_dynamics(drive: Drive) -> SymbolicVectorSystem:
    """Returns the base's equations of motion as a system that Drake evaluates without Python.

    Input, state and output as those of `Wheelchair`.
    dx = v cos(yaw), dy = v sin(yaw), dyaw = w, and for u in (v, w): du = (u_command - u) / tau,
    cut to the acceleration limit; the command is cut to the velocity limits before.
    """
    state = symbolic.MakeVectorVariable(STATE_SIZE, "state")
    command = symbolic.MakeVectorVariable(2, "command")
    _, _, yaw, v, w = state
    v_command = _clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    w_limit = drive.max_angular_velocity_radps
    w_command = _clamped(command[1], -w_limit, w_limit)
    tau = drive.response_time_constant_s
    v_rate = drive.max_linear_acceleration_mps2 or math.inf
    w_rate = drive.max_angular_acceleration_radps2 or math.inf
    return SymbolicVectorSystem(
        state=state,
        input=command,
        dynamics=[
            v * symbolic.cos(yaw),
            v * symbolic.sin(yaw),
            w,
            _clamped((v_command - v) / tau, -v_rate, v_rate),
            _clamped((w_command - w) / tau, -w_rate, w_rate),
        ],
        output=state,
    )


def _clamped(value: symbolic.Expression, low: float, high: float) -> symbolic.Expression:
    return symbolic.min(symbolic.max(value, low), high)


class _BaseLink(LeafSystem):
    """Places the frame of the base in SceneGraph, where the state [x m, y m, yaw rad, ...] says."""

    def __init__(self, frame_id: FrameId) -> None:
        super().__init__()
        self._frame_id = frame_id
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            self._calc_geometry_pose,
            prerequisites_of_calc={self._state_port.ticket()},
        )

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw, _, _ = self._state_port.Eval(context).tolist()
        pose = RigidTransform(RotationMatrix.MakeZRotation(yaw), np.array([x, y, 0.0]))
        output.get_mutable_value().set_value(self._frame_id, pose)
