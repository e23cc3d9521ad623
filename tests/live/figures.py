"""Measures the figures of docs/live.md: `python tests/live/figures.py [--ros] [WHAT ...]`.

--ros: the stand-in runs as a node of rclpy over Fast DDS (`make test-ros` installs ROS's wheels);
without, it runs over Cyclone DDS. WHAT: speed, jitter, latency, repeats, goals (all).
"""

from __future__ import annotations

import argparse
import os
import resource
import time

import numpy as np
from stand_ins import CYCLONE, RCLPY, ROBOT, live, stand_in, way

from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.trial import run_trial

DOMAIN = 29
BEAMS = 720
SCENARIOS = ("empty", "doorway", "static_obstacles")
REPEATS, GOALS = 10, 100
KB_PER_MB = 1024.0


def with_beams(scenario: Scenario) -> Scenario:
    """Returns a scenario in which the robot's lidar has BEAMS beams."""
    overrides = {"lidar": {"beam_count": BEAMS}}
    return scenario.model_copy(update={"robot_overrides": overrides})


def driven(scenario: Scenario, **parameters: object) -> tuple[TrialLog, float]:
    """Returns the log of a trial, and the wall-clock time of its driving, s."""
    log = run_trial(scenario, live(DOMAIN, **parameters), robot=ROBOT)
    facts = log.info["running_stack"]
    return log, facts["wall_s"]


def measure_speed() -> None:
    for name in SCENARIOS:
        log, wall_s = driven(with_beams(load_scenario(name)))
        ratio = log.end_time_s / wall_s
        print(f"speed {name}: {log.outcome}, {log.end_time_s:.2f} s in {wall_s:.2f} s: {ratio:.1f}")


def measure_jitter() -> None:
    log, _ = driven(with_beams(load_scenario("empty")), rate=1.0)
    facts = log.info["running_stack"]
    print(f"jitter: {facts['clock_late_p50_ms']} ms p50, {facts['clock_late_p99_ms']} ms p99")


def measure_latency() -> None:
    scenario = with_beams(load_scenario("empty")).model_copy(update={"timeout_s": 20.0})
    log, _ = driven(scenario, command_period_s=0.1)
    facts = log.info["running_stack"]
    p50, p99 = facts["scan_to_command_p50_ms"], facts["scan_to_command_p99_ms"]
    print(f"latency from scan to command: {p50} ms p50, {p99} ms p99")


def measure_repeats() -> None:
    for rate in ("max", 1.0):
        logs = [
            run_trial(load_scenario("doorway"), live(DOMAIN, rate=rate), robot=ROBOT)
            for _ in range(REPEATS if rate == "max" else 3)
        ]
        times = np.array([log.end_time_s for log in logs])
        ends = np.array([log.samples[["x_m", "y_m"]].iloc[-1] for log in logs])
        farthest = max(np.hypot(*(ends - end).T).max() for end in ends)
        print(
            f"{len(logs)} repeats of doorway at rate {rate}: {times.min():.2f} to "
            f"{times.max():.2f} s (std {times.std(ddof=1):.3f}), ends within {farthest:.3f} m, "
            f"{sum(log.outcome is Outcome.SUCCEEDED for log in logs)} at the goal"
        )


def measure_goals() -> None:
    scenario = way(0.5)
    preset = live(DOMAIN)
    reached, memory_mb, began = 0, [], time.monotonic()
    for _ in range(GOALS):
        log = run_trial(scenario, preset, robot=ROBOT)
        reached += log.outcome is Outcome.SUCCEEDED
        peak_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        memory_mb.append(peak_kb / KB_PER_MB)
    handles = len(os.listdir("/proc/self/fd"))
    print(
        f"{reached} of {GOALS} goals in a row in {time.monotonic() - began:.0f} s; peak memory "
        f"{memory_mb[9]:.0f} MB after 10, {memory_mb[-1]:.0f} MB after all; {handles} open files"
    )


MEASURES = {
    "speed": measure_speed,
    "jitter": measure_jitter,
    "latency": measure_latency,
    "repeats": measure_repeats,
    "goals": measure_goals,
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", nargs="*", metavar="WHAT")
    parser.add_argument("--ros", action="store_true")
    arguments = parser.parse_args()
    middleware = RCLPY if arguments.ros else CYCLONE
    for name in arguments.what or MEASURES:
        with stand_in(middleware, DOMAIN, *(["--echo"] if name == "latency" else [])):
            MEASURES[name]()


if __name__ == "__main__":
    main()
