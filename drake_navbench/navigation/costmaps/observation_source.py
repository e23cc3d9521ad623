"""The sources that a layer of a costmap listens to, under the names of Nav2's parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import Duration
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import positive


class SourceSettings(FrozenModel):
    """The choice of one of the robot's sensors as the source of a layer."""

    data_type: Literal["LaserScan", "PointCloud2"] = Field(
        "LaserScan", description="Message type of the source; the robot's lidar sends LaserScan."
    )
    sensor: str = Field(
        "",
        description="For PointCloud2: name of the robot's depth sensor; empty: the source's name.",
    )
    scanner: int | None = Field(
        None,
        ge=1,
        description="For LaserScan: number of the robot's scanner, from 1; null: all scanners.",
    )

    @model_validator(mode="after")
    def _check_sensor(self) -> SourceSettings:
        if self.sensor and self.data_type != "PointCloud2":
            raise ValueError(f"sensor: got {self.sensor!r}, expected data_type PointCloud2 with it")
        if self.scanner is not None and self.data_type != "LaserScan":
            raise ValueError(f"scanner: got {self.scanner}, expected data_type LaserScan with it")
        return self


class ObservationSourceSettings(SourceSettings):
    """One source of an obstacle or voxel layer, with Nav2's defaults, which suit a planar lidar."""

    marking: bool = Field(True, description="Let the points mark cells.")
    clearing: bool = Field(False, description="Let the rays to the points clear cells.")
    min_obstacle_height: float = Field(
        0.0, description="Height below which points are ignored [m]."
    )
    max_obstacle_height: float = Field(
        0.0, description="Height above which points are ignored [m]."
    )
    # Nav2 takes negative values of both least ranges: it squares the first.
    obstacle_min_range: float = Field(0.0, description="Least distance of a point that marks [m].")
    obstacle_max_range: Annotated[
        float, positive("marks nothing; of a negative range some releases take the size")
    ] = Field(2.5, description="Distance from which points do not mark [m].")
    raytrace_min_range: float = Field(
        0.0, description="Distance at which clearing along a ray starts [m]."
    )
    raytrace_max_range: Annotated[float, positive("clears nothing")] = Field(
        3.0, description="Distance at which clearing along a ray ends [m]."
    )
    inf_is_valid: bool = Field(
        False, description="Let beams of a LaserScan without a hit clear up to the sensor's range."
    )
    observation_persistence: Duration = Field(
        0.0, ge=0.0, description="Time for which an observation is kept [s]; 0: until the next one."
    )
