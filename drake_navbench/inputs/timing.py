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

    scan_latency_s: Duration = Field(0.0, ge=0.0, description="Latency of every scan [s].")
    scan_jitter_s: Duration = Field(
        0.0,
        ge=0.0,
        description="Additional latency of each scan, drawn uniformly from 0 to this [s].",
    )
    odometry_latency_s: Duration = Field(
        0.0,
        ge=0.0,
        description="Latency of the pose and velocity that controller and navigator get [s].",
    )
    odometry_jitter_s: Duration = Field(
        0.0,
        ge=0.0,
        description="Their additional latency, drawn uniformly from 0 to this [s].",
    )
    command_latency_s: Duration = Field(
        0.0, ge=0.0, description="Latency from the navigation's last stage to the wheels [s]."
    )
    command_jitter_s: Duration = Field(
        0.0,
        ge=0.0,
        description="Additional latency of each command, drawn uniformly from 0 to this [s].",
    )
    command_loss_probability: float = Field(
        0.0, ge=0.0, le=1.0, description="Share of the commands that are lost."
    )
    command_timeout_s: Duration | None = Field(
        None,
        gt=0.0,
        description="Time after the last command at which the wheels stop [s]; null: never.",
    )
    compute_time: str | float = Field(
        0.0,
        description="Simulated duration of a control cycle: a number [ms]; measured: the "
        "wall-clock time that it took; scaled: that times compute_time_scale. A cycle "
        "that exceeds its period delays the next one.",
    )
    compute_time_scale: float = Field(
        1.0,
        gt=0.0,
        le=1e4,
        description="Factor by which the robot's computer is slower, for scaled.",
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
        """The largest delay, s, by the field that sets it."""
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
        """Whether the odometry's pose and velocity come late."""
        return self.odometry_latency_s + self.odometry_jitter_s > 0.0

    @property
    def touches_commands(self) -> bool:
        """Whether commands are delayed, lost or stopped by a timeout."""
        return (
            self.command_latency_s + self.command_jitter_s + self.command_loss_probability > 0.0
            or self.command_timeout_s is not None
        )
