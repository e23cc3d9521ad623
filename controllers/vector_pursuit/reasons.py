"""The rule that set the speed of a cycle of Vector Pursuit, in words and as a table."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.vector_pursuit.cycle import (
    CENTRE_OFF_MAP,
    NO_COLLISION,
    ROTATE_TO_GOAL,
    ROTATE_TO_PATH,
    STRAIGHT_RADIUS_M,
    Cycle,
    speed_near_obstacle,
)
from drake_navbench.controllers.vector_pursuit.parameters import VectorPursuitParameters
from drake_navbench.explanation import (
    SPEED_COLUMNS,
    Explanation,
    SpeedRule,
    collision_stop,
    length_text,
    speed_rows,
)
from drake_navbench.kernels.angles import wrap


class CycleFacts(NamedTuple):
    """The facts of a cycle that its outcome does not tell.

    settings: (1,) the kernels' record. max_v: desired speed under the speed limit, last_v: of the
    last command, m/s. centre_cost: cost of the cell below the robot. plan_length, end_distance:
    lengths of the local plan, and straight to its end, m.
    """

    parameters: VectorPursuitParameters
    settings: NDArray[np.void]
    max_v: float
    last_v: float
    centre_cost: int
    plan_length: float
    end_distance: float


def explained(cycle: Cycle, situation: CycleFacts) -> Explanation:
    """Returns the reasons of a cycle's command, or of the stop before a collision."""
    command = cycle.command
    chosen = np.array([command.v, command.w])
    if command.branch == CENTRE_OFF_MAP:
        told = "Vector Pursuit stops: the robot's centre is off the costmap."
        return Explanation(None, told, (), ())
    turning = _turning(cycle, situation.parameters)
    rules = [turning] if turning else _rules(cycle, situation)
    setting = turning or _setting(rules)
    if cycle.collision != NO_COLLISION:
        ahead_s = cycle.collision * cycle.period if cycle.collision > 0 else 0.0
        return collision_stop("Vector Pursuit", chosen, ahead_s, rules)
    rows = speed_rows(rules, setting)
    if not math.isfinite(command.w):
        told = "Vector Pursuit stops: its turn rate has no bound."
        return Explanation(None, told, SPEED_COLUMNS, rows)
    if turning is not None:
        sentence = f"Vector Pursuit turns in place: {turning.words}."
        return Explanation(chosen, sentence, SPEED_COLUMNS, rows)
    sentence = f"Vector Pursuit drives {command.v:.3g} m/s: {setting.words}."
    note = (
        f"It turns {command.w:.3g} rad/s: the curve to the pose {length_text(command.lookahead)} "
        f"ahead and its heading has a radius of {_radius(command.radius)}."
    )
    return Explanation(chosen, sentence, SPEED_COLUMNS, rows, (note,))


def _turning(cycle: Cycle, parameters: VectorPursuitParameters) -> SpeedRule | None:
    command = cycle.command
    if command.branch == ROTATE_TO_GOAL:
        told = "the goal is reached, its heading is not"
        return SpeedRule("rotate to goal", 0.0, told, told)
    if command.branch == ROTATE_TO_PATH:
        angle = math.atan2(command.target_y, command.target_x)
        if parameters.allow_reversing and command.target_x < 0.0:
            angle = float(wrap(angle + math.pi))
        told = (
            f"the pose ahead is {angle:.3g} rad aside, more than "
            f"{parameters.rotate_to_heading_min_angle:.3g} rad"
        )
        return SpeedRule("rotate to path", 0.0, told, told)
    return None


def _rules(cycle: Cycle, situation: CycleFacts) -> list[SpeedRule]:
    """Returns the bounds of the speed in the order of the kernel: see `constrained_speed`."""
    parameters, max_v, command = situation.parameters, situation.max_v, cycle.command
    told = "desired_linear_vel, speed limit"
    rules = [SpeedRule("desired speed", max_v, told, "no rule slows it down")]
    curve_v = math.sqrt(parameters.max_lateral_accel * abs(command.radius))
    told = (
        f"a radius of {_radius(command.radius)} at {parameters.max_lateral_accel:.3g} m/s^2 aside"
    )
    rules.append(SpeedRule("curvature", curve_v, told, f"{told} allows no more"))
    if parameters.use_cost_regulated_linear_velocity_scaling:
        v = float(speed_near_obstacle(situation.settings[0], max_v, situation.centre_cost))
        told = f"cost {situation.centre_cost} below the robot's centre"
        rules.append(SpeedRule("cost", v, told, f"the {told} limits {max_v:.3g} to {v:.3g}"))
    change = parameters.max_linear_accel * float(situation.settings["control_period_s"][0])
    told = f"{situation.last_v:.3g} m/s before, {change:.3g} m/s more in a cycle"
    rules.append(SpeedRule("acceleration", abs(situation.last_v) + change, told, f"it had {told}"))
    if situation.plan_length < parameters.approach_velocity_scaling_dist:
        scaled = max_v * situation.end_distance / parameters.approach_velocity_scaling_dist
        v = max(scaled, parameters.min_approach_linear_velocity)
        told = f"{length_text(situation.end_distance)} to the plan's end"
        rules.append(SpeedRule("approach", v, told, f"it is {told}"))
    told = "min_linear_velocity"
    rules.append(SpeedRule("least speed", parameters.min_linear_velocity, told, f"that is {told}"))
    return rules


def _setting(rules: list[SpeedRule]) -> SpeedRule:
    """Returns the least bound, or the least speed where that is more."""
    *bounds, least = rules
    slowest = min(bounds, key=lambda rule: rule.speed)
    return least if least.speed > slowest.speed else slowest


def _radius(metres: float) -> str:
    return length_text(math.inf if metres >= STRAIGHT_RADIUS_M else metres)
