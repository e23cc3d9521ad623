"""Whole drives with the stand-in stack: as a node of the real rclpy, and over Cyclone DDS.

ROS's wheels stand in an environment of their own, which `make test-ros` makes.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.log import Outcome
from drake_navbench.trial.trial import run_trial

HERE = Path(__file__).parent
ROS_VARIABLE = "DRAKE_NAVBENCH_ROS_PYTHON"
USUAL_PYTHON = HERE.parents[1] / ".venv-ros/bin/python"
ROBOT = "turtlebot3_waffle"
SCENARIOS = ("empty", "doorway", "static_obstacles")
KB_PER_MB = 1024


@cache
def ros_python() -> str:
    """A Python with rclpy; skips the test where there is none."""
    python = os.environ.get(ROS_VARIABLE, str(USUAL_PYTHON))
    if Path(python).exists():
        found = subprocess.run([python, "-c", "import rclpy, nav_msgs, rosgraph_msgs"], check=False)
        if found.returncode == 0:
            return python
    return ""


@contextmanager
def stand_in(middleware, domain, *options):
    if middleware == "cyclone":
        command = [sys.executable, str(HERE / "stand_in_cyclone.py"), str(domain), *options]
    elif not ros_python():
        pytest.skip("rclpy is not there: `make test-ros` installs ROS's wheels (Python 3.11)")
    else:
        command = [ros_python(), str(HERE / "stand_in_rclpy.py"), *options]
    own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    process = subprocess.Popen(command, env=os.environ | own)
    try:
        yield process
    finally:
        # One that is killed stays in the eyes of others until its lease ends.
        process.send_signal(signal.SIGINT)
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def live(domain, **parameters):
    values = {"domain": domain, "rate": "max", "settle_s": 0.1, **parameters}
    return Preset("live", "live", "the stand-in", values, "test").checked()


def way(length_m):
    return Scenario(
        name="way",
        description="straight ahead",
        plan={"type": "polyline", "points": [[0.0, 0.0], [length_m, 0.0]]},
        goal=(length_m, 0.0, 0.0),
        timeout_s=60.0,
    )


@pytest.mark.parametrize("stamped", [False, True])
def test_a_node_of_rclpy_drives_to_the_goal(stamped):
    domain = 101 + 2 * (os.getpid() % 45) + stamped
    with stand_in("rclpy", domain, *(["--stamped"] if stamped else [])):
        log = run_trial(way(0.6), live(domain), robot=ROBOT)
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    kind = "TwistStamped" if stamped else "Twist"
    assert log.info["running_stack"]["command_type"] == f"geometry_msgs/msg/{kind}"
    assert log.info["running_stack"]["faults"] == []


@pytest.mark.long
@pytest.mark.parametrize("middleware", ["cyclone", "rclpy"])
def test_three_scenarios_are_driven_to_the_goal(middleware):
    with stand_in(middleware, 201):
        logs = [run_trial(name, live(201), robot=ROBOT) for name in SCENARIOS]
    assert [log.outcome for log in logs] == [Outcome.SUCCEEDED] * 3
    for name, log in zip(SCENARIOS, logs, strict=True):
        goal = load_scenario(name).goal
        last = log.samples.iloc[-1]
        assert np.hypot(last["x_m"] - goal[0], last["y_m"] - goal[1]) < 0.25


@pytest.mark.long
@pytest.mark.parametrize("middleware", ["cyclone", "rclpy"])
def test_a_hundred_goals_in_a_row_leave_nothing_behind(middleware):
    peaks_mb, handles = [], []
    with stand_in(middleware, 202):
        for _ in range(100):
            log = run_trial(way(0.5), live(202), robot=ROBOT)
            assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
            peaks_mb.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KB_PER_MB)
            handles.append(len(os.listdir("/proc/self/fd")))
    assert peaks_mb[-1] - peaks_mb[20] < 40.0
    assert handles[-1] <= handles[20]


@pytest.mark.long
@pytest.mark.parametrize("middleware", ["cyclone", "rclpy"])
def test_a_stack_that_is_killed_and_started_again_drives_on(middleware):
    """A killed process says no farewell: that it is gone is known when its lease ends."""
    with stand_in(middleware, 203) as first, stand_in_later(middleware, 203, after=first):
        threading.Timer(6.0, first.send_signal, [signal.SIGKILL]).start()
        preset = live(203, rate=1.0, restart_timeout_s=60.0)
        log = run_trial(way(1.5), preset, robot=ROBOT)
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    assert log.info["running_stack"]["restart_count"] >= 1


@contextmanager
def stand_in_later(middleware, domain, *, after):
    """Starts a second stand-in as soon as another process has ended."""
    done = threading.Event()

    def wait_and_start():
        after.wait()
        if done.is_set():
            return
        with stand_in(middleware, domain):
            done.wait()

    thread = threading.Thread(target=wait_and_start, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        after.kill()
        thread.join(timeout=10.0)
