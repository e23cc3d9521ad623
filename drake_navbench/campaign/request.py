"""The request of a run: the part of a manifest from which the run can be resumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from pydantic import Field

from drake_navbench.campaign.sweep import MAX_POINTS, swept_points
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.barn import barn_scenarios
from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.known_base import KnownBase
from drake_navbench.inputs.originals_beside import with_originals
from drake_navbench.inputs.presets import Preset, default_presets, load_preset
from drake_navbench.inputs.robot import Robot, body_top_m, is_model, load_robot
from drake_navbench.inputs.scenario import (
    Scenario,
    load_scenario,
    scenario_on_map,
    warn_of_degrees,
)
from drake_navbench.inputs.task_time import with_time
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.nav2.differences import differences, require_different
from drake_navbench.nav2.known_base import known_base_of
from drake_navbench.nav2.whole_files import (
    FileColumns,
    WholeFile,
    columns_of_files,
    names_of,
    require_columns,
)
from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.quantities import Pose
from drake_navbench.typed_files.typed_yaml import FrozenModel

if TYPE_CHECKING:
    from drake_navbench.campaign.campaign import Campaign
    from drake_navbench.inputs.described_robot import DescribedRobot
    from drake_navbench.inputs.goal_file import GoalFile

# The most trials of a scenario and controller.
MAX_TRIALS = 100_000
MAX_SEED = 2**64 - 1
MAX_GOALS = 1000


class MapTask(FrozenModel):
    """A start and a goal, x m, y m, yaw rad each, or `goals` of them, on a map or in worlds.

    map: a map file; with worlds, the robot's map of them. worlds: files of Gazebo. With `goals`
    each task has a drawn goal, and, if no start is given, a drawn start. goal_file: a file of
    places, between which the tasks lead.
    """

    map: str | None = None
    worlds: tuple[str, ...] = ()
    start: Pose | None = None
    goal: Pose | None = None
    goals: int | None = Field(None, ge=1, le=MAX_GOALS)
    goal_file: str | None = None


class BarnTask(FrozenModel):
    """A folder of BARN worlds, and the numbers of those to drive; none stands for all."""

    folder: str
    worlds: tuple[int, ...] = ()


class Shown(NamedTuple):
    """A request's loaded scenarios and columns, and the robot of columns without a Nav2 file."""

    scenarios: tuple[Scenario, ...]
    presets: tuple[Preset, ...]
    robot: Robot


class Request(FrozenModel):
    """The arguments of a run; the manifest keeps them, so that the run can be resumed.

    controllers: presets and variants by name. parameter_files: more columns, from files.
    nav2_files: whole Nav2 files, merged, which give columns and the robot. against: more whole
    files, whose columns drive with their own settings. names: names of the columns, by file.
    substitutions: values for placeholders in these files. nav2_release: the release that Nav2 files
    are written for; None: their own marks tell it. packages: folders in which ROS packages that a
    robot's model or a world names are searched. original: the build of Nav2 whose originals drive
    beside the columns. sweeps: axes from `parse_axis`. samples: number of points of a Latin
    hypercube over the axes, None for their grid. keeps_costmaps: whether the logs hold the local
    costmaps. metrics: functions in files, 'my.py:name'. columns: the metrics that the terminal
    shows; () for the default.
    """

    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    parameter_files: tuple[str, ...]
    nav2_files: tuple[str, ...] = ()
    against: tuple[str, ...] = ()
    names: dict[str, str] = Field(default_factory=dict)
    substitutions: dict[str, str] = Field(default_factory=dict)
    nav2_release: Release | None = None
    original: str | None = None
    map_task: MapTask | None = None
    barn: BarnTask | None = None
    trials: int = Field(ge=1, le=MAX_TRIALS)
    seed: int = Field(ge=0, le=MAX_SEED)
    robot: str
    packages: tuple[str, ...] = ()
    replay: Literal["race", "each", "none"]
    figures: Literal["none", "key", "all"] = "key"
    sweeps: tuple[str, ...] = ()
    samples: int | None = Field(None, ge=1, le=MAX_POINTS)
    keeps_costmaps: bool = True
    metrics: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    def nav2_columns(self) -> tuple[FileColumns, ...]:
        """Returns the columns of each whole Nav2 file, () without a file; raises InputError.

        A file has no columns if none of its controllers exists here.
        """
        if not self.nav2_files:
            if self.against:
                raise InputError(f"--against {self.against[0]}: expected --nav2 FILE beside it")
            return ()
        merged = tuple(map(Path, self.nav2_files))
        files = [merged, *((Path(path),) for path in self.against)]
        names = [""] if not self.against else names_of([paths[-1] for paths in files])
        named = [
            WholeFile(self.names.get(str(paths[-1]), name), paths)
            for paths, name in zip(files, names, strict=True)
        ]
        unknown = [path for path in self.names if path not in (*self.nav2_files, *self.against)]
        if unknown:
            raise InputError(
                f"--name {self.names[unknown[0]]}={unknown[0]}: expected a file of --nav2 or "
                "--against"
            )
        described = self.described_robot()
        columns = columns_of_files(
            named,
            self.robot,
            self.substitutions,
            release=self.nav2_release,
            base=self._robot(),
            other_names=() if described is None else described.source.arguments,
        )
        if described is None:
            return columns
        # Imported here, as Drake and the model's readers are only needed for a model.
        from drake_navbench.nav2.model_check import contradictions

        return tuple(entry.with_rows(contradictions(entry.setup, described)) for entry in columns)

    def described_robot(self) -> DescribedRobot | None:
        """Returns the robot read from its model; None for a robot file; raises InputError."""
        if not is_model(self.robot):
            return None
        from drake_navbench.inputs.described_robot import describe_robot
        from drake_navbench.inputs.descriptions.xacro_file import require_declared

        found = describe_robot(
            Path(self.robot), self.substitutions, self._folders, self._known_base
        )
        if not self.nav2_files:
            require_declared(Path(self.robot), list(self.substitutions), found.source.arguments)
        return found

    def _robot(self) -> Robot:
        return load_robot(
            self.robot,
            arguments=self.substitutions,
            packages=self._folders,
            known=self._known_base,
        )

    @property
    def _folders(self) -> list[Path]:
        return list(map(Path, self.packages))

    @property
    def _known_base(self) -> KnownBase:
        if not (self.nav2_files and is_model(self.robot)):
            return KnownBase()
        return known_base_of(list(map(Path, self.nav2_files)))

    def campaign(self) -> Campaign:
        """Returns the trials of this request, all input checked; raises InputError.

        The metrics of files are measured in this process, and in its workers, from now on.
        """
        # pandas and Drake are loaded for those who drive, not for those who look.
        from drake_navbench.analysis.metrics.registry import all_metrics, use_metric_files
        from drake_navbench.analysis.tables import TOUCH_RATE
        from drake_navbench.campaign.campaign import plan_campaign

        use_metric_files(self.metrics)
        known = [*(entry.name for entry in all_metrics()), TOUCH_RATE]
        for name in self.columns:
            if name not in known:
                hint = nearest_name_hint(name, known, listed_by="docs/metrics.md")
                raise InputError(f"--columns: metric {name!r} is unknown{hint}")
        presets, nav2 = self._presets()
        if nav2 and not presets:
            raise InputError(
                f"--nav2 {', '.join(self.nav2_files)}: no controller_server with "
                "controller_plugins; expected one, or --controllers"
            )
        if self.original is not None:
            presets = with_originals(presets or default_presets(), self.original)
        robot = nav2[0].setup.robot if nav2 else self._robot()
        further = [columns.setup.robot for columns in nav2[1:]]
        described = self.described_robot()
        campaign = plan_campaign(
            self._scenarios(robot, further),
            presets,
            trials=self.trials,
            seed=self.seed,
            robot=robot if nav2 or described is not None else self.robot,
            wants_diagnostics=self.replay == "each",
            points=swept_points(self.sweeps, samples=self.samples, seed=self.seed),
            keeps_costmaps=self.keeps_costmaps,
        )
        if described is not None:
            campaign = replace(campaign, model=described.check)
        if not nav2:
            return campaign
        scenarios = {spec.scenario.name: spec.scenario for spec in campaign.specs}
        rows = [row for scenario in scenarios.values() for row in _overrides(scenario)]
        return replace(campaign, nav2=tuple(columns.with_rows(rows) for columns in nav2))

    def require_readable(self) -> None:
        """Raises InputError for what a drive would refuse in the inputs beside Nav2 file and robot.

        Warns as a drive does. Nothing is read if there are no such inputs.
        """
        beside = (
            *(self.scenarios, self.map_task, self.barn, self.controllers, self.parameter_files),
            *(self.sweeps, self.samples, self.metrics, self.columns, self.original),
        )
        if not any(beside):
            return
        nav2 = self.nav2_columns()
        if self.controllers or self.parameter_files or not nav2 or any(e.presets for e in nav2):
            self.campaign()
        else:
            self._scenarios(nav2[0].setup.robot, [entry.setup.robot for entry in nav2[1:]])

    def shown(self) -> Shown:
        """Returns the scenarios, columns and robot of the request for a picture; raises InputError.

        Inputs that are not named stay empty: no published scenarios, no default presets.
        """
        presets, nav2 = self._presets()
        robot = nav2[0].setup.robot if nav2 else self._robot()
        further = [columns.setup.robot for columns in nav2[1:]]
        scenarios = self._scenarios(robot, further)
        return Shown(
            tuple(load_scenario(s) if isinstance(s, str) else s for s in scenarios),
            tuple(load_preset(p) if isinstance(p, str) else p for p in presets),
            robot,
        )

    def _presets(self) -> tuple[list[str | Preset], tuple[FileColumns, ...]]:
        """Returns all columns, and the columns of whole Nav2 files by file."""
        from_files = [
            preset
            for path in dict.fromkeys(self.parameter_files)
            for preset in load_parameter_file(Path(path), self.nav2_release)
        ]
        if self.nav2_release and not (self.nav2_files or any(p.nav2_plugin for p in from_files)):
            raise InputError("--nav2-release: expected a Nav2 file by --nav2 or --params as well")
        nav2 = self.nav2_columns()
        if not (self.controllers or from_files):
            require_columns(nav2)
        require_different(nav2, differences(nav2) if len(nav2) > 1 else ())
        whole = [preset for columns in nav2 for preset in columns.presets]
        return [*self.controllers, *from_files, *whole], nav2

    def _scenarios(self, robot: Robot, further: Sequence[Robot]) -> list[str | Scenario]:
        scenarios: list[str | Scenario] = list(self.scenarios)
        task = self.map_task
        if task is not None:
            warn_of_degrees({"--start": task.start, "--goal": task.goal})
            if task.worlds:
                scenarios += self._tasks_in_worlds(task, robot, further)
            elif task.map:
                scenarios += self._tasks_on_map(task, task.map, robot, further)
        if self.barn is not None:
            scenarios += barn_scenarios(Path(self.barn.folder), self.barn.worlds)
        return scenarios

    def _tasks_in_worlds(
        self, task: MapTask, robot: Robot, further: Sequence[Robot]
    ) -> list[Scenario]:
        from drake_navbench.inputs.gazebo_world import load_gazebo_world, scenario_in_world
        from drake_navbench.inputs.goal_tasks import given_world_tasks
        from drake_navbench.inputs.world_on_map import warn_of_other_world
        from drake_navbench.trial.goal_sampling import sample_world_tasks

        described = self.described_robot()
        top_m = body_top_m(robot) if described is None else described.height_m
        scenarios: list[Scenario] = []
        known = None if task.map is None else Path(task.map)
        given = _goal_file(task)
        for name in task.worlds:
            around = [pose for pose in (task.start, task.goal) if pose is not None]
            here = None if given is None else _in_world(given, Path(name), self._folders)
            if here is not None:
                around += [place.pose.standing for place in here.places]
            world = load_gazebo_world(
                Path(name),
                lidar_m=robot.lidar.height_m,
                top_m=top_m,
                around=around,
                folders=self._folders,
            )
            if known is not None:
                warn_of_other_world(world, known)
            if task.start is not None and task.goal is not None:
                given_task = scenario_in_world(world, task.start, task.goal, map_file=known)
                scenarios.append(with_time(given_task, [robot, *further]))
            elif here is not None:
                robots = [robot, *further]
                scenarios += given_world_tasks(
                    here, world, robots, start=task.start, map_file=known
                )
            else:
                count = task.goals or 1
                scenarios += sample_world_tasks(
                    world,
                    robot,
                    count,
                    seed=self.seed,
                    start=task.start,
                    beside=further,
                    map_file=known,
                )
        return scenarios

    def _tasks_on_map(
        self, task: MapTask, file: str, robot: Robot, further: Sequence[Robot]
    ) -> list[Scenario]:
        path = Path(file)
        if task.start is not None and task.goal is not None:
            return [with_time(scenario_on_map(path, task.start, task.goal), [robot, *further])]
        given = _goal_file(task)
        if given is not None:
            from drake_navbench.inputs.goal_tasks import given_tasks

            return given_tasks(given, path, [robot, *further], start=task.start)
        from drake_navbench.trial.goal_sampling import sample_tasks

        return sample_tasks(
            path, robot, task.goals or 1, seed=self.seed, start=task.start, beside=further
        )


def _in_world(goals: GoalFile, world: Path, folders: Sequence[Path]) -> GoalFile:
    """Returns a file of places in m of a world, whose own origin on the earth may be needed."""
    if not goals.is_on_earth:
        return goals
    from drake_navbench.inputs.descriptions.world import origin_on_earth
    from drake_navbench.inputs.goal_on_earth import Datum

    origin = origin_on_earth(world, folders)
    return goals.on_ground(origin and Datum(*origin))


def _goal_file(task: MapTask) -> GoalFile | None:
    if task.goal_file is None:
        return None
    from drake_navbench.inputs.goal_file import read_goal_file

    return read_goal_file(Path(task.goal_file))


def _overrides(scenario: Scenario) -> list[CheckRow]:
    """Returns a row for each field of the robot that a scenario replaces."""
    remark = "the scenario replaces it, whatever the file says"
    node = f"scenario {scenario.name}"
    return [
        CheckRow(Status.OTHER_FORM, node, name, remark)
        for name, _ in flattened(scenario.robot_overrides)
    ]
