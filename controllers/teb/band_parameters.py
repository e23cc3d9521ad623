"""The parameters that have the same meaning in both TEBs, under teb_local_planner's names."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from drake_navbench.controller import AskedSpeeds, ControllerParameters
from drake_navbench.typed_files.name_lists import name_lists
from drake_navbench.typed_files.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Count,
    Duration,
    Length,
    Speed,
    require_order,
)

# Names that are accepted and dropped, by who drops them.
NAMES_WITHOUT_EFFECT = name_lists(__package__, "without_effect.yaml")
# Fewer inner poses than this leave the solver nothing to bend.
FEWEST_SAMPLES = 3


class BandParameters(ControllerParameters):
    """Time, length and limits of a band; names that have no effect are accepted and dropped."""

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset(NAMES_WITHOUT_EFFECT["both"])

    # Trajectory
    dt_ref: Duration = Field(0.3, ge=0.01, description="Wanted time step of a band [s].")
    dt_hysteresis: Duration = Field(
        0.1, ge=0.0, description="Deviation from dt_ref above which a band is resized [s]."
    )
    min_samples: Count = Field(3, description="Least number of intervals of a band.")
    max_samples: Count = Field(500, le=10_000, description="Largest number of intervals of a band.")
    global_plan_viapoint_sep: Length = Field(
        -1.0, description="Distance between via-points on the plan; 0 or less: no via-points [m]."
    )
    max_global_plan_lookahead_dist: Length = Field(
        1.0, description="Length of the plan that a band covers; 0 or less: the whole plan [m]."
    )
    force_reinit_new_goal_dist: Length = Field(
        1.0, gt=0.0, description="Jump of the local goal above which new bands are started [m]."
    )
    force_reinit_new_goal_angular: Angle = Field(
        0.5 * math.pi,
        gt=0.0,
        description="Jump of the local goal's yaw above which new bands are started [rad].",
    )
    feasibility_check_no_poses: Count = Field(
        5,
        description="Index of the last pose that is checked with the outline; negative: all poses.",
    )
    free_goal_vel: bool = Field(False, description="Let the band end in motion.")
    switching_blocking_period: Duration = Field(
        0.0, ge=0.0, description="Time after a change of class in which there is no other one [s]."
    )

    # Robot
    max_vel_x: Speed = Field(0.4, gt=0.0, description="Largest forward speed [m/s].")
    max_vel_x_backwards: Speed = Field(0.2, ge=0.0, description="Largest backward speed [m/s].")
    max_vel_theta: AngularSpeed = Field(0.3, gt=0.0, description="Largest turn rate [rad/s].")
    acc_lim_x: Acceleration = Field(0.5, gt=0.0, description="Largest acceleration [m/s^2].")
    acc_lim_theta: AngularAcceleration = Field(
        0.5, gt=0.0, description="Largest angular acceleration [rad/s^2]."
    )
    min_turning_radius: Length = Field(
        0.0,
        ge=0.0,
        description="Least turning radius of a car; 0: the robot turns on the spot [m].",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits of its bands, at which commands are cut."""
        return AskedSpeeds(self.max_vel_x, -self.max_vel_x_backwards, self.max_vel_theta)

    @model_validator(mode="before")
    @classmethod
    def _drop_names_without_effect(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        return {key: value for key, value in values.items() if key not in cls.WITHOUT_EFFECT}

    @model_validator(mode="after")
    def _check_samples(self) -> Self:
        require_order(self, "dt_hysteresis", "dt_ref", may_be_equal=False)
        require_order(self, "min_samples", "max_samples")
        if self.min_samples < FEWEST_SAMPLES:
            raise ValueError(
                f"min_samples: got {self.min_samples}, expected at least {FEWEST_SAMPLES}"
            )
        return self
