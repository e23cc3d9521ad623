"""A robot's model as a MultibodyPlant on a floor, with motors and friction in its joints."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    ApplyMultibodyPlantConfig,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    ModelInstanceIndex,
    PdControllerGains,
    RevoluteJoint,
    RpyFloatingJoint,
)
from pydrake.systems.framework import DiagramBuilder

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.running_gear import (
    BASE_LINK,
    RunningGear,
    add_wheeled_model,
    load_inertia,
)
from drake_navbench.inputs.wheels import FloorSettings
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.casters import (
    ROLLING_SLACK_MPS,
    SWIVEL_SLACK_RADPS,
    WHEEL_SLACK_RADPS,
)
from drake_navbench.typed_files.quantities import MAX_LENGTH_M

# A convex solver of the SAP family: its step stays stable with stiff tyres and stiff motors.
CONTACT_APPROXIMATION = "lagged"
# The speed at which a point of contact creeps under friction, m/s.
STICTION_TOLERANCE_MPS = 1e-3
# The floor reaches beyond the ends of any world.
FLOOR_SIZE_M, FLOOR_THICKNESS_M = 4.0 * MAX_LENGTH_M, 1.0
# The name of the joint between the floor and the base link.
BASE_JOINT = "on_floor"


def add_wheeled_plant(
    builder: DiagramBuilder,
    drive: DifferentialDrive,
    gear: RunningGear,
    *,
    rolling_resistance: float,
) -> tuple[MultibodyPlant, ModelInstanceIndex]:
    """Adds a robot's bodies on a floor, finalized; returns the plant and the robot's instance.

    The plant's desired state is that of its actuators: the left and the right motor, then those
    that act as friction. rolling_resistance: rolling resistance of the casters' wheels, as a share
    of their load.
    """
    plant = _new_plant(drive.step_s)
    instance = add_wheeled_model(plant, gear.model)
    _place_casters(plant, gear)
    _add_load(plant, gear, instance)
    base = plant.GetFrameByName(BASE_LINK)
    plant.AddJoint(RpyFloatingJoint(BASE_JOINT, plant.world_frame(), base))
    _add_contact(builder, plant, gear, drive.floor)
    _add_torques(plant, gear, drive, rolling_resistance * gear.caster_load_n)
    plant.Finalize()
    return plant, instance


def _new_plant(step_s: float) -> MultibodyPlant:
    """Returns a plant that no SceneGraph knows, so that it takes no shapes from a model."""
    config = MultibodyPlantConfig(
        time_step=step_s,
        contact_model="point",
        discrete_contact_approximation=CONTACT_APPROXIMATION,
        stiction_tolerance=STICTION_TOLERANCE_MPS,
        # The last step's forces are never read; to keep them would copy the state of the whole
        # trial at every step.
        use_sampled_output_ports=False,
    )
    plant = MultibodyPlant(step_s)
    ApplyMultibodyPlantConfig(config, plant)
    return plant


def _place_casters(plant: MultibodyPlant, gear: RunningGear) -> None:
    """Moves swivels and wheels of the casters to where the robot's file has them."""
    for caster in gear.casters:
        swivel = plant.GetJointByName(caster.swivel)
        place = swivel.frame_on_parent().GetFixedPoseInBodyFrame().translation()
        _move(plant, swivel, np.array([caster.x_m, caster.y_m, place[2]]))
        axle = plant.GetJointByName(caster.axle)
        place = axle.frame_on_parent().GetFixedPoseInBodyFrame().translation()
        behind = place[:2] / np.hypot(*place[:2]) * caster.trail_m
        _move(plant, axle, np.array([*behind, place[2]]))


def _move(plant: MultibodyPlant, joint: RevoluteJoint, position: Array) -> None:
    """Puts a revolute joint at a position (3,) m in the frame of its parent's body."""
    on_parent = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    if np.allclose(on_parent.translation(), position, rtol=0.0, atol=1e-9):
        return
    name, axis = joint.name(), joint.revolute_axis()
    parent, child = joint.parent_body(), joint.child_body()
    on_child = joint.frame_on_child().GetFixedPoseInBodyFrame()
    plant.RemoveJoint(joint)
    moved = RigidTransform(on_parent.rotation(), position)
    plant.AddJoint(
        RevoluteJoint(
            name=name,
            frame_on_parent=plant.AddFrame(
                FixedOffsetFrame(f"{name}_moved", parent.body_frame(), moved)
            ),
            frame_on_child=plant.AddFrame(
                FixedOffsetFrame(f"{name}_kept", child.body_frame(), on_child)
            ),
            axis=axis,
        )
    )


def _add_load(plant: MultibodyPlant, gear: RunningGear, instance: ModelInstanceIndex) -> None:
    """Welds a body to the base with the robot's mass beyond that of its model's bodies."""
    if gear.load_kg <= 0.0:
        return
    inertia = load_inertia(gear.load_kg, gear.load_position)
    load = plant.AddRigidBody("load", instance, inertia)
    plant.WeldFrames(plant.GetFrameByName(BASE_LINK), load.body_frame())


def _add_contact(
    builder: DiagramBuilder, plant: MultibodyPlant, gear: RunningGear, floor: FloorSettings
) -> None:
    """Adds the plant with a SceneGraph of its own: a floor, and a ball a wheel to stand on it.

    A model's wheels, cylinders, would touch the floor at one end or the other.
    """
    builder.AddNamedSystem("plant", plant)
    scene_graph = builder.AddNamedSystem("floor", SceneGraph())
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    builder.Connect(
        plant.get_geometry_pose_output_port(),
        scene_graph.get_source_pose_port(plant.get_source_id()),
    )
    builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    properties = ProximityProperties()
    friction = CoulombFriction(floor.friction, floor.friction)
    AddContactMaterial(floor.dissipation_spm, floor.stiffness_npm, friction, properties)
    wheels = [(name, gear.wheel_radius_m) for name in gear.axles]
    wheels += [(caster.axle, caster.radius_m) for caster in gear.casters]
    at_origin = RigidTransform()
    balls = GeometrySet()
    for name, radius_m in wheels:
        body, shape = plant.GetJointByName(name).child_body(), Sphere(radius_m)
        balls.Add(
            plant.RegisterCollisionGeometry(body, at_origin, shape, f"{name}_tyre", properties)
        )
    # Balls are wider than wheels: where wheels pass each other, balls would touch.
    within = CollisionFilterDeclaration().ExcludeWithin(balls)
    scene_graph.collision_filter_manager().Apply(within)
    # A box, as Drake warns that nothing soft can lie on a half space.
    X_WF = RigidTransform([0.0, 0.0, -0.5 * FLOOR_THICKNESS_M])
    floor_box = Box(FLOOR_SIZE_M, FLOOR_SIZE_M, FLOOR_THICKNESS_M)
    plant.RegisterCollisionGeometry(plant.world_body(), X_WF, floor_box, "floor", properties)


def _add_torques(
    plant: MultibodyPlant, gear: RunningGear, drive: DifferentialDrive, rolling_n: float
) -> None:
    """Adds the motors, then the friction of the joints.

    Coulomb friction is a velocity controller that wants standstill, with a limit on its torque.
    """
    for name in gear.axles:
        motors = drive.motors
        gains = PdControllerGains(p=motors.integral_nm, d=motors.stiffness_nms)
        _add_torque(plant, name, motors.max_torque_nm, gains)
    for name in gear.axles:
        _add_friction(plant, name, drive.motors.dry_friction_nm, WHEEL_SLACK_RADPS)
    for caster in gear.casters:
        swivel_nm = drive.casters.swivel_friction_nm
        _add_friction(plant, caster.swivel, swivel_nm, SWIVEL_SLACK_RADPS)
        slack = ROLLING_SLACK_MPS / caster.radius_m
        _add_friction(plant, caster.axle, rolling_n * caster.radius_m, slack)


def _add_friction(plant: MultibodyPlant, joint: str, torque_nm: float, slack: float) -> None:
    if torque_nm > 0.0:
        _add_torque(plant, joint, torque_nm, PdControllerGains(p=0.0, d=torque_nm / slack))


def _add_torque(
    plant: MultibodyPlant, joint: str, limit_nm: float, gains: PdControllerGains
) -> None:
    name = f"{joint}_{plant.num_actuators()}"
    actuator = plant.AddJointActuator(name, plant.GetJointByName(joint), limit_nm)
    actuator.set_controller_gains(gains)
