"""Which paths the planner server's validity service lets pass."""

import numpy as np
import pytest

from drake_navbench.kernels.grid import INSCRIBED, LETHAL, NO_INFORMATION, Costmap
from drake_navbench.navigation.planner import is_path_valid

FOOTPRINT = np.array([[0.5, 0.2], [0.5, -0.2], [-0.5, -0.2], [-0.5, 0.2]])
PATH = np.column_stack([np.linspace(0.0, 2.0, 41), np.zeros(41), np.zeros(41)])


def is_valid(cost: int, x: float, y: float, *, is_circle=False, path=PATH, **limits) -> bool:
    """Tells whether a path is valid on a map with one cell of a cost, 6 m x 6 m from (-3, -3) m."""
    costs = np.zeros((120, 120), dtype=np.uint8)
    costs[int((y + 3.0) / 0.05), int((x + 3.0) / 0.05)] = cost
    costmap = Costmap(costs, -3.0, -3.0, 0.05)
    return is_path_valid(path, costmap, footprint=FOOTPRINT, is_circle=is_circle, **limits)


def test_a_polygon_must_not_touch_a_lethal_cell_with_its_outline():
    assert not is_valid(LETHAL, 1.0, 0.2)
    assert is_valid(LETHAL, 1.0, 0.4)
    assert is_valid(INSCRIBED, 1.0, 0.2)


def test_the_end_of_the_path_counts_with_the_whole_outline():
    assert not is_valid(LETHAL, 2.49, 0.0)
    assert is_valid(LETHAL, 2.6, 0.0)


@pytest.mark.parametrize(("cost", "expected"), [(LETHAL, False), (INSCRIBED, False), (252, True)])
def test_a_circle_is_judged_by_the_cell_under_its_centre(cost, expected):
    assert is_valid(cost, 1.0, 0.0, is_circle=True) is expected


@pytest.mark.parametrize("is_circle", [True, False])
def test_unknown_cells_count_as_free(is_circle):
    assert is_valid(NO_INFORMATION, 1.0, 0.0, is_circle=is_circle)


@pytest.mark.parametrize("is_circle", [True, False])
def test_unknown_cells_block_where_they_are_considered(is_circle):
    y = 0.0 if is_circle else 0.2
    assert is_valid(NO_INFORMATION, 1.0, y, is_circle=is_circle)
    assert not is_valid(
        NO_INFORMATION, 1.0, y, is_circle=is_circle, consider_unknown_as_obstacle=True
    )


def test_a_maximum_cost_blocks_from_itself_on():
    assert not is_valid(INSCRIBED, 1.0, 0.2, max_cost=INSCRIBED)
    assert is_valid(252, 1.0, 0.2, max_cost=INSCRIBED)
    assert not is_valid(60, 1.0, 0.0, is_circle=True, max_cost=60)
    assert is_valid(59, 1.0, 0.0, is_circle=True, max_cost=60)


def test_a_maximum_cost_of_0_blocks_every_path_and_one_above_lethal_lifts_nothing():
    assert not is_valid(0, 1.0, 0.0, max_cost=0)
    assert not is_valid(LETHAL, 1.0, 0.2, max_cost=255)
    assert not is_valid(INSCRIBED, 1.0, 0.0, is_circle=True, max_cost=255)


@pytest.mark.parametrize("is_circle", [True, False])
def test_off_the_map_and_empty_paths_are_not_valid(is_circle):
    assert not is_valid(0, 0.0, 0.0, is_circle=is_circle, path=PATH + np.array([2.0, 0.0, 0.0]))
    assert not is_valid(0, 0.0, 0.0, is_circle=is_circle, path=PATH[:0])
