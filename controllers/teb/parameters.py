"""TEB's parameters: upstream's names and defaults (teb_local_planner, ros2-master)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.controller import ControllerSetup
from drake_navbench.controllers.teb.band_parameters import NAMES_WITHOUT_EFFECT, BandParameters
from drake_navbench.controllers.teb.footprint_model import (
    FootprintModel,
    FootprintType,
    footprint_discs,
    line_discs,
)
from drake_navbench.typed_files.quantities import (
    Count,
    Length,
    Number,
)


class DiscModel(FootprintModel):
    """The robot as discs on its axis; by default those of its own outline."""

    type: FootprintType = Field(
        "from_footprint",
        description="Shape of the robot; from_footprint derives it from the robot's outline.",
    )

    def discs(self, setup: ControllerSetup) -> NDArray[np.float64]:
        """Returns (D, 2): offset along x and radius of the discs, m."""
        discs = self.circles()
        if discs is not None:
            return discs
        if self.type == "line":
            return line_discs(self.outline(setup.footprint))
        return footprint_discs(self.outline(setup.footprint))


class TebParameters(BandParameters):
    """The parameters that upstream reads and this controller uses, then this controller's own.

    Upstream's penalty weights of limits have no meaning here, because limits are constraints;
    `WITHOUT_EFFECT` names them and other parameters that are accepted and dropped.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "max_vel_x": (0.05, 1.0),
        "max_vel_theta": (0.1, 3.0),
        "acc_lim_x": (0.1, 3.0),
        "min_obstacle_dist": (0.02, 1.0),
        "inflation_dist": (0.0, 1.5),
        "weight_optimaltime": (0.1, 10.0),
        "weight_slack": (1.0, 200.0),
    }

    STOOD_IN_FOR: ClassVar[Mapping[str, str]] = {
        "costmap_converter_plugin": "the lethal cells stand in for the shapes that it makes"
    }
    WITHOUT_EFFECT: ClassVar[frozenset[str]] = BandParameters.WITHOUT_EFFECT.union(
        NAMES_WITHOUT_EFFECT["teb"]
    )

    # Trajectory
    global_plan_overwrite_orientation: bool = Field(
        True, description="Point the local goal along the plan, not as its pose says."
    )
    feasibility_check_lookahead_distance: Length = Field(
        -1.0,
        description="Distance from the robot up to which poses are checked; 0 or less: no "
        "limit [m].",
    )
    control_look_ahead_poses: Count = Field(
        1,
        ge=1,
        description="Number of the interval of the band whose speed the command aims at.",
    )

    # Robot
    footprint_model: DiscModel = Field(
        default_factory=DiscModel, description="Shape of the robot in the optimisation."
    )

    # Goal

    # Obstacles
    min_obstacle_dist: Length = Field(
        0.5,
        ge=0.0,
        description="Clearance that the footprint model keeps where there is room for it [m].",
    )
    include_dynamic_obstacles: bool = Field(
        False,
        description="Avoid the predicted positions of moving obstacles, not their present ones.",
    )
    inflation_dist: Length = Field(
        0.6, ge=0.0, description="Clearance below which closeness costs [m]."
    )

    # Optimisation
    no_inner_iterations: Count = Field(
        5,
        ge=1,
        description="IPOPT's iteration limit is no_inner_iterations times no_outer_iterations.",
    )
    no_outer_iterations: Count = Field(
        4, ge=1, description="Second factor of IPOPT's iteration limit."
    )
    weight_optimaltime: Number = Field(
        1.0, gt=0.0, description="Weight of squared time steps [1/s^2]."
    )
    weight_shortest_path: Number = Field(
        0.0, ge=0.0, description="Weight of squared distances between poses [1/m^2]."
    )
    weight_kinematics_forward_drive: Number = Field(
        1.0, ge=0.0, description="Weight of squared backward displacements [1/m^2]."
    )
    weight_inflation: Number = Field(
        0.1, ge=0.0, description="Weight of squared clearance missing from inflation_dist [1/m^2]."
    )
    weight_viapoint: Number = Field(
        1.0, ge=0.0, description="Weight of squared distances to via-points [1/m^2]."
    )

    # Topologies
    enable_homotopy_class_planning: bool = Field(
        True, description="Search paths on the other side of obstacles, too."
    )
    max_number_classes: Count = Field(
        5, ge=1, description="Largest number of candidate bands in a cycle."
    )
    selection_cost_hysteresis: Number = Field(
        1.0, gt=0.0, description="Factor on the duration of the homotopy class driven so far."
    )
    selection_prefer_initial_plan: Number = Field(
        0.95, gt=0.0, description="Factor on the duration of the global plan's homotopy class."
    )
    max_ratio_detours_duration_best_duration: Number = Field(
        3.0, ge=1.0, description="Ratio to the shortest duration above which a detour is dropped."
    )

    # Only here
    weight_smoothness: Number = Field(
        0.1, ge=0.0, description="Weight of squared changes of v and w between intervals."
    )
    weight_slack: Number = Field(
        100.0,
        gt=0.0,
        description="Cost of each metre of clearance missing from min_obstacle_dist [1/m].",
    )
    cold_start_iterations: Count = Field(
        80, ge=1, description="IPOPT's iteration limit for a band without a predecessor."
    )
    solver: Literal["ipopt", "interior_point"] = Field(
        "ipopt",
        description="Solver of converged bands; where interior_point fails, IPOPT takes over.",
    )
    blocked_goal_distance_m: Length = Field(
        0.05,
        gt=0.0,
        description="Distance to the end of the plan's free part below which the controller "
        "gives up [m].",
    )
