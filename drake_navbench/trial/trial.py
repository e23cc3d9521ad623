"""One trial: build the diagram, simulate it to its end, return the log."""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
    SimulatorStatus,
)
from pydrake.systems.framework import Context, EventStatus

from drake_navbench.controller import Controller
from drake_navbench.errors import InputError, NavbenchError, is_machine_fault, one_line
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.logs.log import TrialLog
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.task import TaskStatus
from drake_navbench.processes.tasks import Died, Failure, Task, TimedOut
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import run_tasks, start_server
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.contact_watch import Contact, ContactWatch
from drake_navbench.trial.diagram import Observers, TrialDiagram, TrialMaps, build_trial_diagram
from drake_navbench.trial.floors import trial_floors
from drake_navbench.trial.planning import global_layers, known_map, make_plan
from drake_navbench.trial.plugin_check import check_plugins, check_running_stack
from drake_navbench.trial.rehearsal import rehearse
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses, TrialSpec
from drake_navbench.trial.systems.lifetime import release
from drake_navbench.trial.systems.running_stack import StackTask
from drake_navbench.trial.task_cost import check_cost, wall_clock_limit_s
from drake_navbench.trial.timing import MAX_STEP_S
from drake_navbench.trial.trial_log import failed_log, make_log

# A fixed step without error control: drawing or logging more often must not move the numbers.
INTEGRATION = SimulatorConfig(
    integration_scheme="runge_kutta2", max_step_size=MAX_STEP_S, use_error_control=False
)
HAS_ENDED = SimulatorStatus.ReturnReason.kReachedTerminationCondition
DEFAULT_ROBOT = "wheelchair"
# The column that rehearses a trial in place of a running stack.
STAND_IN = "rpp"


class NotDriven(NavbenchError):
    """A trial was ended by something outside of it, such as the machine; drive it again."""


def run_trial(
    scenario: str | Scenario,
    controller: str | Preset,
    seed: int = 0,
    *,
    robot: str | Robot = DEFAULT_ROBOT,
    wants_diagnostics: bool = False,
    keeps_costmaps: bool = True,
    compute_times_of: TrialLog | None = None,
) -> TrialLog:
    """Runs one trial and returns its log.

    scenario, controller, robot: names of built-in ones, paths of files (for `controller`, which may
    be a variant such as 'rpp:lookahead_dist=0.9', or 'file.py:Class'), or loaded objects. A loaded
    robot is taken as it is: the scenario's robot_overrides do not change it. Raises InputError
    where one of them is wrong. compute_times_of: a log of the same trial; its compute times replace
    the measured ones, so that the new log has the same bytes. A controller that breaks is an
    outcome, not an exception. A controller that is not ours runs in a process of its own, which it
    may end or hang without harm.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    preset = controller if isinstance(controller, Preset) else load_preset(controller)
    if isinstance(robot, str):
        robot = scenario.load_robot(robot)
    check_task(scenario, robot)
    check_cost(scenario, robot)
    check_plugins(scenario, robot)
    preset = preset.for_robot(robot)
    check_running_stack(scenario, preset)
    spec = TrialSpec(
        scenario,
        robot,
        preset,
        seed=seed,
        wants_diagnostics=wants_diagnostics,
        keeps_costmaps=keeps_costmaps,
        compute_times_ms=None if compute_times_of is None else compute_times(compute_times_of),
    )
    return _simulated_apart(spec) if spec.code_owner else simulate(spec)


def compute_times(log: TrialLog) -> tuple[tuple[float, float], ...]:
    """Returns the wall-clock and the processor time, ms, of every control cycle of a trial.

    Raises InputError where the log's rows are too few to tell them all.
    """
    cycles = log.samples.drop_duplicates("cycle_count")
    cycles = cycles[cycles["cycle_count"] > 0]
    counts = cycles["cycle_count"].to_numpy()
    if not np.array_equal(counts, np.arange(1, len(counts) + 1)):
        raise InputError("compute times: the log lacks some control cycles")
    columns = ("compute_time_ms", "compute_cpu_time_ms")
    return tuple(zip(*(cycles[name].tolist() for name in columns), strict=True))


def _simulated_apart(spec: TrialSpec) -> TrialLog:
    start_server([__name__])
    limit_s = wall_clock_limit_s(spec.scenario)
    task = Task(drive, (spec,), time_limit_s=limit_s, owner=spec.code_owner)
    ((_, ending),) = run_tasks([task], jobs=1)
    return ending.value if isinstance(ending, Returned) else log_of_ending(spec, ending)


def drive(spec: TrialSpec) -> TrialLog:
    """Runs a trial in a worker; an error of its controller is an outcome.

    Errors of the machine, such as no memory, are raised (see `is_machine_fault`).
    """
    try:
        return simulate(spec)
    except BaseException as error:
        if is_machine_fault(error):
            raise
        return failed_log(spec, one_line(error), traceback.format_exc())


def log_of_ending(spec: TrialSpec, ending: Failure) -> TrialLog:
    """Returns the log of a trial whose worker ended without returning one.

    Raises NotDriven where something outside of the trial ended the worker.
    """
    is_its_own = isinstance(ending, Died) and not ending.is_from_outside
    if is_its_own or isinstance(ending, TimedOut):
        return failed_log(spec, ending.sentence)
    raise NotDriven(ending.sentence)


def simulate(spec: TrialSpec, observers: Observers | None = None) -> TrialLog:
    """Runs the trial of a checked specification as fast as possible.

    observers: the observers of the trial; the specification says whether costmaps are kept.

    The trial is rehearsed before, so that compute times do not contain work that a process does
    once. A running stack would drive for real: in its place another column rehearses.
    """
    if spec.preset.is_running_stack:
        spec_of_parts = replace(spec, preset=load_preset(STAND_IN))
        rehearse(spec_of_parts, _simulate)
    else:
        rehearse(spec, _simulate)
    return _simulate(spec, observers)


def _simulate(spec: TrialSpec, observers: Observers | None = None) -> TrialLog:
    spec = replace(spec, robot=spec.preset.robot(spec.robot))
    wants_diagnostics = spec.wants_diagnostics
    with built_controller(spec.preset, spec.robot, wants_diagnostics=wants_diagnostics) as built:
        observers = (observers or Observers())._replace(keeps_costmaps=spec.keeps_costmaps)
        return simulate_with(built, spec, observers)


def simulate_with(
    controller: Controller,
    spec: TrialSpec,
    observers: Observers,
    *,
    until_s: float = math.inf,
) -> TrialLog:
    """Runs a trial with a built controller, without a rehearsal; its log ends at `until_s`.

    spec: with the robot as the column drives it.
    """
    trial = build_trial_diagram(
        spec.robot,
        spec.scenario.true_world,
        controller,
        task=trial_task(spec),
        maps=TrialMaps(_static_map(spec), _known_map(spec), spec.scenario.places[0].filter_masks),
        conditions=spec.scenario.conditions(spec.robot),
        compute_times_ms=spec.compute_times_ms,
        observers=observers,
    )
    try:
        return _driven(spec, trial, until_s)
    finally:
        release(trial.diagram)


def _driven(spec: TrialSpec, trial: TrialDiagram, until_s: float) -> TrialLog:
    """Simulates a built trial to its end, or to a time, and returns its log."""
    context = trial.create_context(spec.scenario.start_pose(spec.seed), spec.seed)
    simulator = Simulator(trial.diagram, context)
    ApplySimulatorConfig(INTEGRATION, simulator)
    contact_watch = ContactWatch(
        spec.robot.drive,
        spec.scenario.true_world,
        footprint=spec.robot.outline,
        max_step_s=MAX_STEP_S,
    )
    simulator.set_monitor(_end_of_trial(trial, context, contact_watch))
    if simulator.Initialize().reason() != HAS_ENDED:
        simulator.AdvanceTo(min(spec.scenario.timeout_s, until_s))
    if contact_watch.contact is not None:
        _put_back_to_contact(trial, context, contact_watch.contact)
    return make_log(spec, trial, context, contact_watch)


def trial_task(spec: TrialSpec) -> FollowPlan | NavigateToPoses | StackTask:
    """Returns the robot's task in the scenario's navigation mode, or for a running stack."""
    scenario, robot = spec.scenario, spec.robot
    if spec.preset.is_running_stack:
        return _stack_task(spec)
    if scenario.navigation_mode == "follow_path":
        return FollowPlan(partial(make_plan, scenario, robot))

    def plan(start: Array, goal: Array, costmap: Costmap) -> Array:
        return make_plan(scenario, robot, start, goal, costmap=costmap)

    return NavigateToPoses(
        goals=scenario.goals,
        make_plan=plan,
        global_layers=global_layers(scenario.places[0], robot),
        start_pose=scenario.start_pose(spec.seed),
        floors=trial_floors(scenario, robot, spec.seed),
        navigator=scenario.navigation_mode,
    )


def _stack_task(spec: TrialSpec) -> StackTask:
    """Returns the task of a running stack."""
    scenario, robot = spec.scenario, spec.robot
    start = scenario.start_pose(spec.seed)
    return StackTask(robot, scenario.goals, start, known_map(scenario.places[0], robot))


def _static_map(spec: TrialSpec) -> OccupancyMap | None:
    """Returns the map for the static layer of the local costmap, None without such a layer."""
    settings = spec.robot.navigation.local_costmap
    return (
        known_map(spec.scenario.places[0], spec.robot)
        if settings.is_active("static_layer")
        else None
    )


def _known_map(spec: TrialSpec) -> OccupancyMap | None:
    """Returns AMCL's map, None where AMCL does not localize the robot."""
    if spec.robot.localization.amcl is None:
        return None
    return known_map(spec.scenario.places[0], spec.robot)


def _end_of_trial(
    trial: TrialDiagram, root_context: Context, contact_watch: ContactWatch
) -> Callable[[Context], EventStatus | None]:
    """Returns the monitor that stops the simulation after a touch or when the task is over."""
    state_port, transport = trial.state_port, trial.transport
    status_port = trial.navigator.GetOutputPort("task_status")
    # The simulator hands the same context to every call.
    state_context = trial.state_system.GetMyContextFromRoot(root_context)
    navigator_context = trial.navigator.GetMyContextFromRoot(root_context)
    moving_world = trial.moving_world
    moving_context = moving_world and moving_world.GetMyContextFromRoot(root_context)
    # The last status that was not final: most steps see it again.
    running: TaskStatus | None = None

    def monitor(context: Context) -> EventStatus | None:
        nonlocal running
        time_s = context.get_time()
        status = status_port.Eval(navigator_context)
        if status is running and transport is None and time_s < contact_watch.idle_until_s:
            return None
        # A task that ended in the updates before this step was over before the step's touch.
        is_over = status.state.is_final and status.time_s < time_s
        if transport is not None:
            contact_watch.come_to_floor(transport.floor_changes(state_context))
        if time_s >= contact_watch.idle_until_s and not is_over:
            people = moving_world.people_at(moving_context)[:, :3] if moving_world else None
            contact_watch.look(time_s, state_port.Eval(state_context), people)
            if contact_watch.contact is not None:
                return EventStatus.ReachedTermination(trial.diagram, "collided")
        if status.state.is_final:
            return EventStatus.ReachedTermination(trial.diagram, status.reason)
        running = status
        return None

    return monitor


def _put_back_to_contact(trial: TrialDiagram, context: Context, contact: Contact) -> None:
    """Puts a Context, and the recording in it, back from the end of a step to the touch in it."""
    context.SetTime(contact.time_s)
    state, transport = contact.state, trial.transport
    if transport is not None:
        state = transport.base_state(transport.GetMyContextFromRoot(context), state)
    trial.base.set_state(trial.base.GetMyMutableContextFromRoot(context), state)
    trial.clearance.set_contact(trial.clearance.GetMyMutableContextFromRoot(context))
    recorder_context = trial.recorder.GetMyContextFromRoot(context)
    trial.recorder.find_recording(recorder_context).forget_after(contact.time_s)
