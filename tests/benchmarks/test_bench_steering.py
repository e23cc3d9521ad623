"""Speed of the Rotation Shim, the Graceful Controller and Vector Pursuit.

A cycle of the latter two takes 0.2 ms at most, and the shim adds a few microseconds to its primary
controller.
"""

from __future__ import annotations

import pytest
from controller_scenes import arc_plan, make_costmap, make_setup, observe, turned_plan

from drake_navbench.inputs.presets import load_preset

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
