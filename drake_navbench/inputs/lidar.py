"""The scanner of a robot file."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from drake_navbench.typed_files.quantities import Angle, Length, Period, require_order
from drake_navbench.typed_files.typed_yaml import QuietModel

# The most by which 2 pi is off when it is rounded to four digits or more, rad.
ROUNDING_RAD = 2e-5


class LidarSettings(QuietModel):
    """A planar scanner, beams evenly spaced counter-clockwise."""

    quiet: ClassVar = frozenset(
        {"dropout_burst_beams", "scan_loss_probability", "stuck_beam_share", "range_bias_m"}
    )
    # The fields that no fault may change during a trial.
    constant: ClassVar = frozenset(
        {
            "pose",
            "further_poses",
            "height_m",
            "beam_count",
            "angle_min_rad",
            "angle_span_rad",
            "range_min_m",
            "period_s",
        }
    )

    pose: tuple[Length, Length, Angle] = Field(
        (0.0, 0.0, 0.0),
        description="Pose of the scanner in the base frame: x [m], y [m], yaw [rad].",
    )
    further_poses: tuple[tuple[Length, Length, Angle], ...] = Field(
        (), description="Poses of further scanners of the same kind, which scan at the same time."
    )
    height_m: float = Field(
        0.2, description="Height of the scanned plane above the floor, for voxel layers [m]."
    )
    beam_count: int = Field(360, ge=1, le=100_000, description="Number of beams in a scan.")
    angle_min_rad: Angle = Field(
        -np.pi, ge=-np.pi, description="Angle of the first beam in the scanner's frame [rad]."
    )
    angle_span_rad: float = Field(
        2.0 * np.pi,
        gt=0.0,
        le=2.0 * np.pi,
        description="Angle from the first to the last beam [rad]; at 2 pi the last beam lies one "
        "step before the first.",
    )
    range_min_m: Length = Field(0.05, ge=0.0, description="Shortest valid range [m].")
    range_max_m: Length = Field(12.0, gt=0.0, description="Longest valid range [m].")
    period_s: Period = Field(0.1, description="Time between scans [s].")
    range_std_m: Length = Field(
        0.0, ge=0.0, description="Noise on each range, standard deviation [m]."
    )
    dropout_probability: float = Field(
        0.0, ge=0.0, le=1.0, description="Share of the beams that return nothing."
    )
    dropout_burst_beams: int = Field(
        1, ge=1, le=100_000, description="Number of neighbouring beams that drop out together."
    )
    scan_loss_probability: float = Field(
        0.0, ge=0.0, le=1.0, description="Share of the scans that are lost."
    )
    stuck_beam_share: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Share of the beams that always return one range; drawn for the trial.",
    )
    range_bias_m: Length = Field(0.0, description="Constant error of every range [m].")

    @property
    def beam_angles(self) -> NDArray[np.float64]:
        """(beam_count,) angles of the beams in the sensor's frame, rad."""
        full_turn = math.isclose(self.angle_span_rad, 2.0 * math.pi)
        gaps = self.beam_count if full_turn else max(self.beam_count - 1, 1)
        increment = self.angle_span_rad / gaps
        angles = self.angle_min_rad + increment * np.arange(self.beam_count)
        return np.asarray(angles, dtype=np.float64)

    @property
    def delays_s(self) -> dict[str, float]:
        """The largest delays of the readings, s, by field."""
        return {}

    @field_validator("angle_span_rad", mode="before")
    @classmethod
    def _all_round(cls, value: Any) -> Any:
        turn_rad = 2.0 * math.pi
        is_turn = isinstance(value, float) and abs(value - turn_rad) < ROUNDING_RAD
        return turn_rad if is_turn else value

    @model_validator(mode="after")
    def _check(self) -> LidarSettings:
        require_order(self, "range_min_m", "range_max_m", may_be_equal=False)
        return self
