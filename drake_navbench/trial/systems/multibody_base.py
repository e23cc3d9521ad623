"""The differential base as all bodies of its model on a floor: Drake's MultibodyPlant."""

from __future__ import annotations

import math

import numpy as np
from pydrake import symbolic
from pydrake.common.value import AbstractValue
from pydrake.geometry import FrameId, FramePoseVector, SceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
)
from pydrake.systems.primitives import SymbolicVectorSystem

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.running_gear import RunningGear
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.casters import caster_rates
from drake_navbench.trial.systems.footprint import planar_pose, register_footprint
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.mobile_base import (
    BasePorts,
    clamped,
    command_variables,
    response,
)
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE
from drake_navbench.trial.systems.wheeled_plant import BASE_JOINT, add_wheeled_plant

# The time until the tyres carry the robot, s.
SETTLING_S = 0.5


class MultibodyBase(BasePorts, Diagram):
    """All bodies of a model on a floor; ports as those of MobileBase.

    Input port `command` [v m/s, w rad/s, vy m/s], of which vy has no effect. Output port `state`
    [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] of the model's base link. Output port
    `geometry_pose` places the frame that carries the footprint in the trial's SceneGraph; the
    contact with the floor is found in a SceneGraph of the plant's own, which holds only the floor
    and one ball for each wheel, so that each wheel has one point of contact.

    The motors' set speeds follow the command as the ideal base does. Motors, and the friction of
    swivels and wheels, are velocity controllers of joints with a limit on their torque, which the
    solver takes implicitly.

    rolling_resistance: rolling resistance of the casters' wheels, as a share of their load.
    """

    def __init__(
        self,
        drive: DifferentialDrive,
        gear: RunningGear,
        scene_graph: SceneGraph,
        *,
        footprint: Array,
        rolling_resistance: float,
    ) -> None:
        super().__init__()
        self._gear = gear
        self.source_id, self.frame_id = register_footprint(scene_graph, footprint)
        builder = DiagramBuilder()
        plant, instance = add_wheeled_plant(
            builder, drive, gear, rolling_resistance=rolling_resistance
        )
        self._plant = plant
        self._base_joint = plant.GetJointByName(BASE_JOINT)
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

    def set_pose(self, context: Context, pose: Array) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad, casters as they start."""
        own = self.GetMutableSubsystemContext(self._plant, context)
        self._plant.SetPositions(own, self._plant.GetDefaultPositions())
        self.set_state(context, np.concatenate([pose, np.zeros(STATE_SIZE - 3)]))

    def set_state(self, context: Context, state: Array) -> None:
        """Sets the robot's state, (6,) as in the port `state`; the casters keep their angles."""
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

    def caster_angles(self, context: Context) -> Array:
        """Returns (C,) rad: the casters' angles in the base frame; 0: as in driving ahead."""
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

    def _settled(self, drive: DifferentialDrive) -> Array:
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
    """Computes a base's state from the plant's state, which holds positions, then velocities.

    position, velocity: indices in the plant's state at which the positions and velocities of the
    joint between floor and base begin.
    """

    def __init__(self, size: int, position: int, velocity: int, frame_id: FrameId) -> None:
        super().__init__()
        # Indices of x, y, yaw in the joint's (roll, pitch, yaw, x, y, z), and of their rates.
        self._parts = [position + part for part in (3, 4, 2)]
        self._parts += [velocity + part for part in (3, 4, 2)]
        self._frame_id = frame_id
        self._port = self.DeclareVectorInputPort("plant_state", size)
        plant_state = {self.input_port_ticket(self._port.get_index())}
        self.DeclareVectorOutputPort(
            "state",
            STATE_SIZE,
            weakly_bound(self._calc_state),
            prerequisites_of_calc=plant_state,
        )
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc=plant_state,
        )

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        x, y, yaw, dx, dy, w = self._port.Eval(context)[self._parts].tolist()
        cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
        v, vy = cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx
        output.SetFromVector(np.array([x, y, yaw, v, w, vy]))

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw = self._port.Eval(context)[self._parts[:3]].tolist()
        output.get_mutable_value().set_value(self._frame_id, planar_pose(x, y, yaw))


def _told_speeds(
    drive: DifferentialDrive, gear: RunningGear, actuator_count: int
) -> SymbolicVectorSystem:
    """Returns the system of the plant's desired state: the speeds that the motors are told.

    It is symbolic, so that Drake computes it without calls of Python. Its state is v m/s, w rad/s,
    and the angles rad by which the left and the right wheel have turned at these speeds. v and w
    follow the command as the velocity of the ideal base does.
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
