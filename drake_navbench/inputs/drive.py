"""The base of a robot file: its kind of motion, its limits, and its response to commands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import BeforeValidator, Discriminator, Field, Tag

from drake_navbench.errors import nearest_name_hint
from drake_navbench.inputs.wheels import CasterSettings, FloorSettings, MotorSettings
from drake_navbench.typed_files.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Length,
    Period,
    Speed,
    Within,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel, QuietModel, tuples_for_lists

# The shortest time constant: with a trial's step of 0.02 s, speeds explode below half the step.
LEAST_LAG_S = 0.02
Lag = Annotated[float, Within(LEAST_LAG_S, 3600.0)]


class MotionBounds(NamedTuple):
    """The upper bounds of a base's motion; inf where there is no bound.

    speed_mps, yaw_rate_radps: largest speed and yaw rate of the base origin. acceleration_mps2,
    yaw_acceleration_radps2: largest accelerations of the base origin.
    """

    speed_mps: float
    acceleration_mps2: float
    yaw_rate_radps: float
    yaw_acceleration_radps2: float


class _Drive(FrozenModel):
    """The drive of any base: speed along its heading with a first-order response."""

    max_linear_velocity_mps: Speed = Field(0.5, gt=0.0, description="Largest forward speed [m/s].")
    min_linear_velocity_mps: Speed = Field(
        -0.5, le=0.0, description="Largest backward speed [m/s]."
    )
    response_time_constant_s: Lag = Field(
        0.1,
        description="Time constant of the velocity's first-order response [s], at least the "
        "integration step.",
    )
    max_linear_acceleration_mps2: Acceleration | None = Field(
        2.5, gt=0.0, description="Largest acceleration |dv/dt| [m/s^2]; null: no limit."
    )

    @property
    def lateral_speed_mps(self) -> float:
        """The largest sideways speed, m/s; 0 where the base cannot move sideways."""
        return 0.0

    @property
    def turning_radius_m(self) -> float:
        """The radius of the tightest turn, m; 0 for a base that turns in place."""
        return 0.0

    @property
    def has_wheels(self) -> bool:
        """Whether motors, casters and weight are simulated, not only the commanded motion."""
        return False

    @property
    def bounds(self) -> MotionBounds:
        """The bounds of any motion that can be commanded."""
        raise NotImplementedError

    @property
    def true_bounds(self) -> MotionBounds:
        """The bounds of any motion of the base, with wheels that slip or push included."""
        return self.bounds

    @property
    def _forward_speed_mps(self) -> float:
        return max(self.max_linear_velocity_mps, -self.min_linear_velocity_mps)


class _TurningDrive(_Drive):
    """A base that can turn about its own origin."""

    max_angular_velocity_radps: AngularSpeed = Field(
        2.0, gt=0.0, description="Largest turn rate [rad/s]."
    )
    max_angular_acceleration_radps2: AngularAcceleration | None = Field(
        3.0, gt=0.0, description="Largest angular acceleration |dw/dt| [rad/s^2]; null: no limit."
    )


class DifferentialDrive(QuietModel, _TurningDrive):
    """Two driven wheels: drives along its heading and turns in place."""

    quiet: ClassVar = frozenset(
        {"physics", "motors", "casters", "floor", "load_position", "step_s"}
    )

    # Robot files and logs from before there were other bases have no `type`.
    type: Literal["differential"] = Field(
        "differential",
        exclude=True,
        description="Kind of base; a base without `type` is differential.",
    )
    physics: Literal["ideal", "planar_casters", "multibody"] = Field(
        "ideal",
        description="Model of the motion. ideal: the velocity follows the command; "
        "planar_casters: motors, weight and casters in the plane; multibody: all "
        "bodies of the model on a floor (Drake's MultibodyPlant).",
    )
    motors: MotorSettings = Field(default_factory=MotorSettings)
    casters: CasterSettings = Field(default_factory=CasterSettings)
    floor: FloorSettings = Field(default_factory=FloorSettings)
    load_position: tuple[Length, Length, Length] | None = Field(
        None,
        description="Centre of the load in the base frame [m]; the load is mass_kg less the mass "
        "of the model's bodies, a ball of 0.25 m radius; null: the model's centre of "
        "mass.",
    )
    step_s: Period = Field(
        0.01, le=0.02, description="Time step of the physics planar_casters and multibody [s]."
    )

    @property
    def has_wheels(self) -> bool:
        """Whether motors, casters and weight are simulated, not only the commanded motion."""
        return self.physics != "ideal"

    @property
    def bounds(self) -> MotionBounds:
        """The bounds of any motion that can be commanded."""
        return MotionBounds(
            self._forward_speed_mps,
            self.max_linear_acceleration_mps2 or math.inf,
            self.max_angular_velocity_radps,
            self.max_angular_acceleration_radps2 or math.inf,
        )

    @property
    def true_bounds(self) -> MotionBounds:
        """The bounds of any motion of the base, with wheels that slip or push included.

        Friction only takes energy, and motors push no further than the speed they are told. But
        turning may become speed, and speed turning: by less than as much again.
        """
        told = self.bounds
        if not self.has_wheels:
            return told
        return MotionBounds(2.0 * told.speed_mps, math.inf, 2.0 * told.yaw_rate_radps, math.inf)


class OmnidirectionalDrive(_TurningDrive):
    """Mecanum or other wheels that also move it sideways; each axis has limits of its own."""

    type: Literal["omnidirectional"] = Field(description="Kind of base.")
    max_lateral_velocity_mps: Speed = Field(
        0.5, gt=0.0, description="Largest sideways speed in either direction [m/s]."
    )
    max_lateral_acceleration_mps2: Acceleration | None = Field(
        2.5, gt=0.0, description="Largest sideways acceleration |dvy/dt| [m/s^2]; null: no limit."
    )

    @property
    def lateral_speed_mps(self) -> float:
        """The largest sideways speed, m/s."""
        return self.max_lateral_velocity_mps

    @property
    def bounds(self) -> MotionBounds:
        """The bounds of any motion of the base."""
        return MotionBounds(
            math.hypot(self._forward_speed_mps, self.max_lateral_velocity_mps),
            math.hypot(
                self.max_linear_acceleration_mps2 or math.inf,
                self.max_lateral_acceleration_mps2 or math.inf,
            ),
            self.max_angular_velocity_radps,
            self.max_angular_acceleration_radps2 or math.inf,
        )


class AckermannDrive(QuietModel, _Drive):
    """Car-like: steered front wheels; turns about a point on its rear axle."""

    quiet: ClassVar = frozenset({"rear_axle_x_m"})

    type: Literal["ackermann"] = Field(description="Kind of base.")
    wheelbase_m: Length = Field(gt=0.0, description="Distance from the rear to the front axle [m].")
    min_turning_radius_m: Length = Field(
        gt=0.0, description="Turning radius of the rear axle's middle at full lock [m]."
    )
    rear_axle_x_m: Length = Field(
        0.0,
        description="Distance of the rear axle ahead of the base origin [m]; negative: behind.",
    )
    max_steering_rate_radps: AngularSpeed | None = Field(
        1.0, gt=0.0, description="Largest rate of the steering angle [rad/s]; null: no limit."
    )

    @property
    def turning_radius_m(self) -> float:
        """The radius of the tightest turn, m."""
        return self.min_turning_radius_m

    @property
    def max_angular_velocity_radps(self) -> float:
        """The turn rate at full lock and full speed forward, rad/s."""
        return self.max_linear_velocity_mps / self.min_turning_radius_m

    @property
    def bounds(self) -> MotionBounds:
        """The bounds of any motion of the base; w = v tan(steering angle) / wheelbase."""
        speed_mps = self._forward_speed_mps
        acceleration_mps2 = self.max_linear_acceleration_mps2 or math.inf
        radius_m, wheelbase_m = self.min_turning_radius_m, self.wheelbase_m
        # The curvature's derivative by the steering angle is largest at full lock.
        per_angle = (1.0 + (wheelbase_m / radius_m) ** 2) / wheelbase_m
        curvature_rate = per_angle * (self.max_steering_rate_radps or math.inf)
        yaw_acceleration_radps2 = acceleration_mps2 / radius_m + speed_mps * curvature_rate
        if self.rear_axle_x_m:
            # Turning moves the base origin sideways.
            arm_m = abs(self.rear_axle_x_m)
            speed_mps, acceleration_mps2 = (
                math.hypot(speed_mps, arm_m * speed_mps / radius_m),
                math.hypot(acceleration_mps2, arm_m * yaw_acceleration_radps2),
            )
        return MotionBounds(
            speed_mps,
            acceleration_mps2,
            self._forward_speed_mps / radius_m,
            yaw_acceleration_radps2,
        )


_KINDS: Mapping[str, type[_Drive]] = {
    "differential": DifferentialDrive,
    "omnidirectional": OmnidirectionalDrive,
    "ackermann": AckermannDrive,
}


def _type_of(data: Any) -> Any:
    if isinstance(data, Mapping):
        return data.get("type", "differential")
    return getattr(data, "type", "differential")


def _check_type(data: Any) -> Any:
    kind = _type_of(data)
    if not isinstance(kind, str) or kind not in _KINDS:
        raise ValueError(f"unknown type {kind!r}{nearest_name_hint(kind, _KINDS)}")
    if kind != "differential" and isinstance(data, Mapping) and "physics" in data:
        raise ValueError(
            f"physics: only a drive of type differential has casters, found type {kind!r}"
        )
    return tuples_for_lists(data)


Drive = Annotated[
    Annotated[DifferentialDrive, Tag("differential")]
    | Annotated[OmnidirectionalDrive, Tag("omnidirectional")]
    | Annotated[AckermannDrive, Tag("ackermann")],
    Discriminator(_type_of),
    BeforeValidator(_check_type),
]
"""The base of a robot file, told apart by `type`; without it, a differential one."""


def overrides_for(drive: _Drive, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Returns overrides of a drive without fields that only other kinds of base have.

    A scenario may be for robots of every kind, and sets a limit only for those that have it. Fields
    of wheels and casters stay: a scenario that sets them needs a base that has some.
    """
    if "type" in overrides:
        return dict(overrides)
    own = type(drive).model_fields
    of_any = {name for kind in _KINDS.values() for name in kind.model_fields}
    of_any -= DifferentialDrive.quiet
    return {name: value for name, value in overrides.items() if name in own or name not in of_any}


def as_omnidirectional(drive: _Drive) -> dict[str, Any]:
    """Returns the fields of an omnidirectional drive, as fast sideways as `drive` is ahead."""
    own = drive.model_dump(mode="json", exclude={"type"})
    shared = {name: own[name] for name in OmnidirectionalDrive.model_fields if name in own}
    return {
        "type": "omnidirectional",
        **shared,
        "max_lateral_velocity_mps": drive.max_linear_velocity_mps,
        "max_lateral_acceleration_mps2": drive.max_linear_acceleration_mps2,
    }
