"""The differential base and its outline in SceneGraph."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    ProximityProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, ContinuousState, LeafSystem

from drake_navbench.robot import Drive
from drake_navbench.world_geometry import prism

STATE_SIZE = 5
# Tall enough to meet every obstacle, whatever its height: contact is judged in the plane.
FOOTPRINT_HEIGHT_M = 1.0
FOOTPRINT_COLOR = (0.0, 0.45, 0.7, 0.8)


class Wheelchair(LeafSystem):
    """A differential base with a first-order velocity response.

    Input `command` [v m/s, w rad/s], saturated to the drive's limits. Continuous state and output
    `state` [x m, y m, yaw rad, v m/s, w rad/s] in the world frame. Output `geometry_pose` places
    the frame that carries the footprint in SceneGraph. Numeric parameter 0 holds time constant s,
    acceleration limits m/s^2 and rad/s^2, and the velocity limits.

    dx = v cos(yaw), dy = v sin(yaw), dyaw = w, and for u in (v, w): du = (u_command - u) / tau,
    cut to the acceleration limit.
    """

    def __init__(
        self, drive: Drive, scene_graph: SceneGraph, *, footprint: NDArray[np.float64]
    ) -> None:
        super().__init__()
        unlimited = math.inf
        self._parameters = self.DeclareNumericParameter(
            BasicVector(
                [
                    drive.response_time_constant_s,
                    drive.max_linear_acceleration_mps2 or unlimited,
                    drive.max_angular_acceleration_radps2 or unlimited,
                    drive.min_linear_velocity_mps,
                    drive.max_linear_velocity_mps,
                    drive.max_angular_velocity_radps,
                ]
            )
        )
        self._state = self.DeclareContinuousState(STATE_SIZE)
        self._command_port = self.DeclareVectorInputPort("command", 2)
        self.DeclareStateOutputPort("state", self._state)
        self.source_id = scene_graph.RegisterSource("wheelchair")
        self.frame_id = scene_graph.RegisterFrame(self.source_id, GeometryFrame("base_link"))
        self.footprint_id = self._register_footprint(scene_graph, footprint)
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            self._calc_geometry_pose,
            prerequisites_of_calc={self.xc_ticket()},
        )

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

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        state = context.get_continuous_state_vector()
        pose = RigidTransform(RotationMatrix.MakeZRotation(state[2]), [state[0], state[1], 0.0])
        poses = FramePoseVector()
        poses.set_value(self.frame_id, pose)
        output.set_value(poses)

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        _, _, yaw, v, w = context.get_continuous_state_vector().CopyToVector().tolist()
        v_command, w_command = self._command_port.Eval(context).tolist()
        tau, v_rate, w_rate, v_min, v_max, w_max = (
            context.get_numeric_parameter(self._parameters).CopyToVector().tolist()
        )
        v_command = min(max(v_command, v_min), v_max)
        w_command = min(max(w_command, -w_max), w_max)
        derivatives.get_mutable_vector().SetFromVector(
            [
                v * math.cos(yaw),
                v * math.sin(yaw),
                w,
                min(max((v_command - v) / tau, -v_rate), v_rate),
                min(max((w_command - w) / tau, -w_rate), w_rate),
            ]
        )
