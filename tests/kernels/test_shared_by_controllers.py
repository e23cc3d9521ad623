"""The kernels that controllers have in common: robot frame, speed limit, collision check."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.controller import SpeedLimit
from drake_navbench.kernels.collision_check import distance_from_cost, is_pose_in_collision
from drake_navbench.kernels.grid import OFF_MAP, Grid, cost_at
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.speed_limit import limited_speed, speed_limit_ratio

SQUARE = np.array([[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]])
RESOLUTION = 0.1


def costmap_with(cells, cost):
    """A map from 0 to 2 m with one cost at the cells (column, row)."""
    costs = np.zeros((20, 20), np.uint8)
    for column, row in cells:
        costs[row, column] = cost
    return costs


def collides(costs, x, y, yaw=0.0, tracks_unknown=False):
    return is_pose_in_collision(
        Grid(costs, 0.0, 0.0, RESOLUTION), tracks_unknown, SQUARE, x, y, yaw
    )


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (None, 0.5),
        (SpeedLimit(0.0), 0.5),
        (SpeedLimit(0.0, is_percentage=True), 0.5),
        (SpeedLimit(0.2), 0.2),
        (SpeedLimit(0.9), 0.9),
        (SpeedLimit(30.0, is_percentage=True), 0.15),
    ],
)
def test_a_limit_is_a_speed_or_a_percentage(limit, expected):
    assert limited_speed(0.5, limit) == pytest.approx(expected)
    assert speed_limit_ratio(0.5, limit) == pytest.approx(expected / 0.5)


def test_cost_at_a_point_is_that_of_its_cell():
    costs = costmap_with([(3, 7)], 120)
    assert cost_at(Grid(costs, 0.0, 0.0, RESOLUTION), 0.35, 0.75) == 120
    assert cost_at(Grid(costs, 0.0, 0.0, RESOLUTION), 0.45, 0.75) == 0
    assert cost_at(Grid(costs, 0.0, 0.0, RESOLUTION), -0.05, 0.75) == OFF_MAP
    assert cost_at(Grid(costs, 0.0, 0.0, RESOLUTION), 0.35, 2.05) == OFF_MAP


@pytest.mark.parametrize("distance_m", [0.3, 0.5, 0.8])
def test_distance_from_cost_undoes_the_inflation(distance_m):
    # The inflation layer decays from 252, this inverse from 253: ln(253 / 252) / 3 = 0.0013 m.
    cost = 252.0 * math.exp(-3.0 * (distance_m - 0.25))
    found = distance_from_cost(cost, 0.25, 3.0)
    assert found == pytest.approx(distance_m + math.log(253.0 / 252.0) / 3.0, abs=1e-6)


def test_a_footprint_collides_where_its_outline_is_lethal():
    # Centre (1.05, 1.05): the outline runs over the cells 8 and 12.
    assert collides(costmap_with([(12, 10)], 254), 1.05, 1.05)
    assert not collides(costmap_with([(12, 10)], 253), 1.05, 1.05)
    assert not collides(costmap_with([(13, 10)], 254), 1.05, 1.05)
    # Only the outline is looked at, as in Nav2.
    assert not collides(costmap_with([(10, 10)], 254), 1.05, 1.05)


def test_a_turned_footprint_reaches_farther_with_its_corners():
    lethal = costmap_with([(13, 10)], 254)
    assert not collides(lethal, 1.05, 1.05)
    assert collides(lethal, 1.05, 1.05, yaw=math.pi / 4.0)  # the corner is at 0.283 m


def test_unknown_cells_collide_unless_they_are_tracked():
    unknown = costmap_with([(12, 10)], 255)
    assert collides(unknown, 1.05, 1.05)
    assert not collides(unknown, 1.05, 1.05, tracks_unknown=True)


def test_an_outline_off_the_map_collides_but_not_a_centre_off_the_map():
    free = costmap_with([], 0)
    assert collides(free, 1.95, 1.05)
    assert not collides(free, 2.05, 1.05)


def test_read_only_arrays_share_memory_where_they_can():
    values = np.zeros((3, 3))
    frozen = read_only(values)
    assert np.shares_memory(values, frozen)
    assert not frozen.flags.writeable
    assert values.flags.writeable
    assert read_only(frozen) is frozen


def test_read_only_makes_strided_and_integer_arrays_fit():
    assert read_only(np.zeros((4, 6))[:, ::2]).flags.c_contiguous
    assert read_only([[1, 2, 3]]).dtype == np.float64
