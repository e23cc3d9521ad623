"""The rule that set the speed of a cycle of Regulated Pure Pursuit, in words and as a table."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drake_navbench.controllers.rpp.cycle import (
    CENTRE_OFF_MAP,
    NO_COLLISION,
    ROTATE_TO_GOAL,
    ROTATE_TO_PATH,
    Cycle,
)
from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters
from drake_navbench.explanation import (
    SPEED_COLUMNS,
    Explanation,
    SpeedRule,
    collision_stop,
    length_text,
    speed_rows,
)


class CycleFacts(NamedTuple):
    """The facts of a cycle that its outcome does not tell.

    max_v: desired speed under the speed limit, m/s. centre_cost: cost of the cell below the robot.
    is_cancelling: the robot brakes because the goal is cancelled.
    """

    parameters: RegulatedPurePursuitParameters
    max_v: float
    centre_cost: int
    is_cancelling: bool


def explained(cycle: Cycle, situation: CycleFacts) -> Explanation:
    """Returns the reasons of a cycle's command, or of the stop before a collision."""
    command = cycle.command
    chosen = np.array([command.v, command.w])
    if command.branch == CENTRE_OFF_MAP:
        return Explanation(
            None, "RPP stops: the robot's centre is off the costmap.", SPEED_COLUMNS, ()
        )
    turning = _turning(cycle, situation.parameters)
    if turning is not None:
        rules, setting = [turning], turning
    else:
        rules = _rules(cycle, situation)
        setting = _setting(rules, cycle)
    rows = speed_rows(rules, setting)
    if cycle.collision != NO_COLLISION:
        ahead_s = cycle.collision * cycle.period if cycle.collision > 0 else 0.0
        return collision_stop("RPP", chosen, ahead_s, rules)
    if turning is not None:
        return Explanation(chosen, f"RPP turns in place: {turning.words}.", SPEED_COLUMNS, rows)
    steering = _steering(cycle)
    sentence = f"RPP drives {command.v:.3g} m/s: {setting.words}."
    return Explanation(chosen, sentence, SPEED_COLUMNS, rows, (steering,))


def _turning(cycle: Cycle, parameters: RegulatedPurePursuitParameters) -> SpeedRule | None:
    """Returns the rule of a turn in place, None where the robot tracks the plan."""
    aim = cycle.aim
    if cycle.command.branch == ROTATE_TO_GOAL:
        told = f"the goal is reached, its heading is {aim.goal_angle:.3g} rad away"
        return SpeedRule("rotate to goal", 0.0, told, told)
    if cycle.command.branch == ROTATE_TO_PATH:
        told = (
            f"the point steered at is {aim.heading_error:.3g} rad aside, more than "
            f"{parameters.rotate_to_heading_min_angle:.3g} rad"
        )
        return SpeedRule("rotate to path", 0.0, told, told)
    return None


def _rules(cycle: Cycle, situation: CycleFacts) -> list[SpeedRule]:
    """Returns the rules of a cycle that tracks the plan, in the order in which they act."""
    parameters, max_v, aim, command = (
        situation.parameters,
        situation.max_v,
        cycle.aim,
        cycle.command,
    )
    rules = [
        SpeedRule("desired speed", max_v, "max_linear_vel, speed limit", "no rule slows it down")
    ]
    if parameters.use_regulated_linear_velocity_scaling:
        radius = math.inf if aim.slowing_curvature == 0.0 else abs(1.0 / aim.slowing_curvature)
        least = parameters.regulated_linear_scaling_min_radius
        told = f"radius {length_text(radius)}, slower below {length_text(least)}"
        by = f"the curvature of {length_text(radius)} radius"
        text = f"{by} limits {max_v:.3g} to {command.curve_v:.3g}"
        rules.append(SpeedRule("curvature", command.curve_v, told, text))
    if parameters.use_cost_regulated_linear_velocity_scaling:
        told = f"cost {situation.centre_cost} below the robot's centre"
        text = f"the {told} limits {max_v:.3g} to {command.obstacle_v:.3g}"
        rules.append(SpeedRule("cost", command.obstacle_v, told, text))
    least_v = parameters.regulated_linear_scaling_min_speed
    told = f"never slower for curve and cost than {least_v:.3g}"
    rules.append(SpeedRule("least regulated speed", least_v, told, f"curve and cost are {told}"))
    if aim.plan_length < parameters.approach_velocity_scaling_dist:
        told = (
            f"{length_text(aim.end_distance)} to the plan's end, slower within "
            f"{length_text(parameters.approach_velocity_scaling_dist)}"
        )
        v = abs(command.regulated_v)
        rules.append(SpeedRule("approach", v, told, f"it is {told}"))
    if situation.is_cancelling:
        told = "the goal is cancelled, so it brakes"
        rules.append(SpeedRule("cancel", abs(command.v), told, told))
    if parameters.use_dynamic_window:
        told = "reachable within the accelerations from the last command"
        rules.append(SpeedRule("dynamic window", abs(command.v), told, f"that is the speed {told}"))
    return rules


def _setting(rules: list[SpeedRule], cycle: Cycle) -> SpeedRule:
    """Returns the rule that set the speed: the last one that changed it."""
    by_name = {rule.name: rule for rule in rules}
    command = cycle.command
    setting = rules[0]
    v = setting.speed
    for name in ("curvature", "cost"):
        if name in by_name and by_name[name].speed < v:
            setting, v = by_name[name], by_name[name].speed
    least = by_name["least regulated speed"]
    if least.speed > v:
        setting, v = least, least.speed
    if "approach" in by_name and abs(command.regulated_v) < v:
        setting, v = by_name["approach"], abs(command.regulated_v)
    v = min(v, rules[0].speed)
    for name in ("cancel", "dynamic window"):
        if name in by_name and abs(command.v) != v:
            setting, v = by_name[name], abs(command.v)
    return setting


def _steering(cycle: Cycle) -> str:
    """Returns the sentence on the turn rate."""
    aim, command = cycle.aim, cycle.command
    side = "left" if aim.curvature > 0.0 else "right"
    if aim.curvature == 0.0:
        return "It steers straight at the point ahead."
    return (
        f"It turns {command.w:.3g} rad/s: the arc to the point {length_text(aim.lookahead)} ahead "
        f"has a radius of {length_text(abs(1.0 / aim.curvature))} to the {side}."
    )
