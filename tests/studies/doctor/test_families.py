"""Faults of one class that a user's words tell apart."""

from __future__ import annotations

import pytest

from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.families import OF_ANOTHER, OF_THE_TOLD, WORSE, family_factor
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

CLEARS = Cause("local_costmap.raytrace_max_range", Direction.UP)
MARKS_LESS = Cause("local_costmap.min_obstacle_height", Direction.UP)


def ranks(symptom, words):
    found = suspicions_of(facts_of_values("RPP", "jazzy", {}), symptom, Told(words))
    return {suspicion.cause.key: rank for rank, suspicion in enumerate(found, 1)}


@pytest.mark.parametrize(
    ("words", "of_clearing", "of_marking"),
    [
        ("the chair is gone but its mark stays", OF_THE_TOLD, OF_ANOTHER),
        ("the floor is marked as an obstacle", OF_ANOTHER, OF_THE_TOLD),
        ("marks of the floor that stay", 1.0, 1.0),
        ("phantom obstacles", 1.0, 1.0),
    ],
)
def test_an_obstacle_that_has_gone_is_no_floor(words, of_clearing, of_marking):
    factors = [
        family_factor(Symptom.GHOST_OBSTACLES, words, cause) for cause in (CLEARS, MARKS_LESS)
    ]
    assert factors == [of_clearing, of_marking]


def test_a_late_transform_is_no_lack_of_progress():
    allowance = ("progress_checker.movement_time_allowance", Direction.UP)
    late = ("controller.transform_tolerance", Direction.UP)
    plain = ranks(Symptom.FALSE_ABORT, "it stops")
    told = ranks(Symptom.FALSE_ABORT, "Lookup would require extrapolation into the future")
    assert plain[allowance] < plain[late]
    assert told[late] < told[allowance]


@pytest.mark.parametrize("symptom", [Symptom.GOAL_NOT_REACHED, Symptom.STALL_BEFORE_GOAL])
def test_a_goal_that_counts_as_reached_too_early_asks_for_a_smaller_tolerance(symptom):
    smaller = ("goal_checker.xy_goal_tolerance", Direction.DOWN)
    larger = ("goal_checker.xy_goal_tolerance", Direction.UP)
    early = ranks(symptom, "stands 0.3 m beside the goal, which counts as reached")
    never = ranks(symptom, "it never arrives and keeps correcting")
    assert early[smaller] < early[larger]
    assert never[larger] < never[smaller]


def test_what_would_make_the_fault_worse_counts_least():
    larger = Cause("goal_checker.yaw_goal_tolerance", Direction.UP)
    told = "ends its drives 0.3 m beside the goal"
    assert family_factor(Symptom.GOAL_NOT_REACHED, told, larger) == WORSE < OF_ANOTHER


def test_a_goal_that_does_not_count_as_reached_is_not_met_too_early():
    smaller = Cause("goal_checker.xy_goal_tolerance", Direction.DOWN)
    told = "stands at the goal, which is not considered reached"
    assert family_factor(Symptom.GOAL_NOT_REACHED, told, smaller) == 1.0
    late = "takes long at the goal until it counts as reached"
    assert family_factor(Symptom.GOAL_NOT_REACHED, late, smaller) == 1.0


def test_a_class_of_one_fault_has_no_families():
    assert family_factor(Symptom.TOO_SLOW, "the floor is gone", CLEARS) == 1.0
