"""Causes of a symptom: a parameter and a direction, or a thing outside the file."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Any, NamedTuple

# The first parts of places that a change of the file cannot mend.
OUTSIDE = "outside"
RELEASE = "release"
# The names of things outside of the file, in words.
OUTSIDE_TOLD = {
    "clock": "check the clocks: use_sim_time on all nodes, time synchronisation",
    "compute": "check the computer: a release build, its load, its processor",
    "deadband": "check the motors: the smallest command that moves the robot",
    "frames": "check the tree of frames (TF)",
    "imu_frame": "check the IMU's frame in the robot's description",
    "lag": "check the base: how late it answers commands",
    "localization": "check the localization: jumps of the pose, drift, the map",
    "odometry": "check the odometry: slip, delay, scale",
    "rear_sensor": "check the sensors: none may see behind the robot",
    "sensor_frame": "check the sensor's frame in the robot's description",
}
# Units of the parameters for which a rule knows a number; the others are counts, gains and ratios.
_NAMES_BY_UNIT = {
    "m": "approach_velocity_scaling_dist cost_scaling_dist forward_sampling_distance "
    "inflation_dist inflation_radius linear_granularity height prune_distance width "
    "raytrace_max_range lookahead_dist max_lookahead max_lookahead_dist "
    "max_obstacle_height min_obstacle_dist "
    "min_obstacle_height minimum_turning_radius motion_target_dist "
    "regulated_linear_scaling_min_radius required_movement_radius resolution slowdown_radius "
    "tolerance update_min_d xy_goal_tolerance global_plan_viapoint_sep",
    "rad": "angular_dist_threshold rotate_to_heading_min_angle update_min_a yaw_goal_tolerance",
    "m/s": "max_speed_xy min_approach_linear_velocity min_vel_x min_x_velocity_threshold "
    "v_linear_min vx_min vx_std trans_stopped_velocity",
    "rad/s": "min_theta_velocity_threshold rotate_to_heading_angular_vel v_angular_min_in_place "
    "wz_max wz_std",
    "m/s^2": "acc_lim_x ax_max",
    "rad/s^2": "acc_lim_theta max_angular_accel",
    "s": "failure_tolerance model_dt max_allowed_time_to_collision_up_to_carrot max_planning_time "
    "movement_time_allowance observation_persistence sim_time simulate_ahead_time source_timeout "
    "switching_blocking_period time_before_collision transform_tolerance velocity_timeout",
    "ms": "default_server_timeout",
    "Hz": "controller_frequency smoothing_frequency update_frequency",
}
UNITS = {name: unit for unit, names in _NAMES_BY_UNIT.items() for name in names.split()}
# Parameters whose right value is that of another parameter.
COPIES = {
    "local_costmap.raytrace_max_range": "local_costmap.obstacle_max_range",
    "controller.inflation_cost_scaling_factor": "local_costmap.cost_scaling_factor",
}


# An outline in words: its first corner, and the rest.
OUTLINE = re.compile(r"(\[\[[^\]]*\]), .*?\]\]")


def with_short_outlines(text: str) -> str:
    """Returns a text in which '[[0.1, 0.2], ...]' stands for a whole outline."""
    return OUTLINE.sub(r"\1, ...]", text)


class Direction(StrEnum):
    """The direction in which a parameter is to change."""

    UP = "up"
    DOWN = "down"
    SET = "set"
    ADD = "add"
    UPGRADE = "upgrade"


class Cause(NamedTuple):
    """A culprit with the direction of its cure.

    place: as of `Facts`, with '*' for any name; 'outside.<thing>'; 'release'. to: the value of the
    cure where it is known, else None. why: one sentence.
    """

    place: str
    direction: Direction
    to: Any = None
    why: str = ""
    source: str = ""

    @property
    def is_outside(self) -> bool:
        """Whether no change of the file can mend the cause."""
        return self.place.partition(".")[0] in (OUTSIDE, RELEASE)

    @property
    def key(self) -> tuple[str, Direction]:
        """Place and direction; two causes with the same key are the same."""
        return self.place, self.direction

    @property
    def told(self) -> str:
        """The cure as an instruction: 'raise goal_checker.xy_goal_tolerance to 0.2 m'."""
        if self.place == RELEASE:
            return f"upgrade to {self.to or 'a newer release'}"
        first, _, rest = self.place.partition(".")
        if first == OUTSIDE:
            return f"outside the file: {OUTSIDE_TOLD.get(rest, rest)}"
        thing = "<polygon>" if first == "collision_monitor" else "<plugin>"
        place = self.place.removeprefix("controller.").replace("*", thing)
        if self.direction is Direction.ADD:
            return "add a rotation shim" if place == "plugin" else f"add {place}"
        if self.is_number:
            verb = "raise" if self.direction is Direction.UP else "lower"
            return f"{verb} {place}{self._to_told}"
        if self.to is None and self.place in COPIES:
            return f"set {place} to the value of {COPIES[self.place]}"
        if self.to is None:
            return f"check and correct {place}"
        is_list = place == "critics" or place.endswith(".plugins")
        return f"add {self.to} to {place}" if is_list else f"set {place}{self._to_told}"

    @property
    def is_number(self) -> bool:
        """Whether the cure's value is a number with a direction."""
        return self.direction in (Direction.UP, Direction.DOWN)

    @property
    def _to_told(self) -> str:
        """The cure's value with its unit: ' to 0.2 m'; nothing where no value is known."""
        value = str(self.to).lower() if isinstance(self.to, bool) else self.to
        unit = UNITS.get(self.place.rpartition(".")[2], "")
        return "" if self.to is None else f" to {value} {unit}".rstrip()
