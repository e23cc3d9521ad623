"""The wheels, casters and weight of a robot, read from its SDF or URDF file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JointIndex,
    ModelInstanceIndex,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
)

from drake_navbench.errors import InputError
from drake_navbench.inputs.actuators import GRAVITY_MPS2
from drake_navbench.inputs.descriptions.drake_plant import add_bodies
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.wheels import MIN_TRAIL_M
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable

BASE_LINK = "base_link"
# An axis steeper than 45 degrees is a caster's swivel, any other one a wheel's axle.
STEEP_AXIS = math.sqrt(0.5)
# The largest distance of the driven wheels' axle from x = 0, and difference of the two wheels, m.
TOLERANCE_M = 0.01
LOAD_RADIUS_M = 0.25


class Caster(NamedTuple):
    """A caster: its joints, the place of its swivel in the base frame, and its wheel.

    rest_rad: direction of the caster with both joints at zero: from the contact to the swivel.
    swivel_sign, axle_sign: 1 where the joints turn to the left and roll ahead, -1 where they turn
    the other way.
    """

    swivel: str
    axle: str
    x_m: float
    y_m: float
    trail_m: float
    radius_m: float
    rest_rad: float
    swivel_sign: float
    axle_sign: float


@dataclass(frozen=True)
class RunningGear(Immutable):
    """Wheels, casters and weight of a robot; the base frame lies on the floor under the axle.

    model: the file. axles: names of the joints of the left and the right driven wheel. axle_signs:
    1 where a joint rolls ahead, -1 where it rolls backwards. wheel_inertia_kgm2: inertia of one of
    them about its axle. mass_kg, center_m (3,), yaw_inertia_kgm2 (about the base origin): of all
    bodies, with the load. load_kg, load_position (3,) m: mass beyond that of the model's bodies.
    """

    model: Path
    axles: tuple[str, str]
    axle_signs: tuple[float, float]
    wheel_radius_m: float
    wheel_separation_m: float
    wheel_inertia_kgm2: float
    casters: tuple[Caster, ...]
    mass_kg: float
    center_m: Array
    yaw_inertia_kgm2: float
    load_kg: float = 0.0
    load_position: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def caster_load_n(self) -> float:
        """The load of each caster, N: equal on all, such that the base is in balance."""
        weight_n = self.mass_kg * GRAVITY_MPS2
        moment_arm = sum(caster.x_m for caster in self.casters)
        even_n = weight_n / (2 + len(self.casters))
        if abs(moment_arm) < TOLERANCE_M:
            return even_n
        return float(weight_n * self.center_m[0] / moment_arm)

    @property
    def wheel_load_n(self) -> float:
        """The load of each driven wheel, N."""
        return 0.5 * (self.mass_kg * GRAVITY_MPS2 - len(self.casters) * self.caster_load_n)


def load_inertia(mass_kg: float, position: tuple[float, float, float]) -> SpatialInertia:
    """Returns the inertia of a load, a ball, about the base origin."""
    center = np.array(position)
    ball = UnitInertia.SolidSphere(LOAD_RADIUS_M).ShiftFromCenterOfMass(-center)
    return SpatialInertia(mass_kg, center, ball)


def running_gear_of(
    model: Path,
    drive: DifferentialDrive,
    source: str,
    *,
    outline: Array,
    mass_kg: float | None,
    payload_kg: float,
) -> RunningGear:
    """Returns the running gear of a robot: its model's, changed by the fields of the robot's file.

    source: the name of the robot's file in errors. outline: (K, 2) m in the base frame. mass_kg:
    without the payload; None: that of the model's bodies. Raises InputError where the model has no
    such wheels, or the file does not fit it.
    """
    gear = _read(model, model.stat().st_mtime_ns)
    own_kg = mass_kg or gear.mass_kg
    gear = replace(gear, casters=_casters(gear, drive, source))
    gear = _loaded(gear, own_kg + payload_kg, drive.load_position, source)
    _check_outline(gear, outline, source)
    _check_stands(gear, source)
    return gear


def _casters(gear: RunningGear, drive: DifferentialDrive, source: str) -> tuple[Caster, ...]:
    """Returns the casters as the robot file has them."""
    settings, count = drive.casters, len(gear.casters)
    for name in ("positions", "start_angles_rad"):
        given = getattr(settings, name)
        if given is not None and len(given) != count:
            raise InputError(
                f"{source}: drive.casters.{name}: got {len(given)}, the model has {count} casters"
            )
    changed = list(gear.casters)
    if settings.positions is not None:
        changed = [
            caster._replace(x_m=x, y_m=y)
            for caster, (x, y) in zip(changed, settings.positions, strict=True)
        ]
    if settings.trail_m is not None:
        changed = [caster._replace(trail_m=settings.trail_m) for caster in changed]
    return tuple(changed)


def _loaded(
    gear: RunningGear, mass_kg: float, place: tuple[float, float, float] | None, source: str
) -> RunningGear:
    """Returns the running gear with the load beyond the mass of its model's bodies.

    mass_kg: mass of robot and load. place: position of the load, (3,) m; None: at the bodies'
    centre of mass.
    """
    load_kg = mass_kg - gear.mass_kg
    # The masses are sums of decimals: a difference of a gram is rounding.
    if load_kg < -1e-3:
        raise InputError(
            f"{source}: mass_kg: got {mass_kg:g} kg, the model's bodies alone weigh "
            f"{gear.mass_kg:g} kg"
        )
    if load_kg <= 1e-3:
        return gear
    position = place or tuple(gear.center_m.tolist())
    center = (gear.mass_kg * gear.center_m + load_kg * np.array(position)) / mass_kg
    yaw = load_inertia(load_kg, position).CalcRotationalInertia().get_moments()[2]
    return replace(
        gear,
        mass_kg=mass_kg,
        center_m=center,
        yaw_inertia_kgm2=gear.yaw_inertia_kgm2 + float(yaw),
        load_kg=load_kg,
        load_position=position,
    )


def _check_outline(gear: RunningGear, corners: Array, source: str) -> None:
    """Raises InputError where a caster is not under the robot, whose outline is (K, 2) m."""
    outline = shapely.Polygon(corners)
    for index, caster in enumerate(gear.casters):
        if not outline.covers(shapely.Point(caster.x_m, caster.y_m)):
            raise InputError(
                f"{source}: drive.casters.positions[{index}]: the swivel {caster.swivel!r} at "
                f"[{caster.x_m:g}, {caster.y_m:g}] lies outside of the robot's outline"
            )


def _check_stands(gear: RunningGear, source: str) -> None:
    """Raises InputError where the robot would tip over at once."""
    half_m = 0.5 * gear.wheel_separation_m
    contacts = [(0.0, half_m), (0.0, -half_m), *((c.x_m, c.y_m) for c in gear.casters)]
    stands_on = shapely.MultiPoint(contacts).convex_hull
    x, y = gear.center_m[:2]
    if not stands_on.contains(shapely.Point(x, y)):
        raise InputError(
            f"{source}: drive.load_position: the robot's centre of mass is at [{x:.3g}, {y:.3g}], "
            "where no wheel holds it; expected it between driven wheels and casters"
        )


def add_wheeled_model(plant: MultibodyPlant, path: Path) -> ModelInstanceIndex:
    """Adds the bodies and joints of the one model in a file to a plant; raises InputError."""
    source = read_source(path)
    count = len(source.root.findall("model"))
    if count > 1:
        raise InputError(f"{path}: expected one model, found {count}")
    if BASE_LINK not in source.model.links:
        raise InputError(f"{path}: expected a link {BASE_LINK}, found none")
    try:
        return add_bodies(plant, source.model, BASE_LINK, has_mass=True)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


@lru_cache(maxsize=8)
def _read(path: Path, changed_ns: int) -> RunningGear:
    """Reads the first model in a file; changed_ns: so that a changed file is read anew."""
    plant = MultibodyPlant(0.0)
    add_wheeled_model(plant, path)
    base = plant.GetFrameByName(BASE_LINK)
    parents = _parents(plant, BASE_LINK)
    plant.Finalize()
    if parents:
        raise InputError(
            f"{path}: expected {BASE_LINK} to be the first link, on the floor under the driven "
            f"axle, found it below {parents[0]}"
        )
    context = plant.CreateDefaultContext()
    axles, casters = _sorted_joints(plant, context, base, path)
    left, right = _driven_pair(axles, path)
    inertia = plant.CalcSpatialInertia(context, base, [body.index() for body in _own_bodies(plant)])
    if not inertia.get_mass() > 0.0:
        raise InputError(f"{path}: expected bodies with a mass, found {inertia.get_mass():g} kg")
    wheel = left.joint.child_body().default_spatial_inertia()
    about_axle = left.joint.revolute_axis() @ _matrix(wheel) @ left.joint.revolute_axis()
    return RunningGear(
        model=path,
        axles=(left.joint.name(), right.joint.name()),
        axle_signs=(float(np.sign(left.axis[1])), float(np.sign(right.axis[1]))),
        wheel_radius_m=left.position[2],
        wheel_separation_m=left.position[1] - right.position[1],
        wheel_inertia_kgm2=float(about_axle),
        casters=casters,
        mass_kg=inertia.get_mass(),
        center_m=np.array(inertia.get_com()),
        yaw_inertia_kgm2=float(inertia.CalcRotationalInertia().get_moments()[2]),
    )


class _Turning(NamedTuple):
    """A revolute joint with its place (3,) m and its axis (3,) in the base frame at rest."""

    joint: RevoluteJoint
    position: Array
    axis: Array

    @property
    def swivels(self) -> bool:
        return bool(abs(self.axis[2]) > STEEP_AXIS)


def _sorted_joints(
    plant: MultibodyPlant, context: Any, base: Any, path: Path
) -> tuple[list[_Turning], tuple[Caster, ...]]:
    """Returns the axles that do not swivel, and the casters."""
    to_base: RigidTransform = base.CalcPoseInWorld(context).inverse()
    joints = [plant.get_joint(JointIndex(index)) for index in plant.GetJointIndices()]
    turning = []
    for joint in joints:
        if isinstance(joint, RevoluteJoint):
            pose = to_base @ joint.frame_on_parent().CalcPoseInWorld(context)
            axis = pose.rotation().matrix() @ joint.revolute_axis()
            turning.append(_Turning(joint, pose.translation(), axis))
    axles = [one for one in turning if not one.swivels]
    casters, carried = [], set()
    for swivel in (one for one in turning if one.swivels):
        fork = swivel.joint.child_body().name()
        own = [axle for axle in axles if axle.joint.parent_body().name() == fork]
        if len(own) == 1:
            carried.add(own[0].joint.name())
            casters.append(_caster(swivel, own[0], path))
    if not casters:
        raise InputError(
            f"{path}: expected casters: joints with an upright axis that carry the axle of a "
            "wheel, found none"
        )
    return [axle for axle in axles if axle.joint.name() not in carried], tuple(casters)


def _caster(swivel: _Turning, axle: _Turning, path: Path) -> Caster:
    ahead = swivel.position[:2] - axle.position[:2]
    trail_m = float(np.hypot(*ahead))
    if trail_m < MIN_TRAIL_M or axle.position[2] <= 0.0:
        raise InputError(
            f"{path}: {axle.joint.name()}: expected the wheel of a caster at least {MIN_TRAIL_M:g} "
            f"m behind its swivel and above the floor, found {trail_m:g} m behind and "
            f"{axle.position[2]:g} m above"
        )
    return Caster(
        swivel=swivel.joint.name(),
        axle=axle.joint.name(),
        x_m=float(swivel.position[0]),
        y_m=float(swivel.position[1]),
        trail_m=trail_m,
        radius_m=float(axle.position[2]),
        rest_rad=float(np.arctan2(ahead[1], ahead[0])),
        swivel_sign=float(np.sign(swivel.axis[2])),
        # A wheel on an axis rolls along axis cross up.
        axle_sign=float(np.sign(axle.axis[1] * ahead[0] - axle.axis[0] * ahead[1])),
    )


def _driven_pair(axles: list[_Turning], path: Path) -> tuple[_Turning, _Turning]:
    """Returns the left and the right of the two driven wheels; raises InputError."""
    if len(axles) == 2:
        right, left = sorted(axles, key=lambda axle: float(axle.position[1]))
        mirrored = right.position * [1.0, -1.0, 1.0]
        is_pair = (
            np.abs(left.position - mirrored).max() < TOLERANCE_M
            and abs(left.position[0]) < TOLERANCE_M
            and left.position[1] > TOLERANCE_M
            and left.position[2] > 0.0
            and all(abs(axle.axis[1]) > 1.0 - TOLERANCE_M for axle in axles)
        )
        if is_pair:
            return left, right
    found = [
        f"{axle.joint.name()} at [{', '.join(f'{value:g}' for value in axle.position.round(4))}]"
        for axle in axles
    ]
    raise InputError(
        f"{path}: expected two driven wheels, their axles along y through x = 0 of {BASE_LINK} on "
        f"either side, found {', '.join(found) or 'none'}"
    )


def _parents(plant: MultibodyPlant, link: str) -> list[str]:
    """Returns the links that a link is attached to."""
    joints = [plant.get_joint(JointIndex(index)) for index in plant.GetJointIndices()]
    return [joint.parent_body().name() for joint in joints if joint.child_body().name() == link]


def _own_bodies(plant: MultibodyPlant) -> list[Any]:
    world = plant.world_body().index()
    indices = [index for instance in _instances(plant) for index in plant.GetBodyIndices(instance)]
    return [plant.get_body(index) for index in indices if index != world]


def _instances(plant: MultibodyPlant) -> list[Any]:
    return [ModelInstanceIndex(index) for index in range(plant.num_model_instances())]


def _matrix(inertia: SpatialInertia) -> Array:
    return np.asarray(inertia.CalcRotationalInertia().CopyToFullMatrix3())
