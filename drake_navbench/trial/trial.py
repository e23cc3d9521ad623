"""One trial: build the diagram, simulate it to its end, return the log."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
    SimulatorStatus,
)
from pydrake.systems.framework import Context, EventStatus

from drake_navbench.controller import Controller, ControllerSetup
from drake_navbench.costmaps.map_file import OccupancyMap
from drake_navbench.errors import InputError, one_line
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.grid import Costmap
from drake_navbench.log import COLUMNS, Outcome, TrialLog
from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.systems.recorder import Recording
from drake_navbench.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.diagram import TrialDiagram, build_trial_diagram
from drake_navbench.trial.planning import global_layers, known_map, make_plan
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses, TrialSpec
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S

Array = NDArray[np.float64]

# A fixed step without error control: drawing or logging more often must not move the numbers.
INTEGRATION = SimulatorConfig(
    integration_scheme="runge_kutta2", max_step_size=0.02, use_error_control=False
)
OUTCOME_OF_TASK = {
    TaskState.SUCCEEDED: Outcome.SUCCEEDED,
    TaskState.ABORTED: Outcome.ABORTED,
    TaskState.ERROR: Outcome.ERROR,
}
HAS_ENDED = SimulatorStatus.ReturnReason.kReachedTerminationCondition
DEFAULT_ROBOT = "wheelchair"


def run_trial(
    scenario: str | Scenario,
    controller: str | Preset,
    seed: int = 0,
    *,
    robot: str | Robot = DEFAULT_ROBOT,
    wants_diagnostics: bool = False,
) -> TrialLog:
    """Runs one trial and returns its log.

    scenario, controller, robot: names of built-in ones, paths of files (not for `controller`, which
    may be a variant such as 'rpp:lookahead_dist=0.9'), or loaded objects. A loaded robot is taken
    as it is: the scenario's robot_overrides do not change it. Raises InputError where one of them
    is wrong; a controller that breaks is an outcome, not an exception.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    preset = controller if isinstance(controller, Preset) else load_preset(controller)
    if isinstance(robot, str):
        robot = scenario.load_robot(robot)
    check_task(scenario, robot)
    return simulate(
        TrialSpec(
            scenario,
            robot,
            preset.for_robot(robot),
            seed=seed,
            wants_diagnostics=wants_diagnostics,
        )
    )


def simulate(
    spec: TrialSpec, *, meshcat: Meshcat | None = None, realtime_rate: float = 0.0
) -> TrialLog:
    """Runs the trial of a checked specification; realtime_rate 0 runs as fast as possible."""
    spec = replace(spec, robot=spec.preset.robot(spec.robot))
    controller = make_controller(spec.preset, spec.robot, wants_diagnostics=spec.wants_diagnostics)
    trial = build_trial_diagram(
        spec.robot,
        spec.scenario.true_world,
        controller,
        task=trial_task(spec),
        static_map=_static_map(spec),
        filter_masks=spec.scenario.filter_masks,
        meshcat=meshcat,
    )
    context = trial.create_context(spec.scenario.start_pose(spec.seed), spec.seed)
    simulator = Simulator(trial.diagram, context)
    ApplySimulatorConfig(INTEGRATION, simulator)
    simulator.set_target_realtime_rate(realtime_rate)
    simulator.set_monitor(_end_of_trial(trial, context))
    if simulator.Initialize().reason() != HAS_ENDED:
        simulator.AdvanceTo(spec.scenario.timeout_s)
    return _make_log(spec, trial, context)


def trial_task(spec: TrialSpec) -> FollowPlan | NavigateToPoses:
    """Returns what the robot is to do, in the scenario's navigation mode."""
    scenario, robot = spec.scenario, spec.robot
    if scenario.navigation_mode == "follow_path":
        return FollowPlan(partial(make_plan, scenario, robot))

    def plan(start: Array, goal: Array, costmap: Costmap) -> Array:
        return make_plan(scenario, robot, start, goal, costmap=costmap)

    return NavigateToPoses(
        goals=scenario.goals,
        make_plan=plan,
        global_layers=global_layers(scenario, robot),
        start_pose=scenario.start_pose(spec.seed),
    )


def _static_map(spec: TrialSpec) -> OccupancyMap | None:
    """Returns what a static layer of the local costmap shows, where there is one."""
    settings = spec.robot.navigation.local_costmap
    return known_map(spec.scenario, spec.robot) if settings.is_active("static_layer") else None


def make_controller(preset: Preset, robot: Robot, *, wants_diagnostics: bool = False) -> Controller:
    """Returns a column's controller; raises InputError where it cannot be built for the robot."""
    setup = controller_setup(robot, wants_diagnostics)
    try:
        return preset.controller_class(preset.parameters, setup)
    except InputError as error:
        raise InputError(f"{preset.source}: {error}") from error
    except (Exception, SystemExit) as error:
        # A plugin may break in any way; Drake reports a failed C++ check as SystemExit.
        raise InputError(f"{preset.source}: {one_line(error)}") from error


def controller_setup(robot: Robot, wants_diagnostics: bool = False) -> ControllerSetup:
    """Returns what a controller learns about the robot and its costmap when it is built."""
    inscribed, circumscribed = robot.radii
    costmap = robot.navigation.local_costmap
    return ControllerSetup(
        control_period_s=1.0 / robot.navigation.controller_server.controller_frequency,
        footprint=np.ascontiguousarray(robot.padded_outline),
        inscribed_radius_m=inscribed,
        circumscribed_radius_m=circumscribed,
        footprint_is_circle=robot.is_circle,
        max_linear_velocity_mps=robot.drive.max_linear_velocity_mps,
        max_angular_velocity_radps=robot.drive.max_angular_velocity_radps,
        costmap_resolution_m=costmap.resolution,
        costmap_size_m=float(max(costmap.width, costmap.height)),
        inflation_radius_m=costmap.inflation_layer.inflation_radius,
        inflation_cost_scaling_factor=costmap.inflation_layer.cost_scaling_factor,
        tracks_unknown_space=costmap.track_unknown_space,
        wants_diagnostics=wants_diagnostics,
    )


def _end_of_trial(
    trial: TrialDiagram, root_context: Context
) -> Callable[[Context], EventStatus | None]:
    """Returns the monitor that stops the simulation at contact or when the task is over."""
    distances_port = trial.clearance.GetOutputPort("distances")
    status_port = trial.navigator.GetOutputPort("task_status")
    # The simulator hands the same context to every call.
    clearance_context = trial.clearance.GetMyContextFromRoot(root_context)
    navigator_context = trial.navigator.GetMyContextFromRoot(root_context)

    def monitor(_: Context) -> EventStatus | None:
        if distances_port.Eval(clearance_context)[0] <= 0.0:
            return EventStatus.ReachedTermination(trial.diagram, "collided")
        status = status_port.Eval(navigator_context)
        if status.state.is_final:
            return EventStatus.ReachedTermination(trial.diagram, status.reason)
        return None

    return monitor


def _outcome(trial: TrialDiagram, context: Context) -> tuple[Outcome, TaskStatus]:
    """Returns how the trial ended, with the reason and the time."""
    now_s = context.get_time()
    distances = trial.clearance.GetOutputPort("distances").Eval(
        trial.clearance.GetMyContextFromRoot(context)
    )
    status = trial.navigator.GetOutputPort("task_status").Eval(
        trial.navigator.GetMyContextFromRoot(context)
    )
    if distances[0] <= 0.0:
        touched = TaskStatus(reason="the footprint touched an obstacle", time_s=now_s)
        return Outcome.COLLIDED, touched
    if status.state in OUTCOME_OF_TASK:
        return OUTCOME_OF_TASK[status.state], status
    return Outcome.TIMED_OUT, TaskStatus(reason=f"not finished after {now_s:g} s", time_s=now_s)


def failed_log(spec: TrialSpec, reason: str, traceback: str = "") -> TrialLog:
    """Returns the log of a trial that never came to an end of its own."""
    status = TaskStatus(TaskState.ERROR, reason=reason, traceback=traceback)
    return TrialLog(
        samples=_samples(Recording()),
        plan=np.empty((0, 3)),
        info=_info(spec, Outcome.ERROR, status),
    )


def _make_log(spec: TrialSpec, trial: TrialDiagram, context: Context) -> TrialLog:
    outcome, status = _outcome(trial, context)
    recorder_context = trial.recorder.GetMyContextFromRoot(context)
    recording = trial.recorder.find_recording(recorder_context)
    # The last cycle, or the navigator's last tick, may be too young for the recorder's clock.
    trial.recorder.record(recorder_context)
    info = _info(spec, outcome, status) | _filter_changes(trial, context)
    navigator_context = trial.navigator.GetMyContextFromRoot(context)
    if isinstance(trial.navigator, TreeNavigator):
        navigator = trial.navigator.GetOutputPort("navigator_state").Eval(navigator_context)
        info["legs"] = [leg.as_plain() for leg in navigator.progress.legs]
        plan = navigator.whole_route
    else:
        follow_path = trial.navigator.GetOutputPort("plan").Eval(navigator_context)
        plan = follow_path.poses if follow_path is not None else np.empty((0, 3))
    return TrialLog(
        samples=_samples(recording),
        plan=plan,
        info=info,
        scans=tuple(recording.scans),
        diagnostics=tuple(recording.diagnostics),
        events=tuple(recording.events),
    )


def _filter_changes(trial: TrialDiagram, context: Context) -> dict[str, Any]:
    """Returns what the filters of the scenario did: by name, every change with its time."""
    return {
        system.get_name(): system.GetOutputPort("filter_state")
        .Eval(system.GetMyContextFromRoot(context))
        .as_plain()
        for system in (trial.speed_filter, trial.binary_filter)
        if system is not None
    }


def _info(spec: TrialSpec, outcome: Outcome, status: TaskStatus) -> dict[str, Any]:
    return {
        "scenario": spec.scenario.model_dump(mode="json"),
        "obstacles": [
            obstacle.model_dump(mode="json") for obstacle in spec.scenario.true_world.shapes
        ],
        "robot": spec.robot.model_dump(mode="json"),
        "controller": spec.preset.name,
        "controller_plugin": spec.preset.controller,
        "parameters": spec.preset.parameters.model_dump(mode="json"),
        "seed": spec.seed,
        "trial": spec.trial,
        "outcome": str(outcome),
        "reason": status.reason,
        "error_code": status.error_code,
        "details": json.loads(json.dumps(status.details or {}, default=str)),
        "traceback": status.traceback,
        # A trial may end before its first control cycle.
        "start_time_s": min(CONTROLLER_OFFSET_S, status.time_s),
        "end_time_s": status.time_s,
    }


def _samples(recording: Recording) -> pd.DataFrame:
    table = recording.table()
    columns: dict[str, Any] = dict(zip(COLUMNS, table.T, strict=True))
    columns["cycle_count"] = columns["cycle_count"].astype(np.int64)
    return pd.DataFrame(columns)
