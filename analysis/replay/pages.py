"""The two kinds of replay: all controllers of a scenario in one scene, and one trial alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from pydrake.geometry import Rgba

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.mission import goals
from drake_navbench.analysis.replay import intentions
from drake_navbench.analysis.replay.actors import (
    Pace,
    add_driven_path,
    add_robot,
    add_scans,
    base_motion,
)
from drake_navbench.analysis.replay.costmaps import COSTMAP_COLOR, add_costmaps
from drake_navbench.analysis.replay.global_plans import (
    PLAN_COLOR,
    PLAN_PATH,
    add_course,
    add_plans_in_force,
)
from drake_navbench.analysis.replay.page import LegendRow, assemble
from drake_navbench.analysis.replay.robot_model import RobotModel, load_model
from drake_navbench.analysis.replay.scene import (
    COURSE_MARGIN_M,
    Bounds,
    add_scene,
    add_task,
)
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.inputs.world import Obstacle, World
from drake_navbench.log import Outcome, TrialLog
from drake_navbench.plans import Plan

Array = NDArray[np.float64]

RACE_TURN_PERIOD_S, RACE_MAX_TURNS = 0.5, 400
# A trial alone has room for more, but its controller's intentions need room too.
TRIAL_TURN_PERIOD_S, TRIAL_MAX_TURNS = 0.2, 200
LAYER_COLOR = "#8a94a3"


def write_race_replay(logs: Sequence[TrialLog], path: Path, *, model: Path | None) -> None:
    """Writes a page in which trials of one scenario drive side by side, one colour a controller.

    logs: of different controllers, with at least one sample each. model: the robot's SDF file, or
    None to draw a prism over its outline. Equal logs give equal bytes.
    """
    stage = Stage()
    robot_model = load_model(model, outline_of(logs[0]))
    pace = Pace.fitting(
        [log.samples["time_s"].iloc[-1] for log in logs],
        robot_model,
        turn_period_s=RACE_TURN_PERIOD_S,
        max_turns=RACE_MAX_TURNS,
    )
    # Of one that planned all its legs, where there is one.
    course = max(logs, key=lambda log: len(log.first_plans)).first_plans
    _add_surroundings(stage, logs, course)
    add_course(stage, course)
    rows = [
        _add_trial(stage, log, robot_model, pace=pace, layer=layer)
        for layer, log in enumerate(logs)
    ]
    names = [row.name for row in rows]
    scans = [_scan_path(name) for name in names]
    layers = [_plan_row(), LegendRow("lidar hits", LAYER_COLOR, scans)]
    page = assemble(
        stage.html(),
        title=logs[0].info["scenario"]["name"],
        subtitle=logs[0].info["scenario"]["description"],
        sections=[rows, layers],
    )
    path.write_text(page, encoding="utf-8")


def write_trial_replay(log: TrialLog, path: Path, *, model: Path | None) -> None:
    """Writes a page with one trial and what its controller had in mind.

    The log needs at least one sample. model: as for `write_race_replay`.
    """
    scenario = log.info["scenario"]
    stage = Stage()
    robot_model = load_model(model, outline_of(log))
    pace = Pace.fitting(
        [log.samples["time_s"].iloc[-1]],
        robot_model,
        turn_period_s=TRIAL_TURN_PERIOD_S,
        max_turns=TRIAL_MAX_TURNS,
    )
    _add_surroundings(stage, [log], log.first_plans)
    add_plans_in_force(stage, log.plans, pace.turn_period_s)
    row = _add_trial(stage, log, robot_model, pace=pace)
    layers = [
        LegendRow("robot", row.color, [_robot_path(row.name)]),
        LegendRow("driven path", row.color, [_driven_path(row.name)]),
        _plan_row(),
        LegendRow("lidar hits", LAYER_COLOR, [_scan_path(row.name)]),
        *_costmap_rows(stage, log, pace),
        *_intention_rows(stage, log, pace),
    ]
    page = assemble(
        stage.html(),
        title=f"{scenario['name']}: {row.name}",
        subtitle=f"{scenario['description']}; trial {log.info['trial']}, seed {log.info['seed']}",
        sections=[[row], layers],
    )
    path.write_text(page, encoding="utf-8")


def _world(log: TrialLog) -> World:
    """Returns everything that stood in the trial's world, walls of a map included."""
    return World(tuple(TypeAdapter(list[Obstacle]).validate_python(log.info["obstacles"])))


def _add_surroundings(
    stage: Stage,
    logs: Sequence[TrialLog],
    plans: Sequence[Plan],
) -> None:
    start = np.array(logs[0].info["scenario"]["start"], dtype=float)
    driven = [log.samples[["x_m", "y_m"]].to_numpy() for log in logs]
    ends = np.vstack([start, goals(logs[0])])[:, :2]
    points = np.vstack([*driven, *(plan.poses[:, :2] for plan in plans), ends])
    reach_m = np.hypot(*outline_of(logs[0]).T).max()
    course = Bounds.around(points, reach_m + COURSE_MARGIN_M)
    add_scene(stage, _world(logs[0]), course=course)
    add_task(stage, start, goals(logs[0]), _goal_tolerance_m(logs[0]))


def _goal_tolerance_m(log: TrialLog) -> float | None:
    """Returns how near to a goal is near enough; None where the goal checker has no such radius."""
    checker = log.info["robot"]["navigation"]["goal_checker"]
    return checker.get("xy_goal_tolerance", checker.get("coarse_xy_goal_tolerance"))


def _add_trial(
    stage: Stage,
    log: TrialLog,
    model: RobotModel,
    *,
    pace: Pace,
    layer: int = 0,
) -> LegendRow:
    """Draws robot, path and hits of a trial below one path; returns its row in the legend."""
    name = log.info["controller"]
    color = controller_color(name)
    rgba = _rgba(color)
    motion = base_motion(log)
    add_robot(
        stage,
        _robot_path(name),
        model,
        motion,
        outline=outline_of(log),
        rgba=rgba,
        pose_stride=pace.pose_stride,
        layer=layer,
    )
    add_driven_path(stage, _driven_path(name), motion, rgba=rgba, layer=layer)
    add_scans(stage, _scan_path(name), log.scans, rgba=rgba, period_s=pace.turn_period_s)
    is_failure = log.outcome is not Outcome.SUCCEEDED
    detail = f"{log.outcome.replace('_', ' ')}, {log.end_time_s:.1f} s"
    if is_failure and log.info.get("reason"):
        detail += f": {log.info['reason']}"
    return LegendRow(name, color, [_group(name)], detail, is_failure)


def _costmap_rows(stage: Stage, log: TrialLog, pace: Pace) -> list[LegendRow]:
    """Draws the local costmap; returns its row, or none where the log keeps no costmaps."""
    path = "/local_costmap"
    is_drawn = add_costmaps(stage, path, log, pace.turn_period_s)
    return [LegendRow("local costmap", _css(COSTMAP_COLOR), [path])] if is_drawn else []


def _intention_rows(stage: Stage, log: TrialLog, pace: Pace) -> list[LegendRow]:
    """Draws what the diagnostics hold; returns a row for each kind that there is."""
    kinds: list[tuple[str, Any, Rgba]] = [
        ("prediction", intentions.add_prediction, intentions.PREDICTED_COLOR),
        ("samples", intentions.add_samples, intentions.SAMPLE_COLORS[0]),
        ("carrot", intentions.add_carrot, intentions.CARROT_COLOR),
    ]
    return [
        LegendRow(name, _css(rgba), [f"/{name}"])
        for name, add, rgba in kinds
        if add(stage, f"/{name}", log.diagnostics, pace.turn_period_s)
    ]


def _plan_row() -> LegendRow:
    return LegendRow("global plan", _css(PLAN_COLOR), [PLAN_PATH])


def _group(controller: str) -> str:
    """Returns the Meshcat path of a controller; a slash would start another level."""
    return f"/controllers/{controller.replace('/', '_')}"


def _robot_path(controller: str) -> str:
    return f"{_group(controller)}/robot"


def _driven_path(controller: str) -> str:
    return f"{_group(controller)}/path"


def _scan_path(controller: str) -> str:
    return f"{_group(controller)}/scan"


def _rgba(color: str) -> Rgba:
    return Rgba(*(channel / 255 for channel in bytes.fromhex(color.removeprefix("#"))))


def _css(rgba: Rgba) -> str:
    channels = (rgba.r(), rgba.g(), rgba.b())
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in channels)
