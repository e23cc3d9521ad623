"""What the tests of MPPI have in common."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from controller_scenes import observe as observe_plan
from controller_scenes import setup_of
from scenes import straight_plan

from drake_navbench.controller import ControllerSetup, NoiseKey
from drake_navbench.controllers.mppi.critics.base import CriticContext
from drake_navbench.controllers.mppi.critics.batch import Batch, Scene
from drake_navbench.controllers.mppi.critics.registry import load_critics
from drake_navbench.controllers.mppi.lanes import pack
from drake_navbench.controllers.mppi.motion_models import MotionModel
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.sequence_rules import limits_of
from drake_navbench.inputs.presets import preset_files
from drake_navbench.kernels.footprint import circle_footprint, pad_footprint
from drake_navbench.kernels.grid import Costmap
from drake_navbench.typed_files.typed_yaml import read_yaml

RESOLUTION = 0.05
CELLS = 60
BRINGUP = read_yaml(preset_files()["mppi_bringup"])["parameters"]


def round_robot(**changes) -> ControllerSetup:
    """A round robot of radius 0.22 m at 20 Hz, as in nav2_bringup."""
    values = {"footprint_is_circle": True, "inflation_radius_m": 0.7}
    robot = setup_of(pad_footprint(circle_footprint(0.22), 0.01), **values)
    return replace(robot, **changes)


def costmap(costs=None) -> Costmap:
    """3 x 3 m around the origin; free, or `costs` (60, 60)."""
    if costs is None:
        costs = np.zeros((CELLS, CELLS), np.uint8)
    return Costmap(costs, -1.5, -1.5, RESOLUTION)


def scene_of(plan, *, pose=(0.0, 0.0, 0.0), costs=None) -> Scene:
    """A scene in the 3 x 3 m map."""
    return Scene.from_plan(np.asarray(plan, float), pose=pose, costmap=costmap(costs))


def packed(scene, poses, velocities, furthest=None) -> Batch:
    """The samples with poses (B, N, 3) x, y, yaw and velocities (B, N, 3) vx, vy, wz."""
    lanes = (
        pack(np.asarray(values, np.float32)[:, :, k])
        for values in (poses, velocities)
        for k in range(3)
    )
    return Batch(scene, len(poses), *lanes, known_furthest=furthest)


def batch_of(scene, *, x, y=0.0, yaw=0.0, vx=0.0, vy=0.0, wz=0.0, furthest=None) -> Batch:
    """One sample from columns (N,), or constants."""
    columns = np.broadcast_arrays(np.atleast_1d(np.asarray(x, float)), y, yaw, vx, vy, wz)
    poses = np.stack(columns[:3], axis=1)[None]
    velocities = np.stack(columns[3:], axis=1)[None]
    return packed(scene, poses, velocities, furthest)


def critic_of(name, *, setup=None, steps=56, **parameters):
    """One critic, with `parameters` in its own block and bringup's around it."""
    everything = MppiParameters(critics=[name], time_steps=steps, **{name: parameters})
    context = CriticContext(
        setup or round_robot(),
        MotionModel.DIFF_DRIVE,
        limits_of(everything),
        min_turning_r=0.2,
        model_dt=0.05,
        time_steps=steps,
    )
    return load_critics(((name, everything.critic(name)) for name in everything.critics), context)[
        0
    ]


def observe(*, pose=(0.0, 0.0, 0.0), twist=(0.0, 0.0), plan=None, step=0, seed=1, costs=None):
    """An observation in the 3 x 3 m map; the plan is straight where none is given."""
    plan = straight_plan(1.45) if plan is None else plan
    cycle = {"time_s": 0.05 * step, "noise_key": NoiseKey(seed, 0, step)}
    return observe_plan(plan, pose=pose, twist=twist, costmap=costmap(costs), **cycle)
