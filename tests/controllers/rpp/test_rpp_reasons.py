"""The rule that sets RPP's speed, with the arithmetic beside the numbers."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.controllers.rpp.controller import RppMemory


def reasons(controller, observation, memory=None):
    """The explanation, its setting rule's name, and the rules' speeds by name."""
    found = controller.explain(observation, memory or RppMemory())
    speeds = {row[0]: row[1] for row in found.rows}
    (setting,) = [row[0] for row in found.rows if row[2] == "*"]
    return found, setting, speeds


def test_a_tight_curve_sets_the_speed(make_controller, observe):
    # Radius 0.75 m below 0.9 m: v = 0.5 * 0.75 / 0.9 = 0.417.
    found, setting, speeds = reasons(make_controller(), observe())
    assert setting == "curvature"
    assert speeds["desired speed"] == 0.5
    assert speeds["curvature"] == pytest.approx(0.416667, abs=1e-6)
    assert found.sentence == (
        "RPP drives 0.417 m/s: the curvature of 0.75 m radius limits 0.5 to 0.417."
    )


def test_an_obstacle_nearby_sets_the_speed(make_controller, observe, make_costmap):
    # Cost 128 stands for 0.452618 m, below 0.6 m: v = 0.5 * 0.452618 / 0.6 = 0.377.
    found, setting, _ = reasons(make_controller(), observe(costmap=make_costmap(128)))
    assert setting == "cost"
    assert found.sentence == (
        "RPP drives 0.377 m/s: the cost 128 below the robot's centre limits 0.5 to 0.377."
    )


def test_the_end_of_the_plan_sets_the_speed(make_controller, observe):
    # 0.3 m before the end, slower within 0.6 m: 0.5 * 0.3 / 0.6 = 0.25.
    plan = [[0.05 * i, 0.0, 0.0] for i in range(7)]
    found, setting, _ = reasons(make_controller(), observe(plan=plan, goal=plan[-1]))
    assert setting == "approach"
    assert found.command == pytest.approx([0.25, 0.0])


def test_the_heading_of_the_plan_turns_it_in_place(make_controller, observe):
    # The plan leads off to the left, 1.57 rad aside; from 0.785 rad on it turns in place.
    plan = [[0.0, 0.1 * i, 0.0] for i in range(20)]
    found, setting, _ = reasons(make_controller(), observe(plan=plan, goal=plan[-1]))
    assert setting == "rotate to path"
    assert "the point steered at is 1.57 rad aside, more than 0.785 rad" in found.sentence


def test_a_wall_ahead_stops_it(make_controller, observe, make_costmap):
    ahead = make_costmap(254)
    found, setting, speeds = reasons(make_controller(), observe(costmap=ahead))
    assert found.command is None
    assert setting == "collision stop"
    assert speeds["collision stop"] == 0.0
    assert "the outline hits an obstacle in 0.00 s" in found.sentence


def test_nothing_left_of_the_plan(make_controller, observe):
    found = make_controller().explain(observe(plan=np.empty((0, 3))), RppMemory())
    assert (found.command, found.rows) == (None, ())
