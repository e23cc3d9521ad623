"""Speed of Regulated Pure Pursuit and of the controller server's parts around it.

Nav2's C++ takes about 4 us for a cycle of Regulated Pure Pursuit; most of what is measured here is
the way from Python into the kernel.
"""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import observe, setup_of

from drake_navbench.controllers.rpp import RegulatedPurePursuit, RegulatedPurePursuitParameters
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.goal_checkers import SimpleGoalChecker, SimpleGoalCheckerParameters
from drake_navbench.navigation.path_handler import PathHandler, PathHandlerParameters

PLAN = np.column_stack([np.arange(0.0, 15.0, 0.05), np.zeros((300, 2))])
POSE = np.array([0.01, 0.05, 0.05])
TWIST = np.array([0.4, 0.0])


@pytest.fixture
def costmap():
    costs = np.zeros((120, 120), np.uint8)
    costs[80:, :] = 50
    return Costmap(costs, -3.0, -3.0, 0.05)


def test_bench_rpp_cycle(benchmark, costmap):
    setup = setup_of(np.array([[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]]))
    controller = RegulatedPurePursuit(RegulatedPurePursuitParameters(), setup)
    observation = observe(PLAN[:41], pose=POSE, twist=TWIST, costmap=costmap, goal=PLAN[-1])
    observation.plan.flags.writeable = False
    memory = controller.initial_memory()
    controller.step(observation, memory)
    benchmark(controller.step, observation, memory)


def test_bench_path_handler_cut(benchmark, costmap):
    path_handler = PathHandler(PathHandlerParameters())
    state = path_handler.set_plan(PLAN)
    path_handler.cut(state, POSE, costmap)
    benchmark(path_handler.cut, state, POSE, costmap)


def test_bench_goal_check(benchmark):
    checker = SimpleGoalChecker(SimpleGoalCheckerParameters())
    state = checker.initial_state()
    local_plan = PLAN[:41]
    arguments = {"pose": POSE, "goal": PLAN[-1], "twist": TWIST, "local_plan": local_plan}
    checker.check(state, **arguments)
    benchmark(checker.check, state, **arguments)
