"""Trial logs with known answers: a straight line, a circle, and whatever a test says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from scenes import WHEELCHAIR, straight_plan

from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import COLUMNS, LATERAL_COLUMNS
from drake_navbench.logs.plans import Plan

LOG_PERIOD_S = 0.02
FOOTPRINT = WHEELCHAIR.tolist()


def log_times(end_time_s: float) -> np.ndarray:
    """Returns the recorder's stamps from 0 to the end."""
    return LOG_PERIOD_S * np.arange(round(end_time_s / LOG_PERIOD_S) + 1)


def make_log(
    time_s: np.ndarray,
    *,
    plan: Any = ((0.0, 0.0, 0.0),),
    plans: Sequence[Plan] | None = None,
    outcome: str = "succeeded",
    info: dict[str, Any] | None = None,
    **columns: Any,
) -> TrialLog:
    """Returns a log with these columns (scalars are held), all others 0, far from any obstacle.

    plan: in force from the start, its last pose is the goal. plans: in its place, where given.
    """
    time_s = np.asarray(time_s, dtype=float)
    defaults = {
        "clearance_m": np.inf,
        "obstacle_cell_distance_m": np.inf,
        "obstacle_corner_distance_m": np.inf,
    }
    lateral = LATERAL_COLUMNS if set(columns) & set(LATERAL_COLUMNS) else ()
    values = {
        name: np.broadcast_to(columns.get(name, defaults.get(name, 0.0)), time_s.shape)
        for name in (*COLUMNS, *lateral)
    }
    values["time_s"] = time_s
    unknown = set(columns) - set(COLUMNS) - set(LATERAL_COLUMNS)
    if unknown:
        raise KeyError(f"no such columns: {sorted(unknown)}")
    plan = np.array(plan, dtype=float).reshape(-1, 3)
    if plans is None:
        plans = [Plan(0.0, plan)] if len(plan) else []
    goal = [float(x) for x in plan[-1]] if len(plan) else [0.0, 0.0, 0.0]
    start = [float(values[c][0]) for c in ("x_m", "y_m", "yaw_rad")]
    return TrialLog(
        samples=pd.DataFrame({name: np.array(column) for name, column in values.items()}),
        plans=tuple(plans),
        info={
            "scenario": {
                "name": "empty",
                "start": start,
                "goal": goal,
                "world": {"obstacles": [], "keepout": []},
            },
            "robot": {
                "footprint": FOOTPRINT,
                "robot_radius": None,
                "mass_kg": 180.0,
                "drag_area_m2": 0.8,
                "drive": {"max_linear_velocity_mps": 0.5},
                "navigation": {
                    "controller_server": {"controller_frequency": 20.0},
                    "goal_checker": {"xy_goal_tolerance": 0.25},
                },
            },
            "controller": "rpp",
            "trial": 0,
            "seed": 1,
            "outcome": outcome,
            "reason": "goal reached",
            "start_time_s": 0.0,
            "end_time_s": float(time_s[-1]),
        }
        | (info or {}),
    )


def straight_log(*, speed_mps: float = 0.5, end_time_s: float = 10.0, **kwargs: Any) -> TrialLog:
    """Returns a drive along x at constant speed."""
    time_s = log_times(end_time_s)
    columns = {
        "x_m": speed_mps * time_s,
        "v_mps": speed_mps,
        "command_v_mps": speed_mps,
        "plan": straight_plan(speed_mps * end_time_s),
    }
    return make_log(time_s, **(columns | kwargs))


def circle_log(
    *, radius_m: float = 2.0, speed_mps: float = 0.4, end_time_s: float = 10.0, **kwargs: Any
) -> TrialLog:
    """Returns a drive to the left on a circle around (0, radius) at constant speed."""
    time_s = log_times(end_time_s)
    yaw = speed_mps / radius_m * time_s
    x, y = radius_m * np.sin(yaw), radius_m * (1.0 - np.cos(yaw))
    columns = {
        "x_m": x,
        "y_m": y,
        "yaw_rad": yaw,
        "v_mps": speed_mps,
        "w_radps": speed_mps / radius_m,
        "command_v_mps": speed_mps,
        "command_w_radps": speed_mps / radius_m,
        "plan": np.column_stack([x, y, yaw]),
    }
    return make_log(time_s, **(columns | kwargs))
