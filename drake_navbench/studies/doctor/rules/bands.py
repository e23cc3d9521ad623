"""Rules about TEB, and about Nav2's Graceful controller."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

TEB = ("teb",)
GRACEFUL = ("graceful",)
TEB_CODE = "teb_local_planner: optimal_planner.cpp"
CODE = "nav2_graceful_controller"
# The width of a door in a house, m.
DOOR_M = 0.8


def _free_m(f: Facts) -> float:
    """Returns the narrowest passage that TEB takes willingly, m."""
    return 2.0 * (f.inscribed_radius_m + f.number("controller.min_obstacle_dist", 0.5))


RULES = (
    Rule(
        "teb-reversing-is-cheap",
        lambda f: f.number("controller.weight_kinematics_forward_drive", 1.0) < 10.0,
        lambda f: (
            "weight_kinematics_forward_drive is "
            f"{f.controller('weight_kinematics_forward_drive')}: TEB finds driving backward "
            "cheaper than turning"
        ),
        {S.REVERSE_FAILURE: 1.0, S.GOAL_OSCILLATION: 0.5, S.NO_TURNING: 0.5},
        (up("weight_kinematics_forward_drive", 1000.0),),
        f"{TEB_CODE}; teb_local_planner#51",
        TEB,
    ),
    Rule(
        "teb-reverse-within-the-margin",
        lambda f: (
            f.number("controller.weight_kinematics_forward_drive", 1.0) >= 10.0
            and f.number("controller.max_vel_x_backwards", 0.2)
            >= f.number("controller.penalty_epsilon", 0.05)
        ),
        lambda f: (
            f"max_vel_x_backwards is {f.controller('max_vel_x_backwards')} m/s and "
            f"penalty_epsilon {f.controller('penalty_epsilon')} m/s: TEB does not punish a "
            "backward speed below penalty_epsilon"
        ),
        {S.REVERSE_FAILURE: 1.0},
        (
            up("weight_kinematics_forward_drive"),
            down("penalty_epsilon"),
            down("max_vel_x_backwards"),
        ),
        f"{TEB_CODE}; teb_local_planner#85, #230",
        TEB,
        is_certain=False,
    ),
    Rule(
        "teb-keeps-doors-closed",
        lambda f: f.inscribed_radius_m > 0.0 and _free_m(f) > DOOR_M,
        lambda f: (
            f"min_obstacle_dist is {f.controller('min_obstacle_dist')} m: TEB enters only "
            f"passages wider than {_free_m(f):.2f} m, the robot's width and this distance on both "
            "sides"
        ),
        {S.DOOR_STOP: 1.0, S.WOBBLE_STRAIGHT: 0.5, S.STALL_BEFORE_GOAL: 0.4, S.NO_START: 0.3},
        (down("min_obstacle_dist"),),
        TEB_CODE,
        TEB,
    ),
    Rule(
        "teb-keeps-little-free",
        lambda f: f.number("controller.min_obstacle_dist", 0.5) < 0.06,
        lambda f: (
            f"min_obstacle_dist is {f.controller('min_obstacle_dist')} m: TEB leaves no "
            "room for errors of pose and motion"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 1.0},
        (up("min_obstacle_dist", 0.2),),
        TEB_CODE,
        TEB,
    ),
    Rule(
        "teb-pushed-from-afar",
        lambda f: f.number("controller.inflation_dist", 0.6) > 0.8,
        lambda f: (
            f"inflation_dist is {f.controller('inflation_dist')} m: in a passage the walls on "
            "both sides push TEB's path to and fro"
        ),
        {S.WOBBLE_STRAIGHT: 0.9, S.DOOR_STOP: 0.6},
        (down("inflation_dist", 0.4),),
        f"{TEB_CODE}; teb_local_planner#92",
        TEB,
    ),
    Rule(
        "teb-turns-bind",
        lambda f: (
            f.number("controller.acc_lim_theta", 0.5) < 0.3
            or f.number("controller.max_vel_theta", 0.3) < 0.3
        ),
        lambda f: (
            f"max_vel_theta is {f.controller('max_vel_theta')} rad/s and acc_lim_theta "
            f"{f.controller('acc_lim_theta')} rad/s^2: these limits slow down every "
            "correction of the heading"
        ),
        {S.WOBBLE_STRAIGHT: 0.8, S.NO_TURNING: 0.7, S.CORNER_CUTTING: 0.4},
        (up("acc_lim_theta"), up("max_vel_theta")),
        f"{TEB_CODE}; teb_local_planner#92",
        TEB,
    ),
    Rule(
        "teb-follows-no-plan",
        lambda f: f.number("controller.global_plan_viapoint_sep", -0.1) <= 0.0,
        lambda f: (
            "global_plan_viapoint_sep is off (0 m or less): nothing holds TEB's path on the plan"
        ),
        {S.CORNER_CUTTING: 0.9, S.WOBBLE_STRAIGHT: 0.3},
        (put("global_plan_viapoint_sep", 0.3), up("weight_viapoint")),
        TEB_CODE,
        TEB,
        is_certain=False,
    ),
    Rule(
        "teb-arrives-at-speed",
        lambda f: f.controller("free_goal_vel") is True,
        lambda f: "free_goal_vel is on: the robot may cross the goal at speed",
        {S.GOAL_OVERSHOOT: 1.0, S.GOAL_OSCILLATION: 0.7},
        (put("free_goal_vel", False),),
        TEB_CODE,
        TEB,
    ),
    Rule(
        "teb-many-ways",
        lambda f: (
            f.controller("enable_homotopy_class_planning") is True
            and f.number("controller.max_number_classes", 4) > 3
        ),
        lambda f: (
            f"max_number_classes is {f.controller('max_number_classes')}: TEB optimises up "
            "to this many ways around the obstacles in every cycle"
        ),
        {S.LATE_CYCLES: 0.8, S.STOP_START_JERK: 0.3},
        (down("max_number_classes", 2), put("enable_homotopy_class_planning", False)),
        "teb_local_planner: homotopy_class_planner.cpp",
        TEB,
        is_certain=False,
    ),
    Rule(
        "teb-changes-sides",
        lambda f: (
            f.controller("enable_homotopy_class_planning") is True
            and f.number("controller.selection_cost_hysteresis", 1.0) >= 1.0
            and f.number("controller.switching_blocking_period") == 0.0
        ),
        lambda f: (
            "selection_cost_hysteresis is 1 or more and switching_blocking_period 0 s: "
            "nothing keeps TEB's path on one side of an obstacle"
        ),
        {S.WOBBLE_STRAIGHT: 0.5, S.SPINS: 0.4, S.STOP_START_JERK: 0.4},
        (down("selection_cost_hysteresis", 0.9), up("switching_blocking_period", 1.0)),
        "teb_local_planner: homotopy_class_planner.cpp",
        TEB,
        is_certain=False,
    ),
    Rule(
        "teb-obstacles-left-out",
        lambda f: f.controller("include_costmap_obstacles") is False,
        lambda f: "include_costmap_obstacles is off: TEB ignores the costmap's obstacles",
        {S.COLLISION: 1.0, S.IGNORES_OBSTACLES: 1.0},
        (put("include_costmap_obstacles", True),),
        TEB_CODE,
        TEB,
    ),
    Rule(
        "teb-checks-far-poses",
        lambda f: f.number("controller.feasibility_check_no_poses", 5) > 8,
        lambda f: (
            f"feasibility_check_no_poses is {f.controller('feasibility_check_no_poses')}: "
            "TEB stops the robot when one of this many poses ahead touches something"
        ),
        {S.STOP_START_JERK: 0.7, S.DOOR_STOP: 0.6, S.FALSE_ABORT: 0.4},
        (down("feasibility_check_no_poses", 4),),
        TEB_CODE,
        TEB,
        is_certain=False,
    ),
    Rule(
        "graceful-eager",
        lambda f: (
            f.number("controller.k_phi", 2.0) > 2.5 or f.number("controller.k_delta", 1.0) > 1.5
        ),
        lambda f: (
            f"k_phi is {f.controller('k_phi')} and k_delta {f.controller('k_delta')}: gains "
            "this high are made for docking, and the robot curls onto the path"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.SPINS: 0.5, S.GOAL_OSCILLATION: 0.4},
        (down("k_phi", 2.0), down("k_delta", 1.0), upgrade("jazzy or newer, with other defaults")),
        "navigation2#4795",
        GRACEFUL,
    ),
    Rule(
        "graceful-slow-in-bends",
        lambda f: f.number("controller.beta", 0.4) > 1.0,
        lambda f: (
            f"beta is {f.controller('beta')}: the controller slows the robot down in every bend"
        ),
        {S.TOO_SLOW: 1.0, S.STOP_START_JERK: 0.6},
        (down("beta", 0.4),),
        f"{CODE}: smooth_control_law.cpp",
        GRACEFUL,
    ),
    Rule(
        "graceful-far-target",
        lambda f: (
            f.number("controller.max_lookahead", 1.0) > 1.5
            or f.number("controller.motion_target_dist", 0.6) > 1.2
        ),
        lambda f: (
            f"max_lookahead is {f.controller('max_lookahead')} m and motion_target_dist "
            f"{f.controller('motion_target_dist')} m: targets this far ahead make the robot "
            "cut bends"
        ),
        {S.CORNER_CUTTING: 1.0, S.NEAR_MISS: 0.5, S.DOOR_STOP: 0.3},
        (down("max_lookahead", 1.0), down("motion_target_dist", 0.6)),
        CODE,
        GRACEFUL,
    ),
    Rule(
        "graceful-near-target",
        lambda f: (
            f.number("controller.max_lookahead", 1.0) < 0.8 * f.speed_mps
            or (
                f.release <= Release.IRON
                and f.number("controller.motion_target_dist", 0.6) < 0.8 * f.speed_mps
            )
        ),
        lambda f: (
            f"max_lookahead or motion_target_dist is less than the robot drives in 0.8 s at "
            f"{f.speed_mps:g} m/s: the target is so near that the robot swings"
        ),
        {S.WOBBLE_STRAIGHT: 0.9},
        (up("max_lookahead"), up("motion_target_dist")),
        CODE,
        GRACEFUL,
    ),
    Rule(
        "graceful-slow-turn",
        lambda f: f.number("controller.v_angular_min_in_place", 0.25) < 0.08,
        lambda f: (
            f"v_angular_min_in_place is {f.controller('v_angular_min_in_place')} rad/s: "
            "most motors do not move the robot at such a rate"
        ),
        {S.NO_TURNING: 0.8, S.STALL_BEFORE_GOAL: 0.9, S.GOAL_NOT_REACHED: 0.8, S.NO_START: 0.6},
        (up("v_angular_min_in_place", 0.25),),
        CODE,
        GRACEFUL,
    ),
    Rule(
        "graceful-slow-arrival",
        lambda f: f.number("controller.v_linear_min", 0.1) < 0.03,
        lambda f: (
            f"v_linear_min is {f.controller('v_linear_min')} m/s: most motors do not move "
            "the robot at such a speed"
        ),
        {S.STALL_BEFORE_GOAL: 0.9, S.GOAL_NOT_REACHED: 0.7, S.NO_START: 0.5},
        (up("v_linear_min", 0.1),),
        CODE,
        GRACEFUL,
    ),
    Rule(
        "graceful-late-slowdown",
        lambda f: f.number("controller.slowdown_radius", 1.5) < 1.2 * f.speed_mps,
        lambda f: (
            f"slowdown_radius is {f.controller('slowdown_radius')} m: too short to slow down "
            f"gently from {f.speed_mps:g} m/s"
        ),
        {S.GOAL_OVERSHOOT: 1.0, S.GOAL_OSCILLATION: 0.5},
        (up("slowdown_radius", 1.5),),
        CODE,
        GRACEFUL,
    ),
    Rule(
        "graceful-turns-first-and-backs",
        lambda f: (
            f.controller("initial_rotation") is True and f.controller("allow_backward") is True
        ),
        lambda f: (
            "initial_rotation and allow_backward are both on; the Graceful controller allows only "
            "one of them"
        ),
        {S.REVERSE_FAILURE: 1.0, S.NO_START: 0.5},
        (put("initial_rotation", False), put("allow_backward", False)),
        f"{CODE}: parameter_handler.cpp",
        GRACEFUL,
    ),
)
