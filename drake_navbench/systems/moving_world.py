"""What moves in the world besides the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, LeafSystem, OutputPort

from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import MOVING_COLOR, moving_shape
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.ports import POSE_SIZE, declare_object_output


class MovingWorld(LeafSystem):
    """Moves what moves along given ways, at every instant.

    Output `poses` [x m, y m, yaw rad] of each body in the world frame, one after the other, in the
    order of the scenario file. Output `outlines`: their edges (E, 4) and circles (D, 3) where they
    are, m. Output `geometry_pose` places them in SceneGraph. All three are functions of time alone,
    so that there is no state, and nothing is late.
    """

    def __init__(self, world: World, scene_graph: SceneGraph) -> None:
        super().__init__()
        self._moving = world.moving
        self.source_id = scene_graph.RegisterSource("moving_obstacles")
        self._frame_ids = self._register(scene_graph)
        self.DeclareVectorOutputPort(
            "poses",
            POSE_SIZE * len(world.moving),
            weakly_bound(self._calc_poses),
            prerequisites_of_calc={self.time_ticket()},
        )
        declare_object_output(self, "outlines", self._outlines, {self.time_ticket()})
        self._geometry_pose_port = self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc={self.time_ticket()},
        )

    def get_geometry_pose_output_port(self) -> OutputPort:
        """Returns the port for SceneGraph's source pose port."""
        return self._geometry_pose_port

    def poses(self, context: Context) -> NDArray[np.float64]:
        """Returns (B, 3) x m, y m, yaw rad of every body."""
        return self._moving.tracks.poses_at(context.get_time())

    def _calc_poses(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.poses(context).ravel())

    def _outlines(self, context: Context) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self._moving.bodies.placed(self.poses(context))

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        placed = output.get_mutable_value()
        for frame_id, (x, y, yaw) in zip(self._frame_ids, self.poses(context), strict=True):
            rotation = RotationMatrix.MakeZRotation(yaw)
            placed.set_value(frame_id, RigidTransform(rotation, [x, y, 0.0]))

    def _register(self, scene_graph: SceneGraph) -> list[FrameId]:
        frame_ids = []
        for index, thing in enumerate(self._moving.things):
            frame = GeometryFrame(f"moving_obstacle_{index}")
            frame_ids.append(scene_graph.RegisterFrame(self.source_id, frame))
            pose, shape = moving_shape(thing)
            instance = GeometryInstance(pose, shape, f"moving_obstacle_{index}")
            geometry_id = scene_graph.RegisterGeometry(self.source_id, frame_ids[-1], instance)
            scene_graph.AssignRole(
                self.source_id, geometry_id, MakePhongIllustrationProperties(MOVING_COLOR)
            )
        return frame_ids
