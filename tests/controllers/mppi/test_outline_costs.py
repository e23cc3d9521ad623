"""Remembered outline costs are those that the outline has."""

import numpy as np
import pytest

from drake_navbench.controllers.mppi.critics import outline_costs
from drake_navbench.controllers.mppi.critics.base import MapView
from drake_navbench.controllers.mppi.critics.outline_costs import OutlineCosts, outline_cost
from drake_navbench.kernels.footprint import circle_footprint, footprint_cost
from drake_navbench.kernels.grid import LETHAL, Costmap

CHAIR = np.array([[0.5, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.5, -0.3]])
OUTLINES = {"chair": CHAIR, "16-gon": circle_footprint(0.3), "triangle": CHAIR[:3]}


def random_view(outline) -> MapView:
    """A 3 m map, mostly free, with cells of every cost."""
    random = np.random.default_rng(0)
    costs = random.integers(0, 256, (60, 60)).astype(np.uint8)
    costs[random.random(costs.shape) < 0.9] = 0
    return MapView.of(Costmap(costs, -1.5, -1.5, 0.05), outline)


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_every_pose_has_the_cost_of_its_outline_asked_first_or_again(outline):
    view = random_view(outline)
    remembered = OutlineCosts.of(view)
    random = np.random.default_rng(1)
    poses = random.uniform((-1.8, -1.8, -7.0), (1.8, 1.8, 7.0), (2000, 3))
    for pose in (*poses, *poses, *(poses + 1e-3)):
        expected = footprint_cost(view.grid, view.footprint, *pose, True)
        assert outline_cost(view, remembered, *pose) == expected
    assert 500 < remembered.taken[0] < 4000


def test_a_pose_in_the_same_cells_is_not_computed_again():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    outline_cost(view, remembered, 0.51, 0.01, 0.0)
    # Vertices at x 1.01 and 0.11, y 0.31 and -0.29; moved by 2 and 3 cm no one leaves its cell.
    outline_cost(view, remembered, 0.53, 0.04, 0.0)
    assert remembered.taken[0] == 1


def test_a_vertex_off_the_map_is_lethal_and_takes_no_place():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    assert outline_cost(view, remembered, 1.2, 0.0, 0.0) == LETHAL
    assert remembered.taken[0] == 0


def test_a_full_memory_still_answers_right():
    view = random_view(CHAIR)
    remembered = OutlineCosts.of(view)
    remembered.taken[0] = outline_costs.MOST_REMEMBERED
    expected = footprint_cost(view.grid, view.footprint, 0.0, 0.0, 0.3, True)
    assert outline_cost(view, remembered, 0.0, 0.0, 0.3) == expected
    assert remembered.taken[0] == outline_costs.MOST_REMEMBERED
