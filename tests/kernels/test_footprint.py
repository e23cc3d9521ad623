"""The robot's outline: polygon, padding, radii, and its cost on a costmap."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.footprint import (
    UNBOUNDED_RADIUS,
    circle_footprint,
    footprint_cost,
    footprint_radii,
    pad_footprint,
)
from drake_navbench.kernels.grid import LETHAL, NO_INFORMATION, Grid

# Edges 1 m ahead, 2 m to the left, 3 m behind and 1.5 m to the right of the base.
OFFSET_BOX = np.array([[1.0, 2.0], [-3.0, 2.0], [-3.0, -1.5], [1.0, -1.5]])
# On cells of 1 m and placed at a centre: a ring of 5 x 3 cells.
RING = np.array([[2.0, 1.0], [-2.0, 1.0], [-2.0, -1.0], [2.0, -1.0]])


def cost_at(costs, x=5.5, y=4.5, yaw=0.0, *, footprint=RING, from_first=True):
    """Cost on a grid of 1 m cells with its corner at (0, 0)."""
    return footprint_cost(Grid(costs, 0.0, 0.0, 1.0), footprint, x, y, yaw, from_first)


def grid(*cells, shape=(10, 12)):
    costs = np.zeros(shape, dtype=np.uint8)
    for column, row, cost in cells:
        costs[row, column] = cost
    return costs


# Polygon and padding


def test_circle_becomes_a_regular_polygon_of_16_vertices_on_it():
    footprint = circle_footprint(0.22)
    assert footprint.shape == (16, 2)
    np.testing.assert_allclose(np.hypot(*footprint.T), 0.22)
    np.testing.assert_allclose(footprint[0], [0.22, 0.0])
    np.testing.assert_allclose(footprint[2], [0.22 * math.sqrt(0.5)] * 2)


def test_padding_moves_each_coordinate_away_from_zero():
    footprint = np.array([[0.3, 0.2], [-0.1, 0.2], [0.0, -0.2]])
    np.testing.assert_allclose(
        pad_footprint(footprint, 0.01), [[0.31, 0.21], [-0.11, 0.21], [0.0, -0.21]]
    )


def test_floating_noise_counts_as_a_sign():
    # cos(pi / 2) is 6e-17, not 0, so that vertex 4 is padded along x too, as in Nav2.
    padded = pad_footprint(circle_footprint(0.22), 0.01)
    np.testing.assert_allclose(padded[4], [0.01, 0.23], atol=1e-15)


# Radii


def test_radii_of_a_padded_circle_are_those_of_nav2():
    inscribed, circumscribed = footprint_radii(pad_footprint(circle_footprint(0.22), 0.01))
    assert inscribed == pytest.approx(0.225498, abs=1e-6)
    assert circumscribed == pytest.approx(0.234142, abs=1e-6)


def test_inscribed_radius_is_the_nearest_edge_and_circumscribed_the_farthest_vertex():
    assert footprint_radii(OFFSET_BOX) == pytest.approx((1.0, math.hypot(3.0, 2.0)))


def test_inscribed_radius_may_end_at_a_vertex():
    # The base lies outside: the nearest point is the vertex (1, 1).
    triangle = np.array([[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]])
    assert footprint_radii(triangle) == pytest.approx((math.sqrt(2.0), math.sqrt(10.0)))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_vertices_have_no_radii(count):
    assert footprint_radii(OFFSET_BOX[:count]) == (UNBOUNDED_RADIUS, 0.0)


def test_repeated_vertex_changes_no_radius():
    repeated = np.vstack([OFFSET_BOX, OFFSET_BOX[-1:]])
    assert footprint_radii(repeated) == pytest.approx(footprint_radii(OFFSET_BOX))


@given(turn=st.floats(-4.0, 4.0))
def test_turning_the_footprint_changes_no_radius(turn):
    cos, sin = math.cos(turn), math.sin(turn)
    turned = OFFSET_BOX @ np.array([[cos, sin], [-sin, cos]])
    assert footprint_radii(turned) == pytest.approx(footprint_radii(OFFSET_BOX))


# Cost


def test_cost_is_the_largest_under_the_outline():
    # The ring covers columns 3 to 7 and rows 3 to 5.
    assert cost_at(grid()) == 0
    assert cost_at(grid((3, 3, 7), (7, 4, 50), (5, 5, 20))) == 50


@pytest.mark.parametrize("cell", [(3, 3), (7, 3), (7, 5), (3, 5), (5, 3), (7, 4), (4, 5), (3, 4)])
def test_every_cell_of_the_outline_counts(cell):
    assert cost_at(grid((*cell, LETHAL))) == LETHAL


def test_inside_and_outside_do_not_count():
    costs = np.full((10, 12), LETHAL, dtype=np.uint8)
    costs[3:6, 3:8] = 0
    costs[4, 4:7] = LETHAL
    assert cost_at(costs) == 0


def test_vertex_off_the_map_is_lethal():
    assert cost_at(grid(), x=9.9) == 0
    assert cost_at(grid(), x=10.0) == LETHAL
    assert cost_at(grid(), y=0.9) == LETHAL


def test_unknown_counts_more_than_lethal_and_hides_it():
    # The first edge is row 5, from column 7 to 3; the third is row 3.
    assert cost_at(grid((5, 5, NO_INFORMATION))) == NO_INFORMATION
    assert cost_at(grid((5, 5, NO_INFORMATION), (5, 3, LETHAL))) == NO_INFORMATION
    assert cost_at(grid((5, 5, LETHAL), (5, 3, NO_INFORMATION))) == LETHAL
    # On one edge the lethal cell wins.
    assert cost_at(grid((5, 5, NO_INFORMATION), (4, 5, LETHAL))) == LETHAL


def test_pose_turns_then_moves_the_outline():
    # A quarter turn: columns 4 to 6, rows 2 to 6.
    costs = grid((4, 2, 11), (3, 3, 99))
    assert cost_at(costs, yaw=math.pi / 2) == 11
    assert cost_at(costs) == 99


def test_direction_of_the_closing_edge_decides_ties():
    # From vertex 0 at (0, 0) to vertex 2 at (4, 2) the line visits (1, 1), backwards (1, 0).
    triangle = np.array([[0.0, 0.0], [0.0, 3.0], [4.0, 2.0]])
    forwards, backwards = grid((1, 1, 77)), grid((1, 0, 77))
    place = {"x": 0.5, "y": 0.5, "footprint": triangle}
    assert cost_at(forwards, **place, from_first=True) == 77
    assert cost_at(forwards, **place, from_first=False) == 0
    assert cost_at(backwards, **place, from_first=True) == 0
    assert cost_at(backwards, **place, from_first=False) == 77


@settings(deadline=None)
@given(
    seed=st.integers(0, 1000),
    yaw=st.floats(-3.0, 3.0),
    columns=st.integers(-3, 3),
    rows=st.integers(-3, 3),
)
def test_moving_map_and_robot_by_whole_cells_changes_no_cost(seed, yaw, columns, rows):
    costs = np.random.default_rng(seed).integers(0, 256, (16, 16), dtype=np.uint8)
    moved = np.roll(costs, (rows, columns), axis=(0, 1))
    # An odd place in its cell, so that rounding puts no vertex on the other side of a border.
    plain = cost_at(costs, 8.26, 8.17, yaw)
    assert cost_at(moved, 8.26 + columns, 8.17 + rows, yaw) == plain


@settings(deadline=None)
@given(seed=st.integers(0, 1000), yaw=st.floats(-3.0, 3.0))
def test_mirrored_map_and_robot_have_the_same_cost(seed, yaw):
    costs = np.random.default_rng(seed).integers(0, 254, (16, 16), dtype=np.uint8)
    mirrored = cost_at(costs[::-1].copy(), 8.26, 16.0 - 8.17, -yaw, footprint=RING * [1, -1])
    assert mirrored == cost_at(costs, 8.26, 8.17, yaw)
