"""Legs and the navigator's actions, from logs whose answers are known."""

from __future__ import annotations

import dataclasses

import pytest
from results_folders import measured_folder, report_html
from synthetic_logs import straight_log

from drake_navbench.analysis.journey import Action, actions_of, legs_of
from drake_navbench.logs.results import ResultsFolder


def leg(start_s, end_s, **changes):
    return {
        "goal": [0.5 * end_s, 0.0, 0.0],
        "outcome": "succeeded",
        "error_code": 0,
        "reason": "goal reached",
        "start_time_s": start_s,
        "end_time_s": end_s,
        "recovery_count": 0,
    } | changes


def changed(node, status):
    return {"node": node, "status": status}


# At 0.5 m/s; from 4.01 s to 5 s nobody counts.
TWO_LEGS = [leg(0.0, 4.01), leg(5.0, 10.0, outcome="aborted", recovery_count=2)]


def test_a_leg_has_its_own_time_and_length_also_between_samples():
    first, second = legs_of(straight_log(info={"legs": TWO_LEGS}))
    assert (first.duration_s, first.driven_m) == pytest.approx((4.01, 2.005))
    assert (second.duration_s, second.driven_m) == pytest.approx((5.0, 2.5))
    assert (second.outcome, second.recoveries) == ("aborted", 2)


def test_a_trial_without_navigator_has_neither_legs_nor_deeds():
    assert legs_of(straight_log()) == []
    assert actions_of(straight_log()) == []


def test_deeds_tell_actions_and_plans_and_count_repetitions():
    events = (
        (0.0, changed("RateController", "success")),
        (0.0, changed("ComputePathToPose", "success")),
        (0.0, {"plan_id": 1, "poses": 40}),
        (1.0, changed("ComputePathToPose", "success")),
        (1.0, {"plan_id": 2, "poses": 30}),
        (1.5, changed("FollowPathRecovery", "running")),
        (1.5, changed("FollowPath", "failure")),
        (1.5, changed("FollowPath", "idle")),
        (1.6, changed("ClearLocalCostmap-Context", "success")),
    )
    log = dataclasses.replace(straight_log(), events=events)
    assert actions_of(log) == [
        Action(0.0, 1.0, "new plan", 2),
        Action(1.5, 1.5, "FollowPath fails", 1),
        Action(1.6, 1.6, "ClearLocalCostmap-Context succeeds", 1),
    ]


def test_the_report_shows_legs_and_deeds_of_the_trials_that_have_them(tmp_path):
    path = measured_folder(tmp_path / "campaign")

    def page() -> str:
        return report_html(path)

    assert "Leg by leg" not in page()
    log = straight_log(info={"legs": TWO_LEGS, "trial": 0})
    events = ((1.6, changed("Spin", "running")),)
    ResultsFolder(path).write_log(dataclasses.replace(log, events=events))
    text = page()
    assert "Leg by leg" in text
    assert "2.005" in text
    assert "Spin begins" in text
