"""Parameters of the 2D planner: those of Nav2's SmacPlanner2D, and switches of our own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from drake_navbench.navigation.smoother_parameters import REFINEMENT
from drake_navbench.releases import ReadBy, Release, since
from drake_navbench.typed_files.quantities import Count, Duration, Length, Number


class GridSmootherParameters(BaseModel):
    """Parameters `smoother.*` of SmacPlanner2D, with Nav2's names and defaults."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = REFINEMENT

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    tolerance: Length = Field(
        1e-10,
        gt=0.0,
        description="A smoothing pass ends when a sweep moves the points by less than this in "
        "sum [m]",
    )
    max_iterations: Count = Field(
        1000,
        ge=0,
        description="Number of the sweep before which a smoothing pass ends; 0 turns "
        "smoothing off [sweeps]",
    )
    w_data: Number = Field(
        0.2, ge=0.0, description="Pull of a point towards the unsmoothed path [-]"
    )
    w_smooth: Number = Field(
        0.3, ge=0.0, description="Pull of a point towards the mean of its neighbours [-]"
    )
    do_refinement: bool = Field(True, description="Smooth the smoothed path again [-]")
    refinement_num: Count = Field(
        2, ge=0, description="Number of further smoothing passes [passes]"
    )


class SmacPlanner2DParameters(BaseModel):
    """Parameters of SmacPlanner2D with Nav2's names and defaults, then our own switches."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "terminal_checking_interval": since(Release.JAZZY),
    }

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    plugin: Literal["nav2_smac_planner::SmacPlanner2D"] = "nav2_smac_planner::SmacPlanner2D"
    tolerance: Length = Field(
        0.125, ge=0.0, description="Distance from the goal at which a path may end [m]"
    )
    downsample_costmap: bool = Field(False, description="Plan on a coarser map [-]")
    downsampling_factor: Count = Field(1, ge=1, description="Cells merged along each axis [cells]")
    cost_travel_multiplier: Number = Field(
        1.0,
        ge=0.0,
        description="Weight of the cells' costs against length; 0 gives the shortest path [-]",
    )
    allow_unknown: bool = Field(True, description="Let paths cross unknown cells [-]")
    max_iterations: Count = Field(
        1_000_000, description="Largest number of expansions; 0 or less: no limit [expansions]"
    )
    max_on_approach_iterations: Count = Field(
        1000,
        description="Largest number of further expansions within the tolerance; 0 or less: no "
        "limit [expansions]",
    )
    terminal_checking_interval: Count = Field(
        5000,
        gt=0,
        description="Number of expansions between two checks of the planning time [expansions]",
    )
    max_planning_time: Duration = Field(
        2.0, ge=0.0, description="Longest search on a computer with `expansions_per_second` [s]"
    )
    use_final_approach_orientation: bool = Field(
        False, description="End the path with its own direction, not with the goal's heading [-]"
    )
    smoother: GridSmootherParameters = GridSmootherParameters()

    expansions_per_second: Number = Field(
        1e6,
        gt=0.0,
        description="Ours: turns max_planning_time into a count, so that no result depends on "
        "the speed of the computer [1/s]",
    )
    use_cell_centres: bool = Field(
        True,
        description="Ours: poses, and distances to the goal, count from the middle of cells; Nav2: "
        "from their lower left corners [-]",
    )
    use_exact_end_points: bool = Field(
        True,
        description="Ours: the path starts at the start and ends at the goal before it is "
        "smoothed, offsets within a cell blended along it; Nav2: starts at a cell, the goal "
        "replaces the last position after smoothing [-]",
    )
    allow_corner_cutting: bool = Field(
        False, description="Nav2: True, diagonal steps may pass between two blocked cells [-]"
    )
    always_assign_headings: bool = Field(
        True, description="Ours: also short and unsmoothed paths get headings; Nav2: yaw 0 [-]"
    )
    downsample_known_cells: bool = Field(
        True,
        description="Ours: a merged cell has the largest known cost, unknown if none is known; "
        "Nav2: one unknown cell makes it unknown, even beside lethal ones [-]",
    )
    report_time_limit_as_timeout: bool = Field(
        True, description="Ours: max_planning_time gives PlannerTimedOut; Nav2: no valid path [-]"
    )
    check_footprint: bool = Field(
        False,
        description="Ours: refuse a path on which the footprint meets an obstacle, or the centre "
        "of a robot given by a radius an inscribed cell [-]",
    )

    @classmethod
    def nav2_classic(cls, **parameters: Any) -> Self:
        """Returns parameters that behave as Nav2 does in every switch not given."""
        classic = {
            "use_cell_centres": False,
            "use_exact_end_points": False,
            "allow_corner_cutting": True,
            "always_assign_headings": False,
            "downsample_known_cells": False,
            "report_time_limit_as_timeout": False,
            "check_footprint": False,
        }
        return cls(**{**classic, **parameters})
