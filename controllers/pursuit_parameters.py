"""The parameters that have the same meaning in Regulated Pure Pursuit and Vector Pursuit."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from drake_navbench.controller import ControllerParameters
from drake_navbench.typed_files.quantities import (
    Angle,
    AngularSpeed,
    Duration,
    Length,
    Number,
    Speed,
)
from drake_navbench.typed_files.usual_values import not_negative, positive

# The controllers do not cut the plan any more, so the path handler has this parameter.
SEARCH_DISTANCE = "max_robot_pose_search_dist"


class PursuitParameters(ControllerParameters):
    """Parameters of a controller that steers towards a point or pose of the plan, the target."""

    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset({SEARCH_DISTANCE})

    min_lookahead_dist: Length = Field(0.3, gt=0.0, description="Least scaled lookahead [m].")
    lookahead_time: Annotated[Duration, not_negative("the least lookahead counts")] = Field(
        1.5, description="Scaled lookahead over speed [s]."
    )
    min_approach_linear_velocity: Annotated[Speed, not_negative("as 0")] = Field(
        0.05, description="Lowest speed that the approach leaves [m/s]."
    )
    use_cost_regulated_linear_velocity_scaling: bool = Field(
        True, description="Slow down near obstacles."
    )
    cost_scaling_dist: Annotated[Length, positive("obstacles do not slow the robot down")] = Field(
        0.6, description="Distance to obstacles below which the robot slows down [m]."
    )
    cost_scaling_gain: Annotated[Number, not_negative("the least speed counts near obstacles")] = (
        Field(
            1.0,
            description="Factor on the scaled speed near obstacles; below 1 slows down more.",
        )
    )
    inflation_cost_scaling_factor: Number = Field(
        3.0,
        description="cost_scaling_factor of the costmap's inflation layer; must equal it [1/m].",
    )

    use_rotate_to_heading: bool = Field(
        True, description="Turn in place towards the plan, and to the goal's heading at the goal."
    )
    rotate_to_heading_min_angle: Annotated[Angle, not_negative("the robot only turns")] = Field(
        0.785, description="Angle to the target above which the robot turns in place [rad]."
    )
    rotate_to_heading_angular_vel: Annotated[
        AngularSpeed, not_negative("the robot turns away from where it should face")
    ] = Field(1.8, description="Turn rate in place [rad/s].")
    use_collision_detection: bool = Field(
        True, description="Reject commands that lead to a collision."
    )
