"""The global plans in a replay: each leg's first plan always, or each plan while in force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Rgba

from drake_navbench.analysis.replay.flat_meshes import dashes
from drake_navbench.analysis.replay.stage import Stage, frame_of, spaced_in_time
from drake_navbench.kernels.path_geometry import path_length
from drake_navbench.logs.plans import Plan

PLAN_PATH = "/plan"
PLAN_COLOR = Rgba(0.15, 0.16, 0.20, 1.0)
PLAN_HEIGHT_M = 0.025
PLAN_WIDTH_M = 0.03
PLAN_DASH_M = 0.15
# The most dashes of all plans (0.1 kB of the page each); if there would be more, all become longer.
MAX_DASHES = 5_000


def add_course(stage: Stage, plans: Sequence[Plan]) -> None:
    """Draws plans that stay visible at all times."""
    for plan in plans:
        _draw(stage, f"{PLAN_PATH}/{plan.leg}", plan, PLAN_DASH_M)


def add_plans_in_force(stage: Stage, plans: Sequence[Plan], period_s: float) -> None:
    """Shows each plan until the next one; of the plans in one period only the first is shown."""
    in_turn = spaced_in_time(((plan.time_s, plan) for plan in plans), period_s)
    length_m = sum(path_length(plan.poses) for _, plan in in_turn)
    dash_m = max(PLAN_DASH_M, 0.5 * length_m / MAX_DASHES)
    shown: list[tuple[float, str | None]] = []
    for time_s, plan in in_turn:
        path = f"{PLAN_PATH}/{frame_of(time_s)}"
        shown.append((time_s, path if _draw(stage, path, plan, dash_m) else None))
    stage.take_turns(shown)


def draw_plan(stage: Stage, path: str, poses: NDArray[np.float64]) -> bool:
    """Draws a plan's poses (N, 3) as a dashed line in place of the line drawn before."""
    return _draw(stage, path, Plan(0.0, poses), PLAN_DASH_M)


def _draw(stage: Stage, path: str, plan: Plan, dash_m: float) -> bool:
    """Draws a plan as a dashed line; returns False, drawing nothing, if it has no length."""
    if len(plan.poses) < 2:
        return False
    line = dashes(plan.poses[:, :2], dash_m=dash_m, width_m=PLAN_WIDTH_M, height_m=PLAN_HEIGHT_M)
    return stage.flat_mesh(path, line, PLAN_COLOR)
