"""A sonar or an infrared distance sensor in a robot file."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import Angle, Length, Period, require_order
from drake_navbench.typed_files.typed_yaml import FrozenModel


class RangeSensorSettings(FrozenModel):
    """A sensor that tells one distance: to the nearest thing that any of its rays meets.

    Its rays lie side by side at its height. With equal ranges it is a switch: -inf where something
    is nearer, inf where nothing is.
    """

    pose: tuple[Length, Length, Angle] = Field(
        (0.0, 0.0, 0.0),
        description="Pose of the sensor in the base frame: x [m], y [m], yaw [rad].",
    )
    height_m: Length = Field(0.2, ge=0.0, description="Height of the rays above the floor [m].")
    radiation: Literal["ultrasound", "infrared"] = Field(
        "ultrasound", description="Radiation: ultrasound is reflected by glass, infrared is not."
    )
    field_of_view_rad: float = Field(
        0.5, gt=0.0, le=math.pi, description="Opening angle of the cone, from side to side [rad]."
    )
    ray_count: int = Field(15, ge=1, le=1024, description="Number of rays in the cone.")
    range_min_m: Length = Field(0.02, ge=0.0, description="Shortest range [m].")
    range_max_m: Length = Field(3.0, gt=0.0, description="Longest range [m].")
    out_of_range: Literal["range_max", "inf"] = Field(
        "range_max",
        description="Reading where nothing is in range: the longest range, as from most drivers, "
        "or inf.",
    )
    period_s: Period = Field(0.1, description="Time between readings [s].")
    range_std_m: Length = Field(
        0.0, ge=0.0, description="Noise on each reading, standard deviation [m]."
    )

    @model_validator(mode="after")
    def _check(self) -> RangeSensorSettings:
        require_order(self, "range_min_m", "range_max_m")
        return self

    @property
    def is_switch(self) -> bool:
        """Whether the sensor tells only if something is there, and no distance."""
        return self.range_min_m == self.range_max_m

    @property
    def ray_angles(self) -> NDArray[np.float64]:
        """(ray_count,) angles of the rays from the sensor's axis, rad; a single ray is the axis."""
        half = 0.5 * self.field_of_view_rad if self.ray_count > 1 else 0.0
        return np.asarray(np.linspace(-half, half, self.ray_count), dtype=np.float64)

    def reported_range_m(self, distance_m: float) -> float:
        """Returns the sensor's reading, m or as infinite as in REP 117.

        distance_m: true distance to the nearest thing in the cone; inf where there is none.
        """
        if self.is_switch:
            return -math.inf if distance_m <= self.range_max_m else math.inf
        if distance_m > self.range_max_m:
            return self.range_max_m if self.out_of_range == "range_max" else math.inf
        return -math.inf if distance_m < self.range_min_m else distance_m
