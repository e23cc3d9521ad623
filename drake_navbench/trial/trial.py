"""One trial: its specification is checked and driven, its log returned."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from drake_navbench.errors import InputError, NavbenchError, is_machine_fault, one_line
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.logs.log import TrialLog
from drake_navbench.processes.tasks import Died, Failure, Task, TimedOut
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import run_tasks, start_server
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.plugin_check import check_plugins, check_running_stack
from drake_navbench.trial.rehearsal import rehearse
from drake_navbench.trial.simulation import TrialSimulation, built_simulation, simulate_with
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import check_cost, wall_clock_limit_s
from drake_navbench.trial.trial_log import failed_log

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
    spec = replace(
        checked_spec(scenario, controller, seed, robot),
        wants_diagnostics=wants_diagnostics,
        keeps_costmaps=keeps_costmaps,
        compute_times_ms=None if compute_times_of is None else compute_times(compute_times_of),
    )
    return _simulated_apart(spec) if spec.code_owner else simulate(spec)


@contextmanager
def open_trial(
    scenario: str | Scenario,
    controller: str | Preset,
    seed: int = 0,
    *,
    robot: str | Robot = DEFAULT_ROBOT,
    add_systems: Callable[[DiagramBuilder], None] | None = None,
) -> Iterator[TrialSimulation]:
    """Opens one trial as a Drake Diagram with its Simulator; arguments as those of `run_trial`.

    add_systems: is called with the builder after the trial's systems were wired, to add some of
    your own. The diagram is freed at the end of the `with` block. A controller that is not ours
    runs in this process. Raises InputError where an argument is wrong.
    """
    spec = checked_spec(scenario, controller, seed, robot)
    if spec.preset.is_running_stack:
        raise InputError(f"{spec.preset.source}: expected a controller; a running stack has none")
    spec = replace(spec, robot=spec.preset.robot(spec.robot))
    with (
        built_controller(spec.preset, spec.robot) as built,
        built_simulation(built, spec, Observers(add_systems=add_systems)) as simulation,
    ):
        yield simulation


def checked_spec(
    scenario: str | Scenario, controller: str | Preset, seed: int, robot: str | Robot
) -> TrialSpec:
    """Returns the specification of a trial; raises InputError where it cannot be driven."""
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    preset = controller if isinstance(controller, Preset) else load_preset(controller)
    if isinstance(robot, str):
        robot = scenario.load_robot(robot)
    check_task(scenario, robot)
    check_cost(scenario, robot)
    check_plugins(scenario, robot)
    preset = preset.for_robot(robot)
    check_running_stack(scenario, preset)
    return TrialSpec(scenario, robot, preset, seed=seed)


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
