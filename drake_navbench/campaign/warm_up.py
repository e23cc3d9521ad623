"""Compiles the kernels that trials need and that are not compiled yet; starts the workers' server.

A part of a trial, such as its controller, its people or its planner, has kernels of its own.
`compiled_parts` keeps the list of parts whose kernels are compiled.
"""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from drake_navbench.processes.compiled_parts import compiled_parts, note_compiled
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.workers import run_tasks, start_server

if TYPE_CHECKING:
    import pandas as pd

    from drake_navbench.trial.spec import TrialSpec

# The module that the workers' server imports before it forks them.
PRELOAD_MODULE = "drake_navbench.campaign.worker_preload"
# Together these trials plan with a smoother and with filters, recover, and begin with a turn.
WARM_UP_SCENARIOS = ("one_obstacle", "speed_zone", "dead_end")
WARM_UP_S = 0.1
# In a drive of this length everything in a world has moved, sensed and been measured, s.
WORLD_WARM_UP_S = 1.0
# The column that drives where only the world's kernels are to be compiled.
WORLD_COLUMN = "rpp"
# The number of random scenes: with and without obstacles, on straight and winding plans.
SCENES = 5
# The compiler makes millions of objects that live on; with a search for garbage every 700 objects
# it takes an eighth longer.
OBJECTS_BETWEEN_COLLECTIONS = 100_000


def start_worker_server() -> None:
    """Starts the server that forks the workers; it loads while the caller goes on."""
    start_server([PRELOAD_MODULE])


@dataclass(frozen=True)
class Cold:
    """Trials with parts that are not compiled yet.

    columns: one trial for each controller whose kernels are not compiled. worlds: one trial for
    each other part whose kernels are not, such as people. names: names of these parts, for
    messages.
    """

    columns: tuple[TrialSpec, ...]
    worlds: tuple[TrialSpec, ...]
    names: tuple[str, ...]


def cold_parts(specs: Sequence[TrialSpec]) -> Cold:
    """Returns the trials that have something to compile.

    Third-party controllers are left to the trials, as they may do anything when called. So are
    running stacks, which have no kernels of ours.
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
    """Returns the parts of a trial with kernels of their own, except the controller."""
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


class WarmUp(NamedTuple):
    """A task that compiles kernels.

    part: the part of trials that needs the kernels, for messages. parts: the parts whose kernels
    are compiled when this task and all before it have ended.
    """

    task: Task
    part: str
    parts: frozenset[str]


def warm_ups(cold: Cold) -> list[WarmUp]:
    """Returns the tasks that compile kernels, in order: first the most urgent or largest.

    The order keeps tasks that run at the same time from compiling the same kernels.
    """
    found = []
    for column in cold.columns[:1]:
        worlds = {part for spec in warm_up_specs(column) for part in world_parts(spec)}
        name = _column_name(column)
        task = Task(drive_briefly, (column,), kind=f"compile {name}", is_urgent=True)
        found.append(WarmUp(task, name, frozenset({name, *worlds})))
    driven_first = tuple(one.task for one in found)
    for spec in cold.worlds:
        parts = sorted(world_parts(spec).intersection(cold.names))
        kind = f"compile {', '.join(parts)}"
        task = Task(drive_world_briefly, (spec,), kind=kind, after=driven_first, is_urgent=True)
        found.append(WarmUp(task, ", ".join(parts), frozenset(parts)))
    for column in sorted(cold.columns[1:], key=_size_of_code, reverse=True):
        name = _column_name(column)
        decides = Task(decide_in_scenes, (column,), kind=f"compile {name}")
        drives = Task(
            drive_briefly, (column,), kind=f"drive {name}", after=(*driven_first, decides)
        )
        found.append(WarmUp(decides, name, frozenset()))
        found.append(WarmUp(drives, name, frozenset({name})))
    return found


class Compiling:
    """The state of compiling: the parts of trials whose kernels are still to be compiled.

    on_first_column: is called with the rows of the first column's trials when they are complete.
    """

    def __init__(
        self,
        found: Sequence[WarmUp],
        on_first_column: Callable[[pd.DataFrame], None] = lambda trials: None,
    ) -> None:
        self.on_first_column = on_first_column
        self._waiting = list(found)
        self.tasks = tuple(one.task for one in found)

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts whose kernels are still to be compiled, each once, in order."""
        return tuple(dict.fromkeys(one.part for one in self._waiting))

    def before(self, spec: TrialSpec) -> tuple[Task, ...]:
        """Returns the tasks that compile kernels for a trial."""
        name = _column_name(spec)
        needed = {name, *world_parts(spec)}
        return tuple(
            one.task for one in self._waiting if one.part == name or needed.intersection(one.parts)
        )

    def end(self, task: Task) -> tuple[str, ...]:
        """Notes that a task has ended; returns the remaining parts."""
        ended = [one for one in self._waiting if one.task is task]
        self._waiting = [one for one in self._waiting if one.task is not task]
        note_compiled(part for one in ended for part in one.parts)
        return self.parts


def warm_up(
    compiling: Compiling,
    *,
    jobs: int,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Compiles kernels, in up to `jobs` processes at a time.

    on_progress: is called with the number of steps done, and of all steps. Errors are left for the
    trials to meet.
    """
    start_worker_server()
    total = len(compiling.tasks)
    on_progress(0, total)
    for done, (task, _) in enumerate(run_tasks(compiling.tasks, jobs=jobs), start=1):
        compiling.end(task)
        on_progress(done, total)


def warm_up_specs(column: TrialSpec) -> list[TrialSpec]:
    """Returns the short trials that compile all kernels that a column needs."""
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
    """Calls a column's controller in some random scenes, without a world.

    Returns the number of scenes in which it found a command.
    """
    from drake_navbench.controller import ControllerError
    from drake_navbench.trial.column_controller import built_controller, controller_setup
    from drake_navbench.trial.random_scenes import random_scenes

    robot = column.preset.robot(column.robot)
    found = 0
    with _rare_collections(), built_controller(column.preset, robot) as controller:
        memory = controller.initial_memory()
        for scene in random_scenes(controller_setup(robot), SCENES):
            with suppress(ControllerError):
                memory = controller.step(scene, memory).memory
                found += 1
    return found


def drive_briefly(column: TrialSpec) -> None:
    """Drives a column for a moment and computes its metrics, so that all kernels get compiled."""
    from drake_navbench.analysis.trial_rows import trial_row
    from drake_navbench.trial.trial import simulate

    with _rare_collections():
        for spec in warm_up_specs(column):
            trial_row(simulate(spec))


def drive_world_briefly(spec: TrialSpec) -> None:
    """Drives a trial's robot for WORLD_WARM_UP_S, so that the kernels of its world get compiled.

    A simple controller drives, as third-party controllers are left to the trials.
    """
    from drake_navbench.analysis.trial_rows import trial_row
    from drake_navbench.inputs.presets import load_preset
    from drake_navbench.trial.trial import simulate

    scenario = spec.scenario.model_copy(update={"timeout_s": WORLD_WARM_UP_S})
    preset = load_preset(WORLD_COLUMN)
    with _rare_collections():
        trial_row(simulate(replace(spec, scenario=scenario, preset=preset, compute_times_ms=None)))


def _column_name(spec: TrialSpec) -> str:
    """Returns the column's name without changed parameters, few of which choose other code."""
    return spec.preset.name.partition(":")[0]


def _size_of_code(column: TrialSpec) -> int:
    """Returns the bytes of source in the package of a column's controller."""
    folder = Path(inspect.getfile(column.preset.controller_class)).parent
    return sum(path.stat().st_size for path in folder.glob("*.py"))


@contextmanager
def _rare_collections() -> Generator[None, None, None]:
    before = gc.get_threshold()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    try:
        yield
    finally:
        gc.set_threshold(*before)
