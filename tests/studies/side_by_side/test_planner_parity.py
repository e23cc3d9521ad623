"""Planners beside their originals: what counts as equal, and what is asked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.inputs.robot import load_robot
from drake_navbench.kernels.grid import INSCRIBED, NO_INFORMATION
from drake_navbench.navigation.planner import PlanningError
from drake_navbench.studies.side_by_side.likeness import Likeness
from drake_navbench.studies.side_by_side.parity_page import to_markdown
from drake_navbench.studies.side_by_side.planner_parity import (
    VARIANTS,
    PlannerParity,
    compare_plans,
    port_of,
    random_requests,
)

ROBOT = load_robot("wheelchair")
PLAN = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, math.pi]])


@pytest.mark.parametrize(
    ("other", "likeness", "difference"),
    [
        (PLAN, Likeness.EQUAL, 0.0),
        (PLAN + np.array([1e-7, 0.0, 0.0]), Likeness.CLOSE, 1e-7),
        (PLAN + np.array([0.0, 0.2, 0.0]), Likeness.DIFFERENT, 0.2),
        # Half a turn to the left is half a turn to the right.
        (PLAN * np.array([1.0, 1.0, -1.0]), Likeness.CLOSE, 0.0),
    ],
)
def test_plans_are_as_far_apart_as_their_poses(other, likeness, difference):
    result = compare_plans(PLAN, other)
    assert result.likeness is likeness
    assert result.difference == pytest.approx(difference, abs=1e-15)


def test_plans_with_other_numbers_of_poses_are_different():
    result = compare_plans(PLAN, PLAN[:1])
    assert result.likeness is Likeness.DIFFERENT
    assert result.told == "port: 2 poses, 1.0000 m; original: 1 poses, 0.0000 m"


def test_both_must_fail_for_the_same_reason():
    assert compare_plans("GoalOccupied", "GoalOccupied").likeness is Likeness.EQUAL
    assert compare_plans("GoalOccupied", "StartOccupied").likeness is Likeness.DIFFERENT
    assert compare_plans(PLAN, "GoalOccupied").likeness is Likeness.DIFFERENT
    # A release that tells no reason.
    assert compare_plans("GoalOccupied", "PlannerException").likeness is Likeness.EQUAL
    assert compare_plans(PLAN, "PlannerException").likeness is Likeness.DIFFERENT


def test_requests_are_a_function_of_their_seed_and_begin_on_free_cells():
    first, again = (list(random_requests(ROBOT, 8, seed=3)) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.costmap.costs, other.costmap.costs)
        np.testing.assert_array_equal(one.start, other.start)
        costmap = one.costmap
        cell = (one.start[:2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
        column, row = cell.astype(int)
        assert costmap.costs[row, column] < INSCRIBED
    assert any((one.costmap.costs == NO_INFORMATION).any() for one in first)


@pytest.mark.parametrize("plugin", VARIANTS)
def test_most_requests_can_be_planned(plugin):
    planner = port_of(plugin, {}, ROBOT)
    found = 0
    for request in random_requests(ROBOT, 12):
        try:
            found += len(planner.plan(*request)) > 1
        except PlanningError:
            continue
    assert found > 6


def test_the_page_has_a_row_a_variant(build_of):
    results = (compare_plans(PLAN, PLAN), compare_plans(PLAN, "GoalOccupied"))
    text = to_markdown(build_of(), [], [PlannerParity("a::Planner", {"tolerance": 0.1}, results)])
    assert "| `a::Planner` with tolerance: 0.1 | 1 | 1 / 0 / 1 |" in text
    assert "- port: 2 poses, 1.0000 m; original: GoalOccupied" in text
    assert "| controller |" not in text
