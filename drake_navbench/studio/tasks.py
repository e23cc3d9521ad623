"""The tasks of a studio's workers: everything that needs Drake, planners or parameter models."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.replay.reasons import shown_reasons
from drake_navbench.analysis.tables import PRINTED
from drake_navbench.analysis.trial_rows import trial_row
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.logged_trial import logged_trial, trial_of_log
from drake_navbench.errors import InputError, NavbenchError
from drake_navbench.inputs.controller_file import names_file
from drake_navbench.inputs.gazebo_world import load_gazebo_world, scenario_in_world
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot, body_top_m, load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import TrialLog
from drake_navbench.nav2.whole_files import (
    FileColumns,
    WholeFile,
    columns_of_files,
    require_columns,
)
from drake_navbench.studio.messages import (
    SERVER,
    Checked,
    Column,
    DrawnScenario,
    Driven,
    Ground,
    MetricOf,
)
from drake_navbench.studio.moments import CostmapFrame, Reasons, Watched
from drake_navbench.studio.parameter_fields import ParameterField, fields_of, node_fields
from drake_navbench.trial.planning import make_plan
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.trial.why import require_explainable, whole_why
from drake_navbench.typed_files.output_file import write_whole

WARM_SCENARIO = "doorway"
# The metrics beside those of the tables that the terminal prints.
MORE_METRICS = ("duration_s", "driven_length_m", "mean_speed_mps", "min_clearance_m")
# Columns of the log that the table of a moment shows, with their names there.
SHOWN = {
    "v_mps": "speed [m/s]",
    "w_radps": "turn rate [rad/s]",
    "command_v_mps": "commanded speed [m/s]",
    "command_w_radps": "commanded turn rate [rad/s]",
    "clearance_m": "clearance [m]",
    "compute_time_ms": "compute time [ms]",
}
# A larger map is drawn with fewer cells.
MAX_GROUND_CELLS = 1500


def warm(column: str) -> list[MetricOf]:
    """Drives a column once, so that its kernels are loaded; returns the metrics that are shown."""
    trial_row(simulate(plan_campaign([WARM_SCENARIO], [column], trials=1).specs[0]))
    names = list(dict.fromkeys([*PRINTED, *MORE_METRICS]))
    entries = {entry.name: entry for entry in all_metrics()}
    return [
        MetricOf(name, entries[name].title, entries[name].unit, str(entries[name].better))
        for name in names
        if name in entries
    ]


def check_drawing(drawn: DrawnScenario, robot: str) -> Checked:
    """Returns the faults of a drawing, in the words of the loader, and its plans."""
    try:
        scenario = drawn.scenario()
        loaded = scenario.load_robot(robot)
        check_task(scenario, loaded)
    except InputError as error:
        return Checked((str(error),))
    plans, faults = [], []
    start = np.array(scenario.start, dtype=float)
    for goal in () if scenario.floors else scenario.goals:
        end = np.array(goal, dtype=float)
        try:
            plan = make_plan(scenario, loaded, start, end)
        except NavbenchError as error:
            faults.append(f"scenario {scenario.name}: no way to {list(goal[:2])}: {error}")
        else:
            plans.append(plan[:, :2])
            faults += _narrow(scenario, loaded, plan)
        start = end
    return Checked(tuple(faults), tuple(plans), loaded.outline)


def _narrow(scenario: Scenario, robot: Robot, plan: Array) -> list[str]:
    """Returns a line where the footprint touches an obstacle on its way along the plan."""
    world = scenario.true_world
    footprints = [shapely.Polygon(place_outline(robot.outline, pose)) for pose in plan]
    for pose, body in zip(plan, footprints, strict=True):
        if world.intersects(body):
            x, y = round(float(pose[0]), 2), round(float(pose[1]), 2)
            return [
                f"scenario {scenario.name}: the plan leads through a gap at [{x:g}, {y:g}] that "
                "the robot's footprint does not fit through; expected a wider door"
            ]
    return []


def columns_in(file: str, text: str, robot: str) -> list[str]:
    """Returns the names of the controllers in a Nav2 file; raises InputError."""
    return list(_columns(file, text, robot).plugins)


def column_fields(column: Column, robot: str) -> list[ParameterField]:
    """Returns the fields of a column's parameters, and of its file's costmaps and servers."""
    if not column.file:
        return fields_of(_preset_and_robot(column, robot)[0])
    columns = _columns(column.file, column.patched_text, robot)
    return [*fields_of(_plugin_of(columns, column)), *node_fields(columns.setup)]


def drive_column(drawn: DrawnScenario, column: Column, robot: str, log: str) -> Driven:
    """Drives the trial that `run` with `--trials 1` would drive of these files; writes its log."""
    began_s = time.perf_counter()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        spec = spec_of(drawn, column, robot)
        ended = simulate(spec)
    write_whole(Path(log), ended.write)
    row = trial_row(ended)
    samples = ended.samples
    return Driven(
        spec.preset.name,
        str(ended.outcome),
        str(ended.info["reason"]),
        samples["time_s"].to_numpy(dtype=float),
        samples[["x_m", "y_m", "yaw_rad"]].to_numpy(dtype=float),
        samples[["v_mps", "w_radps"]].to_numpy(dtype=float),
        ended.course[:, :2],
        spec.preset.robot(spec.robot).outline,
        {name: float(v) for name, v in row.items() if isinstance(v, int | float)},
        log,
        time.perf_counter() - began_s,
        (drawn, column, robot),
        tuple(dict.fromkeys(str(one.message) for one in told)),
    )


def read_watched(path: str) -> Watched:
    """Returns the trial of a log; raises InputError."""
    log = TrialLog.read(Path(path))
    samples = log.samples
    poses = samples[["x_m", "y_m", "yaw_rad"]].to_numpy(dtype=float)
    is_drifting = "odometry_x_m" in samples
    odometry = samples[["odometry_x_m", "odometry_y_m"]].to_numpy(float) if is_drifting else poses
    info = log.info
    outline = np.asarray(Robot.model_validate(dict(info["robot"])).outline, dtype=float)
    name = f"{info['scenario']['name']}, {info['controller']}, trial {info['trial']}"
    return Watched(
        f"{name}: {log.outcome}, {info['reason']}",
        {**info["scenario"], "world": {"obstacles": list(log.obstacles)}},
        outline,
        samples["time_s"].to_numpy(dtype=float),
        poses,
        {shown: samples[c].to_numpy(dtype=float) for c, shown in SHOWN.items() if c in samples},
        log.course[:, :2],
        tuple(
            CostmapFrame(c.stamp_s, c.origin_x, c.origin_y, c.resolution, np.asarray(c.costs))
            for c in log.costmaps
        ),
        log.diagnostics,
        poses[:, :2] - odometry[:, :2],
        is_drifting,
    )


def reasons_of(path: str, drawn: tuple[DrawnScenario, Column, str] | None) -> Reasons:
    """Returns the reasons of every decision of a logged trial, and the diagnostics of its cycles.

    drawn: the drawn scenario of a trial of the studio; None for a log in a results folder. Raises
    InputError where the controller cannot tell, or the trial cannot be driven again.
    """
    log = TrialLog.read(Path(path))
    require_explainable(log)
    spec = logged_trial(log, Path(path)) if drawn is None else trial_of_log(spec_of(*drawn), log)
    found = whole_why(spec, log)
    return Reasons(tuple(shown_reasons(found.decisions)), found.diagnostics)


def spec_of(drawn: DrawnScenario, column: Column, robot: str) -> TrialSpec:
    """Returns the specification of the first trial that `run` would drive; raises InputError."""
    preset, own = _preset_and_robot(column, robot)
    return plan_campaign([drawn.scenario()], [preset], trials=1, robot=own).specs[0]


def _preset_and_robot(column: Column, robot: str) -> tuple[Preset, str | Robot]:
    from drake_navbench.inputs.presets import load_preset

    if not column.file:
        if names_file(column.name):
            raise InputError(f"controller {column.name}: expected the name of a preset")
        return load_preset(column.argument), robot
    columns = _columns(column.file, column.patched_text, robot)
    return _plugin_of(columns, column), columns.setup.robot


def _plugin_of(columns: FileColumns, column: Column) -> Preset:
    if column.name not in columns.plugins:
        raise InputError(f"{column.file}: {SERVER}: has no controller {column.name} any more")
    return columns.plugins[column.name]


def _columns(file: str, text: str, robot: str) -> FileColumns:
    whole = WholeFile("", (Path(file),), {Path(file): text})
    (columns,) = require_columns(columns_of_files([whole], robot, base=load_robot(robot)))
    if not columns.presets:
        raise InputError(f"{file}: no {SERVER} with controller_plugins")
    return columns


def begin_again(old: Path, new: Path) -> Path:
    """Makes a results folder for another one's request, with inputs as they are now; returns it."""
    from drake_navbench.campaign.manifest import Begun, begin
    from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
    from drake_navbench.processes.machine import available_cores
    from drake_navbench.typed_files.typed_yaml import validate

    folder = ResultsFolder(old)
    begun = validate(Begun, folder.read_manifest(), str(folder.manifest_path))
    campaign = begun.request.campaign()
    require_writable(new)
    with only_run_in(new):
        begin(ResultsFolder(new), campaign, begun.request, available_cores())
    return new


def open_scenario(drawn: DrawnScenario) -> Ground | None:
    """Returns the map of a scenario, None without one; raises InputError as the loader does."""
    grid = drawn.scenario().places[0].map
    if grid is None:
        return None
    skip = max(1, -(-max(grid.occupancy.shape) // MAX_GROUND_CELLS))
    is_occupied, is_unknown = (
        cells[::skip, ::skip] for cells in (grid.is_occupied, grid.is_unknown)
    )
    image = np.zeros(is_occupied.shape, dtype=np.uint32)
    # Red, green, blue and alpha from the lowest byte on.
    image[is_occupied] = 0xFF7D7064
    image[is_unknown] = 0x2E7D7064
    return Ground(image, grid.bounds)


def scenario_of_world(path: Path, robot: str) -> dict[str, Any]:
    """Returns the content of a scenario in a Gazebo world, from its middle; raises InputError."""
    loaded = load_robot(robot)
    world = load_gazebo_world(path, lidar_m=loaded.lidar.height_m, top_m=body_top_m(loaded))
    scenario = scenario_in_world(world, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), name=path.stem)
    data = scenario.model_dump(mode="json", exclude_unset=True)
    data.pop("name", None)
    return {name: value for name, value in data.items() if value is not None}
