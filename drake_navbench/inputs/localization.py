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

# An odometry that tells no more than this of a way is none.
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
    random_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Spread of the error on x and on y that wheel noise adds to the odometry over "
        "a metre; it grows with the root of the way [m/m^0.5].",
    )
    random_yaw_drift: float = Field(
        0.0,
        ge=0.0,
        le=MAX_DRIFT,
        description="Spread of the error of its heading that wheel noise adds over a metre "
        "[rad/m^0.5].",
    )
    wheel_odometry: bool = Field(
        False,
        description="Whether the odometry believes the wheels: what they slip, and radii that are "
        "not nominal, then mislead it.",
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
    amcl: AmclSettings | None = Field(
        None,
        description="AMCL finds the pose from the scans and what the map shows, instead of fixes "
        "and biases; a jump then displaces what it believes. null: none.",
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
