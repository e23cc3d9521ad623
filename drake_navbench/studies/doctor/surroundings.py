"""The user's map, base and computer, with which probes are driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_navbench.inputs.goal_file import read_goal_file
from drake_navbench.inputs.goal_tasks import given_tasks
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, Variation
from drake_navbench.navigation.costmaps.map_file import load_map
from drake_navbench.trial.goal_sampling import sample_tasks

__all__ = ["Surroundings", "load_map", "tasks_on_map"]


@dataclass(frozen=True)
class Surroundings:
    """The map, base and computer with which probes are driven.

    map_file, goals: the user's map, on which so many tasks are drawn, or a file of places on it.
    overrides: fields of the robot file, of a base that a recording shows and of a computer that was
    measured. remarks: how these were found, a sentence each. recorded: what a recording of the
    robot shows, a line each.
    """

    map_file: Path | None = None
    goals: int | Path = 0
    overrides: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    recorded: tuple[str, ...] = ()


def tasks_on_map(
    robot: Robot,
    around: Surroundings,
    like: Scenario,
    start: Mapping[str, float],
    *,
    seed: int,
) -> dict[str, Scenario]:
    """Returns the tasks on the user's map by their names; raises InputError where it has no room.

    like: a probe whose robot_overrides these have. start: how much their start varies.
    """
    if around.map_file is None:
        return {}
    if isinstance(around.goals, Path):
        tasks = given_tasks(read_goal_file(around.goals), around.map_file, [robot])
    else:
        tasks = sample_tasks(around.map_file, robot, around.goals, seed=seed)
    variation = Variation.model_validate(dict(start))
    return {
        f"map_{number}": task.model_copy(
            update={
                "name": f"probe_map_{number}",
                "description": f"goal {number} on {around.map_file.name}"
                if isinstance(around.goals, int)
                else task.description,
                "variation": variation,
                "robot_overrides": like.robot_overrides,
                "suite": None,
            }
        )
        for number, task in enumerate(tasks, 1)
    }
