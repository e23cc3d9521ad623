"""The localization of a robot file: odometry that drifts, and how the map corrects it."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import (
    Angle,
    AngularSpeed,
    Duration,
    Length,
    Period,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import QuietModel

# An odometry that tells no more than this of a way is none.
MAX_DRIFT = 10.0


class LocalizationSettings(QuietModel):
    """What the navigation is told of pose and velocity.

    The first five fields are white Gaussian noise on what the controller is told. All the others
    make a frame of its own of the odometry, which drifts against the map: see docs/stress.md.
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
        }
    )
    # What no fault may change during a trial.
    constant: ClassVar = frozenset({"period_s", "fix_period_s"})

    period_s: Period = Field(0.05, description="Time for which a noise sample holds [s].")
    xy_std_m: Length = Field(0.0, ge=0.0, description="Noise on x and on y [m].")
    yaw_std_rad: Angle = Field(0.0, ge=0.0, description="Noise on the heading [rad].")
    linear_velocity_std_mps: Speed = Field(
        0.0, ge=0.0, description="Noise on v and, where the base has it, on vy [m/s]."
    )
    angular_velocity_std_radps: AngularSpeed = Field(0.0, ge=0.0, description="Noise on w [rad/s].")
    drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Error that the odometry gathers a metre of way, in a direction of the base "
        "that is drawn for the trial [m/m].",
    )
    yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Error of its heading a radian of turning, to the side that is drawn for the "
        "trial [rad/rad].",
    )
    x_bias_m: Length = Field(0.0, description="How far ahead of itself it is localized [m].")
    y_bias_m: Length = Field(0.0, description="How far to its left it is localized [m].")
    yaw_bias_rad: Angle = Field(0.0, description="Constant error of the localized heading [rad].")
    jump_time_s: Duration = Field(
        5.0, ge=0.0, description="When the localization jumps, and stays off, if it does [s]."
    )
    jump_m: Length = Field(
        0.0, ge=0.0, description="How far it jumps, in a direction drawn for the trial [m]."
    )
    jump_yaw_rad: Angle = Field(
        0.0, ge=0.0, description="By what heading, to the side drawn for the trial [rad]."
    )
    fix_period_s: Period | None = Field(
        None,
        description="Time between two fixes, each of which finds the pose on the map and so undoes "
        "the drift until then [s]; null: none after the start.",
    )
    fix_lag_s: Duration = Field(
        0.0, ge=0.0, description="How long after its instant a fix takes effect [s]."
    )
    fix_xy_std_m: Length = Field(0.0, ge=0.0, description="Noise on x and on y of a fix [m].")
    fix_yaw_std_rad: Angle = Field(0.0, ge=0.0, description="Noise on the heading of a fix [rad].")

    @model_validator(mode="after")
    def _check(self) -> LocalizationSettings:
        if self.fix_period_s is None:
            for name in ("fix_lag_s", "fix_xy_std_m", "fix_yaw_std_rad"):
                if getattr(self, name) > 0.0:
                    raise ValueError(
                        f"{name}: expected fix_period_s as well: without it there is "
                        "no fix after the start"
                    )
        return self

    @property
    def has_frames(self) -> bool:
        """Whether map and odometry come apart, so that each is a frame of its own."""
        sources = ("drift", "yaw_drift", "x_bias_m", "y_bias_m", "yaw_bias_rad", "jump_m")
        return (
            any(getattr(self, name) != 0.0 for name in (*sources, "jump_yaw_rad"))
            or self.fix_period_s is not None
        )

    @property
    def delays_s(self) -> dict[str, float]:
        """By field, how late what it tells may be, s."""
        return {"fix_lag_s": self.fix_lag_s}
