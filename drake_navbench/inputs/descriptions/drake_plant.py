"""A model in a MultibodyPlant: links as bodies, wheels and casters on joints, all others fixed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Mesh, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    ModelInstanceIndex,
    RevoluteJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.body import TURNING, rolls
from drake_navbench.inputs.descriptions.meshes import mesh_files
from drake_navbench.inputs.descriptions.model import Joint, Link, Model
from drake_navbench.inputs.descriptions.model import Shape as ModelShape
from drake_navbench.inputs.descriptions.poses import inverse
from drake_navbench.kernels.arrays import Array

# A limit of an angle beyond this counts as none, rad.
ENDLESS_RAD = 1e3
# The most shapes of a model to draw: Drake's time grows with the square of their number.
MAX_DRAWN = 500


class DrawnShape(NamedTuple):
    """A shape to draw; pose: in the frame of its link. colour: RGBA, None: not given."""

    link: str
    name: str
    shape: Shape
    pose: RigidTransform
    colour: tuple[float, ...] | None


def add_bodies(
    plant: MultibodyPlant, model: Model, base: str, *, has_mass: bool
) -> ModelInstanceIndex:
    """Adds the links and joints of a model to a plant; returns their instance.

    base: the link to which links without a joint are fixed. Joints stay where they rest unless they
    turn without end or are named as wheels or casters. has_mass: whether links have their mass and
    inertia. Raises InputError where no body has such an inertia, or there is no name.
    """
    instance = plant.AddModelInstance(model.name or "robot")
    bodies = {}
    for name, link in model.links.items():
        if not name:
            raise InputError("a link has no name")
        inertia = _spatial_inertia(link) if has_mass else SpatialInertia.NaN()
        bodies[name] = plant.AddRigidBody(name, instance, inertia)
    held_by = dict(zip(bodies, bodies, strict=True))
    taken: set[str] = set()
    for joint in model.joints:
        _add_joint(plant, model, joint, bodies, held_by, taken)
    for name in bodies:
        if _holder(name, held_by) != _holder(base, held_by):
            pose = inverse(model.links[base].pose) @ model.links[name].pose
            plant.WeldFrames(bodies[base].body_frame(), bodies[name].body_frame(), _rigid(pose))
            held_by[_holder(name, held_by)] = base
    return instance


def _holder(name: str, held_by: dict[str, str]) -> str:
    """Returns a name shared by all links that joints connect with a link."""
    while held_by[name] != name:
        name = held_by[name]
    return name


def _add_joint(
    plant: MultibodyPlant,
    model: Model,
    joint: Joint,
    bodies: dict[str, RigidBody],
    held_by: dict[str, str],
    taken: set[str],
) -> None:
    """Adds a joint; a joint between links that are connected already is left out."""
    if joint.parent not in bodies or joint.child not in bodies:
        return
    parent, child = _holder(joint.parent, held_by), _holder(joint.child, held_by)
    if parent == child:
        return
    held_by[child] = parent
    name = joint.name or f"{joint.parent}_{joint.child}"
    while name in taken:
        name += "_"
    taken.add(name)
    on_parent = inverse(model.links[joint.parent].pose) @ joint.pose
    on_child = inverse(model.links[joint.child].pose) @ joint.pose
    low, high = joint.range_rad
    is_endless = low <= -ENDLESS_RAD and high >= ENDLESS_RAD
    # With a blank, so that no link has the frame's name.
    frames = {
        "frame_on_parent": _frame(plant, bodies[joint.parent], on_parent, f"{name} parent"),
        "frame_on_child": _frame(plant, bodies[joint.child], on_child, f"{name} child"),
    }
    axis = joint.pose[:3, :3].T @ joint.axis
    if joint.kind not in TURNING or not (is_endless or rolls(joint)) or not np.any(axis):
        ends = (frames["frame_on_parent"], frames["frame_on_child"])
        plant.AddJoint(WeldJoint(name, *ends, RigidTransform()))
        return
    least, most = (-math.inf, math.inf) if is_endless or low >= high else (low, high)
    plant.AddJoint(
        RevoluteJoint(
            name=name,
            **frames,
            axis=axis,
            pos_lower_limit=least,
            pos_upper_limit=most,
            damping=joint.damping_nms,
        )
    )


def _frame(plant: MultibodyPlant, body: RigidBody, pose: Array, name: str) -> FixedOffsetFrame:
    return plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), _rigid(pose)))


def _rigid(pose: Array) -> RigidTransform:
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(pose[:3, :3]), pose[:3, 3])


def _spatial_inertia(link: Link) -> SpatialInertia:
    if link.mass_kg == 0.0:
        return SpatialInertia.Zero()
    own = link.inertia_kgm2
    try:
        about_center = RotationalInertia(
            own[0, 0], own[1, 1], own[2, 2], own[0, 1], own[0, 2], own[1, 2]
        )
        return SpatialInertia.MakeFromCentralInertia(link.mass_kg, link.center_m, about_center)
    # Drake ends as SystemExit for a negative mass.
    except (RuntimeError, SystemExit, ValueError) as error:
        moments = ", ".join(f"{value:g}" for value in np.diag(own))
        raise InputError(
            f"link {link.name}: no body of {link.mass_kg:g} kg has the inertia {moments} kg m^2"
        ) from error


def drawn_shapes(model: Model) -> Iterator[DrawnShape]:
    """Yields the first MAX_DRAWN shapes of a model to draw; meshes that cannot be read are not."""
    shapes = [(link, shape) for link in model.links.values() for shape in link.shown]
    shapes = shapes[:MAX_DRAWN]
    meshes = [shape for _, shape in shapes if shape.kind == "mesh" and shape.mesh is not None]
    files = dict(zip(map(id, meshes), mesh_files(meshes), strict=True))
    for index, (link, shape) in enumerate(shapes):
        geometry = _geometry(shape, files.get(id(shape)))
        if geometry is not None:
            pose = _rigid(inverse(link.pose) @ shape.pose)
            name = shape.name or f"part_{index}"
            yield DrawnShape(link.name, name, geometry, pose, shape.colour)


def _geometry(shape: ModelShape, file: str | None) -> Shape | None:
    """Returns a shape of Drake's; None where it cannot be drawn."""
    if shape.kind == "mesh":
        return None if file is None or 0.0 in shape.size else Mesh(file, np.array(shape.size))
    if not shape.size or min(shape.size) <= 0.0:
        return None
    kinds = {
        "box": Box,
        "cylinder": Cylinder,
        "capsule": Capsule,
        "sphere": Sphere,
        "ellipsoid": Ellipsoid,
    }
    return kinds[shape.kind](*shape.size) if shape.kind in kinds else None
