"""Time to write replays of trials of half a minute. Run with --benchmark-only."""

from dataclasses import replace

import pytest

from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.inputs.robot import load_robot
from drake_navbench.trial.trial import run_trial

MODEL = load_robot("wheelchair").model_path
RACERS = ("dwb", "rpp", "teb", "mppi", "mppi_nav2")


@pytest.fixture(scope="module")
def log():
    return run_trial("static_obstacles", "rpp", wants_diagnostics=True)


def test_race_of_five(benchmark, log, tmp_path):
    logs = [replace(log, info=dict(log.info) | {"controller": name}) for name in RACERS]
    benchmark(write_race_replay, logs, tmp_path / "race.html", model=MODEL)


def test_trial_with_costmap_and_prediction(benchmark, log, tmp_path):
    benchmark(write_trial_replay, log, tmp_path / "alone.html", model=MODEL)
