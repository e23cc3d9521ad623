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
    xy_std_m: Length = Field(0.0, ge=0.0, description="Noise on x and y, standard deviation [m].")
    yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Noise on the heading, standard deviation [rad]."
    )
    linear_velocity_std_mps: Speed = Field(
        0.0,
        ge=0.0,
        description="Noise on v and vy, standard deviation [m/s].",
    )
    angular_velocity_std_radps: AngularSpeed = Field(
        0.0, ge=0.0, description="Noise on w, standard deviation [rad/s]."
    )
    drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Position error of the odometry per metre driven; its direction in the base "
        "frame is drawn for the trial [m/m].",
    )
    yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Heading error of the odometry per radian turned; its sign is drawn for the "
        "trial [rad/rad].",
    )
    random_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Random error of the odometry's x and y, standard deviation after one metre; "
        "it grows with the square root of the distance [m/m^0.5].",
    )
    random_yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Random error of the odometry's heading, in the same way [rad/m^0.5].",
    )
    wheel_odometry: bool = Field(
        False,
        description="Compute the odometry from the wheels' speeds and nominal radii, so that slip "
        "and unequal radii falsify it.",
    )
    x_bias_m: Length = Field(
        0.0,
        description="Constant error of the localized position, forward [m].",
    )
    y_bias_m: Length = Field(
        0.0,
        description="Constant error of the localized position, to the left [m].",
    )
    yaw_bias_rad: Angle = Field(0.0, description="Constant error of the localized heading [rad].")
    jump_time_s: Duration = Field(
        5.0,
        ge=0.0,
        description="Time at which the localized pose jumps, for good [s]; with jump_m and "
        "jump_yaw_rad 0 nothing jumps.",
    )
    jump_m: Length = Field(
        0.0,
        ge=0.0,
        description="Distance of the jump; its direction is drawn for the trial [m].",
    )
    jump_yaw_rad: Angle = Field(
        0.0,
        ge=0.0,
        description="Turn of the jump; its sign is drawn for the trial [rad].",
    )
    fix_period_s: Period | None = Field(
        None,
        description="Time between two fixes [s]; a fix finds the pose on the map, which removes "
        "the drift so far; null: no fix after the start.",
    )
    fix_lag_s: Duration = Field(0.0, ge=0.0, description="Time from a fix to its effect [s].")
    fix_xy_std_m: Length = Field(
        0.0, ge=0.0, description="Noise on x and y of a fix, standard deviation [m]."
    )
    fix_yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Noise on the heading of a fix, standard deviation [rad]."
    )
    amcl: AmclSettings | None = Field(
        None,
        description="AMCL in place of fixes and biases: it finds the pose from scans and map; a "
        "jump displaces its estimate. null: no AMCL.",
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
