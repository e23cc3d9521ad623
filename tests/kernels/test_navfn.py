"""NavFn's potential and the path down its slope, by hand and as properties."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import label

from drake_navbench.kernels.navfn import (
    BLOCKED_COST,
    HIGHEST_COST,
    NEUTRAL_COST,
    UNREACHED,
    nearest_cell,
    path_down,
    reached_point_near,
    spread_potential,
    traversal_costs,
)

INSCRIBED, LETHAL, UNKNOWN = 253, 254, 255
NOWHERE = (-1, -1)


def free(rows, columns):
    return np.zeros((rows, columns), dtype=np.uint8)


def potential_of(costs, seed, target=NOWHERE, *, use_astar=False, allow_unknown=True):
    """Returns the potential on a costmap's costs; seed, target: (column, row)."""
    crossing = traversal_costs(costs, allow_unknown=allow_unknown)
    return spread_potential(crossing, *seed, *target, use_astar)


def corridor(costs):
    """A map of one row of cells with these costs, between blocked rows."""
    return np.pad(np.array([costs], dtype=np.uint8), 1)


# Costs


def test_costs_of_a_map_lie_between_neutral_and_blocked():
    costs = np.pad(np.array([[0, 1, 10, 252, INSCRIBED, LETHAL, UNKNOWN]], dtype=np.uint8), 1)
    # 50 + 0.8 cost, without the fraction: 50, 50.8, 58, 251.6.
    crossing = traversal_costs(costs, allow_unknown=True)
    np.testing.assert_array_equal(crossing[1, 1:-1], [50, 50, 58, 251, 254, 254, 253])
    assert traversal_costs(costs, allow_unknown=False)[1, -2] == BLOCKED_COST


def test_outermost_cells_of_a_map_are_blocked():
    crossing = traversal_costs(free(4, 5), allow_unknown=True)
    assert (crossing[1:-1, 1:-1] == NEUTRAL_COST).all()
    assert (crossing == BLOCKED_COST).sum() == 20 - 6


# The potential


def test_potential_adds_up_along_a_corridor():
    potential = potential_of(corridor([0, 0, 10, 252, 0]), (1, 1))
    np.testing.assert_array_equal(potential[1, 1:-1], [0, 50, 108, 359, 409])


def test_potential_of_a_diagonal_neighbour_is_that_of_a_planar_wave():
    potential = potential_of(free(7, 7), (3, 3))
    # Both neighbours are at 50: 50 + 50 * 0.704. One step on, 50 and 100 differ by a whole cost.
    assert potential[4, 4] == np.float32(50 + np.float32(50) * np.float32(0.704))
    assert potential[3, 5] == 100.0
    # At (5, 4): neighbours 100 and 85.2 differ by 14.8 / 50 = 0.296 of a cost.
    share = np.float32((100.0 - float(potential[4, 4])) / 50.0)
    expected = float(potential[4, 4]) + 50 * (-0.2301 * share**2 + 0.5307 * share + 0.704)
    assert potential[4, 5] == pytest.approx(expected, rel=1e-6)


def test_what_lies_behind_a_wall_is_not_reached():
    costs = free(7, 9)
    costs[:, 4] = LETHAL
    potential = potential_of(costs, (2, 3))
    assert (potential[1:-1, 1:4] < UNREACHED).all()
    assert (potential[:, 4:] == UNREACHED).all()


def test_unknown_cells_are_reached_where_they_are_allowed():
    costs = corridor([0, UNKNOWN, 0])
    assert potential_of(costs, (1, 1))[1, 3] == HIGHEST_COST + NEUTRAL_COST
    assert potential_of(costs, (1, 1), allow_unknown=False)[1, 3] == UNREACHED


def test_spreading_ends_at_the_target():
    whole = potential_of(free(60, 60), (30, 30))
    early = potential_of(free(60, 60), (30, 30), (35, 30))
    assert (whole[1:-1, 1:-1] < UNREACHED).all()
    assert early[30, 35] == whole[30, 35]
    assert (early[1:-1, 1:-1] == UNREACHED).sum() > 1000


def test_astar_reaches_fewer_cells_than_dijkstra():
    costs = free(60, 60)
    reached = [
        (potential_of(costs, (10, 30), (50, 30), use_astar=flag) < UNREACHED).sum()
        for flag in (False, True)
    ]
    assert reached[1] < 0.5 * reached[0]


def test_seed_in_the_column_beyond_the_map_is_the_first_cell_of_the_next_row():
    np.testing.assert_array_equal(
        potential_of(free(6, 8), (8, 2)), potential_of(free(6, 8), (0, 3))
    )


@given(arrays(np.uint8, (12, 15), elements=st.sampled_from([0, 0, 0, 100, 252, LETHAL])))
def test_reached_cells_are_those_connected_to_the_seed(costs):
    costs[5, 7] = 0
    potential = potential_of(costs, (7, 5))
    is_free = np.zeros(costs.shape, dtype=bool)
    is_free[1:-1, 1:-1] = costs[1:-1, 1:-1] < INSCRIBED
    parts, _ = label(is_free)
    np.testing.assert_array_equal(potential < UNREACHED, parts == parts[5, 7])


@given(st.integers(0, 1000))
def test_no_cell_costs_more_than_the_way_through_its_lowest_neighbour(seed):
    costs = np.random.default_rng(seed).integers(0, 60, size=(30, 30)).astype(np.uint8)
    potential = potential_of(costs, (12, 15)).astype(float)
    crossing = traversal_costs(costs, allow_unknown=True)
    padded = np.pad(potential, 1, constant_values=np.inf)
    lowest = np.minimum.reduce(
        [padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]]
    )
    reached = potential < UNREACHED
    assert reached.sum() == 28 * 28
    # The quadratic of the planar wave ends at 1.0046, not at 1.
    assert (potential[reached] <= (lowest + 1.0047 * crossing)[reached]).all()


def test_a_winding_passage_ends_the_spreading_before_its_end():
    # 40 passages of 18 cells are 720 steps; 83 * 20 cells allow 103 cycles.
    costs = free(83, 20)
    costs[2::2] = LETHAL
    costs[2::4, 18] = costs[4::4, 1] = 0
    potential = potential_of(costs, (1, 1))
    assert potential[1, 18] == 17 * NEUTRAL_COST
    assert potential[81, 1] == potential[81, 18] == UNREACHED


def test_a_front_of_more_than_ten_thousand_cells_loses_some():
    # Two cells deep, the front fills a buffer 1185 cells from the seed.
    potential = potential_of(free(2500, 2500), (1250, 1250))
    rows, columns = np.nonzero(potential[1:-1, 1:-1] == UNREACHED)
    assert 0 < len(rows) < 50
    assert np.hypot(rows + 1 - 1250, columns + 1 - 1250).min() > 1180


# The path


def test_path_runs_straight_down_to_the_seed_in_steps_of_half_a_cell():
    potential = potential_of(free(20, 30), (5, 10))
    path = path_down(potential, 15, 10, 5, 10, 120)
    np.testing.assert_array_equal(path[0], [15, 10])
    np.testing.assert_array_equal(path[-1], [5, 10])
    np.testing.assert_allclose(np.diff(path[:-1, 0]), -0.5)
    np.testing.assert_allclose(path[:, 1], 10.0)


def test_path_beside_an_obstacle_goes_from_cell_to_cell():
    costs = corridor([0] * 8)
    path = path_down(potential_of(costs, (1, 1)), 8, 1, 1, 1, 40)
    np.testing.assert_array_equal(path, [[c, 1] for c in range(8, 0, -1)])


def test_path_fails_when_it_runs_out_of_cycles():
    potential = potential_of(corridor([0] * 8), (1, 1))
    assert len(path_down(potential, 8, 1, 1, 1, 8)) == 8
    assert len(path_down(potential, 8, 1, 1, 1, 7)) == 0


def test_path_stays_where_its_neighbour_is_less_than_one_lower():
    # 60.9 counts as 60, and 60.5 is not below that.
    potential = np.full((3, 6), UNREACHED)
    potential[1, 1:5] = [0.0, 60.5, 60.9, 130.0]
    assert len(path_down(potential, 3, 1, 1, 1, 20)) == 0
    potential[1, 2] = 59.9
    assert len(path_down(potential, 3, 1, 1, 1, 20)) == 3


def test_path_fails_where_there_is_no_slope():
    row, column = np.mgrid[-5:6, -5:6]
    hill = (1000.0 - 10.0 * (np.abs(row) + np.abs(column))).astype(np.float32)
    assert len(path_down(hill, 5, 5, 0, 0, 50)) == 0


def test_path_fails_on_the_edge_of_the_map():
    potential = np.full((6, 6), np.float32(100.0))
    assert len(path_down(potential, 3, 0, 0, 0, 50)) == 0


@given(
    angle=st.floats(-3.0, 3.0),
    distance=st.floats(5.0, 40.0),
)
def test_path_in_the_open_is_hardly_longer_than_the_straight_line(angle, distance):
    potential = potential_of(free(101, 101), (50, 50))
    column, row = round(50 + distance * math.cos(angle)), round(50 + distance * math.sin(angle))
    path = path_down(potential, column, row, 50, 50, 404).astype(float)
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    assert length <= 1.05 * math.hypot(column - 50, row - 50) + 1.0


# Points and cells


@pytest.mark.parametrize(("x", "cell"), [(1.0, 0), (1.04, 0), (1.05, 1), (1.94, 9), (1.96, 10)])
def test_a_point_means_the_cell_whose_corner_is_nearest(x, cell):
    column, _, is_on_map = nearest_cell(x, 2.0, 1.0, 2.0, 0.1, 10, 10)
    assert column == cell
    assert is_on_map == (cell < 10)


def test_points_left_of_or_below_the_map_are_off_it():
    assert nearest_cell(0.99, 2.0, 1.0, 2.0, 0.1, 10, 10) == (-1, -1, False)
    assert nearest_cell(1.0, 1.99, 1.0, 2.0, 0.1, 10, 10) == (-1, -1, False)


def test_a_reached_goal_is_where_the_path_goes():
    potential = np.full((10, 10), np.float32(7.0))
    assert reached_point_near(potential, 0.0, 0.0, 1.0, 4.3, 5.2, 2.0) == (4.3, 5.2, True)


def test_else_it_goes_to_the_nearest_reached_point_within_the_tolerance():
    potential = np.full((10, 10), UNREACHED)
    potential[5, 8] = potential[5, 2] = 7.0
    # The lattice around 4.25 runs through 2.25, 3.25 ... 8.25; 2.25 is 2 m away, 8.25 is 4 m.
    assert reached_point_near(potential, 0.0, 0.0, 1.0, 4.25, 5.25, 4.0) == (2.25, 5.25, True)
    potential[5, 2] = UNREACHED
    assert reached_point_near(potential, 0.0, 0.0, 1.0, 4.25, 5.25, 4.0) == (8.25, 5.25, True)
    assert not reached_point_near(potential, 0.0, 0.0, 1.0, 4.25, 5.25, 3.0)[2]
