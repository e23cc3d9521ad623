"""What a robot's SDF or URDF file tells: the outline of its shapes on the floor, and its mass."""

from __future__ import annotations

import re
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryId,
    Mesh,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame

from drake_navbench.errors import InputError, InputWarning, one_line
from drake_navbench.typed_files.model_file import add_models

Array = NDArray[np.float64]

BASE_LINK = "base_link"
# A round shape becomes a polygon with as many corners.
CIRCLE_CORNERS = 32
# Corners that lie within this of a straight edge are left out of the outline, m.
TOLERANCE_M = 1e-3
MAX_LINKS_NAMED = 5
# Drake's words for a mesh of another kind.
UNSUPPORTED_MESH = re.compile(r"unsupported extension '[^']*' for geometry data: (\S+?)\.?(?:\s|$)")


class RobotModel(NamedTuple):
    """outline: (K, 2) convex, counter-clockwise, around everything of the robot, seen from above,
    in the frame of its base link, m. mass_kg: of all links together.
    """

    outline: Array
    mass_kg: float


def read_robot_model(path: Path) -> RobotModel:
    """Returns outline and mass of the first model in an SDF or URDF file.

    The outline is that of its collision shapes, of what one sees where it has none, with all joints
    at zero. Meshes of visual shapes that are not there are left out with an InputWarning. Raises
    InputError where the file cannot be parsed, has no `base_link` or no shapes.
    """
    with tempfile.TemporaryDirectory() as folder:
        return _read(path, Path(folder))


def _read(path: Path, scratch: Path) -> RobotModel:
    scene_graph = SceneGraph()
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    try:
        left_out = add_models(plant, path, scratch).left_out
        base = _base_of(plant, path)
        plant.Finalize()
    # Drake reports a failed check as SystemExit.
    except (RuntimeError, ValueError, SystemExit) as error:
        raise _unreadable(path, error) from error
    context = plant.CreateDefaultContext()
    # Other links may stand above base_link in the tree, such as a base_footprint.
    to_base = base.CalcPoseInWorld(context).inverse()
    inspector = scene_graph.model_inspector()
    points: list[Array] = []
    for role in (Role.kProximity, Role.kIllustration):
        for geometry_id in sorted(inspector.GetAllGeometryIds(role), key=GeometryId.get_value):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry_id))
            pose = to_base @ body.EvalPoseInWorld(context) @ inspector.GetPoseInFrame(geometry_id)
            try:
                corners = np.vstack(list(_corners(inspector, geometry_id)))
            except RuntimeError as error:
                # A mesh that is only seen Drake looks at no earlier than here.
                raise _unreadable(path, error) from error
            points.append((pose.rotation().matrix() @ corners.T).T + pose.translation())
        if points:
            break
    if left_out:
        effect = "only seen" if role is Role.kProximity else "the outline is that of the others"
        remark = f"{path}: left out {_listed(left_out)}, no such file or package; {effect}"
        warnings.warn(remark, InputWarning, stacklevel=2)
    if not points:
        raise InputError(f"{path}: expected links with collision or visual shapes, found none")
    hull = shapely.MultiPoint(np.vstack(points)[:, :2]).convex_hull.simplify(TOLERANCE_M)
    if not isinstance(hull, shapely.Polygon):
        raise InputError(f"{path}: its shapes cover no area, seen from above")
    outline = np.round(shapely.get_coordinates(hull.normalize())[:-1], 4)[::-1]
    return RobotModel(outline, float(plant.CalcTotalMass(context)))


def _base_of(plant: MultibodyPlant, path: Path) -> Frame:
    """Returns the frame of the base link; raises InputError with the links where it is not there.

    Of several links of that name Drake tells, with a RuntimeError.
    """
    if plant.HasFrameNamed(BASE_LINK):
        return plant.GetFrameByName(BASE_LINK)
    links = [plant.get_body(BodyIndex(index)).name() for index in range(1, plant.num_bodies())]
    found = ", ".join(links[:MAX_LINKS_NAMED]) or "none"
    more = len(links) - MAX_LINKS_NAMED
    more_text = f" and {more} more" if more > 0 else ""
    raise InputError(f"{path}: expected a link {BASE_LINK}, found {found}{more_text}")


def _unreadable(path: Path, error: BaseException) -> InputError:
    mesh = UNSUPPORTED_MESH.search(str(error))
    if mesh is not None:
        remedy = "convert it, or give a footprint in a robot file"
        return InputError(
            f"{path}: expected meshes in .stl, .obj, .vtk or .gltf, found {mesh[1]}; {remedy}"
        )
    return InputError(f"{path}: cannot be read as a robot's model: {one_line(error)}")


def _listed(uris: tuple[str, ...]) -> str:
    more = f" and {len(uris) - 1} more" if len(uris) > 1 else ""
    return f"{uris[0]}{more}"


def _corners(inspector: SceneGraphInspector, geometry_id: GeometryId) -> Iterator[Array]:
    """Yields points (N, 3) m in a shape's own frame whose convex hull is the shape."""
    shape: Shape = inspector.GetShape(geometry_id)
    if isinstance(shape, Box):
        yield _box(0.5 * np.array(shape.size()))
    elif isinstance(shape, Cylinder):
        for end in (-0.5, 0.5):
            yield _circle(shape.radius(), end * shape.length())
    elif isinstance(shape, Sphere):
        yield _ball(np.full(3, shape.radius()))
    elif isinstance(shape, Ellipsoid):
        yield _ball(np.array([shape.a(), shape.b(), shape.c()]))
    elif isinstance(shape, Capsule):
        for end in (-0.5, 0.5):
            centre = np.array([0.0, 0.0, end * shape.length()])
            yield _ball(np.full(3, shape.radius())) + centre
    elif isinstance(shape, Mesh | Convex):
        hull = shape.GetConvexHull()
        yield np.array([hull.vertex(index) for index in range(hull.num_vertices())])
    else:
        # Such as a half space, which is no part of a robot.
        yield np.zeros((1, 3))


def _box(half: Array) -> Array:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return signs * half


def _circle(radius_m: float, height_m: float) -> Array:
    angles = 2.0 * np.pi * np.arange(CIRCLE_CORNERS) / CIRCLE_CORNERS
    height = np.full_like(angles, height_m)
    return np.column_stack([radius_m * np.cos(angles), radius_m * np.sin(angles), height])


def _ball(half_axes: Array) -> Array:
    around = _circle(1.0, 0.0)
    upright = around[:, [0, 2, 1]]
    across = around[:, [2, 0, 1]]
    return np.vstack([around, upright, across]) * half_axes
