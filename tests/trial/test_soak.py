"""Memory does not grow with what was driven, and what a trial has built is freed after it."""

import ctypes
import gc
import weakref
from pathlib import Path

import numpy as np
import pytest

from drake_navbench import run_trial
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.trial import trial as trial_module
from drake_navbench.trial.diagram import TrialDiagram
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

HOUR_S = 3600.0
MEBIBYTE = 2**20
# Corners of a rectangle in the ward, which the robot goes round by drawn ones.
WARD_X_M, WARD_Y_M = (0.0, 11.0), (-1.0, 1.0)


@pytest.mark.parametrize("mode", ["follow_path", "navigate_to_pose"])
def test_what_a_trial_has_built_is_freed_after_it(mode, monkeypatch):
    built: list[weakref.ref] = []

    def build(*arguments, **options) -> TrialDiagram:
        trial = build_trial_diagram(*arguments, **options)
        built.extend(weakref.ref(part) for part in (trial.diagram, *trial.diagram.GetSystems()))
        return trial

    build_trial_diagram = trial_module.build_trial_diagram
    monkeypatch.setattr(trial_module, "build_trial_diagram", build)
    scenario = Scenario(
        name="ahead", description="ahead", goal=(0.5, 0.0, 0.0), navigation_mode=mode
    )
    simulate(TrialSpec(scenario, load_robot("wheelchair"), load_preset("rpp"), seed=0))
    gc.collect()
    assert len(built) > 10
    assert [part() for part in built if part() is not None] == []


def resident_bytes() -> int:
    """Returns the memory that this process holds, without what it has freed but kept."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def drawn_scenario(ward: Scenario, random: np.random.Generator) -> Scenario:
    """Returns the ward with a drawn start and a drawn goal on other sides of it."""
    x, y = random.uniform(*WARD_X_M, 2), random.choice(WARD_Y_M, 2)
    start, goal = ((float(x[k]), float(y[k]), float(random.uniform(-3, 3))) for k in range(2))
    return ward.model_copy(update={"start": start, "goal": goal})


@pytest.mark.long
def test_memory_after_a_day_of_driving_is_that_after_an_hour():
    ward = load_scenario("speed_zone")
    ward = ward.model_copy(update={"navigation_mode": "navigate_to_pose"})
    random = np.random.default_rng(0)
    driven_s, trials, after_s = 0.0, 0, {}
    for hours in (1, 24):
        while driven_s < hours * HOUR_S:
            log = run_trial(drawn_scenario(ward, random), "rpp", seed=trials)
            driven_s += log.end_time_s
            trials += 1
            del log
        after_s[hours] = resident_bytes()
    print(f"{trials} trials, {driven_s:.0f} s; {after_s[1] / MEBIBYTE:.1f} MiB after an hour,")
    print(f"{after_s[24] / MEBIBYTE:.1f} MiB after a day")
    assert after_s[24] <= 1.05 * after_s[1]
