"""The least clearance of a trial against the simulated motion, looked at every millisecond."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from stub_controller import StubPreset
from synthetic_logs import log_times, make_log

from drake_navbench.analysis.metrics import safety
from drake_navbench.analysis.metrics.movers import movers_of
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.controller import Decision
from drake_navbench.inputs.presets import DEFAULT_PRESETS
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.least_gap import TOLERANCE_M
from drake_navbench.kernels.swept_contact import clearance_at, pose_within_step
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial import simulation as trial_module
from drake_navbench.trial.contact_watch import ContactWatch
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

MOMENT_S, REACH_M = 1e-3, 5.0
# The front right corner swings past it while the chair turns left.
POST = {"type": "cylinder", "centre": [1.379, 0.22], "radius_m": 0.005}
CART = {
    "name": "cart",
    "type": "box",
    "size_m": [0.4, 0.3],
    "waypoints": [
        {"time_s": 0.0, "position": [1.9, -1.5]},
        {"time_s": 2.0, "position": [1.9, 1.5]},
    ],
}


class _WatchEveryStep(ContactWatch):
    """Keeps time and state at the end of every step of the integrator."""

    steps: list[tuple[float, np.ndarray]]

    def look(self, time_s, state, people=None):
        super().look(time_s, state, people)
        self.steps.append((time_s, np.array(state)))
        self.idle_until_s = -math.inf


@pytest.fixture
def steps(monkeypatch):
    """The ends of all steps of the trials that are simulated."""
    kept = []
    monkeypatch.setattr(_WatchEveryStep, "steps", kept, raising=False)
    monkeypatch.setattr(trial_module, "ContactWatch", _WatchEveryStep)
    return kept


def least_by_milliseconds(steps, outline, log, world):
    """Returns the least gap of the simulated motion, every millisecond, m."""
    movers, least = movers_of(log), math.inf
    outline = np.ascontiguousarray(outline)
    for (start_s, start), (end_s, end) in pairwise(steps):
        duration_s = end_s - start_s
        for share in np.linspace(0.0, 1.0, max(math.ceil(duration_s / MOMENT_S), 1) + 1):
            pose = start[:3]
            if duration_s > 0.0:
                pose = pose_within_step(start, end, duration_s, share)
            shapes = [(world.segments, world.circles)]
            if movers.body_count:
                poses = movers.poses_at(np.array([start_s + share * duration_s]))[0]
                shapes.append(movers.bodies.placed(poses))
            for edges, circles in shapes:
                least = min(least, clearance_at(outline, *pose, edges, circles, REACH_M))
    return least


def drive(obstacles=(), moving=()):
    """Runs a trial of 2 s that turns left at 0.5 m/s and 0.5 rad/s."""
    data = {
        "name": "turn",
        "description": "a straight plan that nobody follows",
        "world": {"obstacles": list(obstacles), "moving_obstacles": list(moving)},
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        "goal": [9.0, 0.0, 0.0],
        "timeout_s": 2.0,
    }
    scenario = validate(Scenario, data, "turn.yaml")
    preset = StubPreset(lambda observation, memory: Decision(np.array([0.5, 0.5]), memory))
    spec = TrialSpec(scenario, load_robot("wheelchair"), preset, seed=0)
    return simulate(spec), scenario.true_world


@pytest.mark.parametrize(
    ("obstacles", "moving"), [([POST], []), ([], [CART])], ids=["what stands", "what moves"]
)
def test_the_least_clearance_is_that_of_the_motion_not_of_its_samples(steps, obstacles, moving):
    log, world = drive(obstacles, moving)
    assert log.outcome is Outcome.TIMED_OUT
    told = safety.min_clearance_m(log)
    truth = least_by_milliseconds(steps, load_robot("wheelchair").outline, log, world)
    assert told == pytest.approx(truth, abs=TOLERANCE_M)
    # One sample every 0.05 s does not see it.
    assert log.samples["clearance_m"].min() > truth + 5.0 * TOLERANCE_M


def test_a_wall_that_is_nearest_between_two_samples():
    # At 0.5 m/s and -0.5 m/s: the front, 0.85 m ahead, turns back 2.5 mm past the first sample.
    log = make_log(np.array([0.0, 0.02]), x_m=[0.0, 0.0], v_mps=[0.5, -0.5], clearance_m=1.0 - 0.85)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [1.0, -1.0], "max": [1.2, 1.0]}
    ]
    # The cubic's middle: (0.5 - -0.5) * 0.02 / 8.
    assert safety.min_clearance_m(log) == pytest.approx(0.15 - 0.0025, abs=TOLERANCE_M)


def test_what_comes_near_after_the_end_does_not_count():
    # Towards a wall at 0.5 m/s: 0.15 m at first, 0.145 m at the end, 0.13 m in the last sample.
    time_s = log_times(0.04)
    log = make_log(time_s, x_m=0.5 * time_s, v_mps=0.5, clearance_m=0.15)
    log.info["scenario"]["world"]["obstacles"] = [
        {"type": "box", "min": [1.0, -1.0], "max": [1.2, 1.0]}
    ]
    log.info["end_time_s"] = 0.01
    assert safety.min_clearance_m(log) == pytest.approx(0.145, abs=TOLERANCE_M)


def test_what_no_sample_has_near_is_left_out():
    log = make_log(log_times(1.0), clearance_m=0.4)
    assert safety.min_clearance_m(log) == 0.4
    log.info["missing"] = {
        "obstacles": "a recording does not contain the true positions of all obstacles"
    }
    assert safety.min_clearance_m(log) == 0.4


@pytest.mark.long
@pytest.mark.parametrize("column", DEFAULT_PRESETS)
@pytest.mark.parametrize(
    "scenario", ["static_obstacles", "one_obstacle", "restricted_small", "restricted_large"]
)
def test_in_the_default_benchmark_it_is_that_of_the_motion(steps, scenario, column):
    (spec,) = plan_campaign([scenario], [column], trials=1).specs
    log = simulate(spec)
    told, sampled = safety.min_clearance_m(log), log.samples["clearance_m"].min()
    truth = least_by_milliseconds(steps, spec.robot.outline, log, spec.scenario.true_world)
    print(f"{scenario} {column}: sampled {sampled:.5f}, told {told:.5f}, true {truth:.5f} m")
    assert told == pytest.approx(truth, abs=TOLERANCE_M)
