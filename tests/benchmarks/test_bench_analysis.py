"""Speed of the analysis: metrics of one trial, statistics, figures, the whole report."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

from results_folders import write_folder
from synthetic_logs import circle_log

from drake_navbench.analysis.metrics.registry import measure_all
from drake_navbench.analysis.report import build_report
from drake_navbench.analysis.statistics import summarize


@pytest.fixture
def half_minute_among_obstacles():
    log = circle_log(end_time_s=30.0)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [4.0, float(i)], "max": [4.5, i + 0.5]} for i in range(8)
    ]
    return log


def test_all_metrics_of_a_trial_of_half_a_minute(benchmark, half_minute_among_obstacles):
    log = half_minute_among_obstacles

    def measure():
        # Another object each time: what a log has in common is kept for one log.
        return measure_all(type(log)(log.samples, log.plans, log.info))

    assert benchmark(measure)["driven_length_m"].value == pytest.approx(12.0, rel=1e-3)


def test_intervals_of_all_metrics_of_a_cell(benchmark):
    rows = np.random.default_rng(0).normal(size=(60, 4))
    assert len(benchmark(lambda: [summarize(row) for row in rows])) == 60


def test_report_of_twelve_short_trials(benchmark, tmp_path):
    folder = write_folder(tmp_path / "results")
    result = benchmark.pedantic(build_report, (folder,), {"jobs": 1}, rounds=3)
    assert result.trial_count == 12
