"""The localization of a robot file: odometry that drifts, and how the map corrects it."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from drake_navbench.inputs.amcl import AmclSettings
from drake_navbench.typed_files.quantities import (
    Angle,
    AngularSpeed,
    Duration,
    Length,
    Period,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import QuietModel

# The largest drift: with a larger one the odometry would tell nothing of a motion.
MAX_DRIFT = 10.0
DRIFTS = ("drift", "yaw_drift", "random_drift", "random_yaw_drift")
BIASES = ("x_bias_m", "y_bias_m", "yaw_bias_rad")


class LocalizationSettings(QuietModel):
    """The pose and velocity that the navigation gets in place of the true ones.

    The first five fields are white Gaussian noise on the pose and velocity that the controller
    gets. Each of the others gives the odometry a frame of its own, which drifts against the map:
    see docs/stress.md.
    """

    quiet: ClassVar = frozenset(
        {
            "drift",
            "yaw_drift",
            "x_bias_m",
            "y_bias_m",
            "yaw_bias_rad",
            "jump_time_s",
            "jump_m",
            "jump_yaw_rad",
            "fix_period_s",
            "fix_lag_s",
            "fix_xy_std_m",
            "fix_yaw_std_rad",
            "random_drift",
            "random_yaw_drift",
            "wheel_odometry",
            "amcl",
        }
    )
    # The fields that no fault may change during a trial.
    constant: ClassVar = frozenset({"period_s", "fix_period_s", "wheel_odometry", "amcl"})

    period_s: Period = Field(0.05, description="Time for which a noise sample is held [s].")
    xy_std_m: Length = Field(
        0.0, ge=0.0, description="Standard deviation of the noise on x and y [m]."
    )
    yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Standard deviation of the noise on the heading [rad]."
    )
    linear_velocity_std_mps: Speed = Field(
        0.0,
        ge=0.0,
        description="Standard deviation of the noise on v and, for omnidirectional bases, on "
        "vy [m/s].",
    )
    angular_velocity_std_radps: AngularSpeed = Field(
        0.0, ge=0.0, description="Standard deviation of the noise on w [rad/s]."
    )
    drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Position error that the odometry gathers per metre, in a direction of "
        "the base that is drawn for the trial [m/m].",
    )
    yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Heading error that the odometry gathers per radian of turning, to a side "
        "that is drawn for the trial [rad/rad].",
    )
    random_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Standard deviation of the odometry's error on x and y after a metre, "
        "from wheel noise; it grows with the square root of the distance "
        "[m/m^0.5].",
    )
    random_yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Standard deviation of the odometry's heading error after a metre, from "
        "wheel noise [rad/m^0.5].",
    )
    wheel_odometry: bool = Field(
        False,
        description="Compute the odometry from the wheels' nominal radii and speeds, so that "
        "slip and unequal radii mislead it.",
    )
    x_bias_m: Length = Field(
        0.0,
        description="Constant error of the localized position along the robot's x, forward [m].",
    )
    y_bias_m: Length = Field(
        0.0,
        description="Constant error of the localized position along the robot's y, to the "
        "left [m].",
    )
    yaw_bias_rad: Angle = Field(0.0, description="Constant error of the localized heading [rad].")
    jump_time_s: Duration = Field(
        5.0,
        ge=0.0,
        description="Time at which the localization jumps and stays off [s]; null: never.",
    )
    jump_m: Length = Field(
        0.0,
        ge=0.0,
        description="Distance of the jump, in a direction that is drawn for the trial [m].",
    )
    jump_yaw_rad: Angle = Field(
        0.0,
        ge=0.0,
        description="Change of heading of the jump, to a side that is drawn for the trial [rad].",
    )
    fix_period_s: Period | None = Field(
        None,
        description="Time between two fixes; a fix finds the pose on the map and so removes "
        "the drift up to then [s]; null: no fix after the start.",
    )
    fix_lag_s: Duration = Field(0.0, ge=0.0, description="Time from a fix to its effect [s].")
    fix_xy_std_m: Length = Field(
        0.0, ge=0.0, description="Standard deviation of the noise on x and y of a fix [m]."
    )
    fix_yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Standard deviation of the noise on the heading of a fix [rad]."
    )
    amcl: AmclSettings | None = Field(
        None,
        description="Parameters of AMCL, which finds the pose from the scans and the known "
        "map instead of fixes and biases; a jump then displaces AMCL's estimate. "
        "null: no AMCL.",
    )

    @model_validator(mode="after")
    def _check(self) -> LocalizationSettings:
        if self.fix_period_s is None:
            for name in ("fix_lag_s", "fix_xy_std_m", "fix_yaw_std_rad"):
                if getattr(self, name) > 0.0:
                    raise ValueError(
                        f"{name}: expected fix_period_s as well: without it there is "
                        "no fix after the start"
                    )
        if self.amcl is not None:
            for name in ("fix_period_s", *BIASES):
                if getattr(self, name):
                    raise ValueError(f"{name}: AMCL finds the pose by itself; expected amcl: null")
        return self

    @property
    def has_frames(self) -> bool:
        """Whether map and odometry come apart, so that each is a frame of its own."""
        sources = (*DRIFTS, *BIASES, "jump_m", "jump_yaw_rad")
        return (
            any(getattr(self, name) != 0.0 for name in sources)
            or self.wheel_odometry
            or self.fix_period_s is not None
            or self.amcl is not None
        )

    @property
    def delays_s(self) -> dict[str, float]:
        """The largest delays of the fixes, s, by field."""
        return {"fix_lag_s": self.fix_lag_s}
