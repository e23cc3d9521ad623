"""Rules about the samples and obstacles of Nav2's DWB."""

from __future__ import annotations

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.quantities import (
    braking_m,
    driven_mps,
    half_window_m,
    has_critic,
    is_not_round,
    whole_m,
)
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

# From this ratio of the two on, braking is weak compared with accelerating.
WEAKER = 2.5
# Nav2's usual limit of DWB's accelerations, m/s^2: no base brakes harder because a file says so.
USUAL_MPS2 = 2.5

DWB = ("dwb",)
CODE = "dwb_core, dwb_plugins, dwb_critics"
# Poses of a sample that are farther apart leave room for a chair's leg between them, m.
COARSE_M = 0.1
# Samples of up to this length bend and end as a usual robot's do: 0.5 m/s for 2.5 s.
LONG_M = 1.25
# Longer samples differ enough, however fast they are driven: 0.5 m/s for 1 s.
SHORT_M = 0.5
# A window with longer sides takes long to update, m; in a shorter time no sample can stop, s. Where
# a cure would need these, the file asks for too much speed.
LARGE_WINDOW_M, SHORT_S = 10, 0.8


def _spacing_m(f: Facts) -> float:
    """Returns the spacing of the poses of a fast sample, m."""
    if f.controller("discretize_by_time"):
        return f.speed_mps * f.number("controller.time_granularity", 0.5)
    return f.number("controller.linear_granularity", 0.5)


def _reach_m(f: Facts) -> float:
    """Returns the length of the fastest sample, m."""
    return f.speed_mps * f.number("controller.sim_time", 1.7)


def _driven_reach_m(f: Facts) -> float:
    """Returns the length of the fastest sample whose speed the velocity smoother lets by, m."""
    return driven_mps(f) * f.number("controller.sim_time", 1.7)


def _window_for_reach_m(f: Facts) -> int | None:
    """Returns the side of a window that holds the fastest sample, m; None of one too large."""
    side_m = whole_m(2.0 * _driven_reach_m(f))
    return side_m if side_m <= LARGE_WINDOW_M else None


def _time_within_window_s(f: Facts) -> float | None:
    """Returns the sim_time with which samples end in the window, s; None of one too short."""
    time_s = half_window_m(f) / driven_mps(f)
    return time_s if time_s >= SHORT_S else None


def deceleration(f: Facts) -> float:
    return abs(f.number("controller.decel_lim_x", -2.5)) or 2.5


RULES = (
    Rule(
        "dwb-no-obstacle-critic",
        lambda f: (
            bool(f.controller("critics")) and not has_critic(f, "BaseObstacle", "ObstacleFootprint")
        ),
        lambda f: (
            "critics lists neither BaseObstacle nor ObstacleFootprint: no critic looks at obstacles"
        ),
        {S.COLLISION: 1.0, S.IGNORES_OBSTACLES: 1.0, S.NEAR_MISS: 0.8},
        (put("critics", "ObstacleFootprint"),),
        f"{CODE}: base_obstacle.cpp, obstacle_footprint.cpp",
        DWB,
    ),
    Rule(
        "dwb-centre-alone",
        lambda f: (
            is_not_round(f)
            and has_critic(f, "BaseObstacle")
            and not has_critic(f, "ObstacleFootprint")
        ),
        lambda f: (
            "BaseObstacle checks only the cell under the robot's centre, but the robot is not "
            f"round: its edge is {f.inscribed_radius_m:.2f} to {f.circumscribed_radius_m:.2f} m "
            "away"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.6, S.CORNER_CUTTING: 0.4},
        (put("critics", "ObstacleFootprint"),),
        f"{CODE}: base_obstacle.cpp, obstacle_footprint.cpp",
        DWB,
    ),
    Rule(
        "dwb-coarse-samples",
        lambda f: _spacing_m(f) > COARSE_M,
        lambda f: (
            f"DWB checks only one pose every {_spacing_m(f):.2f} m of a trajectory: a thin "
            "obstacle between two poses stays unseen"
        ),
        {S.COLLISION: 1.0, S.CORNER_CUTTING: 0.7, S.NEAR_MISS: 0.4},
        (down("linear_granularity", 0.05),),
        f"{CODE}: standard_traj_generator.cpp; navigation2#669",
        DWB,
    ),
    Rule(
        "dwb-weak-obstacles",
        lambda f: (
            has_critic(f, "BaseObstacle")
            and f.number("controller.BaseObstacle.scale", 1.0) * 254.0
            < 0.5 * f.number("controller.PathDist.scale", 1.0)
        ),
        lambda f: (
            f"BaseObstacle.scale is {f.controller('BaseObstacle.scale')} and PathDist.scale "
            f"{f.controller('PathDist.scale')}: to leave the path by half a cell costs more than "
            "to drive through the highest obstacle cost"
        ),
        {S.NEAR_MISS: 1.0, S.COLLISION: 0.5},
        (up("BaseObstacle.scale"), down("PathDist.scale")),
        f"{CODE}: base_obstacle.cpp",
        DWB,
        is_certain=False,
    ),
    Rule(
        "dwb-looks-less-than-it-brakes",
        lambda f: (
            f.speed_mps * f.number("controller.sim_time", 1.7) < braking_m(f, deceleration(f))
        ),
        lambda f: (
            f"sim_time is {f.controller('sim_time')} s: at {f.speed_mps:g} m/s DWB looks less far "
            "ahead than the robot needs to brake"
        ),
        {S.COLLISION: 0.9, S.GOAL_OVERSHOOT: 0.6},
        (up("sim_time"), down("max_vel_x")),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-brakes-weaker-than-it-accelerates",
        lambda f: (
            0.0
            < abs(f.number("controller.decel_lim_x"))
            <= f.number("controller.acc_lim_x") / WEAKER + 1e-9
        ),
        lambda f: (
            f"decel_lim_x is {f.controller('decel_lim_x')} m/s^2 and acc_lim_x "
            f"{f.controller('acc_lim_x')} m/s^2: the robot brakes much more slowly than it "
            "accelerates"
        ),
        {S.GOAL_OVERSHOOT: 0.6, S.STALL_BEFORE_GOAL: 0.3, S.COLLISION: 0.3},
        (
            down("decel_lim_x", lambda f: -min(f.number("controller.acc_lim_x"), USUAL_MPS2)),
            down("acc_lim_x", lambda f: abs(f.number("controller.decel_lim_x"))),
        ),
        "dwb_plugins: xy_theta_iterator, one_d_velocity_iterator",
        DWB,
    ),
    Rule(
        "dwb-looks-a-short-way",
        lambda f: f.number("controller.sim_time", 1.7) < 1.0 and _reach_m(f) < SHORT_M,
        lambda f: (
            f"sim_time is {f.controller('sim_time')} s: DWB's trajectories are {_reach_m(f):.2f} m "
            "long, so short that they hardly differ, so that it steers hard"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.COLLISION: 0.5, S.STOP_START_JERK: 0.3},
        (up("sim_time", 1.7),),
        "docs.nav2.org, tuning guide",
        DWB,
    ),
    Rule(
        "dwb-looks-a-long-way",
        lambda f: f.number("controller.sim_time", 1.7) > 2.5 and _reach_m(f) > LONG_M,
        lambda f: (
            f"sim_time is {f.controller('sim_time')} s: DWB's trajectories are {_reach_m(f):.1f} m "
            "long, so that in a bend or a door all of them leave the path or touch something"
        ),
        {S.DOOR_STOP: 0.8, S.CORNER_CUTTING: 0.9, S.TOO_SLOW: 0.4, S.STALL_BEFORE_GOAL: 0.4},
        (down("sim_time", 1.7),),
        "docs.nav2.org, tuning guide",
        DWB,
    ),
    Rule(
        "dwb-beyond-window",
        lambda f: _driven_reach_m(f) > half_window_m(f),
        lambda f: (
            f"DWB's fastest trajectories reach {_driven_reach_m(f):.1f} m, but the local "
            f"costmap only {half_window_m(f):.1f} m: DWB rejects these trajectories"
        ),
        {S.TOO_SLOW: 0.9, S.STOP_START_JERK: 0.3},
        (
            up("local_costmap.width", _window_for_reach_m),
            down("sim_time", _time_within_window_s),
            down("max_vel_x", lambda f: half_window_m(f) / f.number("controller.sim_time", 1.7)),
        ),
        f"{CODE}: off the grid is illegal",
        DWB,
    ),
    Rule(
        "dwb-few-speeds",
        lambda f: f.number("controller.vx_samples", 20) < 6,
        lambda f: f"vx_samples is {f.controller('vx_samples')}: DWB tries only so few speeds",
        {S.STOP_START_JERK: 0.8, S.GOAL_OVERSHOOT: 0.4, S.STALL_BEFORE_GOAL: 0.3, S.TOO_SLOW: 0.4},
        (up("vx_samples", 20),),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-few-turn-rates",
        lambda f: f.number("controller.vtheta_samples", 20) < 10,
        lambda f: (
            f"vtheta_samples is {f.controller('vtheta_samples')}: DWB tries only so few turn rates"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.DOOR_STOP: 0.6, S.STOP_START_JERK: 0.5, S.CORNER_CUTTING: 0.4},
        (up("vtheta_samples", 20),),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-sideways-for-nothing",
        lambda f: (
            f.number("controller.max_vel_y") == 0.0
            and f.number("controller.vy_samples", 5) > 1
            and f.number("controller.vx_samples", 20) * f.number("controller.vtheta_samples", 20)
            > 600
        ),
        lambda f: (
            f"vx_samples {f.controller('vx_samples')} and vtheta_samples "
            f"{f.controller('vtheta_samples')} make many trajectories; vy_samples multiplies "
            "their number although max_vel_y is 0 m/s"
        ),
        {S.LATE_CYCLES: 0.6},
        (down("vx_samples"), down("vtheta_samples"), down("vy_samples")),
        f"{CODE}: xy_theta_iterator.cpp",
        DWB,
        is_certain=False,
    ),
    Rule(
        "dwb-no-pull",
        lambda f: (
            bool(f.controller("critics"))
            and not has_critic(f, "GoalDist", "PathDist", "PathProgress")
        ),
        lambda f: (
            "critics lists neither PathDist nor GoalDist: nothing pulls the robot along the plan"
        ),
        {S.NO_START: 1.0, S.STALL_BEFORE_GOAL: 1.0, S.SPINS: 0.5},
        (put("critics", "PathDist"),),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-oscillation-not-watched",
        lambda f: bool(f.controller("critics")) and not has_critic(f, "Oscillation"),
        lambda f: "critics lists no Oscillation: nothing keeps the robot from moving to and fro",
        {S.WOBBLE_STRAIGHT: 0.5, S.GOAL_OSCILLATION: 0.5, S.SPINS: 0.5, S.DOOR_STOP: 0.3},
        (put("critics", "Oscillation"),),
        f"{CODE}: oscillation.cpp",
        DWB,
    ),
    Rule(
        "dwb-heavy-weights-in-doors",
        lambda f: (
            f.number("controller.PathDist.scale") > 20.0
            and f.number("controller.GoalDist.scale") > 16.0
        ),
        lambda f: (
            f"PathDist.scale is {f.controller('PathDist.scale')} and GoalDist.scale "
            f"{f.controller('GoalDist.scale')}: they outweigh every critic that favours "
            "waiting or turning"
        ),
        {S.DOOR_STOP: 0.8},
        (down("PathDist.scale"), down("GoalDist.scale")),
        "ROBOTIS-GIT/turtlebot3#178",
        DWB,
        is_certain=False,
    ),
    Rule(
        "dwb-writes-details",
        lambda f: (
            f.controller("debug_trajectory_details") is True
            or f.controller("publish_cost_grid_pc") is True
        ),
        lambda f: (
            "debug_trajectory_details or publish_cost_grid_pc is on: either takes time in "
            "every cycle"
        ),
        {S.LATE_CYCLES: 0.8},
        (put("debug_trajectory_details", False), put("publish_cost_grid_pc", False)),
        CODE,
        DWB,
        is_certain=False,
    ),
)
