"""The layers of a page beside the robots, each drawn with its rows in the legend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydrake.geometry import Rgba

from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.replay import intentions
from drake_navbench.analysis.replay.actors import Pace
from drake_navbench.analysis.replay.costmaps import (
    COSTMAP_COLOR,
    MAX_COSTMAP_TURNS,
    add_costmaps,
)
from drake_navbench.analysis.replay.global_plans import PLAN_COLOR, PLAN_PATH
from drake_navbench.analysis.replay.moving_shapes import add_moving
from drake_navbench.analysis.replay.odometry_frame import cycles_in_world
from drake_navbench.analysis.replay.page import LegendRow
from drake_navbench.analysis.replay.paths import LAYER_COLOR, MOVING_PATH, RobotPaths, css_color
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.inputs.world_geometry import MOVING_COLOR
from drake_navbench.logs.log import TrialLog


def moving_rows(stage: Stage, logs: Sequence[TrialLog], pace: Pace) -> list[LegendRow]:
    """Draws the moving obstacles, which move alike in all trials, and the people.

    Returns the legend's rows: one for moving obstacles and one for people, if there are any.
    """
    end_time_s = max(log.samples["time_s"].iloc[-1] for log in logs)
    movers = movers_of(logs[0])
    is_drawn = add_moving(stage, movers, end_time_s=end_time_s, pose_stride=pace.pose_stride)
    rows = []
    if is_drawn:
        color = css_color(Rgba(*MOVING_COLOR))
        rows.append(LegendRow("moving obstacles", color, [MOVING_PATH]))
    if any(log.people is not None for log in logs):
        paths = [RobotPaths(log.info["controller"]).people for log in logs]
        if len(logs) == 1:
            rows.append(LegendRow("people", LAYER_COLOR, paths))
        else:
            # Shown all at once, they would be as many crowds as there are robots.
            detail = "each trial has its own"
            rows.append(
                LegendRow("people of the chosen one", LAYER_COLOR, paths, detail, is_of_chosen=True)
            )
    return rows


def costmap_rows(
    stage: Stage,
    logs: Sequence[TrialLog],
    pace: Pace,
    *,
    max_turns: int = MAX_COSTMAP_TURNS,
) -> list[LegendRow]:
    """Draws the local costmaps; the page shows the chosen robot's. Returns their legend's row.

    Returns no row where no log has costmaps.
    """
    paths = [RobotPaths(log.info["controller"]).costmap for log in logs]
    is_drawn = [
        add_costmaps(stage, path, log, pace.turn_period_s, max_turns=max_turns)
        for log, path in zip(logs, paths, strict=True)
    ]
    name = "local costmap" if len(logs) == 1 else "local costmap of the chosen one"
    row = LegendRow(name, css_color(COSTMAP_COLOR), paths, is_of_chosen=True)
    return [row] if any(is_drawn) else []


def intention_rows(stage: Stage, log: TrialLog, pace: Pace) -> list[LegendRow]:
    """Draws the trajectories in a log's diagnostics; returns a legend row for each kind in it."""
    kinds: list[tuple[str, Any, Rgba]] = [
        ("prediction", intentions.add_prediction, intentions.PREDICTED_COLOR),
        ("stop plan", intentions.add_stop, intentions.STOP_COLOR),
        ("groups", intentions.add_groups, intentions.GROUP_COLOR),
        ("samples", intentions.add_samples, intentions.SAMPLE_COLORS[0]),
        ("carrot", intentions.add_carrot, intentions.CARROT_COLOR),
    ]
    cycles = cycles_in_world(log)
    return [
        LegendRow(name, css_color(rgba), [path])
        for name, add, rgba in kinds
        if add(stage, path := f"/{name.replace(' ', '_')}", cycles, pace.turn_period_s)
    ]


def plan_row() -> LegendRow:
    """Returns the legend's row of the plans that `global_plans` draws."""
    return LegendRow("global plan", css_color(PLAN_COLOR), [PLAN_PATH])
