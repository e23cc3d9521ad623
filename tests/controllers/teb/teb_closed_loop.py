"""A closed loop around the controller without the trial diagram: unicycle, boxes, rolling window.

The robot follows its commands with a first-order lag; the costmap is a window of lethal cells
around it; the plan is a polyline whose passed poses are dropped, cut a fixed length ahead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from controller_scenes import observe
from scenes import WHEELCHAIR

from drake_navbench.controller import ControllerError
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import FREE, LETHAL, Costmap

PERIOD_S = 0.05
LAG_S = 0.1
ACCELERATION_MPS2, ANGULAR_ACCELERATION_RADPS2 = 2.5, 3.0
SUBSTEP_COUNT = 10
RESOLUTION_M = 0.05
WINDOW_M = 6.0
SIGHT_M = 2.95
PLAN_AHEAD_M = 3.0
GOAL_TOLERANCE_M, GOAL_TOLERANCE_RAD = 0.25, 0.25


def window(boxes, x: float, y: float, *, sight_m: float = SIGHT_M) -> Costmap:
    """Returns the 6 x 6 m costmap around (x, y): cells inside a box and in sight are lethal."""
    count = round(WINDOW_M / RESOLUTION_M)
    origin_x = math.floor((x - 0.5 * WINDOW_M) / RESOLUTION_M) * RESOLUTION_M
    origin_y = math.floor((y - 0.5 * WINDOW_M) / RESOLUTION_M) * RESOLUTION_M
    xs = origin_x + (np.arange(count) + 0.5) * RESOLUTION_M
    ys = origin_y + (np.arange(count) + 0.5) * RESOLUTION_M
    costs = np.full((count, count), FREE, dtype=np.uint8)
    for x_min, y_min, x_max, y_max in boxes:
        inside = np.ix_((ys >= y_min) & (ys <= y_max), (xs >= x_min) & (xs <= x_max))
        costs[inside] = LETHAL
    seen = np.hypot(xs[None, :] - x, ys[:, None] - y) <= sight_m
    costs[~seen] = FREE
    return Costmap(costs, origin_x, origin_y, RESOLUTION_M)


def plan_from_elements(elements, spacing_m: float = 0.05) -> np.ndarray:
    """Returns (P, 3) poses of straights ('s', length) and arcs ('a', degrees, radius) from 0."""
    poses = [np.zeros(3)]
    for element in elements:
        if element[0] == "s":
            length, curvature = element[1], 0.0
        else:
            turn = math.radians(element[1])
            length, curvature = abs(turn) * element[2], math.copysign(1.0 / element[2], turn)
        steps = max(1, round(length / spacing_m))
        for _ in range(steps):
            x, y, yaw = poses[-1]
            step = length / steps
            middle = yaw + 0.5 * curvature * step
            poses.append(
                np.array(
                    [
                        x + step * math.cos(middle),
                        y + step * math.sin(middle),
                        yaw + curvature * step,
                    ]
                )
            )
    return np.array(poses)


@dataclass
class Drive:
    """What happened: one entry a cycle. outcome: succeeded, collided, timed_out, or the error."""

    outcome: str = "timed_out"
    times_s: list = field(default_factory=list)
    poses: list = field(default_factory=list)
    commands: list = field(default_factory=list)
    diagnostics: list = field(default_factory=list)
    step_times_s: list = field(default_factory=list)
    clearance_m: float = math.inf
    message: str = ""


def drive(
    controller,
    plan,
    boxes,
    *,
    duration_s: float = 60.0,
    start=None,
    noise=None,
    failures_allowed: int = 0,
    clock=None,
) -> Drive:
    """Drives until the goal, a collision, a failure or the end of time.

    noise: (Generator, standard deviation m and rad) of the pose that the controller sees.
    """
    pose = np.array(plan[0] if start is None else start, dtype=np.float64)
    twist = np.zeros(2)
    memory = controller.initial_memory()
    record = Drive()
    passed, failures = 0, 0
    for step in range(round(duration_s / PERIOD_S)):
        distances = np.hypot(*(plan[passed : passed + 120, :2] - pose[:2]).T)
        passed += int(np.argmin(distances))
        costmap = window(boxes, pose[0], pose[1])
        truth = footprint_cost(
            window(boxes, pose[0], pose[1], sight_m=math.inf).grid,
            WHEELCHAIR,
            *pose,
            False,
        )
        if truth >= LETHAL:
            record.outcome = "collided"
            break
        cells = costmap.lethal_centres
        if len(cells):
            record.clearance_m = min(
                record.clearance_m, float(np.hypot(*(cells - pose[:2]).T).min())
            )
        to_goal = np.hypot(*(plan[-1, :2] - pose[:2]))
        turn_left = abs(math.remainder(plan[-1, 2] - pose[2], math.tau))
        if to_goal < GOAL_TOLERANCE_M and turn_left < GOAL_TOLERANCE_RAD:
            record.outcome = "succeeded"
            break
        seen = pose.copy()
        if noise is not None:
            seen += noise[0].normal(0.0, noise[1], 3)
        ahead = plan[passed:]
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ahead[:, :2], axis=0).T))])
        observation = observe(
            ahead[lengths <= PLAN_AHEAD_M],
            time_s=step * PERIOD_S,
            pose=seen,
            twist=twist,
            costmap=costmap,
            goal=plan[-1],
        )
        before = clock() if clock else 0.0
        try:
            decision = controller.step(observation, memory)
            command, memory = decision.command, decision.memory
            record.diagnostics.append(decision.diagnostics)
            failures = 0
        except ControllerError as error:
            failures += 1
            if failures > failures_allowed:
                record.outcome, record.message = type(error).__name__, str(error)
                break
            command = np.zeros(2)
            memory = error.memory if error.memory is not None else memory
        record.step_times_s.append((clock() if clock else 0.0) - before)
        record.times_s.append(step * PERIOD_S)
        record.poses.append(pose.copy())
        record.commands.append(np.array(command))
        pose, twist = _advance(pose, twist, np.asarray(command))
    record.poses.append(pose.copy())
    return record


def _advance(pose, twist, command):
    """Returns pose and twist one period later: lag, limited acceleration, exact arcs."""
    step_s = PERIOD_S / SUBSTEP_COUNT
    limits = np.array([ACCELERATION_MPS2, ANGULAR_ACCELERATION_RADPS2])
    for _ in range(SUBSTEP_COUNT):
        twist = twist + step_s * np.clip((command - twist) / LAG_S, -limits, limits)
        middle = pose[2] + 0.5 * twist[1] * step_s
        pose = pose + step_s * np.array(
            [twist[0] * math.cos(middle), twist[0] * math.sin(middle), twist[1]]
        )
    return pose, twist
