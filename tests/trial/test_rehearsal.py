"""Compute times hold the work of the controller and not what a process does once."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from stub_controller import StubPreset, straight_ahead

from drake_navbench import run_trial
from drake_navbench.analysis.metrics.compute import cycle_times_ms
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.trial.rehearsal import rehearse
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

pytestmark = pytest.mark.usefixtures("rehearsals")

LOADING_S = 0.5
FIRST_SECONDS = 3.0


class SlowOnce(StubPreset):
    """A controller that loads something when it is first asked, and only then."""

    controller = "slow once"

    def __init__(self):
        self.is_loaded = False
        super().__init__(self._drive)

    def _drive(self, observation, memory):
        if not self.is_loaded:
            time.sleep(LOADING_S)
            self.is_loaded = True
        return straight_ahead(observation, memory)


def first_seconds(name):
    return load_scenario(name).model_copy(update={"timeout_s": FIRST_SECONDS})


def test_what_a_controller_loads_when_first_asked_is_in_no_compute_time():
    preset = SlowOnce()
    scenario = first_seconds("empty")
    log = simulate(TrialSpec(scenario, scenario.load_robot("wheelchair"), preset, seed=0))
    assert preset.is_loaded
    assert cycle_times_ms(log).max() < 1e3 * LOADING_S


def spec_of(preset="rpp", scenario="empty"):
    loaded = load_scenario(scenario)
    return TrialSpec(loaded, loaded.load_robot("wheelchair"), preset, seed=5)


def test_a_kind_of_trial_is_rehearsed_once_whatever_its_seed():
    driven = []
    for seed in (1, 2):
        scenario = load_scenario("empty")
        robot = scenario.load_robot("wheelchair")
        rehearse(TrialSpec(scenario, robot, load_preset("rpp"), seed=seed), driven.append)
    assert [spec.scenario.name for spec in driven] == ["empty", "rehearsal", "rehearsal"]
    assert {spec.seed for spec in driven} == {0}


@pytest.mark.parametrize(
    ("other", "count"),
    [
        (spec_of(load_preset("rpp:lookahead_dist=0.9")), 3),
        (spec_of(load_preset("rpp"), "static_obstacles"), 1),
    ],
    ids=["another parameter", "another scenario"],
)
def test_what_differs_is_rehearsed_too(other, count):
    rehearse(spec_of(load_preset("rpp")), lambda spec: None)
    driven = []
    rehearse(other, driven.append)
    assert len(driven) == count


@pytest.mark.parametrize("error", [ValueError("broken"), SystemExit(1)])
def test_what_goes_wrong_in_a_rehearsal_is_left_to_the_trial(error):
    tried = []

    def fail(spec):
        tried.append(spec)
        raise error

    rehearse(spec_of(load_preset("rpp")), fail)
    assert tried


def test_a_rehearsed_trial_is_the_same_to_the_last_bit(monkeypatch):
    with monkeypatch.context() as unrehearsed:
        unrehearsed.setattr("drake_navbench.trial.trial.rehearse", lambda *arguments: None)
        first = run_trial(first_seconds("empty"), "mppi_nav2", seed=3)
    again = run_trial(first_seconds("empty"), "mppi_nav2", seed=3)
    columns = [name for name in first.samples if name not in UNREPEATABLE_COLUMNS]
    np.testing.assert_array_equal(first.samples[columns], again.samples[columns])


# In a process of its own, where nothing has been driven yet. A dispatcher's signatures are the
# kernels of its name that this process has loaded.
LOADED_WHILE_DRIVING = """
import gc, sys
import drake_navbench.commands.run
from numba.core.dispatcher import Dispatcher
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.trial import trial
from drake_navbench.trial.rehearsal import rehearse
from drake_navbench.trial.spec import TrialSpec

def loaded():
    kernels = (found for found in gc.get_objects() if isinstance(found, Dispatcher))
    names = {
        f"{kernel.py_func.__module__}.{kernel.py_func.__name__}{signature}"
        for kernel in kernels
        for signature in kernel.signatures
    }
    return names | set(sys.modules)

for scenario_name, preset in CASES:
    scenario = load_scenario(scenario_name).model_copy(update={"timeout_s": 4.0})
    robot = scenario.load_robot("wheelchair")
    spec = TrialSpec(scenario, robot, load_preset(preset), seed=0)
    rehearse(spec, trial._simulate)
    before = loaded()
    log = trial._simulate(spec)
    assert log.samples["cycle_count"].max() > 20, log.info["reason"]
    for name in sorted(loaded() - before):
        print(scenario_name, preset, name)
assert "pydrake.multibody.plant" not in sys.modules
"""


@pytest.mark.parametrize(
    "cases",
    [
        [("one_obstacle", "dwb_bringup"), ("static_obstacles", "rpp")],
        pytest.param(
            [
                ("static_obstacles", "mppi_bringup"),
                ("speed_zone", "mppi"),
                ("static_obstacles", "teb"),
            ],
            marks=pytest.mark.long,
        ),
    ],
    ids=["quick columns", "the others"],
)
def test_after_a_rehearsal_a_trial_loads_no_kernel_and_no_module_nor_multibody(cases):
    code = f"CASES = {cases}\n{LOADED_WHILE_DRIVING}"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
