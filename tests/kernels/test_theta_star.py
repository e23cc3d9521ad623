"""Theta*: lines of sight, corners of paths, and Nav2's habits."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drake_navbench.kernels.theta_star import (
    cost_tables,
    lattice_line_of_sight,
    line_of_sight,
    search,
)

LETHAL, UNKNOWN = 254, 255
TABLES = cost_tables(2.0, allow_unknown=True)


def free(rows, columns):
    return np.zeros((rows, columns), dtype=np.uint8)


def corners_of(
    costs, start, goal, *, how_many_corners=8, w_euc_cost=1.0, tables=TABLES, by_lattice=False
):
    corners = search(
        costs,
        start,
        goal,
        tables=tables,
        w_euc_cost=w_euc_cost,
        how_many_corners=how_many_corners,
        by_lattice=by_lattice,
    )
    return None if corners is None else [tuple(corner) for corner in corners.tolist()]


def length_of(path):
    return sum(math.dist(here, there) for here, there in pairwise(path))


def sight(costs, start, end):
    return line_of_sight(costs, *start, *end, TABLES.may_enter, TABLES.may_cross, TABLES.crossing)


# Costs


def test_a_cell_costs_the_square_of_its_scaled_cost():
    # (26 + 0.9 * 100)^2 / 252^2 * 2
    assert TABLES.step[100] == pytest.approx(2.0 * 116.0**2 / 252.0**2)
    assert TABLES.crossing[100] == TABLES.step[100]


def test_unknown_cells_count_as_253_along_a_line_and_as_255_as_a_step():
    assert TABLES.crossing[UNKNOWN] == pytest.approx(2.0 * 253.0**2 / 252.0**2)
    assert TABLES.step[UNKNOWN] == pytest.approx(2.0 * (26 + 0.9 * 255) ** 2 / 252.0**2)
    refused = cost_tables(2.0, allow_unknown=False)
    assert not refused.may_enter[UNKNOWN]
    assert not refused.may_cross[UNKNOWN]


def test_a_cost_of_252_may_be_entered_but_not_crossed():
    assert TABLES.may_enter[252]
    assert not TABLES.may_cross[252]
    assert TABLES.may_cross[251]


# Lines of sight


def test_a_line_takes_all_its_cells_but_the_last():
    costs = free(3, 8)
    costs[1] = [10, 20, 30, 40, 50, 60, 70, 80]
    is_free, cost = sight(costs, (1, 1), (4, 1))
    assert is_free
    assert cost == pytest.approx(TABLES.crossing[[20, 30, 40]].sum())


def test_a_line_is_blocked_by_a_cell_on_it():
    costs = free(3, 8)
    costs[1, 3] = LETHAL
    assert not sight(costs, (1, 1), (5, 1))[0]
    assert sight(costs, (1, 0), (5, 0))[0]


def test_a_line_does_not_look_at_its_last_cell():
    costs = free(3, 8)
    costs[1, 5] = LETHAL
    assert sight(costs, (1, 1), (5, 1))[0]


@pytest.mark.parametrize("beside", [(1, 2), (2, 1)])
def test_a_diagonal_step_needs_both_cells_beside_it(beside):
    costs = free(4, 4)
    assert sight(costs, (1, 1), (2, 2))[0]
    costs[beside] = LETHAL
    assert not sight(costs, (1, 1), (2, 2))[0]


# Lines of sight up to Kilted


def lattice_sight(costs, start, end):
    return lattice_line_of_sight(costs, *start, *end, TABLES.may_cross, TABLES.crossing)


def test_a_level_line_needs_one_of_the_two_cells_beside_each_edge():
    costs = free(3, 8)
    costs[1, 3] = LETHAL
    costs[0, 3] = 40
    is_free, cost = lattice_sight(costs, (1, 1), (5, 1))
    assert is_free
    # Columns 1 to 4 of row 1, but for column 3, whose neighbour in row 0 counts.
    assert cost == pytest.approx(3 * TABLES.crossing[0] + TABLES.crossing[40])
    costs[0, 3] = LETHAL
    assert not lattice_sight(costs, (1, 1), (5, 1))[0]


def test_an_upright_line_takes_the_cell_to_its_left_where_the_right_one_is_blocked():
    costs = free(8, 3)
    costs[3, 1] = LETHAL
    assert lattice_sight(costs, (1, 1), (1, 5))[0]
    costs[3, 0] = LETHAL
    assert not lattice_sight(costs, (1, 1), (1, 5))[0]


def test_a_line_down_passes_the_cells_before_its_corners():
    costs = free(4, 4)
    costs[1, 1] = LETHAL
    # From corner (2, 2) to corner (1, 1) lies the cell (1, 1); on to (0, 0) the cell (0, 0).
    assert not lattice_sight(costs, (2, 2), (0, 0))[0]
    assert lattice_sight(costs, (1, 1), (0, 0))[0]


def test_a_shallow_line_crosses_both_cells_where_it_changes_its_row():
    costs = free(4, 8)
    costs[0, :4] = [10, 20, 30, 40]
    costs[1, :4] = [50, 60, 70, 80]
    # From (0, 0) to (4, 2) it is at row 1 after two columns: cells (0, 0), (1, 0), (2, 1), (3, 1).
    is_free, cost = lattice_sight(costs, (0, 0), (4, 2))
    assert is_free
    assert cost == pytest.approx(TABLES.crossing[[10, 20, 70, 80]].sum())


def test_left_of_the_first_column_lies_the_row_below_and_below_the_first_row_nothing():
    costs = free(4, 4)
    costs[2, 0] = LETHAL
    assert lattice_sight(costs, (0, 1), (0, 3))[0]
    costs[1, 3] = LETHAL
    assert not lattice_sight(costs, (0, 1), (0, 3))[0]
    costs[0, 2] = LETHAL
    assert not lattice_sight(costs, (1, 0), (3, 0))[0]


# Paths


@given(st.tuples(*[st.integers(0, 24)] * 4))
def test_in_the_open_a_path_is_hardly_longer_than_the_straight_line(ends):
    # Not always straight: a line takes the cells that it crosses, and a detour may cross fewer.
    start, goal = ends[:2], ends[2:]
    if start != goal:
        path = corners_of(free(25, 25), start, goal)
        assert (path[0], path[-1]) == (start, goal)
        assert length_of(path) <= 1.08 * math.dist(start, goal)


def test_a_path_turns_at_the_end_of_a_wall():
    costs = free(30, 30)
    costs[:20, 15] = LETHAL
    path = corners_of(costs, (5, 5), (25, 5))
    assert (path[0], path[-1]) == ((5, 5), (25, 5))
    # The taut line goes over the wall's end, 15 rows up.
    assert length_of(path) == pytest.approx(2 * math.hypot(10, 15), rel=0.05)


def test_a_path_keeps_away_from_dear_cells():
    costs = free(21, 41)
    costs[8:13, 15:26] = 200
    cheap = cost_tables(0.0, allow_unknown=True)
    assert length_of(corners_of(costs, (5, 10), (35, 10), tables=cheap)) == 30.0
    assert max(row for _, row in corners_of(costs, (5, 10), (35, 10))) > 12


def test_four_corners_allow_no_diagonal_steps():
    # Along the diagonal only the eight neighbours lead on.
    costs = np.full((6, 6), LETHAL, dtype=np.uint8)
    np.fill_diagonal(costs, 0)
    costs[0, 1] = 0
    assert corners_of(costs, (0, 0), (4, 4)) is not None
    assert corners_of(costs, (0, 0), (4, 4), how_many_corners=4) is None


def test_an_enclosed_goal_is_not_reached():
    costs = free(20, 20)
    costs[5:10, 5:10] = LETHAL
    costs[7, 7] = 0
    assert corners_of(costs, (1, 1), (7, 7)) is None


def test_along_a_passage_one_cell_wide_the_search_gives_up():
    # The heap is empty when the second cell has been taken from it.
    assert corners_of(free(1, 10), (0, 0), (9, 0)) is None
    assert length_of(corners_of(free(2, 10), (0, 0), (9, 0))) == 9.0


@given(arrays(np.uint8, (14, 14), elements=st.sampled_from([0, 0, 0, 120, 252, LETHAL])))
def test_each_corner_is_a_neighbour_of_the_last_or_sees_it(costs):
    costs[2, 2] = costs[11, 11] = 0
    path = corners_of(costs, (2, 2), (11, 11))
    if path is None:
        return
    for here, there in pairwise(path):
        is_neighbour = max(abs(here[0] - there[0]), abs(here[1] - there[1])) == 1
        assert is_neighbour or sight(costs, there, here)[0]
        assert costs[there[1], there[0]] <= 252
