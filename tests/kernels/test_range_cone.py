"""A reading of a sonar moves how probably cells are occupied, by hand-computed numbers."""

import math

import numpy as np
import pytest

from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.range_cone import Cone, cost_of, update_by_cone

UNSEEN = cost_of(0.5)
# The sensor stands in the middle of cell (row 20, column 0) and looks along x, at 1 m.
APEX_Y_M = 2.05
AHEAD = Cone(0.05, APEX_Y_M, 0.0, 1.0, 0.3, False)


def updated(cone=AHEAD, *, before=UNSEEN, phi=1.2, inflate_cone=1.0):
    """Returns 41 x 41 cells of 0.1 m after a reading, and the box touched."""
    costs = np.full((41, 41), before, np.uint8)
    box = update_by_cone(Grid(costs, 0.0, 0.0, 0.1), cone, phi=phi, inflate_cone=inflate_cone)
    return costs, box


def trust(distance_m, phi=1.2):
    """Returns how far a reading is trusted on its axis."""
    return 1.0 - (1.0 + math.tanh(2.0 * (distance_m - phi))) / 2.0


def test_half_probable_is_half_of_lethal():
    assert UNSEEN == 127


def test_a_cell_well_before_the_reading_becomes_free():
    # 0.5 m away: trusted by 0.9427, so seen occupied with (1 - 0.9427) / 2 = 0.0287; 254 times it.
    assert trust(0.5) == pytest.approx(0.9427, abs=1e-4)
    costs, _ = updated()
    assert costs[20, 5] == 7


def test_the_cell_at_the_reading_is_likely_and_the_one_behind_it_less():
    # There it begins with 233 / 254 = 0.9173 and is seen with 0.5 trust + 0.5 = 0.8450:
    # 0.8450 * 0.9173 / (0.8450 * 0.9173 + 0.1550 * 0.0827) = 0.9837, 249 of 254.
    costs, _ = updated()
    assert costs[20, 10] == 249
    # One cell behind the band ends, and the reading says nothing.
    assert costs[20, 11] == UNSEEN
    # Nor does it say anything beside the cone: 45 degrees, where it is 17 degrees wide.
    assert costs[25, 5] == UNSEEN


def test_a_second_reading_of_the_same_makes_surer():
    costs, _ = updated()
    grid = Grid(costs, 0.0, 0.0, 0.1)
    update_by_cone(grid, AHEAD, phi=1.2, inflate_cone=1.0)
    # 0.0287 after 7 / 254: 0.0287 * 0.02756 / (0.0287 * 0.02756 + 0.9713 * 0.97244) = 8.4e-4.
    assert costs[20, 5] == 0


def test_a_reading_that_clears_frees_even_what_was_surely_occupied():
    clearing = AHEAD._replace(clears=True)
    for before in (UNSEEN, 254):
        costs, _ = updated(clearing, before=before)
        assert not costs[20, :10].any()
    # Without it, what is surely occupied stays so.
    costs, _ = updated(before=254)
    assert costs[20, 5] == 254


def test_left_and_right_are_alike():
    costs, _ = updated()
    np.testing.assert_array_equal(costs, costs[::-1])


def test_the_box_reaches_1_2_times_as_far_as_the_reading():
    _, box = updated()
    ahead, aside = 0.05 + 1.2 * math.cos(0.3), 1.2 * math.sin(0.3)
    expected = [0.05, APEX_Y_M - aside, ahead, APEX_Y_M + aside]
    np.testing.assert_allclose(box, expected, atol=1e-12)


def test_cells_beside_the_triangle_are_left_alone_unless_the_cone_is_inflated():
    # 0.1 m ahead the triangle is 0.03 m to either side, and the cone, with 15 cells, holds one.
    cone = AHEAD._replace(clears=True)
    narrow, _ = updated(cone, inflate_cone=0.0)
    wide, _ = updated(cone)
    assert (narrow[20, :11] == 0).all()
    assert narrow[23, 1] == UNSEEN
    assert wide[23, 1] == 0
    assert (narrow == 0).sum() < (wide == 0).sum()


def test_a_cone_beside_the_grid_changes_nothing():
    costs, _ = updated(Cone(-3.0, 2.0, math.pi, 1.0, 0.3, False))
    assert (costs == UNSEEN).all()
