"""The original's parameters: names and defaults of teb_local_planner (ros2-master)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from drake_navbench.controllers.teb.band_parameters import BandParameters
from drake_navbench.controllers.teb.footprint_model import FootprintModel, footprint_of_original
from drake_navbench.typed_files.quantities import (
    Angle,
    Count,
    Duration,
    Length,
    Number,
    require_order,
)


def _flag_of_number(value: Any) -> Any:
    """Returns whether a number is not 0; the original declares this flag as a real number."""
    return value != 0 if isinstance(value, int | float) else value


class TebUpstreamParameters(BandParameters):
    """The parameters that teb_local_planner reads; `WITHOUT_EFFECT` names those with none.

    Moving obstacles come from costmap_converter alone, so that their parameters have no effect
    without it; robots that drive sideways do not exist here. shrink_horizon_backup,
    obstacle_keypoint_offset, is_footprint_dynamic and, in a file, roadmap_graph_no_samples and
    use_proportional_saturation change nothing in the original (ros2-master) either.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "max_vel_x": (0.05, 1.0),
        "max_vel_theta": (0.1, 3.0),
        "acc_lim_x": (0.1, 3.0),
        "min_obstacle_dist": (0.02, 1.0),
        "inflation_dist": (0.0, 1.5),
        "weight_obstacle": (0.0, 200.0),
        "weight_inflation": (0.0, 10.0),
        "weight_optimaltime": (0.0, 10.0),
    }

    # Trajectory
    teb_autosize: Annotated[bool, BeforeValidator(_flag_of_number)] = Field(
        True, description="Resize the band in every outer iteration."
    )
    global_plan_overwrite_orientation: bool = Field(
        True, description="Point intermediate headings along the plan, not as its poses say."
    )
    allow_init_with_backwards_motion: bool = Field(
        False, description="Let first guesses drive backwards to goals behind the robot."
    )
    via_points_ordered: bool = Field(
        False, description="Attach via-points to poses in the order of the plan."
    )
    global_plan_prune_distance: Length = Field(
        1.0, description="Distance behind the robot at which the plan begins [m]."
    )
    exact_arc_length: bool = Field(False, description="Compute speeds from arcs, not from chords.")
    feasibility_check_lookahead_distance: Length = Field(
        -1.0,
        description="Distance from the robot up to which poses are checked, instead of their "
        "number; 0 or less: off [m].",
    )
    min_resolution_collision_check_angular: Angle = Field(
        math.pi,
        gt=0.0,
        description="Turn between two poses above which poses between them are checked, too [rad].",
    )
    control_look_ahead_poses: Count = Field(
        1,
        ge=1,
        description="Index of the pose up to which the band's motion is averaged for the command.",
    )

    # Robot
    wheelbase: Length = Field(
        1.0, gt=0.0, description="Wheelbase of a car, for its steering angle [m]."
    )
    cmd_angle_instead_rotvel: bool = Field(
        False, description="Command a steering angle; the car converts it into a turn rate."
    )
    footprint_model: FootprintModel = Field(
        default_factory=FootprintModel, description="Shape of the robot in the optimisation."
    )

    # Goal

    # Obstacles
    min_obstacle_dist: Length = Field(
        0.5, ge=0.0, description="Distance to obstacles that bands should keep [m]."
    )
    inflation_dist: Length = Field(
        0.6, ge=0.0, description="Distance to obstacles below which closeness costs [m]."
    )
    include_dynamic_obstacles: bool = Field(
        True, description="Compute signatures over time, too, and resize until nothing changes."
    )
    include_costmap_obstacles: bool = Field(
        True, description="Take lethal costmap cells as obstacles."
    )
    costmap_obstacles_behind_robot_dist: Length = Field(
        1.5, ge=0.0, description="Distance behind the robot up to which cells count [m]."
    )
    obstacle_poses_affected: Count = Field(
        25, ge=0, description="Legacy association: number of poses that an obstacle acts on."
    )
    legacy_obstacle_association: bool = Field(
        False, description="Attach each obstacle to the poses around the nearest one (legacy)."
    )
    obstacle_association_force_inclusion_factor: Number = Field(
        1.5,
        ge=0.0,
        description="Multiple of min_obstacle_dist within which every obstacle is attached.",
    )
    obstacle_association_cutoff_factor: Number = Field(
        5.0,
        ge=0.0,
        description="Multiple of min_obstacle_dist beyond which no obstacle is attached.",
    )
    obstacle_proximity_ratio_max_vel: Number = Field(
        1.0, ge=0.0, description="Share of the largest speed that is allowed beside obstacles."
    )
    obstacle_proximity_lower_bound: Length = Field(
        0.0, description="Distance to obstacles at which the allowed share is 0 [m]."
    )
    obstacle_proximity_upper_bound: Length = Field(
        0.5, description="Distance to obstacles from which on the allowed share is full [m]."
    )

    # Optimisation
    no_inner_iterations: Count = Field(
        5, ge=1, le=1000, description="Number of optimiser steps in a round."
    )
    no_outer_iterations: Count = Field(
        4, ge=1, le=1000, description="Number of rounds in a control cycle."
    )
    optimization_activate: bool = Field(
        True, description="Optimise bands; when off, no band is found."
    )
    penalty_epsilon: Number = Field(
        0.05, ge=0.0, description="Margin inside every limit, in the limit's unit."
    )
    weight_max_vel_x: Number = Field(2.0, ge=0.0, description="Weight of speed above the limit.")
    weight_max_vel_theta: Number = Field(
        1.0, ge=0.0, description="Weight of turn rate above the limit."
    )
    weight_acc_lim_x: Number = Field(
        1.0, ge=0.0, description="Weight of acceleration above the limit."
    )
    weight_acc_lim_theta: Number = Field(
        1.0, ge=0.0, description="Weight of angular acceleration above the limit."
    )
    weight_kinematics_nh: Number = Field(
        1000.0, ge=0.0, description="Weight of the condition that poses are joined by arcs."
    )
    weight_kinematics_forward_drive: Number = Field(
        1.0, ge=0.0, description="Weight of backward motion."
    )
    weight_kinematics_turning_radius: Number = Field(
        1.0,
        ge=0.0,
        description="Weight of turning radii below the least one; 0: no limit of the radius.",
    )
    weight_optimaltime: Number = Field(1.0, ge=0.0, description="Weight of squared time steps.")
    weight_shortest_path: Number = Field(
        0.0, ge=0.0, description="Weight of squared distances between poses."
    )
    weight_obstacle: Number = Field(
        50.0, ge=0.0, description="Weight of distance missing from min_obstacle_dist."
    )
    weight_inflation: Number = Field(
        0.1, ge=0.0, description="Weight of distance missing from inflation_dist."
    )
    weight_velocity_obstacle_ratio: Number = Field(
        0.0, ge=0.0, description="Weight of speed above the share allowed beside obstacles."
    )
    weight_viapoint: Number = Field(
        1.0, ge=0.0, description="Weight of squared distances to via-points."
    )
    weight_prefer_rotdir: Number = Field(
        50.0, ge=0.0, description="Weight of turning back while an oscillation is resolved."
    )
    weight_adapt_factor: Number = Field(
        2.0, ge=1.0, description="Factor by which the weight of obstacles grows in every round."
    )
    obstacle_cost_exponent: Number = Field(
        1.0, gt=0.0, description="Exponent of the distance missing from min_obstacle_dist."
    )

    # Topologies
    enable_homotopy_class_planning: bool = Field(
        True, description="Optimise several bands, one for each homotopy class."
    )
    simple_exploration: bool = Field(
        False, description="Search paths by points beside obstacles, not by a random roadmap."
    )
    max_number_classes: Count = Field(5, ge=1, le=100, description="Largest number of bands.")
    max_number_plans_in_current_class: Count = Field(
        1,
        ge=0,
        description="Largest number of bands in the best band's class (the original leaves it "
        "unset).",
    )
    selection_cost_hysteresis: Number = Field(
        1.0, gt=0.0, description="Factor on the cost of the band driven so far."
    )
    selection_prefer_initial_plan: Number = Field(
        0.95, gt=0.0, description="Factor on the cost of the band in the global plan's class."
    )
    selection_obst_cost_scale: Number = Field(
        100.0, ge=0.0, description="Factor on the obstacle cost where bands are compared."
    )
    selection_viapoint_cost_scale: Number = Field(
        1.0, ge=0.0, description="Factor on the via-point cost where bands are compared."
    )
    selection_alternative_time_cost: bool = Field(
        False, description="Compare bands by their duration instead of squared time steps."
    )
    selection_dropping_probability: Number = Field(
        0.0, ge=0.0, le=1.0, description="Probability that a band is dropped in a cycle."
    )
    roadmap_graph_samples: Count = Field(
        15,
        ge=0,
        le=60,
        description="Number of points of the roadmap.",
    )
    roadmap_graph_area_width: Length = Field(
        6.0, gt=0.0, description="Width of the roadmap's area [m]."
    )
    roadmap_graph_area_length_scale: Number = Field(
        1.0, gt=0.0, description="Length of the roadmap's area over the distance to the goal."
    )
    h_signature_prescaler: Number = Field(
        1.0, gt=0.1, le=1.0, description="Factor on signatures in the plane."
    )
    h_signature_threshold: Number = Field(
        0.1, ge=0.0, description="Difference of signatures below which two bands are of one class."
    )
    obstacle_heading_threshold: Number = Field(
        0.45,
        ge=0.0,
        le=1.0,
        description="Least cosine between the way to a roadmap point and the goal direction.",
    )
    viapoints_all_candidates: bool = Field(
        True, description="Let via-points attract all bands, not only the one in the plan's class."
    )
    delete_detours_backwards: bool = Field(
        True, description="Drop bands whose first motion points another way than the best band's."
    )
    detours_orientation_tolerance: Angle = Field(
        0.5 * math.pi,
        ge=0.0,
        description="Angle from which the first motion points another way [rad].",
    )
    length_start_orientation_vector: Length = Field(
        0.4, ge=0.0, description="Length over which the first motion is compared [m]."
    )
    max_ratio_detours_duration_best_duration: Number = Field(
        3.0, gt=0.0, description="Ratio to the shortest duration above which a band is dropped."
    )

    # Recovery
    oscillation_recovery: bool = Field(
        True, description="Resolve oscillations: keep the direction of turning for a while."
    )
    oscillation_v_eps: Number = Field(
        0.1,
        ge=0.0,
        description="Mean speed, as a share of its limit, below which the robot may oscillate.",
    )
    oscillation_omega_eps: Number = Field(
        0.1,
        ge=0.0,
        description="Mean turn rate, as a share of its limit, below which the robot may oscillate.",
    )
    oscillation_recovery_min_duration: Duration = Field(
        10.0, ge=0.0, description="Least duration of the recovery from an oscillation [s]."
    )
    oscillation_filter_duration: Duration = Field(
        10.0,
        ge=0.0,
        description="Duration of past commands in which oscillations are searched [s].",
    )
    divergence_detection_enable: bool = Field(
        False, description="Fail when a band's cost is above divergence_detection_max_chi_squared."
    )
    divergence_detection_max_chi_squared: Number = Field(
        10.0, description="Largest cost that does not count as divergence."
    )

    def kernel_record(self) -> NDArray[np.void]:
        """Returns the record of the kernels: the parameters, and four values computed from them.

        is_carlike: the turning radius is bounded. include_at: every obstacle nearer than this is
        attached to a pose, m. cut_off_at: no obstacle farther than this is, m. with_first_pose:
        obstacles are attached to the first pose, too.
        """
        wanted = self.min_obstacle_dist
        bounds_radius = self.weight_kinematics_turning_radius != 0.0
        return self.as_record(
            is_carlike=self.min_turning_radius != 0.0 and bounds_radius,
            include_at=wanted * self.obstacle_association_force_inclusion_factor,
            cut_off_at=wanted * self.obstacle_association_cutoff_factor,
            with_first_pose=self.weight_velocity_obstacle_ratio != 0.0,
        )

    @classmethod
    def for_original(cls, values: Mapping[str, Any], release: str) -> dict[str, Any]:
        """Returns values in the form in which the original declares them.

        All corners of the robot's shape are one text, and a flag is a number.
        """
        own = super().for_original(values, release)
        if "footprint_model" in own:
            own["footprint_model"] = footprint_of_original(own["footprint_model"])
        if "teb_autosize" in own:
            own["teb_autosize"] = float(own["teb_autosize"])
        return own

    @model_validator(mode="after")
    def _check_numbers_agree(self) -> TebUpstreamParameters:
        lower, upper = "obstacle_proximity_lower_bound", "obstacle_proximity_upper_bound"
        require_order(self, lower, upper, may_be_equal=False)
        if self.cmd_angle_instead_rotvel and self.min_turning_radius == 0.0:
            raise ValueError(
                "min_turning_radius: got 0.0, expected more with cmd_angle_instead_rotvel"
            )
        weights = [name for name in type(self).model_fields if name.startswith("weight_")]
        driving = [name for name in weights if name != "weight_adapt_factor"]
        if all(getattr(self, name) == 0.0 for name in driving):
            raise ValueError("all weights are 0, expected one above 0, such as weight_optimaltime")
        return self
