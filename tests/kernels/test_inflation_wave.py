"""Inflation as the releases up to Kilted make it."""

import heapq

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.kernels.inflation import CellWindow, inflate
from drake_navbench.kernels.inflation_wave import inflate_by_wave, wave_costs

RADII = {"resolution": 0.1, "inscribed_radius": 0.15, "inflation_radius": 0.5}
SLOPE = {"cost_scaling_factor": 3.0}


def grid_with(*cells, shape=(21, 21)):
    """Returns a free grid with lethal cells (row, column)."""
    costs = np.full(shape, FREE, np.uint8)
    for cell in cells:
        costs[cell] = LETHAL
    return costs


def test_costs_around_one_obstacle():
    costs = inflate_by_wave(grid_with((10, 10)), **RADII, **SLOPE)
    # 0.1 m is within the inscribed radius; 0.2, 0.3 m: 252 exp(-3 (d - 0.15)).
    assert costs[10, 10:17].tolist() == [LETHAL, INSCRIBED, 216, 160, 119, 88, 0]


def test_distances_are_not_rounded():
    # sqrt(2) cells: the newer layer takes 1.41 cells, and so a cost of one more.
    table = wave_costs(5, resolution=0.5, inscribed_radius=0.1, cost_scaling_factor=4.0)
    assert table[2] == int(252 * np.exp(-4.0 * (0.5 * np.sqrt(2.0) - 0.1)))


@given(
    cells=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=12),
    unknown=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=6),
    inflate_unknown=st.booleans(),
    around_unknown=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_it_is_nearly_the_exact_inflation(cells, unknown, inflate_unknown, around_unknown):
    costs = grid_with(*cells)
    for cell in unknown:
        costs[cell] = NO_INFORMATION
    flags = {"inflate_unknown": inflate_unknown, "inflate_around_unknown": around_unknown}
    wave = inflate_by_wave(costs, **RADII, **SLOPE, **flags)
    exact = inflate(costs, **RADII, **SLOPE, **flags)
    np.testing.assert_array_equal(wave == LETHAL, exact == LETHAL)
    np.testing.assert_array_equal(wave == INSCRIBED, exact == INSCRIBED)
    # A source that is not the nearest is at most a cell farther; rounding makes a cost of one.
    assert np.all(wave.astype(int) <= exact.astype(int) + 1)


@given(cells=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=12))
@settings(max_examples=60, deadline=None)
def test_it_is_nav2s_queue(cells):
    """Against the same rule with a priority queue of (distance, order of coming)."""
    costs, reach = grid_with(*cells), 5
    table = wave_costs(reach, resolution=0.1, inscribed_radius=0.15, **SLOPE)
    expected, seen = costs.copy(), set()
    queue = [(0, n, tuple(c), tuple(c)) for n, c in enumerate(np.argwhere(costs == LETHAL))]
    order = len(queue)
    while queue:
        squared, _, cell, source = heapq.heappop(queue)
        if cell in seen:
            continue
        seen.add(cell)
        expected[cell] = max(expected[cell], table[squared])
        for d_row, d_column in ((0, -1), (-1, 0), (0, 1), (1, 0)):
            beside = (cell[0] + d_row, cell[1] + d_column)
            away = (beside[0] - source[0]) ** 2 + (beside[1] - source[1]) ** 2
            is_on_grid = 0 <= beside[0] < 21 and 0 <= beside[1] < 21
            if is_on_grid and beside not in seen and squared <= away <= reach * reach:
                heapq.heappush(queue, (away, order, beside, source))
                order += 1
    np.testing.assert_array_equal(inflate_by_wave(costs, **RADII, **SLOPE), expected)


def test_only_the_window_changes_but_obstacles_beside_it_reach_into_it():
    costs = grid_with((10, 10))
    window = CellWindow(0, 21, 12, 14)
    inflated = inflate_by_wave(costs, window=window, **RADII, **SLOPE)
    whole = inflate_by_wave(costs, **RADII, **SLOPE)
    np.testing.assert_array_equal(inflated[:, 12:14], whole[:, 12:14])
    inflated[:, 12:14] = costs[:, 12:14]
    np.testing.assert_array_equal(inflated, costs)


@pytest.mark.parametrize("radius", [0.0])
def test_without_a_reach_nothing_happens(radius):
    costs = grid_with((10, 10))
    radii = {**RADII, "inflation_radius": radius}
    np.testing.assert_array_equal(inflate_by_wave(costs, **radii, **SLOPE), costs)
