"""The outline of a robot in SceneGraph, and its pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    FrameId,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
    SourceId,
)
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.inputs.world_geometry import convex_pieces, prism

# The height of the outline matters for pictures alone: touches are judged in the plane.
FOOTPRINT_HEIGHT_M = 1.0
FOOTPRINT_COLOR = (0.0, 0.45, 0.7, 0.8)


def register_footprint(
    scene_graph: SceneGraph, footprint: NDArray[np.float64]
) -> tuple[SourceId, FrameId]:
    """Registers an outline (K, 2) m in the base frame; returns its source and its frame."""
    source_id = scene_graph.RegisterSource("base")
    frame_id = scene_graph.RegisterFrame(source_id, GeometryFrame("base_link"))
    for index, piece in enumerate(convex_pieces(footprint)):
        shape = prism(piece, FOOTPRINT_HEIGHT_M)
        instance = GeometryInstance(RigidTransform(), shape, f"footprint_{index}")
        geometry_id = scene_graph.RegisterGeometry(source_id, frame_id, instance)
        scene_graph.AssignRole(
            source_id, geometry_id, MakePhongIllustrationProperties(FOOTPRINT_COLOR)
        )
    return source_id, frame_id


def planar_pose(x: float, y: float, yaw: float) -> RigidTransform:
    """Returns the pose of a body on the floor; m, rad."""
    return RigidTransform(RotationMatrix.MakeZRotation(yaw), np.array([x, y, 0.0]))
