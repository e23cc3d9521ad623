"""Rules about how Nav2's DWB arrives, and about its limits."""

from __future__ import annotations

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.dwb import CODE, DWB, deceleration
from drake_navbench.studies.doctor.rules.quantities import has_critic
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, add, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom


def _rolls_on_m(f: Facts) -> float:
    """Returns the way to stop from the speed that counts as stopped, m."""
    speed = f.number("controller.trans_stopped_velocity", 0.25)
    return speed**2 / (2.0 * deceleration(f)) + speed * f.period_s


def _what_is_looked_at(f: Facts) -> str:
    if f.number("controller.RotateToGoal.lookahead_time") > 0.0:
        return (
            "Nav2 reads beyond the end of a trajectory's list of times, so which command is best "
            "near the goal depends on what the memory holds there"
        )
    return "RotateToGoal scores the heading that the robot has now, equal for all commands"


RULES = (
    Rule(
        "dwb-rotate-to-goal-looks-ahead",
        lambda f: (
            has_critic(f, "RotateToGoal")
            and f.number("controller.RotateToGoal.lookahead_time", -1.0) >= 0.0
        ),
        lambda f: (
            f"RotateToGoal.lookahead_time is {f.controller('RotateToGoal.lookahead_time')} s: "
            f"{_what_is_looked_at(f)}"
        ),
        {S.GOAL_OSCILLATION: 0.6, S.SPINS: 0.5, S.GOAL_NOT_REACHED: 0.5},
        (put("RotateToGoal.lookahead_time", -1.0),),
        "dwb_core: projectPose in trajectory_utils.cpp",
        DWB,
    ),
    Rule(
        "dwb-never-turns-to-the-goal",
        lambda f: (
            bool(f.controller("critics"))
            and not has_critic(f, "RotateToGoal")
            and not f.is_kind("shim")
            and f.number("goal_checker.yaw_goal_tolerance", 0.25) < 3.1
        ),
        lambda f: "critics lists no RotateToGoal: nothing turns the robot to the goal's heading",
        {S.GOAL_NOT_REACHED: 1.0, S.GOAL_OSCILLATION: 0.6},
        (put("critics", "RotateToGoal"),),
        f"{CODE}: rotate_to_goal.cpp",
        DWB,
    ),
    Rule(
        "dwb-two-tolerances",
        lambda f: (
            has_critic(f, "RotateToGoal")
            and f.number("goal_checker.xy_goal_tolerance") > 0.0
            and f.number("controller.xy_goal_tolerance")
            > 1.2 * f.number("goal_checker.xy_goal_tolerance")
        ),
        lambda f: (
            f"RotateToGoal begins to turn within {f.controller('xy_goal_tolerance')} m of "
            "the goal, but the goal checker accepts only "
            f"{f['goal_checker.xy_goal_tolerance']} m"
        ),
        {S.GOAL_NOT_REACHED: 1.0, S.STALL_BEFORE_GOAL: 0.9, S.GOAL_OSCILLATION: 0.5},
        (
            down("xy_goal_tolerance", lambda f: f.number("goal_checker.xy_goal_tolerance")),
            up(
                "goal_checker.xy_goal_tolerance", lambda f: f.number("controller.xy_goal_tolerance")
            ),
        ),
        f"{CODE}: rotate_to_goal.cpp",
        DWB,
    ),
    Rule(
        "dwb-turns-while-rolling",
        lambda f: (
            _rolls_on_m(f) > 0.5 * f.number("goal_checker.xy_goal_tolerance", 0.25)
            and f.number("controller.trans_stopped_velocity", 0.25) <= f.speed_mps
        ),
        lambda f: (
            f"trans_stopped_velocity is {f.controller('trans_stopped_velocity')} m/s: "
            f"RotateToGoal begins to turn while the robot still rolls {_rolls_on_m(f):.2f} m "
            "farther, more than half of xy_goal_tolerance"
        ),
        {S.GOAL_OVERSHOOT: 0.7, S.GOAL_OSCILLATION: 0.4},
        (down("trans_stopped_velocity"),),
        f"{CODE}: rotate_to_goal.cpp",
        DWB,
    ),
    Rule(
        "dwb-never-counts-as-stopped",
        lambda f: f.number("controller.trans_stopped_velocity", 0.25) < 0.02,
        lambda f: (
            f"trans_stopped_velocity is {f.controller('trans_stopped_velocity')} m/s, below "
            "the noise of odometry: RotateToGoal may never begin the turn at the goal"
        ),
        {S.GOAL_NOT_REACHED: 0.9, S.STALL_BEFORE_GOAL: 0.8},
        (up("trans_stopped_velocity", 0.25),),
        f"{CODE}: rotate_to_goal.cpp",
        DWB,
    ),
    Rule(
        "dwb-no-reverse",
        lambda f: f.number("controller.min_vel_x") >= 0.0,
        lambda f: f"min_vel_x is {f.controller('min_vel_x')} m/s: DWB never drives backward",
        {S.NO_RECOVERY: 0.7},
        (down("min_vel_x", -0.1),),
        CODE,
        DWB,
        is_certain=False,
    ),
    Rule(
        "dwb-least-speed",
        lambda f: (
            f.number("controller.min_speed_xy") > 0.15 or f.number("controller.min_vel_x") > 0.05
        ),
        lambda f: (
            f"min_speed_xy is {f.controller('min_speed_xy')} m/s and min_vel_x "
            f"{f.controller('min_vel_x')} m/s: the robot can neither drive slowly nor stop "
            "in front of the goal"
        ),
        {S.GOAL_OVERSHOOT: 0.9, S.STOP_START_JERK: 0.6, S.DOOR_STOP: 0.4},
        (down("min_speed_xy", 0.0), down("min_vel_x", 0.0)),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-steep-ramps",
        lambda f: (
            f.number("controller.acc_lim_x", 2.5)
            > 1.5 * (f.axis("velocity_smoother.max_accel", 0) or 1e9)
        ),
        lambda f: (
            f"acc_lim_x is {f.controller('acc_lim_x')} m/s^2, but "
            "velocity_smoother.max_accel lets through only "
            f"{f.axis('velocity_smoother.max_accel', 0):g} m/s^2: the robot accelerates more "
            "slowly than DWB expects"
        ),
        {S.WOBBLE_STRAIGHT: 0.3, S.GOAL_OVERSHOOT: 0.5, S.STOP_START_JERK: 0.4},
        (down("acc_lim_x"), up("velocity_smoother.max_accel")),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-no-acceleration",
        lambda f: (
            f.number("controller.acc_lim_x", 2.5) == 0.0
            or f.number("controller.acc_lim_theta", 3.2) == 0.0
        ),
        lambda f: "acc_lim_x or acc_lim_theta is 0: DWB can never change its speed",
        {S.NO_START: 1.0, S.TOO_SLOW: 0.8, S.NO_TURNING: 0.8},
        (up("acc_lim_x", 2.5), up("acc_lim_theta", 3.2)),
        CODE,
        DWB,
    ),
    Rule(
        "dwb-speed-limit-of-zero",
        lambda f: f.is_whole and f.number("controller.max_speed_xy", 1e9) == 0.0,
        lambda f: (
            "max_speed_xy is 0 m/s, Nav2's default where none is given: DWB samples no speed but "
            "turns on the spot, so the robot never drives"
        ),
        {S.NO_START: SURE, S.FALSE_ABORT: 1.0, S.TOO_SLOW: 1.0},
        (up("max_speed_xy", lambda f: f.number("controller.max_vel_x")),),
        f"{CODE}: kinematic_parameters.cpp, xy_theta_iterator.cpp",
        DWB,
    ),
    Rule(
        "dwb-two-speed-limits",
        lambda f: 0.0 < f.number("controller.max_speed_xy", 1e9) < f.asked_mps,
        lambda f: (
            f"max_speed_xy is {f.controller('max_speed_xy')} m/s, less than max_vel_x "
            f"{f.asked_mps:g} m/s: the robot never reaches max_vel_x"
        ),
        {S.TOO_SLOW: 1.0},
        (up("max_speed_xy", lambda f: f.number("controller.max_vel_x")),),
        f"{CODE}: kinematic_parameters.cpp",
        DWB,
    ),
    Rule(
        "dwb-no-shim",
        lambda f: not f.is_kind("shim") and f.is_whole,
        lambda f: "DWB is poor at turns on the spot, and the file puts no rotation shim before it",
        {S.NO_TURNING: 0.5},
        (add("plugin"),),
        "docs.nav2.org, tuning guide: rotate in place behaviour",
        DWB,
        is_certain=False,
    ),
)
