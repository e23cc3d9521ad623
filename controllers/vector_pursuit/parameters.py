"""The parameters of Vector Pursuit, under the original's names and with its defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

from pydantic import Field, model_validator

from drake_navbench.controller import AskedSpeeds
from drake_navbench.controllers.pursuit_parameters import SEARCH_DISTANCE, PursuitParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, until
from drake_navbench.typed_files.quantities import (
    Acceleration,
    AngularAcceleration,
    Duration,
    Length,
    Number,
    Speed,
    require_order,
)


class VectorPursuitParameters(PursuitParameters):
    """Parameters of vector_pursuit_controller, branches master at 3f1b30a and jazzy-devel.

    `use_rotate_to_heading` is on where `min_turning_radius` is 0, and cost regulation off where
    `inflation_cost_scaling_factor` is 0 or less, as in the original.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "desired_linear_vel": (0.05, 1.0),
        "lookahead_dist": (0.2, 2.0),
        "k": (1.5, 20.0),
        "max_lateral_accel": (0.05, 2.0),
        "cost_scaling_dist": (0.05, 1.0),
        "approach_velocity_scaling_dist": (0.0, 1.5),
        "rotate_to_heading_min_angle": (0.1, 3.14),
    }

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset({"transform_tolerance"})
    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        SEARCH_DISTANCE: until(Release.KILTED),
    }

    k: Number = Field(
        8.0,
        gt=0.0,
        description="Ratio of the time to reach the target position over the time to reach "
        "its heading.",
    )
    desired_linear_vel: Speed = Field(0.5, gt=0.0, description="Cruise speed [m/s].")
    min_turning_radius: Length = Field(
        1.0, ge=0.0, description="Least turning radius that is commanded [m]."
    )
    lookahead_dist: Length = Field(
        0.6,
        gt=0.0,
        description="Distance to the target below which the robot drives straight to it [m].",
    )
    use_velocity_scaled_lookahead_dist: bool = Field(
        False,
        description="Scale the lookahead with the last command instead of using lookahead_dist.",
    )
    max_lookahead_dist: Length = Field(0.9, gt=0.0, description="Largest scaled lookahead [m].")
    use_interpolation: bool = Field(
        True, description="Interpolate the target between the poses of the plan."
    )
    use_heading_from_path: bool = Field(
        True, description="Take the target's heading from the plan's pose, not along its segment."
    )

    min_linear_velocity: Speed = Field(0.05, ge=0.0, description="Lowest commanded speed [m/s].")
    approach_velocity_scaling_dist: Length = Field(
        1.0,
        ge=0.0,
        description="Length of the remaining local plan below which the robot slows down [m].",
    )
    max_linear_accel: Acceleration = Field(
        2.0, ge=0.0, description="Largest acceleration from the last command [m/s^2]."
    )
    max_lateral_accel: Acceleration = Field(
        0.5,
        ge=0.0,
        description="Largest lateral acceleration: bounds the speed in curves, v^2 <= radius "
        "times this [m/s^2].",
    )

    max_angular_accel: AngularAcceleration = Field(
        3.2,
        ge=0.0,
        description="Largest angular acceleration of a turn in place, from the last command "
        "[rad/s^2].",
    )
    allow_reversing: bool = Field(
        False,
        description="Drive backwards to a target behind the robot, unless it turns to the target.",
    )

    max_allowed_time_to_collision_up_to_target: Duration = Field(
        1.0, ge=0.0, description="Duration for which a command is checked for collisions [s]."
    )
    transform_tolerance: Duration = Field(
        0.1, description="No effect here, as there is no transform to wait for [s]."
    )
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply; Lyrical, which has no such controller, "
        "drives mostly by Humble's.",
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length that is searched for the closest pose [m]; "
        "null: half the local costmap's side.",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the cruise speed, also backwards if allowed; the turn rate has no limit."""
        backward = -self.desired_linear_vel if self.allow_reversing else None
        return AskedSpeeds(self.desired_linear_vel, backward)

    def turns_in_place(self) -> bool:
        """Returns whether the controller turns in place towards the plan and at the goal."""
        return self.use_rotate_to_heading or self.min_turning_radius == 0.0

    @model_validator(mode="after")
    def _check_lookahead(self) -> Self:
        if self.use_velocity_scaled_lookahead_dist:
            require_order(self, "min_lookahead_dist", "max_lookahead_dist")
        return self
