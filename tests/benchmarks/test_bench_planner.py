"""Speed of the global planner and the smoothers."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from drake_navbench.kernels.astar import FOUND, SearchRules, search
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation import constrained_smoother
from drake_navbench.navigation.constrained_smoother import ConstrainedSmootherParameters
from drake_navbench.navigation.navfn_planner import NavfnPlanner
from drake_navbench.navigation.planner_settings import PLANNERS
from drake_navbench.navigation.smoothers import SimpleSmoother, SimpleSmootherParameters

RESOLUTION_M = 0.05
ROOMS = 10
NO_LIMIT = 10**12
NO_FOOTPRINT = np.empty((0, 2))


def building(size):
    """(size, size) costs of ten by ten rooms with doors, inflated by 0.9 m with scaling 3."""
    rng = np.random.default_rng(0)
    room = size // ROOMS
    is_wall = np.zeros((size, size), dtype=bool)
    is_wall[::room] = True
    is_wall[:, ::room] = True
    for row in range(0, size, room):
        for column in range(0, size, room):
            doors = rng.integers(room // 3, 2 * room // 3, size=2)
            is_wall[row, column + doors[0] : column + doors[0] + 2 * room // 5] = False
            is_wall[row + doors[1] : row + doors[1] + 2 * room // 5, column] = False
    distance = distance_transform_edt(~is_wall) * RESOLUTION_M
    costs = np.floor(252.0 * np.exp(-3.0 * (distance - 0.3)))
    costs[distance > 0.9] = 0.0
    costs[distance <= 0.3] = 253.0
    costs[is_wall] = 254.0
    return costs.astype(np.uint8)


def across(size):
    """Start and goal cell near opposite corners."""
    margin = size // (2 * ROOMS)
    return (margin, margin), (size - margin, size - margin)


@pytest.mark.parametrize("size", [400, 1000])
def test_bench_search_across_a_building(benchmark, size):
    costs = building(size)
    start, goal = across(size)
    status, cells, expansions = benchmark(
        search,
        costs,
        start,
        goal,
        goal,
        SearchRules(
            tolerance=2.5,
            cost_travel_multiplier=1.0,
            allow_unknown=True,
            corner_cutting=False,
            max_iterations=0,
            max_on_approach_iterations=1000,
            terminal_checking_interval=5000,
            expansion_budget=NO_LIMIT,
        ),
    )
    assert status == FOUND
    benchmark.extra_info["expansions"] = expansions
    benchmark.extra_info["path_cells"] = len(cells)


@pytest.mark.parametrize("size", [400, 1000])
@pytest.mark.parametrize("plugin", PLANNERS.names)
def test_bench_plan_across_a_building(benchmark, plugin, size):
    plan_across(benchmark, PLANNERS.load(plugin), size)


def test_bench_plan_across_a_building_by_navfns_astar(benchmark):
    plan_across(benchmark, NavfnPlanner, 1000, use_astar=True)


def plan_across(benchmark, planner_class, size, **parameters):
    costmap = Costmap(building(size), 0.0, 0.0, RESOLUTION_M)
    start, goal = (((np.array([*cell, 0.0]) + 0.5) * RESOLUTION_M) for cell in across(size))
    planner = planner_class(planner_class.Parameters(**parameters), NO_FOOTPRINT)
    path = benchmark(planner.plan, costmap, start, goal)
    benchmark.extra_info["poses"] = len(path)


def test_bench_simple_smoother_on_500_poses(benchmark):
    costmap = Costmap(np.zeros((200, 1000), dtype=np.uint8), 0.0, 0.0, RESOLUTION_M)
    path = np.zeros((500, 3))
    path[:, 0] = 1.0 + RESOLUTION_M * np.arange(500)
    path[:, 1] = 5.0 + 0.3 * np.sin(0.1 * np.arange(500))
    benchmark(SimpleSmoother(SimpleSmootherParameters()).smooth, path, costmap)


@pytest.mark.parametrize(("poses", "downsampling"), [(61, 1), (121, 1), (301, 5)])
def test_bench_constrained_smoother(benchmark, poses, downsampling):
    costmap = Costmap(building(400), 0.0, 0.0, RESOLUTION_M)
    path = np.zeros((poses, 3))
    path[:, 0] = 1.0 + RESOLUTION_M * np.arange(poses)
    path[:, 1] = 1.0 + 0.03 * np.random.default_rng(0).normal(size=poses)
    parameters = ConstrainedSmootherParameters(path_downsampling_factor=downsampling)
    smoothed = benchmark(constrained_smoother.smooth_path, path, costmap, parameters)
    assert len(smoothed) == poses
