"""Whole drives with the stand-in stack: as a node of the real rclpy, and over Cyclone DDS.

ROS's wheels stand in an environment of their own, which `make test-ros` makes.
"""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from resident_memory import resident_mb
from stand_ins import CYCLONE, RCLPY, ROBOT, live, ros_python, stand_in, way

pytest.importorskip("cyclonedds")

from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.trial import run_trial

SCENARIOS = ("empty", "doorway", "static_obstacles")

needs_ros = pytest.mark.skipif(
    not ros_python(),
    reason="rclpy is not there: `make test-ros` installs ROS's wheels (Python 3.11)",
)
both_middlewares = pytest.mark.parametrize(
    "middleware", [CYCLONE, pytest.param(RCLPY, marks=needs_ros)]
)


@needs_ros
@pytest.mark.parametrize("stamped", [False, True])
def test_a_node_of_rclpy_drives_to_the_goal(stamped, domain):
    with stand_in(RCLPY, domain, *(["--stamped"] if stamped else [])):
        log = run_trial(way(0.6), live(domain), robot=ROBOT)
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    kind = "TwistStamped" if stamped else "Twist"
    assert log.info["running_stack"]["command_type"] == f"geometry_msgs/msg/{kind}"
    assert log.info["running_stack"]["faults"] == []


@pytest.mark.long
@both_middlewares
def test_three_scenarios_are_driven_to_the_goal(middleware, domain):
    with stand_in(middleware, domain):
        logs = [run_trial(name, live(domain), robot=ROBOT) for name in SCENARIOS]
    assert [log.outcome for log in logs] == [Outcome.SUCCEEDED] * 3
    for name, log in zip(SCENARIOS, logs, strict=True):
        goal = load_scenario(name).goal
        last = log.samples.iloc[-1]
        assert np.hypot(last["x_m"] - goal[0], last["y_m"] - goal[1]) < 0.25


@pytest.mark.long
@both_middlewares
def test_a_hundred_goals_in_a_row_leave_nothing_behind(middleware, domain):
    memory_mb, handles = [], []
    with stand_in(middleware, domain):
        for _ in range(100):
            log = run_trial(way(0.5), live(domain), robot=ROBOT)
            assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
            del log
            memory_mb.append(resident_mb())
            handles.append(len(os.listdir("/proc/self/fd")))
    assert memory_mb[-1] - memory_mb[20] < 20.0
    assert handles[-1] <= handles[20]


@pytest.mark.long
@both_middlewares
def test_a_stack_that_is_killed_and_started_again_drives_on(middleware, domain):
    """A killed process says no farewell: that it is gone is known when its lease ends."""
    killed = stand_in(middleware, domain, "--dies-after", "20")
    with killed as first, stand_in_later(middleware, domain, after=first):
        preset = live(domain, rate=1.0, restart_timeout_s=60.0)
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
        thread.join()
