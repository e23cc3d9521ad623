"""Parameters of Nav2's planner for cars, and how they bound a search."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from drake_navbench.navigation.smac_planner_2d_parameters import GridSmootherParameters
from drake_navbench.typed_files.quantities import Count, Duration, Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel


class SmacPlannerHybridParameters(FrozenModel):
    """Parameters of nav2_smac_planner::SmacPlannerHybrid, with its names and defaults."""

    plugin: Literal["nav2_smac_planner::SmacPlannerHybrid"] = "nav2_smac_planner::SmacPlannerHybrid"
    motion_model_for_search: Literal["DUBIN", "REEDS_SHEPP"] = Field(
        "DUBIN", description="Forward only, or backward too."
    )
    minimum_turning_radius: Length = Field(0.4, gt=0.0, description="Of the path [m].")
    angle_quantization_bins: Count = Field(72, ge=1, le=720, description="Headings of a state.")
    tolerance: Length = Field(
        0.25, ge=0.0, description="Distance from the goal at which a path may end [m]."
    )
    downsample_costmap: bool = Field(False, description="Plan on a coarser map.")
    downsampling_factor: Count = Field(1, ge=1, description="Cells merged along each axis.")
    allow_unknown: bool = Field(True, description="Unknown cells may be crossed.")
    max_iterations: Count = Field(
        1_000_000, description="Limit of the search; 0 or less is none [expansions]."
    )
    max_on_approach_iterations: Count = Field(
        1000, description="Search on within the tolerance; 0 or less is no limit [expansions]."
    )
    terminal_checking_interval: Count = Field(
        5000, gt=0, description="How often the planning time is looked at [expansions]."
    )
    max_planning_time: Duration = Field(
        5.0, ge=0.0, description="Search time on a computer of `expansions_per_second` [s]."
    )
    smooth_path: bool = Field(True, description="Whether the path is smoothed.")
    allow_primitive_interpolation: bool = Field(
        True, description="Wider turns beside the tightest one."
    )
    cache_obstacle_heuristic: bool = Field(
        False, description="Keep the way round obstacles for a goal; here nothing is kept."
    )
    reverse_penalty: Number = Field(2.0, ge=0.0, description="Factor of driving backwards.")
    change_penalty: Number = Field(0.0, ge=0.0, description="Added where a turn changes side.")
    non_straight_penalty: Number = Field(1.2, ge=0.0, description="Factor of a turn.")
    cost_penalty: Number = Field(2.0, ge=0.0, description="Weight of the cells' costs.")
    retrospective_penalty: Number = Field(
        0.015, ge=0.0, description="Less weight of the length near the start."
    )
    use_quadratic_cost_penalty: bool = Field(False, description="Costs count squared.")
    analytic_expansion_ratio: Number = Field(
        3.5, gt=0.0, description="How much more often curves to the goal are tried near it."
    )
    analytic_expansion_max_length: Length = Field(
        3.0, ge=0.0, description="Longest curve to the goal [m]."
    )
    analytic_expansion_max_cost: Number = Field(
        200.0, ge=0.0, description="Largest cost on it, but where the goal itself lies in more."
    )
    analytic_expansion_max_cost_override: bool = Field(
        False, description="Any cost, where the goal is nearer than a full turn."
    )
    downsample_obstacle_heuristic: bool = Field(
        True, description="The way round obstacles by cells twice as large."
    )
    lookup_table_size: Length = Field(
        20.0, gt=0.0, le=200.0, description="Around the goal, where a car's way counts [m]."
    )
    goal_heading_mode: Literal["DEFAULT", "BIDIRECTIONAL", "ALL_DIRECTION"] = Field(
        "DEFAULT", description="Headings at the goal: its own, also the opposite one, or any."
    )
    coarse_search_resolution: Count = Field(
        1, description="With any heading, every how many are tried first; 0 or less: all."
    )
    debug_visualizations: bool = Field(False, description="Output only, of no effect here.")
    smoother: GridSmootherParameters = Field(default_factory=GridSmootherParameters)

    expansions_per_second: Number = Field(
        1e5,
        gt=0.0,
        description="Ours: turns max_planning_time into a count, so that no result depends on "
        "the speed of the computer [1/s].",
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.angle_quantization_bins % self.coarse_step != 0:
            raise ValueError(
                f"coarse_search_resolution: got {self.coarse_search_resolution}, expected a "
                f"divisor of angle_quantization_bins {self.angle_quantization_bins}"
            )
        return self

    @property
    def coarse_step(self) -> int:
        """The step between the goal headings that are tried first."""
        return max(1, self.coarse_search_resolution)
