"""Parameters that the settings and the plugins of obstacle and voxel layers have in common."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from drake_navbench.typed_files.typed_yaml import FrozenModel


class SensingFields(FrozenModel):
    """Parameters of an obstacle or voxel layer, apart from its sources."""

    footprint_clearing_enabled: bool = Field(True, description="Free the cells under the robot.")
    min_obstacle_height: float = Field(
        0.0, description="Height below which points do not mark [m]."
    )
    max_obstacle_height: float = Field(
        2.0, description="Height above which points do not mark [m]."
    )
    combination_method: Literal[0, 1, 2] = Field(
        1,
        description="How costs are written: 0 overwrites, 1 takes the larger cost, 2 as 1 but "
        "keeps unknown cells.",
    )


class VoxelFields(SensingFields):
    """Parameters of a voxel layer, apart from its sources."""

    z_voxels: int = Field(
        10, ge=1, le=16, description="Number of levels of the voxel grid [voxels]."
    )
    origin_z: float = Field(0.0, description="Height of the floor of the lowest level [m].")
    z_resolution: float = Field(0.2, gt=0.0, description="Height of a level [m].")
    unknown_threshold: int = Field(
        15,
        ge=0,
        description="Number of unknown voxels above which a column stays unknown [voxels].",
    )
    mark_threshold: int = Field(
        0, ge=0, description="Number of marked voxels above which a column is lethal [voxels]."
    )
