"""Draws a robot in a replay: the visuals of its SDF file, or a prism over its outline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import Rgba, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex, RevoluteJoint

from drake_navbench.analysis.replay.rolling import BaseMotion, rolled_angle, trailing_heading
from drake_navbench.inputs.descriptions.body import base_of
from drake_navbench.inputs.descriptions.drake_plant import DrawnShape, add_bodies, drawn_shapes
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.world_geometry import prism
from drake_navbench.kernels.arrays import Array

BASE_LINK = "base_link"
# Visuals whose names have this prefix take the controller's colour.
TINTED_PREFIX = "upholstery"
PRISM_HEIGHT_M = 0.3
DEFAULT_COLOR = Rgba(0.6, 0.6, 0.6, 1.0)
# A joint whose axis is steeper than 45 degrees is a caster's swivel, any other joint a wheel's
# axle.
STEEP_AXIS = np.sqrt(0.5)


@dataclass(frozen=True)
class Visual:
    """One shape of a link, in the link's frame; rgba: None for the controller's colour."""

    link: str
    name: str
    shape: Shape
    pose: RigidTransform
    rgba: Rgba | None


class PrismModel:
    """An upright prism over the outline (K, 2) m, for robots without a model file."""

    moving_links: tuple[str, ...] = ()

    def __init__(self, outline: Array) -> None:
        shape = prism(outline, PRISM_HEIGHT_M)
        self.visuals = (Visual(BASE_LINK, "prism", shape, RigidTransform(), None),)

    def link_poses(self, motion: BaseMotion, times_s: Array) -> Iterator[dict[str, RigidTransform]]:
        """Yields the poses of all links in the base frame at each of the times."""
        return ({BASE_LINK: RigidTransform()} for _ in times_s)

    def rest_poses(self) -> dict[str, RigidTransform]:
        """Returns the poses of all links in the base frame with all joints at rest."""
        return {BASE_LINK: RigidTransform()}


class SdfModel:
    """The first model in an SDF or URDF file; its base frame is that of `base_link`.

    Every revolute joint with a horizontal axis is a wheel that rolls without slip, every one with a
    vertical axis is the swivel of a trailing caster. Visuals whose meshes are missing are left out.

    caster_angles_rad: the casters' angles at the start of a motion, in the order of their joints;
    None: as in the file.

    visuals: everything to draw. moving_links: names of the links that wheels and casters move.
    """

    def __init__(self, path: Path, caster_angles_rad: Sequence[float] | None = None) -> None:
        self._start_angles = caster_angles_rad
        model = read_source(path).model
        base = base_of(model)
        self._plant = MultibodyPlant(0.0)
        add_bodies(self._plant, model, base, has_mass=False)
        self._plant.WeldFrames(self._plant.world_frame(), self._plant.GetFrameByName(base))
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        self._rest = self._plant.CreateDefaultContext()
        joints = [self._plant.get_joint(JointIndex(i)) for i in range(self._plant.num_joints())]
        self._joints = [joint for joint in joints if isinstance(joint, RevoluteJoint)]
        self.visuals = tuple(map(_visual, drawn_shapes(model)))
        self.moving_links = tuple(joint.child_body().name() for joint in self._joints)

    def link_poses(self, motion: BaseMotion, times_s: Array) -> Iterator[dict[str, RigidTransform]]:
        """Yields the poses of all links in the base frame at each of the times."""
        links = dict.fromkeys(visual.link for visual in self.visuals)
        bodies = [self._plant.GetBodyByName(link) for link in links]
        angles = {
            joint: np.interp(times_s, motion.time_s, values)
            for joint, values in self._joint_angles(motion)
        }
        for k in range(len(times_s)):
            for joint, values in angles.items():
                joint.set_angle(self._context, values[k])
            yield {body.name(): body.EvalPoseInWorld(self._context) for body in bodies}

    def rest_poses(self) -> dict[str, RigidTransform]:
        """Returns the poses of all links in the base frame with all joints at rest."""
        links = dict.fromkeys(visual.link for visual in self.visuals)
        return {link: self._plant.GetBodyByName(link).EvalPoseInWorld(self._rest) for link in links}

    def _joint_angles(self, motion: BaseMotion) -> Iterator[tuple[RevoluteJoint, Array]]:
        """Yields each revolute joint with its angles (T,) rad at the motion's times."""
        axles = [joint for joint in self._joints if not self._is_swivel(joint)]
        carried: set[str] = set()
        starts = iter(self._start_angles or ())
        for swivel in filter(self._is_swivel, self._joints):
            fork = swivel.child_body().name()
            own = [axle for axle in axles if axle.parent_body().name() == fork]
            carried |= {axle.name() for axle in own}
            if own:
                yield from self._caster_angles(swivel, own, motion, next(starts, None))
        for axle in axles:
            if axle.name() not in carried:
                position, axis = self._position_and_axis(axle)
                speed = motion.point_velocity(position[:2]) @ _rolling_direction(axis)
                yield axle, rolled_angle(motion.time_s, speed, position[2])

    def _caster_angles(
        self,
        swivel: RevoluteJoint,
        axles: list[RevoluteJoint],
        motion: BaseMotion,
        start_rad: float | None,
    ) -> Iterator[tuple[RevoluteJoint, Array]]:
        """Yields the angles of a caster's joints; start_rad: its first heading, None: at rest."""
        pivot, axis = self._position_and_axis(swivel)
        contact, axle_axis = self._position_and_axis(axles[0])
        ahead = pivot[:2] - contact[:2]
        rest_rad = np.arctan2(ahead[1], ahead[0])
        velocity = motion.point_velocity(pivot[:2])
        heading = trailing_heading(
            motion,
            velocity,
            trail_m=np.hypot(*ahead),
            initial_rad=rest_rad if start_rad is None else start_rad,
        )
        yield swivel, np.sign(axis[2]) * (heading - rest_rad)
        speed = velocity[:, 0] * np.cos(heading) + velocity[:, 1] * np.sin(heading)
        speed *= np.sign(_rolling_direction(axle_axis) @ ahead)
        for axle in axles:
            yield axle, rolled_angle(motion.time_s, speed, contact[2])

    def _is_swivel(self, joint: RevoluteJoint) -> bool:
        return abs(self._position_and_axis(joint)[1][2]) > STEEP_AXIS

    def _position_and_axis(self, joint: RevoluteJoint) -> tuple[Array, Array]:
        """Returns origin (3,) m and axis (3,) of a joint in the base frame at rest."""
        pose = joint.frame_on_parent().CalcPoseInWorld(self._rest)
        return pose.translation(), pose.rotation().matrix() @ joint.revolute_axis()


def _visual(drawn: DrawnShape) -> Visual:
    colour = DEFAULT_COLOR if drawn.colour is None else Rgba(*np.clip(drawn.colour, 0.0, 1.0))
    is_tinted = drawn.name.startswith(TINTED_PREFIX)
    return Visual(drawn.link, drawn.name, drawn.shape, drawn.pose, None if is_tinted else colour)


def _rolling_direction(axis: Array) -> Array:
    """Returns the rolling direction (2,) of a wheel about `axis` (3,): axis cross z (y gives x)."""
    return np.array([axis[1], -axis[0]])


RobotModel = PrismModel | SdfModel


def load_model(
    path: Path | None, outline: Array, caster_angles_rad: Sequence[float] | None = None
) -> RobotModel:
    """Returns the model in a file, or without a file a prism over the outline (K, 2) m.

    caster_angles_rad: see `SdfModel`.
    """
    return PrismModel(outline) if path is None else SdfModel(path, caster_angles_rad)
