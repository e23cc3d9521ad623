"""The ways between the places of a user's file on a map, as scenarios to open."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_navbench.inputs.goal_file import read_goal_file
from drake_navbench.inputs.goal_tasks import given_tasks
from drake_navbench.inputs.robot import load_robot
from drake_navbench.studio.drawing import EMPTY_FLOOR
from drake_navbench.studio.open_folder import OpenFolder


def ways_between(
    folder: OpenFolder, map_file: Path, goals: Path, robot: str
) -> dict[str, Mapping[str, Any]]:
    """Returns the content of a scenario for each way of `run --map --goals FILE`, by its name.

    robot: the one that must have room at the places. Raises InputError, also where the map lies
    outside the folder.
    """
    name = folder.name_of(folder.inside(str(map_file.resolve())))
    return {
        task.name: {
            **EMPTY_FLOOR,
            "description": task.description,
            "world": {"map": name, "obstacles": []},
            "start": list(task.start),
            "goal": list(task.goals[-1]),
            "navigation_mode": "navigate_to_pose",
        }
        for task in given_tasks(read_goal_file(goals), map_file, [load_robot(robot)])
    }
