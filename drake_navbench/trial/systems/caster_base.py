"""The differential base with motors, weight and casters, in the plane."""

from __future__ import annotations

import math

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import FramePoseVector, SceneGraph
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.running_gear import RunningGear
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.casters import (
    BEHIND,
    FIRST_ANGLE,
    SWIVEL_SLACK_RADPS,
    TOLD_V,
    TOLD_W,
    WHEEL_SLACK_RADPS,
    advanced,
)
from drake_navbench.trial.systems.footprint import planar_pose, register_footprint
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.mobile_base import BasePorts
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE

# The largest product of inner step and fastest rate: far below 2, where the midpoint rule
# becomes unstable.
MAX_STEP_BY_RATE = 0.25


class CasterBase(BasePorts, LeafSystem):
    """Two driven wheels and casters that roll without slip; ports as those of MobileBase.

    Input port `command` [v m/s, w rad/s, vy m/s], of which vy has no effect. Output port `state`
    [x m, y m, yaw rad, v m/s, w rad/s, vy m/s], vy is 0. The discrete state, see `kernels.casters`,
    is the base's state at the end of the present period. A tyre rolls on its radius less its
    compression; the motor reckons with the full radius. Output port `geometry_pose` places the
    frame that carries the footprint in SceneGraph.

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
        self._period_s = drive.step_s
        self._limits, self._body = _limits_of(drive), _body_of(gear)
        self._motors = _motors_of(drive, gear)
        self._casters = np.array([[one.x_m, one.y_m, one.trail_m] for one in gear.casters])
        self._frictions = np.array(
            [drive.casters.swivel_friction_nm, rolling_resistance * gear.caster_load_n]
        )
        fastest = self._fastest_rate(drive)
        self._count = max(1, math.ceil(self._period_s * fastest / MAX_STEP_BY_RATE))
        angles = drive.casters.start_angles_rad or [0.0] * len(gear.casters)
        self._at_rest = np.concatenate([np.zeros(FIRST_ANGLE), angles])
        self.source_id, self.frame_id = register_footprint(scene_graph, footprint)
        self._declare_ports()

    def _declare_ports(self) -> None:
        """Declares state and ports, and the step that advances the state."""
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        state = self.DeclareDiscreteState(self._at_rest)
        self.DeclareVectorOutputPort(
            "state",
            STATE_SIZE,
            weakly_bound(self._calc_state),
            prerequisites_of_calc={self.discrete_state_ticket(state)},
        )
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc={self.discrete_state_ticket(state)},
        )
        self.DeclarePeriodicDiscreteUpdateEvent(self._period_s, 0.0, weakly_bound(self._on_step))

    def set_pose(self, context: Context, pose: Array) -> None:
        """Puts the robot at rest at pose (3,) x m, y m, yaw rad, casters as they start."""
        state = self._at_rest.copy()
        state[:3] = pose
        context.SetDiscreteState(state)

    def set_state(self, context: Context, state: Array) -> None:
        """Sets the robot's state, (6,) as in the port `state`; the casters keep their angles."""
        own = context.get_discrete_state_vector().CopyToVector()
        own[:5] = state[:5]
        own[TOLD_V], own[TOLD_W] = state[3:5]
        own[BEHIND:FIRST_ANGLE] = 0.0
        context.SetDiscreteState(own)

    def caster_angles(self, context: Context) -> Array:
        """Returns (C,) rad: the casters' angles in the base frame; 0: as in driving ahead."""
        return context.get_discrete_state_vector().CopyToVector()[FIRST_ANGLE:]

    def _on_step(self, context: Context, discrete_state: DiscreteValues) -> None:
        state = advanced(
            context.get_discrete_state_vector().value(),
            self._command_port.Eval(context),
            self._limits,
            self._body,
            self._motors,
            self._casters,
            self._frictions,
            (self._count, self._period_s),
        )
        discrete_state.get_mutable_vector().SetFromVector(state)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        state = np.zeros(STATE_SIZE)
        state[:5] = context.get_discrete_state_vector().value()[:5]
        output.SetFromVector(state)

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        x, y, yaw = context.get_discrete_state_vector().value()[:3].tolist()
        output.get_mutable_value().set_value(self.frame_id, planar_pose(x, y, yaw))

    def _fastest_rate(self, drive: DifferentialDrive) -> float:
        """Returns a bound of the rates, 1/s, at which speeds and casters settle."""
        mass, _, inertia = self._body.tolist()
        radius, half, stiffness, integral, _, dry, _ = self._motors.tolist()
        # Speeds per rad/s of a wheel, and of a swivel.
        wheel = (stiffness + dry / WHEEL_SLACK_RADPS) / radius**2
        swivel = self._frictions[0] / SWIVEL_SLACK_RADPS
        x, y, trail = self._casters.T
        arm = np.hypot(x, y) / trail + 1.0
        bounds = drive.true_bounds
        swung = (bounds.speed_mps + bounds.yaw_rate_radps * np.hypot(x, y)) / trail
        return float(
            2.0 * wheel * (1.0 / mass + half**2 / inertia)
            + swivel * (1.0 / (mass * trail**2) + arm**2 / inertia).sum()
            + swung.max()
            + integral / stiffness
            + 1.0 / drive.response_time_constant_s
        )


def _limits_of(drive: DifferentialDrive) -> Array:
    """Returns the limits of the told motion (6,), as `kernels.casters` takes them."""
    return np.array(
        [
            drive.min_linear_velocity_mps,
            drive.max_linear_velocity_mps,
            drive.max_angular_velocity_radps,
            drive.response_time_constant_s,
            drive.bounds.acceleration_mps2,
            drive.bounds.yaw_acceleration_radps2,
        ]
    )


def _body_of(gear: RunningGear) -> Array:
    """Returns mass kg, centre of mass ahead m, yaw inertia kg m^2; the driven wheels included."""
    # The wheels' moment of inertia acts as if it were mass at the point where they touch the floor.
    turning_kg = gear.wheel_inertia_kgm2 / gear.wheel_radius_m**2
    half_m = 0.5 * gear.wheel_separation_m
    return np.array(
        [
            gear.mass_kg + 2.0 * turning_kg,
            gear.center_m[0] * gear.mass_kg / (gear.mass_kg + 2.0 * turning_kg),
            gear.yaw_inertia_kgm2 + 2.0 * turning_kg * half_m**2,
        ]
    )


def _motors_of(drive: DifferentialDrive, gear: RunningGear) -> Array:
    """Returns the numbers of wheels and motors (7,), as `kernels.casters` takes them."""
    motors = drive.motors
    return np.array(
        [
            gear.wheel_radius_m - gear.wheel_load_n / drive.floor.stiffness_npm,
            0.5 * gear.wheel_separation_m,
            motors.stiffness_nms,
            motors.integral_nm,
            motors.max_torque_nm,
            motors.dry_friction_nm,
            gear.wheel_radius_m,
        ]
    )
