"""Parameters of Nav2's planner for cars, and how they bound a search."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from drake_navbench.navigation.smac_planner_2d_parameters import SmacSearchParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, before, since
from drake_navbench.typed_files.quantities import Count, Duration, Length, Number

# No cell costs more: before the parameter existed, curves to the goal had no limit.
ANY_COST = 255.0


class SmacPlannerHybridParameters(SmacSearchParameters):
    """Parameters of nav2_smac_planner::SmacPlannerHybrid, with its names and defaults."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "debug_visualizations": since(Release.IRON),
        # Jazzy and later read it; only in Lyrical it is true by default.
        "allow_primitive_interpolation": since(Release.JAZZY, before(Release.LYRICAL, False)),
        "analytic_expansion_max_cost": since(Release.JAZZY, before(Release.JAZZY, ANY_COST)),
        "analytic_expansion_max_cost_override": since(Release.JAZZY),
        "downsample_obstacle_heuristic": since(Release.JAZZY),
        "use_quadratic_cost_penalty": since(Release.JAZZY),
        "coarse_search_resolution": since(Release.KILTED),
        "goal_heading_mode": since(Release.KILTED),
    }

    plugin: Literal["nav2_smac_planner::SmacPlannerHybrid"] = "nav2_smac_planner::SmacPlannerHybrid"
    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: up to Kilted the smoother tests the cell "
        "under the robot's centre, all first motions cost the same, and a tolerance "
        "frees a blocked goal; up to Jazzy curves to the goal ignore changes of "
        "direction; up to Iron paths start and end in cells, and curves are not "
        "widened.",
    )
    motion_model_for_search: Literal["DUBIN", "REEDS_SHEPP"] = Field(
        "DUBIN", description="Kind of curves: DUBIN drives forward only, REEDS_SHEPP backward, too."
    )
    minimum_turning_radius: Length = Field(
        0.4, gt=0.0, description="Least turning radius of the path [m]."
    )
    angle_quantization_bins: Count = Field(
        72, ge=1, le=720, description="Number of headings that are told apart."
    )
    tolerance: Length = Field(
        0.25, ge=0.0, description="Distance from the goal at which a path may end [m]."
    )
    max_planning_time: Duration = Field(
        5.0, ge=0.0, description="Longest search on a computer with `expansions_per_second` [s]."
    )
    smooth_path: bool = Field(True, description="Smooth the path.")
    allow_primitive_interpolation: bool = Field(
        True, description="Try wider turns beside the tightest one."
    )
    cache_obstacle_heuristic: bool = Field(
        False,
        description="No effect here: no obstacle heuristic is kept.",
    )
    reverse_penalty: Number = Field(2.0, ge=0.0, description="Cost factor of driving backwards.")
    change_penalty: Number = Field(
        0.0, ge=0.0, description="Cost of a change between left and right."
    )
    non_straight_penalty: Number = Field(1.2, ge=0.0, description="Cost factor of a turn.")
    cost_penalty: Number = Field(2.0, ge=0.0, description="Weight of the cells' costs.")
    retrospective_penalty: Number = Field(
        0.015,
        ge=0.0,
        description="Share by which the weight of the length is reduced, so that turns come late.",
    )
    use_quadratic_cost_penalty: bool = Field(False, description="Square the cells' costs.")
    analytic_expansion_ratio: Number = Field(
        3.5,
        gt=0.0,
        description="Rate at which curves to the goal are tried more often near the goal.",
    )
    analytic_expansion_max_length: Length = Field(
        3.0, ge=0.0, description="Length of the longest direct curve to the goal [m]."
    )
    analytic_expansion_max_cost: Number = Field(
        200.0,
        ge=0.0,
        description="Largest cost on a direct curve to the goal, unless the goal itself costs "
        "more.",
    )
    analytic_expansion_max_cost_override: bool = Field(
        False, description="Accept any cost on the curve where the goal is nearer than a full turn."
    )
    downsample_obstacle_heuristic: bool = Field(
        True, description="Compute the obstacle heuristic on cells twice as large."
    )
    lookup_table_size: Length = Field(
        20.0,
        gt=0.0,
        le=200.0,
        description="Side of the square around the goal in which the heuristic respects the "
        "turning radius [m].",
    )
    goal_heading_mode: Literal["DEFAULT", "BIDIRECTIONAL", "ALL_DIRECTION"] = Field(
        "DEFAULT",
        description="Accepted headings at the goal: its own, its own and the opposite one, or any.",
    )
    coarse_search_resolution: Count = Field(
        1, description="With any heading: try every n-th heading first; 0 or less: all at once."
    )
    debug_visualizations: bool = Field(False, description="Topic output in Nav2; no effect here.")

    expansions_per_second: Number = Field(
        1e5,
        gt=0.0,
        description="Ours: turns max_planning_time into a count of expansions, whatever the "
        "computer's speed [1/s].",
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.angle_quantization_bins % max(1, self.coarse_search_resolution) != 0:
            raise ValueError(
                f"coarse_search_resolution: got {self.coarse_search_resolution}, expected a "
                f"divisor of angle_quantization_bins {self.angle_quantization_bins}"
            )
        return self

    @property
    def coarse_step(self) -> int:
        """The step between the goal headings that are tried first; 1 unless any heading counts."""
        is_any = self.goal_heading_mode == "ALL_DIRECTION"
        return max(1, self.coarse_search_resolution) if is_any else 1
