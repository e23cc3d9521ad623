"""The parameters of Vector Pursuit, under the original's names and with its defaults."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from drake_navbench.controller import (
    AskedSpeeds,
    ControllerParameters,
)
from drake_navbench.releases import NEWEST_RELEASE, ReadBy, Release, release_in, until
from drake_navbench.typed_files.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Number,
    Speed,
)

# The search distance is the path handler's where the controller does not cut the plan.
SEARCH_DISTANCE = "max_robot_pose_search_dist"


class VectorPursuitParameters(ControllerParameters):
    """Parameters of vector_pursuit_controller, branches master at 3f1b30a and jazzy-devel.

    `use_rotate_to_heading` is on where `min_turning_radius` is 0, and cost regulation off where
    `inflation_cost_scaling_factor` is 0 or less, as in the original.
    """

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset({"transform_tolerance"})
    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset({SEARCH_DISTANCE})
    READ_BY: ClassVar[Mapping[str, ReadBy]] = MappingProxyType(
        {
            SEARCH_DISTANCE: until(Release.KILTED),
        }
    )

    k: Number = Field(
        8.0, gt=0.0, description="How much sooner to be at the target than to face as it does [-]."
    )
    desired_linear_vel: Speed = Field(0.5, gt=0.0, description="Cruise speed [m/s].")
    min_turning_radius: Length = Field(1.0, ge=0.0, description="Tightest curve [m].")
    lookahead_dist: Length = Field(0.6, gt=0.0, description="Straight to the target [m].")
    use_velocity_scaled_lookahead_dist: bool = Field(
        False, description="Lookahead from the last command instead of lookahead_dist."
    )
    min_lookahead_dist: Length = Field(0.3, gt=0.0, description="Least scaled lookahead [m].")
    max_lookahead_dist: Length = Field(0.9, gt=0.0, description="Largest scaled lookahead [m].")
    lookahead_time: Duration = Field(1.5, ge=0.0, description="Scaled lookahead over speed [s].")
    use_interpolation: bool = Field(True, description="Aim between the poses of the plan.")
    use_heading_from_path: bool = Field(
        True, description="Arrive as the plan's pose faces, not along its segment."
    )

    min_linear_velocity: Speed = Field(0.05, ge=0.0, description="Nothing is slower [m/s].")
    min_approach_linear_velocity: Speed = Field(
        0.05, ge=0.0, description="The approach slows down no further [m/s]."
    )
    approach_velocity_scaling_dist: Length = Field(
        1.0, ge=0.0, description="Length of the local plan below which to slow down [m]."
    )
    max_linear_accel: Acceleration = Field(
        2.0, ge=0.0, description="Speeding up, from the last command [m/s^2]."
    )
    max_lateral_accel: Acceleration = Field(
        0.5, ge=0.0, description="Bounds the speed in curves: v^2 <= radius times this [m/s^2]."
    )
    use_cost_regulated_linear_velocity_scaling: bool = Field(
        True, description="Slow down near obstacles."
    )
    cost_scaling_dist: Length = Field(
        0.6, gt=0.0, description="Distance to obstacles below which to slow down [m]."
    )
    cost_scaling_gain: Number = Field(
        1.0, ge=0.0, description="Factor on the slowed speed; below 1 slows down more [-]."
    )
    inflation_cost_scaling_factor: Number = Field(
        3.0, description="Decay of the costmap's inflation layer; must match it [1/m]."
    )

    use_rotate_to_heading: bool = Field(
        True, description="Turn in place towards the plan, and to the goal's heading."
    )
    rotate_to_heading_min_angle: Angle = Field(
        0.785, ge=0.0, description="Angle to the target beyond which to turn in place [rad]."
    )
    rotate_to_heading_angular_vel: AngularSpeed = Field(
        1.8, ge=0.0, description="Turn rate in place [rad/s]."
    )
    max_angular_accel: AngularAcceleration = Field(
        3.2, ge=0.0, description="Of a turn in place, from the last command [rad/s^2]."
    )
    allow_reversing: bool = Field(
        False, description="Drive backwards to a target behind, unless it turns to it."
    )

    use_collision_detection: bool = Field(True, description="Refuse commands that collide.")
    max_allowed_time_to_collision_up_to_target: Duration = Field(
        1.0, ge=0.0, description="Time for which a command is checked [s]."
    )
    transform_tolerance: Duration = Field(0.1, description="No effect here [s].")
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Release whose rules hold; for Lyrical: those of Humble, mostly.",
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length searched for the closest pose [m]; null: half the "
        "local costmap's side.",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the cruise speed, as far back where it reverses; its turn rate has no limit."""
        backward = -self.desired_linear_vel if self.allow_reversing else None
        return AskedSpeeds(self.desired_linear_vel, backward)

    def turns_in_place(self) -> bool:
        """Returns whether it turns in place towards the plan and at the goal."""
        return self.use_rotate_to_heading or self.min_turning_radius == 0.0

    @classmethod
    def path_handler_fields(cls, given: Mapping[str, Any]) -> dict[str, str]:
        """See the base class; up to Kilted the controller has no path handler before it."""
        if release_in(given) != NEWEST_RELEASE:
            return {}
        return super().path_handler_fields(given)

    @model_validator(mode="after")
    def _check_lookahead(self) -> Self:
        low, high = self.min_lookahead_dist, self.max_lookahead_dist
        if self.use_velocity_scaled_lookahead_dist and low > high:
            raise ValueError(
                f"min_lookahead_dist ({low}) must not exceed max_lookahead_dist ({high})"
            )
        return self
