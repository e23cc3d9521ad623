"""A controller that ends its trials far before the goal is told as such."""

from __future__ import annotations

import pandas as pd

from drake_navbench.analysis.early_arrivals import early_arrivals


def test_a_controller_that_arrives_far_before_the_goal_is_told():
    rows = [
        ("wide", "succeeded", 2.4),
        ("wide", "succeeded", 2.6),
        # Whoever gave up did not arrive.
        ("wide", "aborted", 9.0),
        ("near", "succeeded", 0.2),
        ("near", "aborted", 9.0),
        # One far arrival among near ones is chance.
        ("mixed", "succeeded", 0.9),
        ("mixed", "succeeded", 0.05),
        # The last trial ended on another floor.
        ("elsewhere", "succeeded", None),
    ]
    trials = pd.DataFrame(rows, columns=["controller", "outcome", "goal_position_error_m"])
    (line,) = early_arrivals(trials)
    assert line.startswith("wide counts as arrived 2.5 m before the goal on average, by its goal")
    assert early_arrivals(trials.drop(columns="goal_position_error_m")) == []
