"""The rule that set the speed of a cycle of the Graceful Controller, in words and as a table."""

from __future__ import annotations

import math

import numpy as np

from drake_navbench.controllers.graceful.cycle import (
    BLOCKED,
    ROTATE_TO_GOAL,
    ROTATE_TO_TARGET,
    Cycle,
)
from drake_navbench.controllers.graceful.simulation import Scene
from drake_navbench.explanation import (
    SPEED_COLUMNS,
    Explanation,
    SpeedRule,
    command_text,
    length_text,
    speed_rows,
)

# Speeds that differ by less are one: the control law is computed in single precision.
SAME_SPEED_MPS = 1e-5


def explained(cycle: Cycle, scene: Scene) -> Explanation:
    """Returns the reasons of a cycle's command."""
    if cycle.branch == BLOCKED:
        told = "Graceful stops: on the way to every target on the plan the outline hits something."
        return Explanation(None, told, (), ())
    if not (math.isfinite(cycle.v) and math.isfinite(cycle.w)):
        told = "Graceful stops: the only free target is where the robot stands."
        return Explanation(None, told, (), ())
    command = np.array([cycle.v, cycle.w])
    told = command_text(command)
    if cycle.branch in (ROTATE_TO_GOAL, ROTATE_TO_TARGET):
        place = "goal" if cycle.branch == ROTATE_TO_GOAL else "target"
        away = f"{cycle.target_yaw:.3g} rad away"
        sentence = f"Graceful turns, {told}: the heading of the {place} is {away}."
        return Explanation(command, sentence, (), ())
    distance = math.hypot(cycle.target_x, cycle.target_y)
    note = (
        f"The target is the farthest pose of the plan that a simulated drive reaches without a "
        f"collision: {length_text(distance)} away, its heading {cycle.target_yaw:.3g} rad."
    )
    if cycle.v == 0.0:
        angle = math.atan2(cycle.target_y, cycle.target_x)
        sentence = f"Graceful turns, {told}: the target is {angle:.3g} rad aside."
        return Explanation(command, sentence, (), (), (note,))
    rules = _rules(cycle, scene, distance)
    setting = _setting(rules, abs(cycle.v))
    sentence = f"Graceful drives {told}: {setting.words}."
    return Explanation(command, sentence, SPEED_COLUMNS, speed_rows(rules, setting), (note,))


def _rules(cycle: Cycle, scene: Scene, distance: float) -> list[SpeedRule]:
    """Returns the bounds of the control law, in its order."""
    law, max_v = scene.law, scene.max_v
    curvature = abs(cycle.w / cycle.v)
    radius = length_text(1.0 / curvature if curvature > 0.0 else math.inf)
    told = "v_linear_max, speed limit"
    rules = [SpeedRule("desired speed", max_v, told, "no rule slows it down")]
    v = max_v / (1.0 + law.beta * curvature**law.lambda_)
    told = f"radius {radius}: beta {law.beta:.3g}, lambda {law.lambda_:.3g}"
    text = f"the curvature of {radius} radius limits {max_v:.3g} to {v:.3g}"
    rules.append(SpeedRule("curvature", v, told, text))
    v = max_v * distance / law.slowdown_radius
    told = f"target {length_text(distance)} away, slower within {length_text(law.slowdown_radius)}"
    rules.append(SpeedRule("slowdown", v, told, f"the {told}"))
    v = math.sqrt(2.0 * distance * law.deceleration_max)
    if v < 1e3:
        told = f"stops within {length_text(distance)} at {law.deceleration_max:.3g} m/s^2"
        rules.append(SpeedRule("braking", v, told, f"it {told}"))
    if curvature > 0.0:
        told = f"radius {radius} at {law.max_w:.3g} rad/s at most"
        rules.append(SpeedRule("turn rate", law.max_w / curvature, told, told))
    told = "v_linear_min"
    rules.append(SpeedRule("least speed", law.v_linear_min, told, f"that is {told}"))
    v = abs(cycle.v)
    told = "faster, the drive to the target is not free"
    rules.append(SpeedRule("room", v, told, told))
    return rules


def _setting(rules: list[SpeedRule], v: float) -> SpeedRule:
    """Returns the rule that set the speed v; `room`, the last one, where no other gives it."""
    *bounds, least, room = rules
    slowest = min(bounds, key=lambda rule: rule.speed)
    given = least if least.speed > slowest.speed else slowest
    if abs(given.speed - v) <= SAME_SPEED_MPS * max(1.0, v):
        del rules[-1]
        return given
    return room
