"""What the tests of DWB share: parameters, maps, windows of hand-made trajectories."""

from __future__ import annotations

import numpy as np
from controller_scenes import observe as observe_plan
from controller_scenes import setup_of
from scenes import straight_plan

from drake_navbench.controller import Observation
from drake_navbench.controllers.dwb import DynamicWindowApproachParameters
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.controllers.dwb.trajectories import Trajectories
from drake_navbench.inputs.presets import preset_files
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.read_only import read_only
from drake_navbench.typed_files.typed_yaml import read_yaml

# nav2_bringup's, at its own speed; the preset drives at the wheelchair's.
BRINGUP = read_yaml(preset_files()["dwb_bringup"])["parameters"]
BRINGUP |= {"max_vel_x": 0.26, "max_speed_xy": 0.26}
RECTANGLE = np.array([[0.4, 0.2], [0.4, -0.2], [-0.2, -0.2], [-0.2, 0.2]])
SETUP = setup_of(RECTANGLE)


def parameters(**changes) -> DynamicWindowApproachParameters:
    """Returns nav2_bringup's parameters with changes."""
    return DynamicWindowApproachParameters(**(BRINGUP | changes))


def free_map(columns=60, rows=60, *, resolution=0.05, origin=None) -> Costmap:
    """Returns an empty map, centred on the world's origin unless said otherwise."""
    if origin is None:
        origin = (-0.5 * columns * resolution, -0.5 * rows * resolution)
    return Costmap(np.zeros((rows, columns), dtype=np.uint8), *origin, resolution)


def map_of(costs, *, resolution=1.0, origin=(0.0, 0.0)) -> Costmap:
    """Returns a map from rows given bottom row first, cells of 1 m from the origin on."""
    return Costmap(np.array(costs, dtype=np.uint8), *origin, resolution)


def observe(**changes) -> Observation:
    """Returns an observation of a robot at rest at the origin before a straight plan."""
    plan = changes.pop("plan", straight_plan(1.4))
    known = {"costmap": free_map(), "goal": np.array([5.0, 0.0, 0.0])}
    return observe_plan(plan, **known | changes)


def situate(**changes) -> Situation:
    """Returns the situation of the same robot."""
    known = {
        "time_s": 0.0,
        "pose": (0.0, 0.0, 0.0),
        "twist": (0.0, 0.0, 0.0),
        "plan": straight_plan(1.4),
        "goal": (5.0, 0.0, 0.0),
        "costmap": free_map(),
    }
    known |= changes
    known["plan"] = read_only(known["plan"])
    return Situation(**known)


def scene_of(poses, *, velocities=None, step_s=0.5, **changes) -> Scene:
    """Returns a scene with hand-made trajectories: poses (K, N, 3), each of the same length."""
    poses = np.array(poses, dtype=float)
    count, length = poses.shape[:2]
    velocities = np.zeros((count, 3)) if velocities is None else np.array(velocities, dtype=float)
    window = Trajectories(
        twists=velocities,
        velocities=velocities,
        poses=poses,
        headings=np.stack([np.cos(poses[..., 2]), np.sin(poses[..., 2])], axis=-1),
        pose_counts=np.full(count, length),
        step_counts=np.full(count, length - 1),
        step_s=np.full(count, step_s),
    )
    for array in window:
        array.flags.writeable = False
    return Scene.of(situate(**changes), window)
