"""The two kinds of replay: all controllers of a scenario in one scene, and one trial alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.mission import goals, leads_through_poses
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.analysis.metrics.signals import stretches
from drake_navbench.analysis.replay.actors import (
    Pace,
    add_driven_path,
    add_robot,
    add_scans,
    base_motion,
)
from drake_navbench.analysis.replay.global_plans import (
    add_course,
    add_plans_in_force,
)
from drake_navbench.analysis.replay.layers import (
    costmap_rows,
    intention_rows,
    moving_rows,
    plan_row,
)
from drake_navbench.analysis.replay.page import LegendRow, assemble
from drake_navbench.analysis.replay.paths import (
    LAYER_COLOR,
    RobotPaths,
    rgba_of,
)
from drake_navbench.analysis.replay.people import add_people
from drake_navbench.analysis.replay.reasons import Decision, shown_reasons
from drake_navbench.analysis.replay.robot_model import RobotModel, load_model
from drake_navbench.analysis.replay.scene import (
    CAMERA_ASPECT,
    COURSE_MARGIN_M,
    Bounds,
    add_scene,
    add_task,
    goal_tolerance_m,
)
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.analysis.replay.strip import compute_top_ms, strip_of
from drake_navbench.inputs.world import Obstacle, World
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.plans import Plan

Reasons = Mapping[str, Sequence[Decision]]

RACE_TURN_PERIOD_S, RACE_MAX_TURNS = 0.5, 400
# A trial alone leaves more room in the page, but the controller's intentions need some of it.
TRIAL_TURN_PERIOD_S, TRIAL_MAX_TURNS = 0.2, 200
# The most costmaps of all controllers together; each takes about 5 kB of the page.
RACE_MAX_COSTMAPS = 160
# The label lies beyond the floor, so that it covers nothing.
FLOOR_LABEL_ABOVE_M = 1.0


def write_race_replay(
    logs: Sequence[TrialLog],
    path: Path,
    *,
    model: Path | None,
    columns: Sequence[str] = (),
    reasons: Reasons | None = None,
) -> None:
    """Writes a page in which trials of one scenario drive side by side, one colour a controller.

    logs: logs of different controllers, with at least one sample each. model: the robot's SDF file,
    or None to draw a prism over its outline. columns: all columns of the results, so that each
    keeps its colour on every page. reasons: the reasons of each column's decisions, shown at their
    times. Equal input gives equal bytes.
    """
    columns = [*columns, *(log.info["controller"] for log in logs)]
    stage = Stage()
    robot_model = load_model(model, outline_of(logs[0]), _caster_angles(logs[0]))
    pace = Pace.fitting(
        [log.samples["time_s"].iloc[-1] for log in logs],
        robot_model,
        turn_period_s=RACE_TURN_PERIOD_S,
        max_turns=RACE_MAX_TURNS,
    )
    # Show the plans of a trial that planned all its legs, if there is one.
    course = max(logs, key=lambda log: len(log.first_plans)).first_plans
    bounds = _add_surroundings(stage, logs, course)
    add_course(stage, course)
    rows = [
        _add_trial(
            stage,
            log,
            robot_model,
            pace=pace,
            columns=columns,
            layer=layer,
            trial_count=len(logs),
        )
        for layer, log in enumerate(logs)
    ]
    names = [row.name for row in rows]
    scans = [RobotPaths(name).scan for name in names]
    layers = [
        plan_row(),
        LegendRow("lidar hits", LAYER_COLOR, scans),
        *moving_rows(stage, logs, pace),
        *costmap_rows(stage, logs, pace, max_turns=RACE_MAX_COSTMAPS // len(logs)),
    ]
    page = assemble(
        stage.html(),
        title=logs[0].info["scenario"]["name"],
        subtitle=logs[0].info["scenario"]["description"],
        sections=[rows, layers],
        notes=_notes(logs, layers, is_race=True, has_reasons=bool(reasons)),
        data=_page_data(logs, bounds, columns, reasons or {}),
    )
    path.write_text(page, encoding="utf-8")


def _caster_angles(log: TrialLog) -> list[float] | None:
    """Returns the angles of the robot's casters at the start, rad; None where unknown."""
    casters = log.info["robot"].get("drive", {}).get("casters") or {}
    angles: list[float] | None = casters.get("start_angles_rad")
    return angles


def write_trial_replay(
    log: TrialLog,
    path: Path,
    *,
    model: Path | None,
    columns: Sequence[str] = (),
    reasons: Reasons | None = None,
) -> None:
    """Writes a page with one trial and its controller's predictions and samples.

    The log needs at least one sample. model, columns, reasons: as for `write_race_replay`.
    """
    scenario = log.info["scenario"]
    stage = Stage()
    robot_model = load_model(model, outline_of(log), _caster_angles(log))
    pace = Pace.fitting(
        [log.samples["time_s"].iloc[-1]],
        robot_model,
        turn_period_s=TRIAL_TURN_PERIOD_S,
        max_turns=TRIAL_MAX_TURNS,
    )
    bounds = _add_surroundings(stage, [log], log.first_plans)
    add_plans_in_force(stage, log.plans, pace.turn_period_s)
    row = _add_trial(stage, log, robot_model, pace=pace, columns=columns)
    layers = [
        LegendRow("robot", row.color, [RobotPaths(row.name).robot]),
        LegendRow("driven path", row.color, [RobotPaths(row.name).driven]),
        plan_row(),
        LegendRow("lidar hits", LAYER_COLOR, [RobotPaths(row.name).scan]),
        *moving_rows(stage, [log], pace),
        *costmap_rows(stage, [log], pace),
        *intention_rows(stage, log, pace),
    ]
    page = assemble(
        stage.html(),
        title=f"{scenario['name']}: {row.name}",
        subtitle=f"{scenario['description']}; trial {log.info['trial']}, seed {log.info['seed']}",
        sections=[[row], layers],
        notes=_notes([log], layers, is_race=False, has_reasons=bool(reasons)),
        data=_page_data([log], bounds, columns, reasons or {}),
    )
    path.write_text(page, encoding="utf-8")


def _world(log: TrialLog) -> World:
    """Returns everything that was in the trial's world, with the walls of a map."""
    standing = TypeAdapter(list[Obstacle]).validate_python(log.info["obstacles"])
    return World(tuple(standing), moving=movers_of(log).things)


def _add_surroundings(
    stage: Stage,
    logs: Sequence[TrialLog],
    plans: Sequence[Plan],
) -> Bounds:
    """Draws the world, the start and the goals; returns the bounds of task and driven paths."""
    start = np.array(logs[0].info["scenario"]["start"], dtype=float)
    driven = [log.samples[["x_m", "y_m"]].to_numpy() for log in logs]
    ends = np.vstack([start, goals(logs[0])])[:, :2]
    points = np.vstack([*driven, *(plan.poses[:, :2] for plan in plans), ends])
    reach_m = np.hypot(*outline_of(logs[0]).T).max()
    course = Bounds.around(points, reach_m + COURSE_MARGIN_M)
    add_scene(stage, _world(logs[0]), course=course)
    checker = logs[0].info["robot"]["navigation"]["goal_checker"]
    add_task(
        stage,
        start,
        goals(logs[0]),
        goal_tolerance_m(checker),
        is_through_poses=leads_through_poses(logs[0]),
    )
    return course


def _page_data(
    logs: Sequence[TrialLog], course: Bounds, columns: Sequence[str], reasons: Reasons
) -> dict[str, Any]:
    """Returns the robots' data for the page's own script, in the order of the legend."""
    robots = []
    for log in logs:
        name = log.info["controller"]
        paths = {"group": RobotPaths(name).group, "robot": RobotPaths(name).robot}
        robots.append(
            {
                "name": name,
                "color": controller_color(name, columns),
                **paths,
                **strip_of(log),
                "reasons": shown_reasons(reasons.get(name, ())),
            }
        )
    x, y = zip(course.low.tolist(), course.high.tolist(), strict=True)
    return {
        "bounds": [*x, *y],
        "aspect": CAMERA_ASPECT,
        "robots": robots,
        "compute_top_ms": compute_top_ms([robot["compute"] for robot in robots]),
        "floors": _floor_labels(logs[0]),
    }


def _add_trial(
    stage: Stage,
    log: TrialLog,
    model: RobotModel,
    *,
    pace: Pace,
    columns: Sequence[str],
    layer: int = 0,
    trial_count: int = 1,
) -> LegendRow:
    """Draws robot, path and hits of a trial below one path; returns its row in the legend."""
    name = log.info["controller"]
    color = controller_color(name, columns)
    rgba = rgba_of(color)
    motion = base_motion(log)
    add_robot(
        stage,
        RobotPaths(name).robot,
        model,
        motion,
        outline=outline_of(log),
        rgba=rgba,
        pose_stride=pace.pose_stride,
        layer=layer,
    )
    add_driven_path(stage, RobotPaths(name).driven, stretches(log), rgba=rgba, layer=layer)
    add_people(stage, RobotPaths(name).people, log, rgba=rgba, trial_count=trial_count)
    add_scans(stage, RobotPaths(name).scan, log.scans, rgba=rgba, period_s=pace.turn_period_s)
    is_failure = log.outcome is not Outcome.SUCCEEDED
    detail = f"{log.outcome.replace('_', ' ')}, {log.end_time_s:.1f} s"
    if is_failure and log.info.get("reason"):
        detail += f": {log.info['reason']}"
    return LegendRow(name, color, [RobotPaths(name).group], detail, is_failure, robot=layer)


def _notes(
    logs: Sequence[TrialLog], layers: Sequence[LegendRow], *, is_race: bool, has_reasons: bool
) -> list[str]:
    """Returns notes that say which option adds each layer that the page lacks."""
    paths = {path for row in layers for path in row.paths}
    notes = []
    if not any(RobotPaths(log.info["controller"]).costmap in paths for log in logs):
        notes.append("No local costmaps in these logs: run without --no-costmaps.")
    if not has_reasons and not logs[0].is_recording:
        # The page escapes the notes. They say LOG because the log may lie anywhere.
        notes.append(
            "Why it decided so: drake-navbench why LOG --at SECONDS, or of every decision on this "
            "page: drake-navbench replay LOG --why."
        )
    if is_race:
        notes.append(
            "What a controller has in mind (prediction, samples, carrot) has a page for each "
            "trial: run with --replay each."
        )
    elif not any(log.diagnostics and _has_arrays(log) for log in logs):
        notes.append(
            "What the controller had in mind (prediction, samples, carrot) is not in this log: "
            "run with --replay each."
        )
    return notes


def _has_arrays(log: TrialLog) -> bool:
    """Returns whether the log contains a controller's arrays."""
    return any(np.ndim(value) > 0 for _, notes in log.diagnostics for value in notes.values())


def _floor_labels(log: TrialLog) -> list[dict[str, Any]]:
    """Returns the names of a mission's floors, with the place of each label, m."""
    labels = []
    for floor in log.info.get("floors", ()):
        low_x, _, high_x, high_y = floor["bounds_m"]
        labels.append(
            {
                "name": floor["name"],
                "x": round(0.5 * (low_x + high_x), 2),
                "y": round(high_y + FLOOR_LABEL_ABOVE_M, 2),
            }
        )
    return labels
