"""Rules about planners and AMCL."""

from __future__ import annotations

from typing import Any

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SMAC = ("SmacPlannerHybrid", "SmacPlannerLattice")


def _text(value: Any) -> str:
    return str(value or "")


def _is_smac(f: Facts) -> bool:
    return any(kind in _text(f["planner.plugin"]) for kind in SMAC)


RULES = (
    Rule(
        "unknown-forbidden",
        lambda f: f["planner.allow_unknown"] is False,
        lambda f: "planner.allow_unknown is off: the planner makes no plan through unknown cells",
        {S.PLANNER_FAILS: 0.6},
        (put("planner.allow_unknown", True),),
        "nav2_planner and its plugins",
        is_certain=False,
    ),
    Rule(
        "planner-insists-on-the-goal",
        lambda f: f["planner.tolerance"] is not None and f.number("planner.tolerance") < 0.1,
        lambda f: (
            f"planner.tolerance is {f['planner.tolerance']} m: when the goal's cell is occupied, "
            "the planner looks for a free one only within this distance"
        ),
        {S.PLANNER_FAILS: 0.6, S.GOAL_NOT_REACHED: 0.2},
        (up("planner.tolerance", 0.25),),
        "nav2_navfn_planner, nav2_smac_planner",
        is_certain=False,
    ),
    Rule(
        "planner-has-no-time",
        lambda f: 0.0 < f.number("planner.max_planning_time", 5.0) < 1.0,
        lambda f: (
            f"max_planning_time is {f['planner.max_planning_time']} s: too short to search "
            "a large map"
        ),
        {S.PLANNER_FAILS: 0.9},
        (up("planner.max_planning_time", 5.0),),
        "nav2_smac_planner",
        is_certain=False,
    ),
    Rule(
        "planner-turns-wide",
        lambda f: _is_smac(f) and f.number("planner.minimum_turning_radius", 0.4) > 0.8,
        lambda f: (
            f"minimum_turning_radius is {f['planner.minimum_turning_radius']} m: curves "
            "this wide do not fit into a house"
        ),
        {S.PLANNER_FAILS: 0.8, S.REVERSE_FAILURE: 0.3},
        (down("planner.minimum_turning_radius", 0.4),),
        "nav2_smac_planner",
        is_certain=False,
    ),
    Rule(
        "planner-turns-in-a-point",
        lambda f: (
            _is_smac(f)
            and "planner.minimum_turning_radius" in f.given
            and f.number("planner.minimum_turning_radius", 0.4) <= 0.0
        ),
        lambda f: "minimum_turning_radius is 0 m: Smac plans with arcs of this radius and has none",
        {S.PLANNER_FAILS: SURE},
        (up("planner.minimum_turning_radius", 0.1),),
        "nav2_smac_planner: node_hybrid.cpp; navigation2#4845",
    ),
    Rule(
        "costmap-slower-than-its-planner-waits",
        lambda f: (
            f.release >= Release.JAZZY
            and 0.0
            < f.number("global_costmap.update_frequency", 5.0)
            < 1.0 / max(f.number("planner.costmap_update_timeout", 1.0), 0.01)
        ),
        lambda f: (
            f"global_costmap.update_frequency is {f['global_costmap.update_frequency']} Hz: after "
            "the costmap was cleared, the planner waits at most "
            f"{f.number('planner.costmap_update_timeout', 1.0):g} s for its next update and then "
            "fails"
        ),
        {S.PLANNER_FAILS: 1.2, S.FALSE_ABORT: 0.4},
        (
            up("global_costmap.update_frequency", 1.0),
            up("planner.costmap_update_timeout"),
        ),
        "nav2_planner: planner_server.cpp, waitForCostmap",
    ),
    Rule(
        "amcl-looks-seldom",
        lambda f: f.number("amcl.update_min_d") > 0.4 or f.number("amcl.update_min_a") > 0.5,
        lambda f: (
            f"amcl.update_min_d is {f['amcl.update_min_d']} m and amcl.update_min_a "
            f"{f['amcl.update_min_a']} rad: AMCL rarely corrects the pose, and the pose "
            "jumps"
        ),
        {S.LOCALIZATION_JUMPS: 0.9, S.SPINS: 0.4, S.GOAL_OSCILLATION: 0.4, S.GOAL_NOT_REACHED: 0.3},
        (down("amcl.update_min_d", 0.2), down("amcl.update_min_a", 0.2)),
        "nav2_amcl",
    ),
    Rule(
        "amcl-few-particles",
        lambda f: 0 < f.number("amcl.max_particles") < 1000,
        lambda f: (
            f"amcl.max_particles is {f['amcl.max_particles']}: too few to find a lost pose again"
        ),
        {S.LOCALIZATION_JUMPS: 0.7},
        (up("amcl.max_particles", 2000),),
        "nav2_amcl",
    ),
    Rule(
        "amcl-odometry-perfect",
        lambda f: f["amcl.alpha1"] is not None and f.number("amcl.alpha1") < 0.03,
        lambda f: (
            f"amcl.alpha1 is {f['amcl.alpha1']}: AMCL takes the odometry's turns as nearly exact, "
            "but wheels slip"
        ),
        {S.LOCALIZATION_JUMPS: 0.7, S.SPINS: 0.5},
        (up("amcl.alpha1", 0.2),),
        "nav2_amcl: differential_motion_model.cpp",
    ),
    Rule(
        "amcl-stale-transform",
        lambda f: 0.0 < f.number("amcl.transform_tolerance", 1.0) < 0.2,
        lambda f: (
            f"amcl.transform_tolerance is {f['amcl.transform_tolerance']} s: with fewer than "
            f"{1.0 / f.number('amcl.transform_tolerance'):.0f} scans a second, or late ones, the "
            "transform from map to odom expires before the next one comes"
        ),
        {S.FALSE_ABORT: 0.6, S.PLANNER_FAILS: 0.4, S.LOCALIZATION_JUMPS: 0.4},
        (up("amcl.transform_tolerance", 1.0),),
        "nav2_amcl",
    ),
)
