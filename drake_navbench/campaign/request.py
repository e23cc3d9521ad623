"""What was asked for: the part of a manifest from which a run can be resumed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

from pydantic import Field

from drake_navbench.campaign.campaign import Campaign, plan_campaign
from drake_navbench.campaign.sweep import MAX_POINTS
from drake_navbench.errors import InputError
from drake_navbench.inputs.nav2_check import Check, CheckRow, Status
from drake_navbench.inputs.nav2_robot import Nav2Setup, read_nav2_files
from drake_navbench.inputs.parameter_files import load_parameter_file
from drake_navbench.inputs.parameter_names import flattened
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Pose, Scenario, scenario_on_map
from drake_navbench.typed_files.typed_yaml import FrozenModel

# Of each scenario and controller.
MAX_TRIALS = 100_000
MAX_SEED = 2**64 - 1


class MapTask(FrozenModel):
    """A map file of Nav2's map_server, a start and a goal on it: x m, y m, yaw rad each."""

    map: str
    start: Pose
    goal: Pose


class Request(FrozenModel):
    """What was asked for; it is kept in the manifest, so that a run can be resumed.

    controllers: presets and variants by name. parameter_files: more columns, from files.
    nav2_files: whole Nav2 files, which give columns and the robot. substitutions: their values.
    sweeps: axes as of `parse_axis`. samples: of a Latin hypercube over them, None for their grid.
    """

    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    parameter_files: tuple[str, ...]
    nav2_files: tuple[str, ...] = ()
    substitutions: dict[str, str] = Field(default_factory=dict)
    map_task: MapTask | None = None
    trials: int = Field(ge=1, le=MAX_TRIALS)
    seed: int = Field(ge=0, le=MAX_SEED)
    robot: str
    replay: Literal["race", "each", "none"]
    figures: Literal["none", "key", "all"] = "key"
    sweeps: tuple[str, ...] = ()
    samples: int | None = Field(None, ge=1, le=MAX_POINTS)

    def nav2_setup(self) -> Nav2Setup | None:
        """Returns what the Nav2 files make, None without any; raises InputError."""
        if not self.nav2_files:
            return None
        paths = list(map(Path, self.nav2_files))
        return read_nav2_files(paths, load_robot(self.robot), self.robot, self.substitutions)

    def campaign(self) -> Campaign:
        """Returns the trials of this request, all input checked; raises InputError."""
        presets: list[str | Preset] = list(self.controllers)
        for path in dict.fromkeys(self.parameter_files):
            presets += load_parameter_file(Path(path))
        nav2 = self.nav2_setup()
        if nav2 is not None:
            presets += nav2.presets
            if not presets:
                raise InputError(
                    f"--nav2 {', '.join(self.nav2_files)}: no controller_server with "
                    "controller_plugins; expected one, or --controllers"
                )
        campaign = plan_campaign(
            self._scenarios(),
            presets,
            trials=self.trials,
            seed=self.seed,
            robot=self.robot if nav2 is None else nav2.robot,
            wants_diagnostics=self.replay == "each",
            sweeps=self.sweeps,
            samples=self.samples,
        )
        if nav2 is None:
            return campaign
        scenarios = {spec.scenario.name: spec.scenario for spec in campaign.specs}
        rows = [row for scenario in scenarios.values() for row in _overrides(scenario)]
        return replace(campaign, nav2=replace(nav2, check=Check((*nav2.check.rows, *rows))))

    def _scenarios(self) -> list[str | Scenario]:
        task = self.map_task
        if task is None:
            return list(self.scenarios)
        return [*self.scenarios, scenario_on_map(Path(task.map), task.start, task.goal)]


def _overrides(scenario: Scenario) -> list[CheckRow]:
    """Returns a row for each field of the robot that a scenario replaces."""
    remark = "the scenario replaces it, whatever the file says"
    node = f"scenario {scenario.name}"
    return [
        CheckRow(Status.OTHER_FORM, node, name, remark)
        for name, _ in flattened(scenario.robot_overrides)
    ]
