"""The parameters of Regulated Pure Pursuit, under Nav2's names and with Nav2's defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import AliasChoices, ConfigDict, Field, model_validator

from drake_navbench.controller import AskedSpeeds
from drake_navbench.controllers.pursuit_parameters import SEARCH_DISTANCE, PursuitParameters
from drake_navbench.plugins.releases import (
    NEWEST_RELEASE,
    ReadBy,
    Release,
    release_in,
    since,
    until,
)
from drake_navbench.typed_files.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Speed,
    require_order,
)
from drake_navbench.typed_files.usual_values import not_negative, positive

# The name of the cruise speed in Lyrical, and the only name that earlier releases read.
SPEED, OLDER_SPEED = "max_linear_vel", "desired_linear_vel"


class RegulatedPurePursuitParameters(PursuitParameters):
    """Parameters of nav2_regulated_pure_pursuit_controller, of all releases since Humble.

    `desired_linear_vel`, the older name of `max_linear_vel`, is accepted as in Nav2.
    `interpolate_curvature_after_goal` has no effect without `use_fixed_curvature_lookahead`, nor
    `use_cost_regulated_linear_velocity_scaling` with an `inflation_cost_scaling_factor` of 0 or
    less: Nav2 switches them off with a warning.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "max_linear_vel": (0.05, 1.0),
        "lookahead_dist": (0.2, 2.0),
        "regulated_linear_scaling_min_radius": (0.1, 2.0),
        "regulated_linear_scaling_min_speed": (0.0, 0.5),
        "cost_scaling_dist": (0.05, 1.0),
        "approach_velocity_scaling_dist": (0.0, 1.5),
        "rotate_to_heading_min_angle": (0.1, 3.14),
        "rotate_to_heading_angular_vel": (0.2, 3.0),
    }

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "use_fixed_curvature_lookahead": since(Release.IRON),
        "curvature_lookahead_dist": since(Release.IRON),
        "interpolate_curvature_after_goal": since(Release.JAZZY),
        "use_cancel_deceleration": since(Release.JAZZY),
        "cancel_deceleration": since(Release.JAZZY),
        "min_distance_to_obstacle": since(Release.KILTED),
        "allow_obstacle_checking_beyond_goal": since(Release.LYRICAL),
        "use_dynamic_window": since(Release.LYRICAL),
        "min_linear_vel": since(Release.LYRICAL),
        "max_angular_vel": since(Release.LYRICAL),
        "min_angular_vel": since(Release.LYRICAL),
        "max_linear_accel": since(Release.LYRICAL),
        "max_linear_decel": since(Release.LYRICAL),
        "max_angular_decel": since(Release.LYRICAL),
        "use_interpolation": until(Release.IRON),
        "stateful": ReadBy(frozenset({Release.JAZZY, Release.KILTED})),
        SEARCH_DISTANCE: until(Release.KILTED),
    }

    model_config = ConfigDict(populate_by_name=True)

    max_linear_vel: Speed = Field(
        0.5,
        gt=0.0,
        validation_alias=AliasChoices(SPEED, OLDER_SPEED),
        description="Cruise speed before any scaling [m/s].",
    )
    min_linear_vel: Speed = Field(-0.5, description="Lowest speed; dynamic window only [m/s].")
    max_angular_vel: AngularSpeed = Field(
        2.5, description="Highest yaw rate; dynamic window only [rad/s]."
    )
    min_angular_vel: AngularSpeed = Field(
        -2.5, description="Lowest yaw rate; dynamic window only [rad/s]."
    )
    max_linear_accel: Acceleration = Field(
        2.5, gt=0.0, description="Largest acceleration; dynamic window only [m/s^2]."
    )
    max_linear_decel: Acceleration = Field(
        -2.5, description="Largest deceleration, negative; dynamic window only [m/s^2]."
    )
    max_angular_accel: AngularAcceleration = Field(
        3.2,
        gt=0.0,
        description="Largest angular acceleration, for turns in place and the dynamic window "
        "[rad/s^2].",
    )
    max_angular_decel: AngularAcceleration = Field(
        -3.2, description="Largest angular deceleration, negative; dynamic window only [rad/s^2]."
    )

    lookahead_dist: Annotated[
        Length, positive("the carrot is the pose of the plan nearest to the robot")
    ] = Field(0.6, description="Arc length from the robot to the carrot [m].")
    use_velocity_scaled_lookahead_dist: bool = Field(
        False,
        description="Scale the lookahead with the measured speed instead of using lookahead_dist.",
    )
    min_lookahead_dist: Length = Field(0.3, ge=0.0, description="Least scaled lookahead [m].")
    max_lookahead_dist: Length = Field(
        0.9,
        gt=0.0,
        description="Largest scaled lookahead; also the farthest checked point of a command [m].",
    )
    use_fixed_curvature_lookahead: bool = Field(
        False,
        description="Steer towards a second point, at curvature_lookahead_dist, instead of "
        "the carrot.",
    )
    curvature_lookahead_dist: Length = Field(
        0.6, gt=0.0, description="Arc length from the robot to that second point [m]."
    )
    interpolate_curvature_after_goal: bool = Field(
        False,
        description="Extend the plan in a straight line so that the second point stays ahead "
        "at the goal.",
    )

    use_regulated_linear_velocity_scaling: bool = Field(
        True, description="Slow down in tight curves."
    )
    regulated_linear_scaling_min_radius: Annotated[Length, not_negative("as 0")] = Field(
        0.90, description="Radius below which a curve is tight [m]."
    )
    regulated_linear_scaling_min_speed: Annotated[Speed, not_negative("as 0")] = Field(
        0.25, description="Lowest speed that scaling by curves and obstacles leaves [m/s]."
    )
    approach_velocity_scaling_dist: Annotated[Length, not_negative("as 0")] = Field(
        0.6,
        description="Length of the remaining local plan below which the robot slows down [m].",
    )

    allow_reversing: bool = Field(
        False, description="Drive backwards to a carrot behind the robot."
    )

    max_allowed_time_to_collision_up_to_carrot: Annotated[
        Duration, not_negative("no command is checked ahead")
    ] = Field(1.0, description="Duration for which a command is checked for collisions [s].")
    min_distance_to_obstacle: Length = Field(
        -1.0, description="Least distance for which a command is checked [m]; 0 or less: none."
    )
    allow_obstacle_checking_beyond_goal: bool = Field(
        False,
        description="Check that distance beyond the plan's end, too; needs a scaled lookahead.",
    )

    use_cancel_deceleration: bool = Field(
        False, description="Brake at cancel_deceleration when the task is cancelled."
    )
    cancel_deceleration: Acceleration = Field(
        3.2, gt=0.0, description="Deceleration when the task is cancelled [m/s^2]."
    )
    use_dynamic_window: bool = Field(
        False,
        description="Keep commands within the acceleration limits and near the wanted curvature.",
    )

    nav2_release: Release = Field(NEWEST_RELEASE, description="Nav2 release whose rules apply.")
    stateful: bool = Field(
        True, description="Jazzy, Kilted: once near the end, turn in place until a new plan comes."
    )
    use_interpolation: bool = Field(
        True,
        description="Up to Iron: interpolate the carrot between two poses of the plan; when "
        "off, the farther pose is the carrot.",
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length that is searched for the closest pose [m]; "
        "null: half the local costmap's side; negative, from Iron on: the whole "
        "plan.",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the cruise speed, also backwards if allowed; the turn rate has no limit."""
        backward = -self.max_linear_vel if self.allow_reversing else None
        return AskedSpeeds(self.max_linear_vel, backward)

    def turns_in_place(self) -> bool:
        """Returns whether the controller may command a rotation without translation."""
        return self.use_rotate_to_heading

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Returns the unread parameters, also `max_linear_vel` where the older name counts."""
        not_read = super().keys_not_read(values)
        is_older = release_in(values) < Release.LYRICAL
        if SPEED in values and (OLDER_SPEED in values or is_older):
            not_read.append(SPEED)
        return not_read

    @model_validator(mode="after")
    def _check_ranges(self) -> Self:
        # Nav2 takes any of these; where they come into use, they must make sense.
        if self.use_velocity_scaled_lookahead_dist:
            require_order(self, "min_lookahead_dist", "max_lookahead_dist")
        if self.use_dynamic_window:
            require_order(self, "min_linear_vel", "max_linear_vel")
            require_order(self, "min_angular_vel", "max_angular_vel")
            for name in ("max_linear_decel", "max_angular_decel"):
                if (value := getattr(self, name)) >= 0.0:
                    raise ValueError(f"{name}: got {value}, expected a negative number")
        return self
