"""Obstacles as Drake's shapes, for SceneGraph and for Meshcat alike."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    Convex,
    Cylinder,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix

from drake_navbench.inputs import world
from drake_navbench.inputs.moving_obstacles import MovingBox, MovingCylinder
from drake_navbench.inputs.world import World

OBSTACLE_COLOR = (0.45, 0.47, 0.50, 1.0)
MOVING_COLOR = (0.80, 0.52, 0.20, 1.0)
PERSON_COLOR = (0.30, 0.45, 0.60, 1.0)
PERSON_HEIGHT_M = 1.7


def obstacle_shapes(obstacle: world.Obstacle) -> Iterator[tuple[RigidTransform, Shape]]:
    """Yields convex shapes that make up an obstacle, with their poses in the world frame."""
    height = obstacle.height_m
    if isinstance(obstacle, world.Cylinder):
        pose = RigidTransform([*obstacle.centre, 0.5 * height])
        yield pose, Cylinder(obstacle.radius_m, height)
    elif isinstance(obstacle, world.Polygon):
        for piece in convex_pieces(obstacle.outline):
            yield RigidTransform(), prism(piece, height)
    else:
        yield _upright_box(obstacle.outline, height)


def moving_shape(thing: MovingCylinder | MovingBox) -> tuple[RigidTransform, Shape]:
    """Returns the shape of something that moves, with its pose in the thing's own frame."""
    pose = RigidTransform([0.0, 0.0, 0.5 * thing.height_m])
    if isinstance(thing, MovingCylinder):
        return pose, Cylinder(thing.radius_m, thing.height_m)
    return pose, Box(*thing.size_m, thing.height_m)


def body_of(radius_m: float) -> tuple[RigidTransform, Shape]:
    """Returns the shape of a person's body, and its pose in the person's frame."""
    pose = RigidTransform([0.0, 0.0, 0.5 * PERSON_HEIGHT_M])
    return pose, Cylinder(radius_m, PERSON_HEIGHT_M)


def prism(outline: NDArray[np.float64], height_m: float) -> Convex:
    """Returns an upright prism over the convex hull of (K, 2) corners, from the floor up."""
    corners = np.asarray(outline).T
    bottom = np.vstack([corners, np.zeros(corners.shape[1])])
    top = np.vstack([corners, np.full(corners.shape[1], height_m)])
    return Convex(points=np.hstack([bottom, top]), label="prism")


def register_obstacles(scene_graph: SceneGraph, obstacles: World) -> None:
    """Anchors all standing shapes of the world, to be seen; Clearance measures in the plane."""
    source_id = scene_graph.RegisterSource("obstacles")
    for index, obstacle in enumerate(obstacles.shapes):
        for piece, (pose, shape) in enumerate(obstacle_shapes(obstacle)):
            instance = GeometryInstance(pose, shape, f"obstacle_{index}_{piece}")
            geometry_id = scene_graph.RegisterAnchoredGeometry(source_id, instance)
            scene_graph.AssignRole(
                source_id, geometry_id, MakePhongIllustrationProperties(OBSTACLE_COLOR)
            )


def _upright_box(outline: NDArray[np.float64], height_m: float) -> tuple[RigidTransform, Box]:
    along, across = outline[1] - outline[0], outline[3] - outline[0]
    centre = outline.mean(axis=0)
    yaw = np.arctan2(along[1], along[0])
    pose = RigidTransform(RotationMatrix.MakeZRotation(yaw), [*centre, 0.5 * height_m])
    return pose, Box(np.hypot(*along), np.hypot(*across), height_m)


def convex_pieces(outline: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Returns convex outlines that cover a simple polygon (K, 2): itself, or its triangles."""
    polygon = shapely.Polygon(outline)
    if polygon.equals(polygon.convex_hull):
        return [outline]
    triangles = shapely.constrained_delaunay_triangles(polygon)
    return [shapely.get_coordinates(t)[:-1] for t in triangles.geoms]
