"""Logs to replay: a short task beside one box, driven by several controllers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from synthetic_logs import straight_log

from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.log import TrialLog

BOX_FACE_Y_M = 1.0
BEAM_ANGLES_RAD = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def scenario(length_m: float) -> Scenario:
    """Returns a straight task with a box on its left."""
    box = {"type": "box", "min": [0.0, BOX_FACE_Y_M], "max": [length_m, BOX_FACE_Y_M + 0.5]}
    return Scenario.model_validate(
        {
            "name": "beside_a_box",
            "description": "Straight past a <box>",
            "goal": [length_m, 0.0, 0.0],
            "world": {"obstacles": [box]},
        }
    )


def scan(time_s: float, x_m: float) -> Scan:
    """Returns what a lidar at (x, 0) sees of the line of the box's face, up to 3 m away."""
    with np.errstate(divide="ignore"):
        ranges = BOX_FACE_Y_M / np.sin(BEAM_ANGLES_RAD)
    ranges = np.where((ranges > 0.0) & (ranges < 3.0), ranges, np.inf)
    return Scan(time_s, np.array([x_m, 0.0, 0.0]), BEAM_ANGLES_RAD, ranges.astype(np.float32))


def costmap(time_s: float, x_m: float) -> Costmap:
    """Returns one of 1.5 m by 1 m with a lethal cell, at the robot's x but for half its length."""
    costs = np.zeros((20, 30), dtype=np.uint8)
    costs[10, 15] = LETHAL
    return Costmap(costs, origin_x=x_m - 0.75, origin_y=-0.5, resolution=0.05, stamp_s=time_s)


def replay_log(
    controller: str,
    *,
    robot: str = "wheelchair",
    end_time_s: float = 4.0,
    speed_mps: float = 0.5,
    info: dict[str, Any] | None = None,
    **kwargs: Any,
) -> TrialLog:
    """Returns a complete log of a straight drive, as a trial writes it."""
    task = scenario(speed_mps * end_time_s)
    log = straight_log(
        speed_mps=speed_mps,
        end_time_s=end_time_s,
        info={
            "scenario": task.model_dump(mode="json"),
            "obstacles": [o.model_dump(mode="json") for o in task.true_world.obstacles],
            "robot": load_robot(robot).model_dump(mode="json"),
            "controller": controller,
        }
        | (info or {}),
        **kwargs,
    )
    times = np.arange(0.0, end_time_s, 0.1)
    scans = tuple(scan(float(t), speed_mps * float(t)) for t in times)
    updates = [float(t) for t in np.arange(0.01, end_time_s, 0.2)]
    costmaps = tuple(costmap(time_s, speed_mps * time_s) for time_s in updates)
    return dataclasses.replace(log, scans=scans, costmaps=costmaps)


def with_diagnostics(log: TrialLog) -> TrialLog:
    """Returns the log with the trajectories that a sampling controller leaves."""
    horizon_m = 0.025 * np.arange(56)
    bends = np.linspace(-1.0, 1.0, 100)[:, None]
    ahead = np.broadcast_arrays(horizon_m, bends * horizon_m**2, bends * horizon_m)
    fan = np.stack(ahead, axis=2)
    cycles = []
    for time_s in np.arange(0.0, log.end_time_s, 0.05):
        x = 0.5 * time_s
        samples = fan + np.array([x, 0.0, 0.0])
        cycles.append(
            (
                float(time_s),
                {
                    "predicted_trajectory": samples[50],
                    "sampled_trajectories": samples,
                    "sampled_costs": np.abs(bends[:, 0]),
                    "carrot": np.array([x + 0.6, 0.0]),
                    "stop_trajectory": samples[50][:20],
                    "group_trajectories": samples[[30, 70]],
                    "critic": 1.0,
                },
            )
        )
    return dataclasses.replace(log, diagnostics=tuple(cycles))
