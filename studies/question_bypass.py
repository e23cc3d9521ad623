"""The study of docs/questions/bypass.md: `python studies/questions.py bypass FOLDER`.

It needs two builds of Nav2's MPPI (docs/native_controllers.md): `bypass` of the branch with the
critic, `bypass_base` of its merge base, both with the benchmark's noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure
from question_trials import (
    Arm,
    Row,
    Study,
    arrived,
    compared_by_metrics,
    ends_cells,
    measures_of,
    robot_in,
    spread,
    table,
    touched,
)

from drake_navbench.inputs.scenario import Variation, load_scenario
from drake_navbench.logs.log import TrialLog

ROBOT, BASE, BRANCH = "round_robot", "mppi_bringup@bypass_base", "mppi_bringup@bypass"
# Twelve were planned; these were driven with every arm.
SEEDS = (*range(4), *range(5, 8))
VARIED = Variation(start_xy_std_m=0.05, start_yaw_std_rad=0.1)
# Bringup's list, with the critic where the branch's bringup has it.
CRITICS = (
    *("ConstraintCritic", "CostCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic"),
    *("ObstacleBypassCritic", "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic"),
)
WITH_CRITIC = f":critics=[{','.join(CRITICS)}]:ObstacleBypassCritic.max_path_occupancy_ratio=0.05"
# The branch's bringup looks farther for what blocks the path than the default of 2 m.
CHECKED_M = 4.5
FARTHER = f":PathAlignCritic.min_distance_occupancy_check={CHECKED_M}"
FARTHER_CRITIC = f":ObstacleBypassCritic.min_distance_occupancy_check={CHECKED_M}"
# The branch's bringup as it differs from that of its merge base.
WIDE = {
    "navigation": {
        "path_handler": {"prune_distance": 10.0},
        "local_costmap": {
            "width": 10,
            "height": 10,
            "inflation_layer": {"inflation_radius": 5.0, "cost_scaling_factor": 0.7},
            "obstacle_layer": {
                "observation_sources": {
                    "scan": {"obstacle_max_range": 9.5, "raytrace_max_range": 10.0}
                }
            },
        },
    }
}
BOXES, ELSEWHERE = ("box_on_path", "blocking_box"), ("static_obstacles", "corridor_passing")
KEPT = ("time_to_goal_s", "min_clearance_m", "cross_track_error_rms_m", "angular_jerk_rms_radps3")


class Setting(NamedTuple):
    """A robot file's settings and the columns of merge base, branch, and branch with critic."""

    name: str
    overrides: Mapping[str, object]
    columns: Mapping[str, str]


SETTINGS = (
    Setting("bringup", {}, {"base": BASE, "branch": BRANCH, "critic": BRANCH + WITH_CRITIC}),
    Setting(
        "wide",
        WIDE,
        {
            "base": BASE,
            "branch": BRANCH + FARTHER,
            "critic": BRANCH + WITH_CRITIC + FARTHER + FARTHER_CRITIC,
        },
    ),
)


def cells() -> list[tuple[str, Setting, str]]:
    """Returns scenario, setting and controller of each arm: elsewhere the wide settings alone."""
    return [
        (scenario, setting, name)
        for scenario in (*BOXES, *ELSEWHERE)
        for setting in (SETTINGS if scenario in BOXES else SETTINGS[1:])
        for name in setting.columns
    ]


def arms() -> list[Arm]:
    """Returns an arm for each cell."""
    found = []
    for name, setting, controller in cells():
        scenario = load_scenario(name).model_copy(update={"variation": VARIED})
        robot = robot_in(scenario, ROBOT, setting.overrides)
        arm = f"{name} {setting.name} {controller}"
        found.append(Arm(arm, scenario, robot, setting.columns[controller]))
    return found


def pairs() -> list[tuple[str, str]]:
    """Returns the arms that are compared: the merge base with the branch, and with the critic."""
    return [
        (f"{scenario} {setting.name} base", f"{scenario} {setting.name} {controller}")
        for scenario, setting, controller in cells()
        if controller != "base"
    ]


def kept_of(log: TrialLog) -> Row:
    """Returns the metrics of a trial that the page tells, and how far the robot got."""
    return measures_of(log, KEPT) | {"last_x_m": float(log.samples["x_m"].iloc[-1])}


def tell(rows: pd.DataFrame) -> Mapping[str, str]:
    """Returns the tables of the page."""
    lines = []
    for scenario, setting, controller in cells():
        own = rows[rows["arm"] == f"{scenario} {setting.name} {controller}"]
        reached = own[arrived(own)]
        lines.append(
            [
                *(f"`{scenario}`", setting.name, controller),
                *ends_cells(own, tests=len(cells())),
                spread(own, "last_x_m", "{:.1f}"),
                spread(reached, "time_to_goal_s", "{:.1f}"),
                spread(own, "min_clearance_m", "{:.2f}"),
            ]
        )
    titles = [
        *("scenario", "settings", "controller", "touches", "arrivals", "ends at x [m]"),
        *("time to the goal [s]", "least clearance [m]"),
    ]
    return {"arms": table(titles, lines)} | compared_by_metrics(rows, pairs(), KEPT)


def draw(rows: pd.DataFrame) -> Figure:
    """Returns arrivals and touches of each arm."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    axes = figure.subplots()
    names = [
        f"{scenario}\n{setting.name} {controller}" for scenario, setting, controller in cells()
    ]
    own = [
        rows[rows["arm"] == f"{scenario} {setting.name} {controller}"]
        for scenario, setting, controller in cells()
    ]
    axes.bar(range(len(own)), [100 * arrived(each).mean() for each in own], label="arrivals")
    touches = [100 * touched(each).mean() for each in own]
    axes.bar(range(len(own)), touches, width=0.4, color="C3", label="touches")
    axes.set_xticks(range(len(own)), names, rotation=90, fontsize=7)
    axes.set(ylabel="of the trials [%]", ylim=(0, 100))
    axes.legend(loc="upper left")
    return figure


STUDY = Study("bypass", arms(), SEEDS, kept_of, tell, draw)
