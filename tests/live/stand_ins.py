"""The stand-in stack as a process, over either middleware, and the trials that it drives."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario

HERE = Path(__file__).parent
ROBOT = "turtlebot3_waffle"
ROS_VARIABLE = "DRAKE_NAVBENCH_ROS_PYTHON"
USUAL_PYTHON = HERE.parents[1] / ".venv-ros/bin/python"
CYCLONE, RCLPY = "cyclone", "rclpy"


@cache
def ros_python() -> str:
    """Returns a Python with ROS's wheels, '' where there is none."""
    python = os.environ.get(ROS_VARIABLE, str(USUAL_PYTHON))
    if not Path(python).exists():
        return ""
    found = subprocess.run([python, "-c", "import rclpy, nav_msgs, rosgraph_msgs"], check=False)
    return python if found.returncode == 0 else ""


@contextmanager
def stand_in(middleware: str, domain: int, *options: str) -> Iterator[subprocess.Popen[bytes]]:
    """Runs the stand-in stack; it takes its leave in the end."""
    if middleware == CYCLONE:
        command = [sys.executable, str(HERE / "stand_in_cyclone.py"), str(domain), *options]
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


def live(domain: int, **parameters: object) -> Preset:
    """Returns the column at rate max, unless said otherwise."""
    values = {"domain": domain, "rate": "max", "settle_s": 0.1, **parameters}
    return Preset("live", "live", "the stand-in", values, "test").checked()


def way(length_m: float = 1.0) -> Scenario:
    """Returns the task to drive straight ahead in an empty world."""
    return Scenario(
        name="way",
        description="straight ahead",
        plan={"type": "polyline", "points": [[0.0, 0.0], [length_m, 0.0]]},
        goal=(length_m, 0.0, 0.0),
        timeout_s=60.0,
    )
