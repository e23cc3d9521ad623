"""The timing of a robot file: late and lost messages, and the duration of control cycles."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, field_validator

from drake_navbench.typed_files.quantities import Duration
from drake_navbench.typed_files.typed_yaml import FrozenModel

MAX_COMPUTE_TIME_MS = 1e6
MEASURED = ("measured", "scaled")


class TimingSettings(FrozenModel):
    """The latencies of messages, and the effect of a control cycle's compute time on commands."""

    # The fields that no fault may change during a trial.
    constant: ClassVar = frozenset[str]()

    scan_latency_s: Duration = Field(0.0, ge=0.0, description="Of every scan [s].")
    scan_jitter_s: Duration = Field(
        0.0, ge=0.0, description="Further latency, evenly spread from 0 to this [s]."
    )
    odometry_latency_s: Duration = Field(
        0.0, ge=0.0, description="Of pose and velocity as controller and navigator have them [s]."
    )
    odometry_jitter_s: Duration = Field(0.0, ge=0.0, description="Likewise [s].")
    command_latency_s: Duration = Field(
        0.0, ge=0.0, description="From the last stage of the navigation to the wheels [s]."
    )
    command_jitter_s: Duration = Field(0.0, ge=0.0, description="Likewise [s].")
    command_loss_probability: float = Field(
        0.0, ge=0.0, le=1.0, description="Share of commands that never arrive."
    )
    command_timeout_s: Duration | None = Field(
        None, gt=0.0, description="The wheels stop so long after the last command [s]; null: never."
    )
    compute_time: str | float = Field(
        0.0,
        description="How late a command is, and with it the next cycle where it misses its period: "
        "measured: by the wall-clock time that the cycle took; scaled: by that times "
        "compute_time_scale; or by so many [ms].",
    )
    compute_time_scale: float = Field(
        1.0, gt=0.0, le=1e4, description="How much slower the robot's computer is, if scaled."
    )

    @field_validator("compute_time")
    @classmethod
    def _check_compute_time(cls, value: str | float) -> str | float:
        if isinstance(value, str):
            is_known = value in MEASURED
        else:
            is_known = 0.0 <= value <= MAX_COMPUTE_TIME_MS
        if not is_known:
            raise ValueError(f"expected measured, scaled or 0 to {MAX_COMPUTE_TIME_MS:g} ms")
        return value

    @property
    def delays_s(self) -> dict[str, float]:
        """By field, how late something may be, s."""
        compute = self.compute_time
        return {
            "scan_latency_s": self.scan_latency_s + self.scan_jitter_s,
            "odometry_latency_s": self.odometry_latency_s + self.odometry_jitter_s,
            "command_latency_s": self.command_latency_s + self.command_jitter_s,
            "compute_time": 0.0 if isinstance(compute, str) else 1e-3 * compute,
        }

    @property
    def delays_scans(self) -> bool:
        """Whether scans come late."""
        return self.scan_latency_s + self.scan_jitter_s > 0.0

    @property
    def delays_odometry(self) -> bool:
        """Whether pose and velocity come late."""
        return self.odometry_latency_s + self.odometry_jitter_s > 0.0

    @property
    def touches_commands(self) -> bool:
        """Whether commands come late, or not at all."""
        return (
            self.command_latency_s + self.command_jitter_s + self.command_loss_probability > 0.0
            or self.command_timeout_s is not None
        )
