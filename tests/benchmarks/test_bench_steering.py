"""Speed of Nav2's small controllers, and of the controller server's parts around them.

Nav2's C++ takes about 4 us for a cycle of Regulated Pure Pursuit; most of what is measured here is
the way from Python into the kernel. A cycle of Graceful and of Vector Pursuit takes 0.2 ms at most,
and the shim adds a few microseconds to its primary controller.
"""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import arc_plan, make_costmap, make_setup, observe, turned_plan

from drake_navbench.inputs.presets import load_preset
from drake_navbench.navigation.goal_checkers import SimpleGoalChecker, SimpleGoalCheckerParameters
from drake_navbench.navigation.path_handler import PathHandler, PathHandlerParameters

PLAN = np.column_stack([np.arange(0.0, 15.0, 0.05), np.zeros((300, 2))])
POSE = np.array([0.01, 0.05, 0.05])
# Beside the plan, so that outlines and costs are looked at, and nothing is in the way.
COSTMAP = make_costmap(cells=[(0.1 * i, 1.9, 254) for i in range(-20, 20)])


def make_controller(preset):
    loaded = load_preset(preset)
    return loaded.controller_class(loaded.parameters, make_setup())


@pytest.mark.parametrize(
    "preset", ["graceful", "vector_pursuit", "rotation_shim", "rpp:use_rotate_to_heading=false"]
)
def test_bench_cycle_in_a_curve(benchmark, preset):
    controller = make_controller(preset)
    seen = observe(arc_plan(2.0, 1.0), twist=(0.4, 0.2), costmap=COSTMAP)
    memory = controller.step(seen, controller.initial_memory()).memory
    benchmark(controller.step, seen, memory)


def test_bench_turn_of_the_shim(benchmark):
    controller = make_controller("rotation_shim")
    seen = observe(turned_plan(2.0), twist=(0.0, 1.0))
    memory = controller.step(seen, controller.initial_memory()).memory
    benchmark(controller.step, seen, memory)


def test_bench_graceful_before_the_goal(benchmark):
    controller = make_controller("graceful")
    seen = observe(turned_plan(0.2, 0.8), costmap=COSTMAP)
    memory = controller.step(seen, controller.initial_memory()).memory
    benchmark(controller.step, seen, memory)


def test_bench_path_handler_cut(benchmark):
    path_handler = PathHandler(PathHandlerParameters())
    state = path_handler.set_plan(PLAN)
    path_handler.cut(state, POSE, COSTMAP)
    benchmark(path_handler.cut, state, POSE, COSTMAP)


def test_bench_goal_check(benchmark):
    checker = SimpleGoalChecker(SimpleGoalCheckerParameters())
    state, twist = checker.initial_state(), np.array([0.4, 0.0])
    arguments = {"pose": POSE, "goal": PLAN[-1], "twist": twist, "local_plan": PLAN[:41]}
    checker.check(state, **arguments)
    benchmark(checker.check, state, **arguments)
