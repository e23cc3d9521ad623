"""The specification of a trial, which determines its result, and the task of its robot."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.inputs.foreign_code import foreign_code, has_foreign_plugins
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.navigation.behavior_tree.board import MakePlan
from drake_navbench.navigation.behavior_tree.description import NAVIGATE_TO_POSE
from drake_navbench.navigation.costmaps.layered_costmap import LayeredCostmap
from drake_navbench.navigation.waypoint_follower import Pose
from drake_navbench.processes.version import __version__
from drake_navbench.trial.floors import TrialFloors


@dataclass(frozen=True)
class TrialSpec:
    """All inputs of a trial; with the code they determine its result.

    trial: its number among the trials of a scenario. seed: seed of this trial, the same for every
    controller. wants_diagnostics: whether to log the controller's arrays too. keeps_costmaps:
    whether to log the local costmaps; nothing else in a trial depends on it. compute_times_ms:
    wall-clock and processor time of every cycle of an earlier run of the trial, which count for
    this run; by default times are measured.
    """

    scenario: Scenario
    robot: Robot
    preset: Preset
    seed: int
    trial: int = 0
    wants_diagnostics: bool = False
    keeps_costmaps: bool = True
    compute_times_ms: tuple[tuple[float, float], ...] | None = None

    @cached_property
    def identity(self) -> str:
        """A digest of all fields: a log belongs to this trial if its header has the same digest."""
        everything = self._shared | {"seed": self.seed, "trial": self.trial}
        return sha256(json.dumps(everything, sort_keys=True).encode()).hexdigest()

    @cached_property
    def _shared(self) -> dict[str, Any]:
        """The identity's fields except for trial number and seed."""
        shared = {
            "drake_navbench": __version__,
            "scenario": self.scenario.model_dump(mode="json"),
            "files": sorted(
                [
                    *self.scenario.file_hashes.values(),
                    *self.preset.file_hashes.values(),
                    *self.robot.file_hashes.values(),
                ]
            ),
            "robot": self.preset.robot(self.robot).model_dump(mode="json"),
            "controller": self.preset.controller,
            "parameters": self.preset.parameters.model_dump(mode="json"),
            "column": self.preset.name,
            "wants_diagnostics": self.wants_diagnostics,
        }
        return shared | ({"plugins": self.foreign_code} if self.foreign_code else {})

    def numbered(self, trial: int, seed: int) -> TrialSpec:
        """Returns another trial of the same settings; `_shared` is computed once for both."""
        other = replace(self, trial=trial, seed=seed)
        other.__dict__["_shared"] = self._shared
        return other

    def __getstate__(self) -> dict[str, Any]:
        """Leaves out `_shared`, which can be computed again and is as long as all the rest."""
        return {name: value for name, value in self.__dict__.items() if name != "_shared"}

    @cached_property
    def foreign_code(self) -> dict[str, str]:
        """The third-party plugins of the trial: package and version by kind and name."""
        origins = foreign_code(self.preset, self.scenario, self.robot)
        return {name: str(origin) for name, origin in sorted(origins.items())}

    @property
    def code_owner(self) -> str:
        """The owner of the third-party code that the trial runs, '' where there is none.

        Trials of two owners are kept apart.
        """
        if has_foreign_plugins(self.scenario, self.robot):
            return f"{self.preset.name} in {self.scenario.name}"
        return self.preset.name if self.foreign_code else ""


@dataclass(frozen=True)
class FollowPlan:
    """A task in the mode follow_path.

    make_plan: function from the start pose (3,) to the plan poses (N, 3); raises PlanningError.
    """

    make_plan: Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class NavigateToPoses:
    """A task in the modes navigate_to_pose and navigate_through_poses.

    goals: one after another. make_plan: function from start, goal and global costmap to a plan.
    global_layers: layers of the global costmap. start_pose: (3,) x m, y m, yaw rad. floors: the
    floors of a mission, None without one; the other fields are about the first floor. navigator:
    the mode.
    """

    goals: tuple[Pose, ...]
    make_plan: MakePlan
    global_layers: LayeredCostmap
    start_pose: NDArray[np.float64]
    floors: TrialFloors | None = None
    navigator: str = NAVIGATE_TO_POSE

    @classmethod
    def floors_of(cls, task: object) -> TrialFloors | None:
        """Returns the floors of a task, None where it has none."""
        return task.floors if isinstance(task, cls) else None
