"""A depth camera, or a lidar of many layers, in a robot file."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import Angle, Length, Period, require_order
from drake_navbench.typed_files.typed_yaml import FrozenModel

# A ray nearer than this to straight up or down has no distance along the floor.
STEEPEST_RAD = math.radians(89.0)


class DepthSensorSettings(FrozenModel):
    """A sensor that sends points: rays at equal angles around the axis that it looks along.

    Its defaults are those of a common depth camera, with fewer pixels.
    """

    pose: tuple[Length, Length, Angle] = Field(
        (0.0, 0.0, 0.0),
        description="Pose of the sensor in the base frame: x [m], y [m], yaw [rad].",
    )
    height_m: Length = Field(0.3, ge=0.0, description="Height of the sensor above the floor [m].")
    pitch_rad: float = Field(
        0.0, ge=-STEEPEST_RAD, le=STEEPEST_RAD, description="Downward tilt of the sensor [rad]."
    )
    horizontal_fov_rad: float = Field(
        1.52,
        gt=0.0,
        le=2.0 * math.pi,
        description="Horizontal field of view [rad]; at 2 pi the last column lies one step before "
        "the first.",
    )
    vertical_fov_rad: float = Field(
        1.01, ge=0.0, le=2.0 * STEEPEST_RAD, description="Vertical field of view [rad]."
    )
    column_count: int = Field(96, ge=1, le=4096, description="Number of columns of rays.")
    row_count: int = Field(32, ge=1, le=1024, description="Number of rows of rays.")
    range_min_m: Length = Field(0.1, ge=0.0, description="Shortest valid range [m].")
    range_max_m: Length = Field(6.0, gt=0.0, description="Longest valid range [m].")
    period_s: Period = Field(0.1, description="Time between clouds [s].")
    sees_floor: bool = Field(False, description="Send points of the floor (height 0), too.")

    @model_validator(mode="after")
    def _check(self) -> DepthSensorSettings:
        require_order(self, "range_min_m", "range_max_m", may_be_equal=False)
        steepest = abs(self.pitch_rad) + 0.5 * self.vertical_fov_rad
        if steepest > STEEPEST_RAD:
            raise ValueError(
                f"pitch_rad {self.pitch_rad:g} and vertical_fov_rad {self.vertical_fov_rad:g}: "
                f"expected rays of at most {STEEPEST_RAD:.4g} rad up or down, got {steepest:.4g}"
            )
        return self

    def rays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns (A,) headings from the axis, rad, and (A, E) slopes of the rays, m a metre.

        A sensor that looks level has the rays of a column on one heading; one that looks up or
        down has a heading for each ray.
        """
        around = math.isclose(self.horizontal_fov_rad, 2.0 * math.pi)
        gaps = self.column_count if around else max(self.column_count - 1, 1)
        half = 0.5 * self.horizontal_fov_rad
        steps = np.arange(self.column_count, dtype=np.float64)
        azimuths = self.horizontal_fov_rad / gaps * steps - half
        half = 0.5 * self.vertical_fov_rad if self.row_count > 1 else 0.0
        elevations = np.asarray(np.linspace(-half, half, self.row_count), dtype=np.float64)
        if self.pitch_rad == 0.0:
            return azimuths, np.tile(np.tan(elevations), (self.column_count, 1))
        azimuth, elevation = np.meshgrid(azimuths, elevations, indexing="ij")
        x, y = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
        z = np.sin(elevation)
        cosine, sine = math.cos(self.pitch_rad), math.sin(self.pitch_rad)
        forward, up = cosine * x + sine * z, -sine * x + cosine * z
        slopes = up / np.hypot(forward, y)
        return np.arctan2(y, forward).ravel(), slopes.reshape(-1, 1)
