"""Inflation: the costs of Nav2's formula at exact distances."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.kernels.inflation import CellWindow, inflate, inflation_costs

# A round robot of 0.22 m with 0.01 m padding, on Nav2's default grid.
ROBOT = {"resolution": 0.05, "inscribed_radius": 0.2254985}
BRINGUP = {**ROBOT, "inflation_radius": 0.7, "cost_scaling_factor": 3.0}
REACH = 14  # 0.7 m / 0.05 m


def one_obstacle(size=31, value=LETHAL):
    costs = np.zeros((size, size), dtype=np.uint8)
    costs[size // 2, size // 2] = value
    return costs


def random_obstacles(seed, shape=(40, 50), share=0.01):
    generator = np.random.default_rng(seed)
    return np.where(generator.random(shape) < share, LETHAL, 0).astype(np.uint8)


@pytest.mark.parametrize(
    ("squared", "cost"),
    [
        (0, 254),
        (1, 253),
        (16, 253),
        (17, 253),  # sqrt(17) cells = 0.2062 m
        (20, 253),  # sqrt(20) cells = 0.2236 m
        (25, 234),  # 252 exp(-3 (0.25 - 0.2254985)) = 234.1
        (36, 201),  # 252 exp(-3 (0.30 - 0.2254985)) = 201.5
        (64, 149),
        (100, 110),
        (144, 81),
        (196, 60),  # 252 exp(-3 (0.70 - 0.2254985)) = 60.7
    ],
)
def test_cost_at_a_distance_is_that_of_nav2(squared, cost):
    assert inflation_costs(REACH, **ROBOT, cost_scaling_factor=3.0)[squared] == cost


def test_distance_is_rounded_to_a_hundredth_of_a_cell():
    # sqrt(50) = 7.0711 cells counts as 7.07. The decay 400 / m makes the difference visible:
    # 252 exp(-400 (0.3535 - 0.35)) = 62.1, while 0.353553 m would give 60.8.
    costs = inflation_costs(10, resolution=0.05, inscribed_radius=0.35, cost_scaling_factor=400.0)
    assert costs[50] == 62


def test_costs_fall_off_along_a_row_up_to_and_with_the_reach():
    row = inflate(one_obstacle(), **BRINGUP)[15, 15:]
    np.testing.assert_array_equal(
        row, [254, 253, 253, 253, 253, 234, 201, 173, 149, 128, 110, 95, 81, 70, 60, 0]
    )


def test_cells_beyond_the_reach_keep_their_cost():
    costs = one_obstacle(size=41)
    costs[20, 35], costs[20, 34] = 7, 7  # 15 and 14 cells away
    inflated = inflate(costs, **BRINGUP)
    assert inflated[20, 35] == 7
    assert inflated[20, 34] == 60
    assert inflated[30, 30] == 0  # sqrt(200) > 14
    assert inflated[29, 30] > 0  # sqrt(181) < 14


def test_reach_rounds_up_to_whole_cells():
    inflated = inflate(one_obstacle(), **{**BRINGUP, "inflation_radius": 0.51})
    assert inflated[15, 15 + 11] == 95
    assert inflated[15, 15 + 12] == 0


def test_reach_below_the_inscribed_radius_cuts_the_inscribed_ring():
    inflated = inflate(one_obstacle(), **{**BRINGUP, "inflation_radius": 0.1})
    np.testing.assert_array_equal(inflated[15, 13:20], [253, 253, 254, 253, 253, 0, 0])


def test_no_radius_inflates_nothing():
    costs = one_obstacle()
    np.testing.assert_array_equal(inflate(costs, **{**BRINGUP, "inflation_radius": 0.0}), costs)


def test_map_without_obstacles_stays_as_it_is():
    costs = np.full((20, 30), INSCRIBED, dtype=np.uint8)
    np.testing.assert_array_equal(inflate(costs, **BRINGUP), costs)


def test_higher_cost_stays():
    costs = one_obstacle()
    costs[15, 25] = 200  # 10 cells away: 110
    assert inflate(costs, **BRINGUP)[15, 25] == 200


def test_unknown_cells_take_contact_costs_only():
    costs = np.full((1, 20), NO_INFORMATION, dtype=np.uint8)
    costs[0, 0] = LETHAL
    np.testing.assert_array_equal(
        inflate(costs, **BRINGUP)[0], [254, 253, 253, 253, 253] + [NO_INFORMATION] * 15
    )


def test_inflate_unknown_lets_graded_costs_replace_unknown():
    costs = np.full((1, 20), NO_INFORMATION, dtype=np.uint8)
    costs[0, 0] = LETHAL
    inflated = inflate(costs, **{**BRINGUP, "inflate_unknown": True})[0]
    np.testing.assert_array_equal(inflated[3:7], [253, 253, 234, 201])
    np.testing.assert_array_equal(inflated[14:], [60] + [NO_INFORMATION] * 5)


def test_cost_of_zero_never_replaces_unknown():
    # 252 exp(-20 (0.6 - 0.2254985)) = 0.14
    costs = np.full((1, 20), NO_INFORMATION, dtype=np.uint8)
    costs[0, 0] = LETHAL
    steep = {**BRINGUP, "cost_scaling_factor": 20.0, "inflate_unknown": True}
    assert inflate(costs, **steep)[0, 12] == NO_INFORMATION


def test_unknown_cells_can_be_sources():
    costs = one_obstacle(value=NO_INFORMATION)
    assert not np.any(inflate(costs, **BRINGUP) == INSCRIBED)
    around = inflate(costs, **{**BRINGUP, "inflate_around_unknown": True})
    assert around[15, 15] == LETHAL  # distance 0: Nav2 turns the source itself into an obstacle
    assert around[15, 19] == INSCRIBED
    assert around[15, 20] == 234


def test_inscribed_cells_are_no_sources():
    assert inflate(one_obstacle(value=INSCRIBED), **BRINGUP).sum() == INSCRIBED


@settings(deadline=None)
@given(seed=st.integers(0, 1000), radius=st.floats(0.04, 3.0), share=st.floats(0.0, 0.05))
def test_costs_agree_with_an_exact_distance_transform(seed, radius, share):
    costs = random_obstacles(seed, share=share)
    inflated = inflate(costs, **{**BRINGUP, "inflation_radius": radius})
    if not costs.any():
        assert not inflated.any()
        return
    cells = distance_transform_edt(costs != LETHAL)
    metres = np.round(cells, 2) * 0.05
    graded = np.trunc(252 * np.exp(-3.0 * (metres - 0.2254985)))
    expected = np.where(metres <= 0.2254985, INSCRIBED, graded)
    expected = np.where(cells == 0, LETHAL, expected)
    expected = np.where(cells > math.ceil(radius / 0.05), 0, expected)
    np.testing.assert_array_equal(inflated, expected)


@settings(deadline=None)
@given(seed=st.integers(0, 1000))
def test_mirrored_and_turned_maps_inflate_alike(seed):
    costs = random_obstacles(seed)
    inflated = inflate(costs, **BRINGUP)
    np.testing.assert_array_equal(inflate(costs[::-1].copy(), **BRINGUP), inflated[::-1])
    np.testing.assert_array_equal(inflate(costs.T.copy(), **BRINGUP), inflated.T)


def test_obstacles_moved_by_whole_cells_give_moved_costs():
    costs = np.zeros((60, 60), dtype=np.uint8)
    costs[20:24, 20:24] = random_obstacles(5, shape=(4, 4), share=0.5)
    moved = np.roll(costs, (7, 11), axis=(0, 1))
    np.testing.assert_array_equal(
        inflate(moved, **BRINGUP), np.roll(inflate(costs, **BRINGUP), (7, 11), axis=(0, 1))
    )


@settings(deadline=None)
@given(
    seed=st.integers(0, 1000),
    rows=st.tuples(st.integers(0, 40), st.integers(0, 40)).map(sorted),
    columns=st.tuples(st.integers(0, 50), st.integers(0, 50)).map(sorted),
)
def test_window_alone_is_written_but_obstacles_outside_count(seed, rows, columns):
    costs = random_obstacles(seed)
    expected = costs.copy()
    inside = np.s_[rows[0] : rows[1], columns[0] : columns[1]]
    expected[inside] = inflate(costs, **BRINGUP)[inside]
    window = CellWindow(*rows, *columns)
    np.testing.assert_array_equal(inflate(costs, **BRINGUP, window=window), expected)


def test_input_stays_unchanged_and_may_be_read_only():
    costs = random_obstacles(1)
    before = costs.copy()
    costs.flags.writeable = False
    inflated = inflate(costs, **BRINGUP)
    np.testing.assert_array_equal(costs, before)
    assert inflated.flags.writeable
