"""Rules about the critics of Nav2's MPPI."""

from __future__ import annotations

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.mppi import CODE, MPPI, PAGE
from drake_navbench.studies.doctor.rules.quantities import has_critic, is_not_round
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom
# The versions that refuse to check a footprint that is none, where not a whole release does.
REFUSES_FOOTPRINT = {
    Release.HUMBLE: "humble from 1.1.19 on",
    Release.IRON: "from jazzy's 1.3.6 on",
    Release.JAZZY: "jazzy from 1.3.6 on",
}


def _looks_where_it_costs(f: Facts) -> bool:
    """Tells whether a critic looks at the outline only where the centre's cell costs something.

    From Jazzy on CostCritic looks everywhere while the inflation is too narrow.
    """
    critics = ["ObstaclesCritic", *(["CostCritic"] if f.release <= Release.IRON else [])]
    return any(
        has_critic(f, critic) and f.controller(f"{critic}.consider_footprint") is True
        for critic in critics
    )


def _told_no_critics(f: Facts) -> str:
    """Returns in words that no critic is listed, and where the file has a list that is not read."""
    start = f"controller_server.{f.plugin}."
    misplaced = [n for n in f.raw if n.startswith(start) and n.endswith(".critics")]
    where = f"; the list {misplaced[0].partition('.')[2]} is read by nobody" if misplaced else ""
    return (
        f"{f.plugin}.critics is not given: MPPI scores no trajectory, so nothing draws the robot "
        f"along its path or keeps it from obstacles{where}"
    )


def _footprint_for_a_radius(critic: str) -> Rule:
    """Returns the rule about a critic that is to check a footprint where there is a radius only."""
    return Rule(
        f"mppi-footprint-for-a-radius-{critic}",
        lambda f: (
            f.robot is not None
            and f.robot.is_circle
            and has_critic(f, critic)
            and f.controller(f"{critic}.consider_footprint") is True
        ),
        lambda f: (
            f"{critic}.consider_footprint is on, but the costmap has a robot_radius and no "
            f"footprint: Nav2 {REFUSES_FOOTPRINT.get(f.release, f.release)} does not start"
        ),
        {S.NO_START: 0.9, S.LATE_CYCLES: 0.3},
        (put(f"{critic}.consider_footprint", False), put("local_costmap.footprint")),
        f"{CODE}/src/critics: cost_critic.cpp, obstacles_critic.cpp",
        MPPI,
    )


RULES = (
    Rule(
        "mppi-no-critics",
        lambda f: f.is_whole and not f.controller("critics"),
        _told_no_critics,
        {S.NO_START: SURE, S.GOAL_NOT_REACHED: 1.5, S.COLLISION: 1.0},
        (put("critics"),),
        f"{CODE}/src/critic_manager.cpp",
        MPPI,
        advice="list critics directly below the controller's name",
    ),
    Rule(
        "mppi-outline-beyond-inflation",
        lambda f: (
            is_not_round(f)
            and _looks_where_it_costs(f)
            and f.number("local_costmap.inflation_radius", 1e9) < f.circumscribed_radius_m
        ),
        lambda f: (
            "consider_footprint is on, but inflation_radius is "
            f"{f['local_costmap.inflation_radius']} m and the footprint reaches "
            f"{f.circumscribed_radius_m:.2f} m from the centre: MPPI does not check the footprint "
            "where the cell under the centre has no cost"
        ),
        {S.COLLISION: 0.9, S.NEAR_MISS: 0.6},
        (up("local_costmap.inflation_radius", lambda f: f.circumscribed_radius_m + 0.05),),
        f"{CODE}/src/critics/cost_critic.cpp: findCircumscribedCost",
        MPPI,
    ),
    Rule(
        "mppi-centre-alone",
        lambda f: (
            is_not_round(f)
            and has_critic(f, "CostCritic")
            and f.controller("CostCritic.consider_footprint") is not True
        ),
        lambda f: (
            "CostCritic checks only the cell under the robot's centre, but the robot is not round: "
            f"its edge is {f.inscribed_radius_m:.2f} to {f.circumscribed_radius_m:.2f} m away"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.7, S.DOOR_STOP: 0.2, S.CORNER_CUTTING: 0.5},
        (put("CostCritic.consider_footprint", True),),
        f"{CODE}/src/critics/cost_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-obstacles-centre-alone",
        lambda f: (
            is_not_round(f)
            and has_critic(f, "ObstaclesCritic")
            and f.controller("ObstaclesCritic.consider_footprint") is not True
        ),
        lambda f: (
            "ObstaclesCritic checks only the cell under the robot's centre, but the robot is not "
            f"round: its edge is {f.inscribed_radius_m:.2f} to {f.circumscribed_radius_m:.2f} m "
            "away"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.7, S.CORNER_CUTTING: 0.5},
        (put("ObstaclesCritic.consider_footprint", True),),
        f"{CODE}/src/critics/obstacles_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-no-obstacle-critic",
        lambda f: (
            bool(f.controller("critics")) and not has_critic(f, "CostCritic", "ObstaclesCritic")
        ),
        lambda f: (
            "critics lists neither CostCritic nor ObstaclesCritic: no critic looks at obstacles"
        ),
        {S.COLLISION: 1.0, S.IGNORES_OBSTACLES: 1.0, S.NEAR_MISS: 0.8},
        (put("critics"),),
        PAGE,
        MPPI,
    ),
    Rule(
        "mppi-path-align-starts-late",
        lambda f: f.number("controller.PathAlignCritic.offset_from_furthest", 20) > 30,
        lambda f: (
            "PathAlignCritic.offset_from_furthest is "
            f"{f.controller('PathAlignCritic.offset_from_furthest')}: PathAlignCritic does "
            "nothing until the samples reach this many points along the path"
        ),
        {S.STOP_START_JERK: 0.5, S.CORNER_CUTTING: 0.6, S.WOBBLE_STRAIGHT: 0.3},
        (down("PathAlignCritic.offset_from_furthest", 20),),
        f"{CODE}/src/critics/path_align_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-gap-before-goal",
        lambda f: (
            f.number("controller.GoalCritic.threshold_to_consider", 1.4)
            < 0.95 * f.number("controller.PathFollowCritic.threshold_to_consider", 1.4)
        ),
        lambda f: (
            f"between {f.controller('PathFollowCritic.threshold_to_consider')} and "
            f"{f.controller('GoalCritic.threshold_to_consider')} m before the goal neither "
            "PathFollowCritic nor GoalCritic pulls the robot"
        ),
        {S.STALL_BEFORE_GOAL: 1.0, S.GOAL_NOT_REACHED: 0.7},
        (
            up(
                "GoalCritic.threshold_to_consider",
                lambda f: f.number("controller.PathFollowCritic.threshold_to_consider", 1.4),
            ),
        ),
        f"{CODE}/src/critics: goal_critic.cpp, path_follow_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-forward-at-any-price",
        lambda f: f.number("controller.PreferForwardCritic.cost_weight", 5.0) > 10.0,
        lambda f: (
            "PreferForwardCritic.cost_weight is "
            f"{f.controller('PreferForwardCritic.cost_weight')}: the robot drives forward even "
            "where it should turn or back out"
        ),
        {S.NO_TURNING: 0.6, S.NO_RECOVERY: 0.6},
        (down("PreferForwardCritic.cost_weight", 5.0),),
        f"{CODE}/src/critics/prefer_forward_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-weak-path-angle",
        lambda f: (
            f.number("controller.PathAngleCritic.cost_weight", 2.0) < 1.5
            and has_critic(f, "PathAngleCritic")
        ),
        lambda f: (
            f"PathAngleCritic.cost_weight is {f.controller('PathAngleCritic.cost_weight')}: "
            "it turns the robot too weakly to the path's heading"
        ),
        {S.NO_TURNING: 0.8, S.SPINS: 0.2},
        (up("PathAngleCritic.cost_weight", 2.0),),
        f"{CODE}/src/critics/path_angle_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-weak-path-align",
        lambda f: (
            f.number("controller.PathAlignCritic.cost_weight", 10.0) < 6.0
            and has_critic(f, "PathAlignCritic")
        ),
        lambda f: (
            f"PathAlignCritic.cost_weight is {f.controller('PathAlignCritic.cost_weight')}: "
            "it holds the robot too weakly on the path"
        ),
        {S.CORNER_CUTTING: 0.9, S.NEAR_MISS: 0.3},
        (up("PathAlignCritic.cost_weight", 14.0),),
        f"{CODE}/src/critics/path_align_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-strong-path-align",
        lambda f: f.number("controller.PathAlignCritic.cost_weight", 10.0) > 18.0,
        lambda f: (
            f"PathAlignCritic.cost_weight is {f.controller('PathAlignCritic.cost_weight')}: "
            "it outweighs obstacles and progress along the path"
        ),
        {S.WOBBLE_STRAIGHT: 0.7, S.STALL_BEFORE_GOAL: 0.5, S.COLLISION: 0.4, S.NO_RECOVERY: 0.5},
        (down("PathAlignCritic.cost_weight", 14.0),),
        f"{CODE}/src/critics/path_align_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-weak-cost",
        lambda f: (
            has_critic(f, "CostCritic")
            and f.number("controller.CostCritic.cost_weight", 3.81) < 2.5
        ),
        lambda f: (
            f"CostCritic.cost_weight is {f.controller('CostCritic.cost_weight')}: the pull "
            "along the path outweighs the cost of obstacles"
        ),
        {S.NEAR_MISS: 1.0, S.COLLISION: 0.6},
        (up("CostCritic.cost_weight", 3.81),),
        f"{CODE}/src/critics/cost_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-strong-cost",
        lambda f: f.number("controller.CostCritic.cost_weight", 3.81) > 7.0,
        lambda f: (
            f"CostCritic.cost_weight is {f.controller('CostCritic.cost_weight')}: any cost "
            "outweighs the pull along the path"
        ),
        {S.DOOR_STOP: 1.0, S.STALL_BEFORE_GOAL: 0.6, S.TOO_SLOW: 0.6, S.STOP_START_JERK: 0.4},
        (down("CostCritic.cost_weight", 3.81),),
        f"{CODE}/src/critics/cost_critic.cpp",
        MPPI,
    ),
    Rule(
        "mppi-omni-twirls",
        lambda f: (
            f.controller("motion_model") == "Omni"
            and bool(f.controller("critics"))
            and not has_critic(f, "TwirlingCritic")
        ),
        lambda f: (
            "motion_model is Omni and critics lists no TwirlingCritic: nothing keeps the "
            "robot from turning without need"
        ),
        {S.SPINS: 0.9, S.WOBBLE_STRAIGHT: 0.6},
        (put("critics", "TwirlingCritic"), down("wz_std")),
        PAGE,
        MPPI,
    ),
    *map(_footprint_for_a_radius, ("CostCritic", "ObstaclesCritic")),
)
