"""Compiles the kernels that trials need and that are not compiled yet; starts the workers' server.

A part of a trial, such as its controller, its people or its planner, has kernels of its own.
`compiled_parts` keeps the list of parts whose kernels are compiled.
"""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.processes.compiled_parts import compiled_parts, note_compiled
from drake_navbench.processes.workers import Task, run_tasks, start_server

if TYPE_CHECKING:
    from drake_navbench.trial.spec import TrialSpec

# Imported by the server from which the workers are forked; see that module.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"
# Together they plan with a smoother and with filters, recover, and begin with a turn.
WARM_UP_SCENARIOS = ("one_obstacle", "speed_zone", "dead_end")
WARM_UP_S = 0.1
# Long enough that everything in a world has moved, sensed and been measured.
WORLD_WARM_UP_S = 1.0
# Drives where only the world is to be compiled.
WORLD_COLUMN = "rpp"
# With and without obstacles, on straight and winding plans.
SCENES = 5
# The compiler makes millions of objects that live on: to look through them all for garbage every
# 700 objects takes it an eighth longer.
OBJECTS_BETWEEN_COLLECTIONS = 100_000


def start_worker_server() -> None:
    """Starts the server that workers are forked from; it loads while the caller goes on."""
    start_server([PRELOAD_MODULE])


@dataclass(frozen=True)
class Cold:
    """Trials with parts that are not compiled yet.

    columns: one trial for each controller without compiled kernels. worlds: one trial for each
    other such part. names: the names of all these parts, for messages.
    """

    columns: tuple[TrialSpec, ...]
    worlds: tuple[TrialSpec, ...]
    names: tuple[str, ...]


def cold_parts(specs: Sequence[TrialSpec]) -> Cold:
    """Returns the trials that have something to compile.

    Controllers of somebody else are left to the trials: they may do anything when they are called.
    So are running stacks, which have no kernels of ours.
    """
    compiled = compiled_parts()
    columns = {
        _column_name(spec): spec
        for spec in specs
        if not (spec.code_owner or spec.preset.is_running_stack)
    }
    cold_columns = {name: spec for name, spec in columns.items() if name not in compiled}
    with_columns = {
        part
        for column in list(cold_columns.values())[:1]
        for spec in warm_up_specs(column)
        for part in world_parts(spec)
    }
    worlds: dict[str, TrialSpec] = {}
    # Columns of a scenario share its world, unless one brings a robot of its own.
    for spec in {(spec.scenario.name, id(spec.robot)): spec for spec in specs}.values():
        for part in world_parts(spec):
            if part not in compiled and part not in with_columns:
                worlds.setdefault(part, spec)
    drivers = {id(spec): spec for spec in worlds.values()}
    return Cold(
        tuple(cold_columns.values()), tuple(drivers.values()), (*cold_columns, *sorted(worlds))
    )


def world_parts(spec: TrialSpec) -> set[str]:
    """Returns the parts of a trial that have kernels of their own, but for the controller."""
    robot, navigation = spec.robot, spec.robot.navigation
    costmaps = navigation.local_costmap, navigation.global_costmap
    worlds = [spec.scenario.world, *(floor.world for floor in spec.scenario.floors)]
    crowds = [world.people for world in worlds if world.people is not None]
    switches = {
        "AMCL": robot.localization.amcl,
        "the collision monitor": navigation.collision_monitor,
        "moving obstacles": any(world.moving_obstacles for world in worlds),
        "depth sensors": robot.depth_sensors,
        "range sensors": robot.range_sensors,
    }
    return {
        f"drive {robot.drive.type}",
        f"drive {getattr(robot.drive, 'physics', 'ideal')}",
        "a round body" if robot.is_circle else "an outline",
        f"planner {navigation.planner.plugin.rpartition('::')[2]}",
        f"smoother {navigation.smoother.plugin}",
        *(f"layer {name}" for costmap in costmaps for name in costmap.plugins),
        *(
            "recorded people" if people.recording else f"people ({people.model})"
            for people in crowds
        ),
        *(name for name, is_there in switches.items() if is_there),
    }


def warm_up(
    cold: Cold, *, jobs: int, on_progress: Callable[[int, int], None] = lambda done, total: None
) -> None:
    """Has kernels compiled, in up to `jobs` processes side by side.

    on_progress: is told how many of how many steps are done. Whatever goes wrong is left for the
    trials to meet.
    """
    start_worker_server()
    tasks = list(_warm_up_tasks(cold))
    on_progress(0, len(tasks))
    for done, _ in enumerate(run_tasks(tasks, jobs=jobs), start=1):
        on_progress(done, len(tasks))
    driven = [spec for column in cold.columns[:1] for spec in warm_up_specs(column)]
    note_compiled({*cold.names, *(part for spec in driven for part in world_parts(spec))})


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
    """Drives a column for a moment, and measures it."""
    from drake_navbench.analysis.tables import trial_row
    from drake_navbench.trial.trial import simulate

    _collect_rarely()
    for spec in warm_up_specs(column):
        trial_row(simulate(spec))


def drive_world_briefly(spec: TrialSpec) -> None:
    """Drives a trial's robot through its world for a moment, and measures it.

    A simple controller drives: one of somebody else is left to the trials.
    """
    from drake_navbench.analysis.tables import trial_row
    from drake_navbench.inputs.presets import load_preset
    from drake_navbench.trial.trial import simulate

    _collect_rarely()
    scenario = spec.scenario.model_copy(update={"timeout_s": WORLD_WARM_UP_S})
    trial_row(
        simulate(
            replace(
                spec,
                scenario=scenario,
                preset=load_preset(WORLD_COLUMN),
                compute_times_ms=None,
            )
        )
    )


def _warm_up_tasks(cold: Cold) -> Iterator[Task]:
    """Yields the tasks of a warm-up: those that compile most come first.

    The order lets few tasks that run at the same time compile the same kernels.
    """
    for column in cold.columns[:1]:
        yield Task(drive_briefly, (column,))
    for column in sorted(cold.columns[1:], key=_size_of_code, reverse=True):
        yield Task(decide_in_scenes, (column,))
    for spec in cold.worlds:
        yield Task(drive_world_briefly, (spec,))
    for column in cold.columns[1:]:
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
