"""The way of a car to the goal of Hybrid-A*, in the goal's frame, by hand-computed lengths."""

import numpy as np
import pytest

from drake_navbench.kernels.hybrid_heuristics import free_way, free_ways
from drake_navbench.kernels.hybrid_motion import motions

BINS = 72
CAR = motions(4.0, BINS, reverses=False, interpolates=False)


def length(column, row, heading, goal):
    """Returns the length in cells from a cell and a bin to a goal (column, row, bin)."""
    ways = free_ways(21, BINS)
    place = np.array(goal, np.float32)
    return float(free_way(ways, CAR, column, row, heading, place, np.float32(1.0)))


@pytest.mark.parametrize(
    ("column", "row", "bin_of_heading"), [(17, 20, 0), (20, 17, 18), (23, 20, 36), (20, 23, 54)]
)
def test_a_car_behind_the_goal_that_faces_as_it_does_drives_straight(column, row, bin_of_heading):
    goal = (20.0, 20.0, bin_of_heading)
    assert length(column, row, bin_of_heading, goal) == pytest.approx(3.0)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_way_is_as_long_where_all_is_turned_by_quarters(quarters):
    # From 7 cells behind the goal, 2 to its right, and 20 degrees to the left of its heading.
    behind, aside = -7, -2
    expected = length(20 + behind, 20 + aside, 4, (20.0, 20.0, 0.0))
    assert expected > np.hypot(behind, aside)
    for _ in range(quarters):
        behind, aside = -aside, behind
    turned = 18 * quarters
    found = length(20 + behind, 20 + aside, turned + 4, (20.0, 20.0, turned))
    assert found == pytest.approx(expected)
