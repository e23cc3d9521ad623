"""Regulated Pure Pursuit in closed loop with an exact unicycle, and its symmetries."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import observe, setup_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import straight_plan

from drake_navbench.controller import NoValidControl
from drake_navbench.controllers.rpp import RegulatedPurePursuit, RegulatedPurePursuitParameters
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.goal_checkers import SimpleGoalChecker, SimpleGoalCheckerParameters
from drake_navbench.navigation.path_handler import PathHandler, PathHandlerParameters

PERIOD_S = 0.05
RESOLUTION = 0.0625  # exact in binary: moving by whole cells moves every number exactly
FOOTPRINT = np.array([[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]])


def make_controller(**parameters):
    return RegulatedPurePursuit(RegulatedPurePursuitParameters(**parameters), setup_of(FOOTPRINT))


def advance(pose, command):
    """The pose of an exact unicycle one period later."""
    v, w = command
    x, y, yaw = pose
    turn = w * PERIOD_S
    chord = v * PERIOD_S * np.sinc(turn / (2.0 * math.pi))
    middle = yaw + 0.5 * turn
    return np.array([x + chord * math.cos(middle), y + chord * math.sin(middle), yaw + turn])


def drive(controller, plan, pose, time_limit_s=40.0):
    """Drives a plan to its goal on a free map; returns (seconds, poses)."""
    path_handler = PathHandler(PathHandlerParameters())
    checker = SimpleGoalChecker(SimpleGoalCheckerParameters())
    path, check, memory = (
        path_handler.set_plan(plan),
        checker.initial_state(),
        controller.initial_memory(),
    )
    pose, twist, poses = np.array(pose, dtype=float), np.zeros(2), []
    for cycle in range(round(time_limit_s / PERIOD_S)):
        costmap = Costmap(np.zeros((120, 120), np.uint8), pose[0] - 3.0, pose[1] - 3.0, 0.05)
        local_plan, path = path_handler.cut(path, pose, costmap)
        goal = checker.check(check, pose=pose, goal=plan[-1], twist=twist, local_plan=local_plan)
        check = goal.state
        poses.append(pose)
        if goal.reached:
            return cycle * PERIOD_S, np.array(poses)
        observation = observe(
            local_plan,
            time_s=cycle * PERIOD_S,
            pose=pose,
            twist=twist,
            costmap=costmap,
            goal=plan[-1],
            goal_xy_reached=goal.xy_reached,
        )
        twist, memory, _ = controller.step(observation, memory)
        pose = advance(pose, twist)
    raise AssertionError(f"not at the goal after {time_limit_s} s, but at {pose}")


def test_straight_plan_takes_as_long_as_with_the_original():
    # 0.5 m/s up to 0.6 m before the goal, then v = 0.5 d / 0.6 down to d = 0.25 m:
    # 6.65 / 0.5 + 1.2 ln(0.6 / 0.25) = 13.3 + 1.05 = 14.35 s.
    duration_s, poses = drive(make_controller(), straight_plan(7.25), (0.0, 0.0, 0.0))
    assert duration_s == pytest.approx(14.35)
    np.testing.assert_array_equal(poses[:, 1:], 0.0)


def test_converges_to_a_plan_beside_the_robot():
    _, poses = drive(make_controller(), straight_plan(6.0), (0.0, 0.4, 0.0))
    assert abs(poses[len(poses) // 2, 1]) < 0.02


def test_turns_round_first_and_to_the_heading_of_the_goal_last():
    plan = straight_plan(2.0)
    plan[-1, 2] = -2.0
    _, poses = drive(make_controller(), plan, (0.0, 0.0, 3.0))
    turned_first = poses[np.argmax(poses[:, 0] > 0.01)]
    assert abs(turned_first[2]) < 0.8
    assert poses[-1, 2] == pytest.approx(-2.0, abs=0.25)


MIRROR = np.array([1.0, -1.0, -1.0])


def cluttered_observation(seed):
    """A random plan, robot and map with few obstacles; poses have few bits, maps exact cells."""
    generator = np.random.default_rng(seed)
    costs = np.zeros((96, 96), np.uint8)
    costs[tuple(generator.integers(0, 96, (2, 4)))] = 254
    costs[generator.random(costs.shape) < 0.3] = 120
    turns = np.cumsum(generator.normal(0.0, 0.1, 40))
    steps = 0.05 * np.column_stack([np.cos(turns), np.sin(turns)])
    plan = np.column_stack([np.cumsum(steps, axis=0), turns])
    plan = np.round(plan * 2**20) / 2**20
    pose = np.round(generator.normal(0.0, [0.1, 0.2, 0.4]) * 2**20) / 2**20
    twist = generator.uniform([0.0, -0.5], [0.5, 0.5])
    return observe(plan, pose=pose, twist=twist, costmap=Costmap(costs, -3.0, -3.0, RESOLUTION))


def outcome(controller, observation):
    """The command, or None where there is no valid one."""
    try:
        return controller.step(observation, controller.initial_memory()).command
    except NoValidControl:
        return None


@given(
    seed=st.integers(0, 10_000),
    cells=st.tuples(st.integers(-20, 20), st.integers(-20, 20)),
    uses_window=st.booleans(),
)
@settings(deadline=None)
def test_moving_the_world_by_whole_cells_does_not_change_the_command(seed, cells, uses_window):
    controller = make_controller(use_dynamic_window=uses_window)
    here = cluttered_observation(seed)
    shift = RESOLUTION * np.array([cells[0], cells[1], 0.0])
    there = replace(
        here,
        pose=here.pose + shift,
        plan=here.plan + shift,
        goal=here.goal + shift,
        costmap=Costmap(here.costmap.costs, *(shift[:2] - 3.0), RESOLUTION),
    )
    one, other = outcome(controller, here), outcome(controller, there)
    assert (one is None) == (other is None)
    if one is not None:
        np.testing.assert_array_equal(one, other)


@given(seed=st.integers(0, 10_000), uses_window=st.booleans())
@settings(deadline=None)
def test_a_mirrored_world_gives_the_mirrored_command(seed, uses_window):
    controller = make_controller(use_dynamic_window=uses_window, use_collision_detection=False)
    here = cluttered_observation(seed)
    there = replace(
        here,
        pose=here.pose * MIRROR,
        twist=here.twist * MIRROR[:2],
        plan=here.plan * MIRROR,
        goal=here.goal * MIRROR,
        costmap=Costmap(here.costmap.costs[::-1], -3.0, -3.0, RESOLUTION),
    )
    one, other = outcome(controller, here), outcome(controller, there)
    np.testing.assert_allclose(other, one * MIRROR[:2], atol=1e-12)
