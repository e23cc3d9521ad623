"""The static layer turns occupancy into costs and samples a map on another grid."""

import math

import numpy as np
import pytest

from drake_navbench.kernels.grid import Grid
from drake_navbench.kernels.static_layer import sample_static, static_costs

OCCUPANCY = np.array([[-1, 0, 1, 50, 98, 99, 100]], dtype=np.int8)


def test_default_map_is_trinary_with_an_inscribed_value():
    np.testing.assert_array_equal(static_costs(OCCUPANCY), [[0, 0, 0, 0, 0, 253, 254]])


def test_unknown_stays_unknown_when_tracked():
    assert static_costs(OCCUPANCY, track_unknown_space=True)[0, 0] == 255


def test_values_from_the_threshold_up_are_lethal():
    costs = static_costs(OCCUPANCY, lethal_cost_threshold=50)
    np.testing.assert_array_equal(costs, [[0, 0, 0, 254, 254, 253, 254]])


def test_graded_map_scales_below_the_threshold():
    # 254 * 1 / 100 = 2.54, 254 * 50 / 100 = 127, 254 * 98 / 100 = 248.92
    costs = static_costs(OCCUPANCY, trinary_costmap=False)
    np.testing.assert_array_equal(costs, [[0, 0, 2, 127, 248, 253, 254]])


@pytest.mark.parametrize(("threshold", "same_as"), [(150, 100), (-5, 0)])
def test_threshold_is_clamped(threshold, same_as):
    np.testing.assert_array_equal(
        static_costs(OCCUPANCY, lethal_cost_threshold=threshold),
        static_costs(OCCUPANCY, lethal_cost_threshold=same_as),
    )


def test_unknown_value_comes_before_the_inscribed_one_and_that_before_the_threshold():
    costs = static_costs(
        OCCUPANCY, track_unknown_space=True, unknown_cost_value=99, lethal_cost_threshold=50
    )
    # -1 is the byte 255, which is now above the threshold.
    np.testing.assert_array_equal(costs, [[254, 0, 0, 254, 254, 255, 254]])


MAP = np.array([[1, 2], [3, 255]], dtype=np.uint8)  # cells of 1 m, corner at (0, 0)


def sampled(costs, origin, *, static_from_grid=(0.0, 0.0, 0.0), use_maximum=False, resolution=0.5):
    grid, static = Grid(costs, *origin, resolution), Grid(MAP, 0.0, 0.0, 1.0)
    sample_static(grid, static, np.array(static_from_grid), use_maximum)
    return costs


def test_window_takes_the_map_at_its_cell_centres_and_stays_elsewhere():
    # Centres along x and y: -0.25, 0.25, 0.75, 1.25.
    costs = sampled(np.full((4, 4), 9, dtype=np.uint8), (-0.5, -0.5))
    np.testing.assert_array_equal(costs, [[9, 9, 9, 9], [9, 1, 1, 2], [9, 1, 1, 2], [9, 3, 3, 255]])


def test_maximum_lets_unknown_win():
    costs = np.array([[2, 2], [2, 254]], dtype=np.uint8)
    np.testing.assert_array_equal(
        sampled(costs, (0.0, 0.0), use_maximum=True, resolution=1.0), [[2, 2], [3, 255]]
    )


def test_frames_may_be_turned_against_each_other():
    # A quarter turn to the left about the map's corner (2, 0): grid x runs along map y.
    costs = sampled(
        np.zeros((2, 2), dtype=np.uint8),
        (0.0, 0.0),
        static_from_grid=(2.0, 0.0, math.pi / 2),
        resolution=1.0,
    )
    np.testing.assert_array_equal(costs, [[2, 255], [1, 3]])
