"""The differential base as all bodies of its model on a floor: Drake's MultibodyPlant."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydrake import symbolic
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    CollisionFilterDeclaration,
    FrameId,
    FramePoseVector,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
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
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    InputPort,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import SymbolicVectorSystem

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.robot_model import BASE_LINK
from drake_navbench.inputs.running_gear import RunningGear, load_inertia
from drake_navbench.inputs.wheels import FloorSettings
from drake_navbench.kernels.casters import (
    ROLLING_SLACK_MPS,
    SWIVEL_SLACK_RADPS,
    WHEEL_SLACK_RADPS,
    caster_rates,
)
from drake_navbench.systems.footprint import planar_pose, register_footprint
from drake_navbench.systems.lifetime import weakly_bound
from drake_navbench.systems.mobile_base import clamped, command_variables, response
from drake_navbench.systems.ports import COMMAND_SIZE, STATE_SIZE
from drake_navbench.typed_files.quantities import MAX_LENGTH_M

Vector = NDArray[np.float64]

# A convex solver of the SAP family: its step stays stable with stiff tyres and stiff motors.
CONTACT_APPROXIMATION = "lagged"
# How slow a point of contact creeps under friction, m/s.
STICTION_TOLERANCE_MPS = 1e-3
# Beyond the ends of any world.
FLOOR_SIZE_M, FLOOR_THICKNESS_M = 4.0 * MAX_LENGTH_M, 1.0
# Until the tyres carry the robot.
SETTLING_S = 0.5


class MultibodyBase(Diagram):
    """All bodies of a model on a floor; ports as those of MobileBase.

    Input port `command` [v m/s, w rad/s, vy m/s], of which vy has no effect. Output port `state`
    [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] of the model's base link. Output port
    `geometry_pose` places the frame that carries the footprint in the trial's SceneGraph; the
    contact with the floor is found in a SceneGraph of the plant's own, which holds no more than the
    floor and a ball a wheel: one point of contact each.

    What the motors are told follows the command as the ideal base does. Motors, and the friction of
    swivels and wheels, are velocity controllers of joints with a limit on their torque, which the
    solver takes implicitly.

    rolling_resistance: of the casters' wheels, share of what stands on them.
    """

    def __init__(
        self,
        drive: DifferentialDrive,
        gear: RunningGear,
        scene_graph: SceneGraph,
        *,
        footprint: Vector,
        rolling_resistance: float,
    ) -> None:
        super().__init__()
        self._gear = gear
        self.source_id, self.frame_id = register_footprint(scene_graph, footprint)
        builder = DiagramBuilder()
        plant = _new_plant(drive.step_s)
        (instance,) = Parser(plant).AddModels(str(gear.model))
        for index in list(plant.GetJointActuatorIndices()):
            plant.RemoveJointActuator(plant.get_joint_actuator(index))
        _place_casters(plant, gear)
        _add_load(plant, gear, instance)
        self._base_joint = plant.AddJoint(
            RpyFloatingJoint("on_floor", plant.world_frame(), plant.GetFrameByName(BASE_LINK))
        )
        _add_contact(builder, plant, gear, drive.floor)
        _add_torques(plant, gear, drive, rolling_resistance * gear.caster_load_n)
        plant.Finalize()
        self._plant = plant
        self._axles = [plant.GetJointByName(name) for name in gear.axles]
        self._swivels = [plant.GetJointByName(caster.swivel) for caster in gear.casters]
        self._rollers = [plant.GetJointByName(caster.axle) for caster in gear.casters]
        self._motors = builder.AddNamedSystem(
            "motors", _told_speeds(drive, gear, plant.num_actuators())
        )
        builder.Connect(
            self._motors.get_output_port(), plant.get_desired_state_input_port(instance)
        )
        reader = _BaseState(
            plant.num_multibody_states(),
            self._base_joint.position_start(),
            plant.num_positions() + self._base_joint.velocity_start(),
            self.frame_id,
        )
        builder.AddNamedSystem("base_state", reader)
        builder.Connect(plant.get_state_output_port(), reader.get_input_port())
        builder.ExportInput(self._motors.get_input_port(), "command")
        builder.ExportOutput(reader.GetOutputPort("state"), "state")
        builder.ExportOutput(reader.GetOutputPort("geometry_pose"), "geometry_pose")
        builder.BuildInto(self)
        plant.SetDefaultPositions(self._settled(drive))

    def get_command_input_port(self) -> InputPort:
        """Returns the port of the command [v m/s, w rad/s, vy m/s]."""
        return self.get_input_port(0)

    def get_state_output_port(self) -> OutputPort:
        """Returns the port of the state [x m, y m, yaw rad, v m/s, w rad/s, vy m/s]."""
        return self.get_output_port(0)

    def get_geometry_pose_output_port(self) -> OutputPort:
        """Returns the port for SceneGraph's source pose port."""
        return self.get_output_port(1)

    def set_pose(self, context: Context, pose: Vector) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad, casters as they start."""
        own = self.GetMutableSubsystemContext(self._plant, context)
        self._plant.SetPositions(own, self._plant.GetDefaultPositions())
        self.set_state(context, np.concatenate([pose, np.zeros(STATE_SIZE - 3)]))

    def set_state(self, context: Context, state: Vector) -> None:
        """Puts the robot where `state` then tells `state` (6,); the casters stay as they are."""
        x, y, yaw, v, w, vy = state.tolist()
        own = self.GetMutableSubsystemContext(self._plant, context)
        joint = self._base_joint
        roll, pitch, _ = joint.get_angles(own)
        z = joint.get_translation(own)[2]
        joint.set_angles(own, np.array([roll, pitch, yaw]))
        joint.SetTranslation(own, np.array([x, y, z]))
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        velocity = [v * cos_yaw - vy * sin_yaw, v * sin_yaw + vy * cos_yaw, 0.0]
        self._plant.SetVelocities(own, np.zeros(self._plant.num_velocities()))
        joint.set_angular_velocity(own, np.array([0.0, 0.0, w]))
        joint.set_translational_velocity(own, np.array(velocity))
        self._roll_along(own, v, w)
        motors = self.GetMutableSubsystemContext(self._motors, context)
        motors.SetDiscreteState(np.array([v, w, *(axle.get_angle(own) for axle in self._axles)]))

    def caster_angles(self, context: Context) -> Vector:
        """Returns (C,) rad where the casters point in the base frame; 0: as in driving ahead."""
        own = self.GetSubsystemContext(self._plant, context)
        return np.array(
            [
                caster.swivel_sign * swivel.get_angle(own) + caster.rest_rad
                for swivel, caster in zip(self._swivels, self._gear.casters, strict=True)
            ]
        )

    def energy_j(self, context: Context) -> float:
        """Returns the kinetic and the potential energy of all bodies, without that in the tyres."""
        own = self.GetSubsystemContext(self._plant, context)
        return float(self._plant.CalcKineticEnergy(own) + self._plant.CalcPotentialEnergy(own))

    def _roll_along(self, context: Context, v: float, w: float) -> None:
        """Sets the rates of all wheels and casters to those of rolling without slip."""
        gear = self._gear
        for joint, sign, side in zip(self._axles, gear.axle_signs, (-1.0, 1.0), strict=True):
            speed = v + side * 0.5 * gear.wheel_separation_m * w
            joint.set_angular_rate(context, sign * speed / gear.wheel_radius_m)
        for caster, swivel, roller in zip(gear.casters, self._swivels, self._rollers, strict=True):
            angle = caster.swivel_sign * swivel.get_angle(context) + caster.rest_rad
            swung, rolled = caster_rates(v, w, caster.x_m, caster.y_m, angle, caster.trail_m)
            swivel.set_angular_rate(context, caster.swivel_sign * swung)
            roller.set_angular_rate(context, caster.axle_sign * rolled / caster.radius_m)

    def _settled(self, drive: DifferentialDrive) -> Vector:
        """Returns the positions at rest at the origin, once the tyres carry the robot."""
        context = self.CreateDefaultContext()
        own = self.GetMutableSubsystemContext(self._plant, context)
        angles = drive.casters.start_angles_rad or [0.0] * len(self._swivels)
        for swivel, caster, angle in zip(self._swivels, self._gear.casters, angles, strict=True):
            swivel.set_angle(own, caster.swivel_sign * (angle - caster.rest_rad))
        self.get_command_input_port().FixValue(context, np.zeros(COMMAND_SIZE))
        simulator = Simulator(self, context)
        simulator.AdvanceTo(SETTLING_S)
        roll, pitch, _ = self._base_joint.get_angles(own)
        z = self._base_joint.get_translation(own)[2]
        self._base_joint.set_angles(own, np.array([roll, pitch, 0.0]))
        self._base_joint.SetTranslation(own, np.array([0.0, 0.0, z]))
        return np.asarray(self._plant.GetPositions(own))


class _BaseState(LeafSystem):
    """Reads what a base tells from the plant's state: positions, then velocities.

    position, velocity: where those of the joint between floor and base begin in it.
    """

    def __init__(self, size: int, position: int, velocity: int, frame_id: FrameId) -> None:
        super().__init__()
        # Of the joint roll, pitch, yaw, x, y, z, and the rates of turning and of moving in x, y, z.
        self._parts = [position + part for part in (3, 4, 2)]
        self._parts += [velocity + part for part in (3, 4, 2)]
        self._frame_id = frame_id
        self._port = self.DeclareVectorInputPort("plant_state", size)
        self.DeclareVectorOutputPort("state", STATE_SIZE, weakly_bound(self._calc_state))
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
        )

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        x, y, yaw, dx, dy, w = self._port.Eval(context)[self._parts].tolist()
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        v, vy = cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx
        output.SetFromVector(np.array([x, y, yaw, v, w, vy]))

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw = self._port.Eval(context)[self._parts[:3]].tolist()
        output.get_mutable_value().set_value(self._frame_id, planar_pose(x, y, yaw))


def _new_plant(step_s: float) -> MultibodyPlant:
    """Returns a plant that no SceneGraph knows, so that it takes no shapes from a model."""
    config = MultibodyPlantConfig(
        time_step=step_s,
        contact_model="point",
        discrete_contact_approximation=CONTACT_APPROXIMATION,
        stiction_tolerance=STICTION_TOLERANCE_MPS,
        # Nobody asks for forces of the step before; to keep them would copy the state of the whole
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


def _move(plant: MultibodyPlant, joint: RevoluteJoint, position: Vector) -> None:
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
    """Fastens what the robot weighs beyond its model's bodies to the base."""
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
    # Balls are wider than wheels: where these pass each other, those would touch.
    within = CollisionFilterDeclaration().ExcludeWithin(balls)
    scene_graph.collision_filter_manager().Apply(within)
    # Of a half space Drake warns that nothing soft can lie on it.
    top_m = RigidTransform([0.0, 0.0, -0.5 * FLOOR_THICKNESS_M])
    floor_box = Box(FLOOR_SIZE_M, FLOOR_SIZE_M, FLOOR_THICKNESS_M)
    plant.RegisterCollisionGeometry(plant.world_body(), top_m, floor_box, "floor", properties)


def _add_torques(
    plant: MultibodyPlant, gear: RunningGear, drive: DifferentialDrive, rolling_n: float
) -> None:
    """Adds the motors, first, and what holds joints back.

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


def _told_speeds(
    drive: DifferentialDrive, gear: RunningGear, actuator_count: int
) -> SymbolicVectorSystem:
    """Returns what tells the motors their speeds, as the plant's desired state: no Python in it.

    Its state is v m/s and w rad/s, which follow the command as the velocity of the ideal base does,
    and the angles rad to which the left and the right wheel would have turned by that.
    """
    state = symbolic.MakeVectorVariable(4, "told")
    command = command_variables()
    w_limit = drive.max_angular_velocity_radps
    v_wanted = clamped(command[0], drive.min_linear_velocity_mps, drive.max_linear_velocity_mps)
    w_wanted = clamped(command[1], -w_limit, w_limit)
    tau, step_s = drive.response_time_constant_s, drive.step_s
    v = state[0] + step_s * response(v_wanted, state[0], tau, drive.max_linear_acceleration_mps2)
    w = state[1] + step_s * response(w_wanted, state[1], tau, drive.max_angular_acceleration_radps2)
    half_m = 0.5 * gear.wheel_separation_m
    speeds = [
        sign * (v + side * half_m * w) / gear.wheel_radius_m
        for sign, side in zip(gear.axle_signs, (-1.0, 1.0), strict=True)
    ]
    angles = [state[2] + step_s * speeds[0], state[3] + step_s * speeds[1]]
    rest = [symbolic.Expression(0.0)] * (actuator_count - len(speeds))
    return SymbolicVectorSystem(
        state=state,
        input=command,
        dynamics=[v, w, *angles],
        # Positions, then velocities; friction has no wanted position and wants no velocity.
        output=[*angles, *rest, *speeds, *rest],
        time_period=step_s,
    )
