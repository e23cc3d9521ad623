"""The original's parameters: names and defaults of teb_local_planner (ros2-master)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field, model_validator

from drake_navbench.controller import AskedSpeeds, ControllerParameters
from drake_navbench.controllers.teb.footprint_model import FootprintModel, footprint_of_original
from drake_navbench.typed_files.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Count,
    Duration,
    Length,
    Number,
    Speed,
)

FEWEST_SAMPLES = 3


class TebUpstreamParameters(ControllerParameters):
    """The parameters that teb_local_planner reads; `WITHOUT_EFFECT` names those with none.

    Moving obstacles come from costmap_converter alone, so that their parameters have no effect
    without it; robots that drive sideways do not exist here. shrink_horizon_backup,
    obstacle_keypoint_offset and is_footprint_dynamic change nothing in the original (ros2-master)
    either.
    """

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset(
        {
            "acc_lim_y",
            "costmap_converter_plugin",
            "costmap_converter_rate",
            "costmap_converter_spin_thread",
            "dynamic_obstacle_inflation_dist",
            "enable_multithreading",
            "is_footprint_dynamic",
            "map_frame",
            "max_vel_y",
            "obstacle_keypoint_offset",
            "odom_topic",
            "optimization_verbose",
            "publish_feedback",
            "shrink_horizon_backup",
            "shrink_horizon_min_duration",
            "transform_tolerance",
            "visualize_hc_graph",
            "visualize_with_time_as_z_axis_scale",
            "weight_acc_lim_y",
            "weight_dynamic_obstacle",
            "weight_dynamic_obstacle_inflation",
            "weight_max_vel_y",
        }
    )

    # Trajectory
    teb_autosize: bool = Field(True, description="Resize the band in every outer iteration.")
    dt_ref: Duration = Field(0.3, ge=0.01, description="Time step wanted [s].")
    dt_hysteresis: Duration = Field(0.1, ge=0.0, description="Deviation that is left alone [s].")
    min_samples: Count = Field(3, description="Fewest intervals of a band.")
    max_samples: Count = Field(500, le=10_000, description="Most intervals of a band.")
    global_plan_overwrite_orientation: bool = Field(
        True, description="Headings along the plan, not as its poses say."
    )
    allow_init_with_backwards_motion: bool = Field(
        False, description="First guesses drive backwards to goals behind the robot."
    )
    global_plan_viapoint_sep: Length = Field(
        -1.0, description="Distance of via-points on the plan; not positive: none [m]."
    )
    via_points_ordered: bool = Field(False, description="Attach via-points in their order.")
    max_global_plan_lookahead_dist: Length = Field(
        1.0, description="Length of the plan that a band covers; not positive: all [m]."
    )
    global_plan_prune_distance: Length = Field(
        1.0, description="The plan begins so far behind the robot [m]."
    )
    exact_arc_length: bool = Field(False, description="Speeds by arcs, not by chords.")
    force_reinit_new_goal_dist: Length = Field(
        1.0, gt=0.0, description="A local goal that jumps farther starts new bands [m]."
    )
    force_reinit_new_goal_angular: Angle = Field(
        0.5 * math.pi, gt=0.0, description="The same for its yaw [rad]."
    )
    feasibility_check_no_poses: Count = Field(
        5, description="Last pose checked with the outline; negative: all."
    )
    feasibility_check_lookahead_distance: Length = Field(
        -1.0, description="Check so far from the robot instead; not positive: off [m]."
    )
    min_resolution_collision_check_angular: Angle = Field(
        math.pi, gt=0.0, description="Check between poses that are turned farther apart [rad]."
    )
    control_look_ahead_poses: Count = Field(
        1, ge=1, description="The command is the displacement up to this pose over its time."
    )

    # Robot
    max_vel_x: Speed = Field(0.4, gt=0.0, description="Forward speed [m/s].")
    max_vel_x_backwards: Speed = Field(0.2, ge=0.0, description="Backward speed [m/s].")
    max_vel_theta: AngularSpeed = Field(0.3, gt=0.0, description="Turn rate [rad/s].")
    acc_lim_x: Acceleration = Field(0.5, gt=0.0, description="Acceleration [m/s^2].")
    acc_lim_theta: AngularAcceleration = Field(
        0.5, gt=0.0, description="Angular acceleration [rad/s^2]."
    )
    min_turning_radius: Length = Field(
        0.0, ge=0.0, description="Of a car; 0: the robot turns on the spot [m]."
    )
    wheelbase: Length = Field(1.0, gt=0.0, description="Of a car, for its steering angle [m].")
    cmd_angle_instead_rotvel: bool = Field(
        False, description="Command a steering angle, which the car turns into a turn rate."
    )
    use_proportional_saturation: bool = Field(
        False, description="Too fast a command is slowed down in all its components alike."
    )
    footprint_model: FootprintModel = Field(
        default_factory=FootprintModel, description="The robot as the optimiser sees it."
    )

    # Goal
    free_goal_vel: bool = Field(False, description="The band may end in motion.")

    # Obstacles
    min_obstacle_dist: Length = Field(0.5, ge=0.0, description="Distance wanted [m].")
    inflation_dist: Length = Field(0.6, ge=0.0, description="Distance below which it costs [m].")
    include_dynamic_obstacles: bool = Field(
        True, description="Signatures in time, and resizing until nothing changes."
    )
    include_costmap_obstacles: bool = Field(True, description="Lethal cells are obstacles.")
    costmap_obstacles_behind_robot_dist: Length = Field(
        1.5, ge=0.0, description="Cells behind the robot count up to here [m]."
    )
    obstacle_poses_affected: Count = Field(
        25, ge=0, description="Poses that an obstacle acts on, of the legacy association."
    )
    legacy_obstacle_association: bool = Field(
        False, description="Attach each obstacle to the poses around the nearest one."
    )
    obstacle_association_force_inclusion_factor: Number = Field(
        1.5, ge=0.0, description="Of min_obstacle_dist: all closer obstacles are attached."
    )
    obstacle_association_cutoff_factor: Number = Field(
        5.0, ge=0.0, description="Of min_obstacle_dist: no farther obstacle is attached."
    )
    obstacle_proximity_ratio_max_vel: Number = Field(
        1.0, ge=0.0, description="Share of the speed that is allowed beside obstacles."
    )
    obstacle_proximity_lower_bound: Length = Field(
        0.0, description="Distance at which that share is zero [m]."
    )
    obstacle_proximity_upper_bound: Length = Field(
        0.5, description="Distance from which on it is whole [m]."
    )

    # Optimisation
    no_inner_iterations: Count = Field(5, ge=1, le=1000, description="Steps of a round.")
    no_outer_iterations: Count = Field(4, ge=1, le=1000, description="Rounds of a cycle.")
    optimization_activate: bool = Field(True, description="Where off, no band is found.")
    penalty_epsilon: Number = Field(0.05, ge=0.0, description="Margin of all limits, any unit.")
    weight_max_vel_x: Number = Field(2.0, ge=0.0, description="Of excess speed.")
    weight_max_vel_theta: Number = Field(1.0, ge=0.0, description="Of excess turn rate.")
    weight_acc_lim_x: Number = Field(1.0, ge=0.0, description="Of excess acceleration.")
    weight_acc_lim_theta: Number = Field(1.0, ge=0.0, description="Of excess angular acceleration.")
    weight_kinematics_nh: Number = Field(1000.0, ge=0.0, description="Of the arc condition.")
    weight_kinematics_forward_drive: Number = Field(1.0, ge=0.0, description="Of driving back.")
    weight_kinematics_turning_radius: Number = Field(
        1.0, ge=0.0, description="Of too small a turning radius; 0: as without one."
    )
    weight_optimaltime: Number = Field(1.0, ge=0.0, description="Of squared time steps.")
    weight_shortest_path: Number = Field(0.0, ge=0.0, description="Of squared distances.")
    weight_obstacle: Number = Field(50.0, ge=0.0, description="Of distance missing.")
    weight_inflation: Number = Field(0.1, ge=0.0, description="Of the same to inflation_dist.")
    weight_velocity_obstacle_ratio: Number = Field(
        0.0, ge=0.0, description="Of excess speed beside obstacles."
    )
    weight_viapoint: Number = Field(1.0, ge=0.0, description="Of squared distances.")
    weight_prefer_rotdir: Number = Field(
        50.0, ge=0.0, description="Of turning back while an oscillation is resolved."
    )
    weight_adapt_factor: Number = Field(
        2.0, ge=1.0, description="The weight of obstacles grows by this in every round."
    )
    obstacle_cost_exponent: Number = Field(1.0, gt=0.0, description="Of distance missing.")

    # Topologies
    enable_homotopy_class_planning: bool = Field(True, description="Several bands at once.")
    simple_exploration: bool = Field(
        False, description="Look for ways by points beside obstacles, not by a roadmap."
    )
    max_number_classes: Count = Field(5, ge=1, le=100, description="Most bands.")
    max_number_plans_in_current_class: Count = Field(
        1, ge=0, description="Most bands of the best band's class (the original leaves it unset)."
    )
    selection_cost_hysteresis: Number = Field(
        1.0, gt=0.0, description="Factor on the cost of the best band so far."
    )
    selection_prefer_initial_plan: Number = Field(
        0.95, gt=0.0, description="Factor on the cost of the band of the global plan's class."
    )
    selection_obst_cost_scale: Number = Field(
        100.0, ge=0.0, description="Factor on obstacles where bands are compared."
    )
    selection_viapoint_cost_scale: Number = Field(1.0, ge=0.0, description="On via-points.")
    selection_alternative_time_cost: bool = Field(
        False, description="Compare durations in place of squared time steps."
    )
    selection_dropping_probability: Number = Field(
        0.0, ge=0.0, le=1.0, description="Chance of a band to be dropped in a cycle."
    )
    switching_blocking_period: Duration = Field(
        0.0, ge=0.0, description="No change of class so soon after the last one [s]."
    )
    roadmap_graph_samples: Count = Field(
        15, ge=0, le=60, description="Points of the roadmap (also: roadmap_graph_no_samples)."
    )
    roadmap_graph_area_width: Length = Field(6.0, gt=0.0, description="Width of its box [m].")
    roadmap_graph_area_length_scale: Number = Field(
        1.0, gt=0.0, description="Length of its box over the distance to the goal."
    )
    h_signature_prescaler: Number = Field(
        1.0, gt=0.1, le=1.0, description="Of signatures in the plane."
    )
    h_signature_threshold: Number = Field(
        0.1, ge=0.0, description="Signatures closer than this are of one class."
    )
    obstacle_heading_threshold: Number = Field(
        0.45, ge=0.0, le=1.0, description="Ways lead ahead by at least this cosine."
    )
    viapoints_all_candidates: bool = Field(
        True, description="Via-points attract all bands, not only that of the plan's class."
    )
    delete_detours_backwards: bool = Field(True, description="Drop bands that set off otherwise.")
    detours_orientation_tolerance: Angle = Field(
        0.5 * math.pi, ge=0.0, description="How far otherwise [rad]."
    )
    length_start_orientation_vector: Length = Field(
        0.4, ge=0.0, description="Length of the start that is compared [m]."
    )
    max_ratio_detours_duration_best_duration: Number = Field(
        3.0, gt=0.0, description="Bands that take longer than the best one by this are dropped."
    )

    # Recovery
    oscillation_recovery: bool = Field(True, description="Resolve oscillations.")
    oscillation_v_eps: Number = Field(0.1, ge=0.0, description="Mean speed over its limit.")
    oscillation_omega_eps: Number = Field(0.1, ge=0.0, description="Mean turn rate, likewise.")
    oscillation_recovery_min_duration: Duration = Field(
        10.0, ge=0.0, description="The recovery lasts so long [s]."
    )
    oscillation_filter_duration: Duration = Field(
        10.0, ge=0.0, description="Commands looked at [s]."
    )
    divergence_detection_enable: bool = Field(False, description="Fail where the cost is high.")
    divergence_detection_max_chi_squared: Number = Field(10.0, description="How high.")

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits that its commands are cut at."""
        return AskedSpeeds(self.max_vel_x, -self.max_vel_x_backwards, self.max_vel_theta)

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

    @model_validator(mode="before")
    @classmethod
    def _drop_names_without_effect(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        kept = {key: value for key, value in values.items() if key not in cls.WITHOUT_EFFECT}
        # The name in the source; the one that is declared for files is another.
        if "roadmap_graph_no_samples" in kept:
            kept.setdefault("roadmap_graph_samples", kept.pop("roadmap_graph_no_samples"))
        return kept

    @model_validator(mode="after")
    def _check_numbers_agree(self) -> TebUpstreamParameters:
        if self.dt_hysteresis >= self.dt_ref:
            raise ValueError(
                f"dt_hysteresis must be below dt_ref, got {self.dt_hysteresis} and {self.dt_ref}"
            )
        if self.min_samples < FEWEST_SAMPLES:
            raise ValueError(
                f"min_samples must be at least {FEWEST_SAMPLES}, got {self.min_samples}"
            )
        if self.max_samples < self.min_samples:
            raise ValueError(
                "max_samples must not be below min_samples, got"
                f" {self.max_samples} and {self.min_samples}"
            )
        if self.obstacle_proximity_upper_bound <= self.obstacle_proximity_lower_bound:
            raise ValueError(
                "obstacle_proximity_upper_bound must be above obstacle_proximity_lower_bound, got"
                f" {self.obstacle_proximity_upper_bound} and {self.obstacle_proximity_lower_bound}"
            )
        if self.cmd_angle_instead_rotvel and self.min_turning_radius == 0.0:
            raise ValueError("cmd_angle_instead_rotvel needs a min_turning_radius above 0")
        weights = [name for name in type(self).model_fields if name.startswith("weight_")]
        driving = [name for name in weights if name != "weight_adapt_factor"]
        if all(getattr(self, name) == 0.0 for name in driving):
            raise ValueError("all weights are 0, expected one above 0, such as weight_optimaltime")
        return self
