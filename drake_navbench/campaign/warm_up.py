"""Compiles the kernels, once for an installation, and starts the server of the workers."""

from __future__ import annotations

import gc
import inspect
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.processes.compiled_columns import compiled_columns, note_compiled
from drake_navbench.processes.workers import Task, run_tasks, start_server

if TYPE_CHECKING:
    from drake_navbench.trial.spec import TrialSpec

# Imported by the server from which the workers are forked; see that module.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"
# Together they plan with a smoother and with filters, recover, and begin with a turn.
WARM_UP_SCENARIOS = ("one_obstacle", "speed_zone", "dead_end")
WARM_UP_S = 0.1
# With and without obstacles, on straight and winding plans.
SCENES = 5
# The compiler makes millions of objects that live on: to look through them all for garbage every
# 700 objects takes it an eighth longer.
OBJECTS_BETWEEN_COLLECTIONS = 100_000


def start_worker_server() -> None:
    """Starts the server that workers are forked from; it loads while the caller goes on."""
    start_server([PRELOAD_MODULE])


def cold_columns(specs: Sequence[TrialSpec]) -> list[TrialSpec]:
    """Returns a specification for each column with a controller of ours that is not compiled yet.

    Others' are left to the trials: they may do anything when they are called.
    """
    compiled = compiled_columns()
    columns = {_column_name(spec): spec for spec in specs if not spec.code_owner}
    return [spec for name, spec in columns.items() if name not in compiled]


def warm_up(columns: Sequence[TrialSpec], *, jobs: int) -> None:
    """Has the kernels compiled that columns need, in up to `jobs` processes side by side.

    Whatever goes wrong is left for the trials to meet.
    """
    start_worker_server()
    for _ in run_tasks(list(_warm_up_tasks(columns)), jobs=jobs):
        pass
    note_compiled(map(_column_name, columns))


def warm_up_specs(column: TrialSpec) -> list[TrialSpec]:
    """Returns the short trials that have the kernels compiled that a column needs."""
    from drake_navbench.inputs.scenario import load_scenario
    from drake_navbench.trial.trial import DEFAULT_ROBOT

    scenarios = [load_scenario(name) for name in WARM_UP_SCENARIOS]
    return [
        replace(
            column,
            scenario=scenario.model_copy(update={"timeout_s": WARM_UP_S}),
            robot=scenario.load_robot(DEFAULT_ROBOT),
            seed=0,
            trial=0,
            compute_times_ms=None,
        )
        for scenario in scenarios
    ]


def decide_in_scenes(column: TrialSpec) -> int:
    """Has a column's controller decide in some random scenes, with nothing around it.

    Returns in how many of them it found a command.
    """
    from drake_navbench.controller import ControllerError
    from drake_navbench.trial.column_controller import built_controller, controller_setup
    from drake_navbench.trial.random_scenes import random_scenes

    _collect_rarely()
    robot = column.preset.robot(column.robot)
    found = 0
    with built_controller(column.preset, robot) as controller:
        memory = controller.initial_memory()
        for scene in random_scenes(controller_setup(robot), SCENES):
            with suppress(ControllerError):
                memory = controller.step(scene, memory).memory
                found += 1
    return found


def drive_briefly(column: TrialSpec) -> None:
    """Drives a column for a moment."""
    from drake_navbench.trial.trial import simulate

    _collect_rarely()
    for spec in warm_up_specs(column):
        simulate(spec)


def warm_up_planners(specs: Sequence[TrialSpec]) -> None:
    """Has the kernels of planners compiled that the default robot does not use.

    Theirs take so long that a worker that compiled them might look as if it hung.
    """
    from drake_navbench.trial.planning import compile_planner

    for robot in {spec.robot.navigation.planner.plugin: spec.robot for spec in specs}.values():
        compile_planner(robot)


def _warm_up_tasks(columns: Sequence[TrialSpec]) -> Iterator[Task]:
    """Yields what has most to compile first, in an order in which few compile the same."""
    for column in columns[:1]:
        yield Task(drive_briefly, (column,))
    for column in sorted(columns[1:], key=_size_of_code, reverse=True):
        yield Task(decide_in_scenes, (column,))
    for column in columns[1:]:
        yield Task(drive_briefly, (column,))


def _column_name(spec: TrialSpec) -> str:
    """Returns the name without parameters that were changed for a run: few choose other code."""
    return spec.preset.name.partition(":")[0]


def _size_of_code(column: TrialSpec) -> int:
    """Returns the bytes of source in the package of a column's controller."""
    folder = Path(inspect.getfile(column.preset.controller_class)).parent
    return sum(path.stat().st_size for path in folder.glob("*.py"))


def _collect_rarely() -> None:
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
