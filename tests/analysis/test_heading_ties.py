"""Which of equally near samples counts for the published heading error, and what follows."""

from __future__ import annotations

from trial_tables import published_trials

from drake_navbench.analysis.reproduction.heading_ties import heading_ties
from drake_navbench.analysis.reproduction.judgement import judge_all
from drake_navbench.analysis.reproduction.lineups import PUBLISHED_SETTINGS


def test_numbers_and_findings_that_hang_on_the_rule_are_told():
    trials = published_trials(noise=1e-3)
    is_dwb = (trials["controller"] == "dwb") & trials["scenario"].str.startswith("restricted")
    last = trials["avg_heading_error"].where(~is_dwb, 0.1)
    found = heading_ties(
        trials.assign(avg_heading_error_last=last), PUBLISHED_SETTINGS, judge_all(trials)
    )
    assert [(cell.scenario, cell.controller) for cell in found.cells] == [
        ("restricted_small", "dwb"),
        ("restricted_large", "dwb"),
    ]
    # MPPI rotates less than DWB: no longer, where DWB hardly rotates.
    assert {64, 65} <= {entry.number for entry in found.findings}


def test_where_the_rules_agree_nothing_is_told():
    trials = published_trials()
    same = trials.assign(avg_heading_error_last=trials["avg_heading_error"])
    for table in (trials, same):
        found = heading_ties(table, PUBLISHED_SETTINGS, judge_all(trials))
        assert (found.cells, found.findings) == ([], [])
