"""Parameters of the 2D planner: those of Nav2's SmacPlanner2D, and switches of our own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from drake_navbench.navigation.smoother_parameters import RelaxationParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.quantities import Count, Duration, Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel


class GridSmootherParameters(RelaxationParameters):
    """Parameters `smoother.*` of SmacPlanner2D."""

    max_iterations: Count = Field(
        1000,
        ge=0,
        description="Number of the sweep before which a smoothing pass ends; 0 turns "
        "smoothing off [sweeps]",
    )


class SmacSearchParameters(FrozenModel):
    """The parameters that Nav2's planners of the package smac read in the same sense."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "terminal_checking_interval": since(Release.JAZZY),
    }

    downsample_costmap: bool = Field(False, description="Plan on a coarser map.")
    downsampling_factor: Count = Field(1, ge=1, description="Cells merged along each axis [cells]")
    allow_unknown: bool = Field(True, description="Let paths cross unknown cells.")
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
    smoother: GridSmootherParameters = GridSmootherParameters()


class SmacPlanner2DParameters(SmacSearchParameters):
    """Parameters of SmacPlanner2D, then our own switches."""

    plugin: Literal["nav2_smac_planner::SmacPlanner2D"] = "nav2_smac_planner::SmacPlanner2D"
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Kilted the smoother tests the cell "
        "under the robot's centre, a tolerance frees a blocked goal, and a search out "
        "of time finds no path; up to Iron a blocked start is refused.",
    )
    tolerance: Length = Field(
        0.125, ge=0.0, description="Distance from the goal at which a path may end [m]"
    )
    cost_travel_multiplier: Number = Field(
        1.0,
        ge=0.0,
        description="Weight of the cells' costs against length; 0 gives the shortest path.",
    )
    max_planning_time: Duration = Field(
        2.0, ge=0.0, description="Longest search on a computer with `expansions_per_second` [s]"
    )
    use_final_approach_orientation: bool = Field(
        False, description="End the path with its own direction, not with the goal's heading."
    )

    expansions_per_second: Number = Field(
        1e6,
        gt=0.0,
        description="Ours: turns max_planning_time into a count of expansions, whatever the "
        "computer's speed [1/s]",
    )
    use_cell_centres: bool = Field(
        True,
        description="Ours: poses and distances to the goal refer to the middle of a cell; Nav2: "
        "to its lower left corner (poses in Humble half a cell further, in Iron half a cell "
        "before).",
    )
    use_exact_end_points: bool = Field(
        True,
        description="Ours: before smoothing the path is moved to the exact start and goal, their "
        "offsets blended along it; Nav2: it starts at the cell, and the goal replaces "
        "its last position (up to Kilted it ends at a cell).",
    )
    allow_corner_cutting: bool = Field(
        False, description="Let diagonal steps pass between two blocked cells; Nav2: true."
    )
    always_assign_headings: bool = Field(
        True, description="Ours: also short and unsmoothed paths get headings; Nav2: yaw 0."
    )
    downsample_known_cells: bool = Field(
        True,
        description="Ours: a merged cell has the largest known cost; Nav2: one unknown cell makes "
        "it unknown.",
    )
    report_time_limit_as_timeout: bool = Field(
        True, description="Ours: max_planning_time gives PlannerTimedOut; Nav2: no valid path."
    )
    check_footprint: bool = Field(
        False,
        description="Ours: refuse a path on which the footprint meets an obstacle; with "
        "robot_radius, one whose poses lie in inscribed cells.",
    )

    @model_serializer(mode="wrap")
    def _as_plain(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leaves out the release if it was not given, as logs did before there was one."""
        values: dict[str, Any] = plain(self)
        if "nav2_release" not in self.model_fields_set:
            values.pop("nav2_release", None)
        return values

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
