"""The study of docs/questions/arrival.md: `python studies/questions.py arrival FOLDER`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from question_trials import (
    Arm,
    Row,
    Study,
    arrived,
    compared,
    metric,
    share_cell,
    spread,
    table,
)

from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.typed_files.typed_yaml import validate

SCENARIO, ROBOT = "precise_arrival", "round_robot"
# As the scenario sets them.
LAG_S, WITHIN_M, WITHIN_DEG = 0.2, 0.02, 1.0
# Nav2's default tolerance: hunting is counted from the first time that the robot is so near.
NEAR_M = 0.25
# Slower motion has no direction.
LEAST_MPS, LEAST_RADPS = 0.01, 0.02
# As shipped, and with a setting changed that helped in trials that do not count.
CONTROLLERS = {
    "rpp": "rpp",
    "rpp_slow": "rpp:rotate_to_heading_angular_vel=0.3",
    "shim": "rotation_shim",
    "graceful": "graceful",
    "vector_pursuit": "vector_pursuit",
    "dwb": "dwb",
    "dwb_2cm": "dwb:xy_goal_tolerance=0.02",
    "dwb_short": "dwb:xy_goal_tolerance=0.02:sim_time=0.8",
    "mppi_nav2": "mppi_nav2",
    "mppi_goal": "mppi_nav2:GoalCritic.cost_weight=25",
}
FINE = {"xy_goal_tolerance": WITHIN_M, "yaw_goal_tolerance": 0.01745}
STANDING = {"trans_stopped_velocity": 0.01, "rot_stopped_velocity": 0.02}
CHECKERS = {
    "latched": FINE,
    "unlatched": FINE | {"stateful": False},
    "buffer": FINE | {"xy_goal_tolerance_buffer": 0.03},
    "adaptive": {
        "plugin": "nav2_controller::AdaptiveToleranceGoalChecker",
        "fine_xy_goal_tolerance": WITHIN_M,
        "coarse_xy_goal_tolerance": 0.1,
        "yaw_goal_tolerance": 0.01745,
    },
    "stopped": FINE | STANDING | {"plugin": "nav2_controller::StoppedGoalChecker"},
}
# Pairs of arms that show what a goal checker changes, and what a setting changes.
OF_CHECKERS = (("unlatched", "buffer"), ("latched", "adaptive"), ("latched", "stopped"))
OF_SETTINGS = (
    ("rpp", "rpp_slow"),
    ("rpp", "shim"),
    ("dwb", "dwb_2cm"),
    ("dwb_2cm", "dwb_short"),
    ("mppi_nav2", "mppi_goal"),
)
HUNTING = metric("near_time_s", "s", relevant=0.1)


def arms() -> list[Arm]:
    """Returns every controller with every goal checker."""
    scenario = load_scenario(SCENARIO)
    robots = {
        checker: with_checker(scenario.load_robot(ROBOT), parameters)
        for checker, parameters in CHECKERS.items()
    }
    return [
        Arm(f"{name} {checker}", scenario, robot, column)
        for name, column in CONTROLLERS.items()
        for checker, robot in robots.items()
    ]


def with_checker(robot: Robot, parameters: Mapping[str, Any]) -> Robot:
    """Returns a robot with another goal checker, and no parameter of the former one."""
    data = robot.navigation.model_dump(mode="json", exclude_unset=True)
    data["goal_checker"] = dict(parameters)
    navigation = validate(NavigationSettings, data, "study: navigation")
    return robot.model_copy(update={"navigation": navigation})


def kept_of(log: TrialLog) -> Row:
    """Returns the place of rest, the time near the goal and the number of turns back.

    It comes to rest LAG_S times its speed farther on: the server tells it to stop when the goal
    counts as reached, and a first-order base then rolls out.
    """
    samples = log.samples
    goal = np.array(log.info["scenario"]["goal"], dtype=float)
    x, y, yaw, v, w = samples[["x_m", "y_m", "yaw_rad", "v_mps", "w_radps"]].to_numpy().T
    rest = np.array(
        [x[-1] + LAG_S * v[-1] * np.cos(yaw[-1]), y[-1] + LAG_S * v[-1] * np.sin(yaw[-1])]
    )
    turned = yaw[-1] + LAG_S * w[-1] - goal[2]
    is_near = np.hypot(x - goal[0], y - goal[1]) <= NEAR_M
    first = int(np.argmax(is_near)) if is_near.any() else len(x)
    time_s = samples["time_s"].to_numpy()
    return {
        "rest_position_error_m": float(np.hypot(*(rest - goal[:2]))),
        "rest_heading_error_deg": float(
            abs(np.degrees(np.arctan2(np.sin(turned), np.cos(turned))))
        ),
        "near_time_s": float(time_s[-1] - time_s[first]) if is_near.any() else float("nan"),
        "turns_back": _turns(v[first:], LEAST_MPS) + _turns(w[first:], LEAST_RADPS),
    }


def _turns(speed: np.ndarray, least: float) -> int:
    """Returns the number of changes of sign of a speed."""
    signs = np.sign(speed[np.abs(speed) > least])
    return int(np.count_nonzero(np.diff(signs)))


def is_precise(rows: pd.DataFrame) -> pd.Series:
    """Returns whether each trial arrived, and its true pose at rest is within both limits."""
    return (
        arrived(rows)
        & (rows["rest_position_error_m"] <= WITHIN_M)
        & (rows["rest_heading_error_deg"] <= WITHIN_DEG)
    )


def tell(rows: pd.DataFrame) -> Mapping[str, str]:
    """Returns the tables of the page."""
    cells = []
    for name in rows["arm"].unique():
        own = rows[rows["arm"] == name]
        reached = own[arrived(own)]
        controller, checker = name.split()
        cells.append(
            [
                f"`{controller}`",
                checker,
                str(int(arrived(own).sum())),
                share_cell(int(is_precise(own).sum()), len(own), tests=len(arms())),
                spread(own, "near_time_s", "{:.1f}"),
                spread(own, "turns_back", "{:.0f}"),
                spread(reached, "rest_position_error_m", "{:.1f}", 1e3),
                spread(reached, "rest_heading_error_deg", "{:.2f}"),
            ]
        )
    titles = [
        *("controller", "goal checker", "says reached", "precise at rest", "near the goal [s]"),
        *("turns back", "position [mm]", "heading [deg]"),
    ]
    counted = rows.assign(outcome=np.where(is_precise(rows), "succeeded", "aborted"))
    pairs = [
        (f"{controller} {before}", f"{controller} {after}")
        for before, after in OF_CHECKERS
        for controller in CONTROLLERS
    ]
    pairs += [
        (f"{before} {checker}", f"{after} {checker}")
        for before, after in OF_SETTINGS
        for checker in ("latched", "stopped")
    ]
    shown = {"success_rate": "precise at rest [%]", "near_time_s": "near the goal [s]"}
    return {
        "arms": table(titles, cells),
        **compared(counted, pairs, [HUNTING], shown),
    }


def draw(rows: pd.DataFrame) -> Figure:
    """Returns a picture of the places of rest, a panel a goal checker."""
    figure = Figure(figsize=(11.0, 3.4), layout="constrained")
    panels = figure.subplots(1, len(CHECKERS), sharex=True, sharey=True)
    for panel, checker in zip(panels, CHECKERS, strict=True):
        for place, controller in enumerate(CONTROLLERS):
            own = rows[rows["arm"] == f"{controller} {checker}"]
            has = arrived(own).to_numpy()
            errors = own[["rest_position_error_m", "rest_heading_error_deg"]].to_numpy() * [
                1e3,
                1.0,
            ]
            for which, marker in ((has, "o"), (~has, "x")):
                panel.scatter(
                    *np.maximum(errors[which], [0.3, 0.03]).T,
                    s=12,
                    marker=marker,
                    color=f"C{place}",
                    label=controller if marker == "o" and checker == "latched" else None,
                )
        panel.plot(
            [0.3, 1e3 * WITHIN_M, 1e3 * WITHIN_M], [WITHIN_DEG, WITHIN_DEG, 0.03], "k", lw=0.8
        )
        panel.set(title=checker, xscale="log", yscale="log", xlabel="position at rest [mm]")
    panels[0].set_ylabel("heading at rest [deg]")
    figure.legend(loc="outside lower center", ncols=len(CONTROLLERS))
    return figure


STUDY = Study("arrival", arms(), range(12), kept_of, tell, draw)
