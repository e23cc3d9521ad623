"""Trials of a running stack, with the stand-in stack over Cyclone DDS on the other side."""

from __future__ import annotations

import socket
from concurrent.futures import ThreadPoolExecutor

import pytest
from stand_ins import CYCLONE, ROBOT, live, stand_in, way

pytest.importorskip("cyclonedds")

from drake_navbench.analysis.metrics.compute import cycle_times_ms
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.commands.main import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario_plan import GridPlan
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.ros2.live import live_extra, lookout
from drake_navbench.ros2.live.domain import PLAIN, LiveDomain
from drake_navbench.ros2.live.endpoints import TRANSIENT_LOCAL, Quality
from drake_navbench.ros2.live.loopback import domain_sockets
from drake_navbench.trial.trial import run_trial

SCAN = "sensor_msgs/msg/LaserScan"
WAYPOINTS = way(0.9).model_copy(
    update={
        "waypoints": [(0.5, 0.0, 0.0)],
        "navigation_mode": "navigate_to_pose",
        "plan": GridPlan(type="planner"),
    }
)


@pytest.fixture(autouse=True)
def _short_listening(monkeypatch):
    monkeypatch.setattr(lookout, "LISTEN_S", 0.3)


def test_a_stack_drives_to_the_goal_and_the_log_is_a_trials(domain, tmp_path):
    with stand_in(CYCLONE, domain, "--stamped"):
        # However busy the machine is.
        preset = live(domain, patience_s=5.0)
        log = run_trial(way(), preset, robot=ROBOT)
        again = run_trial(WAYPOINTS, preset, robot=ROBOT, seed=1)
    assert (log.outcome, again.outcome) == (Outcome.SUCCEEDED, Outcome.SUCCEEDED)
    last = log.samples.iloc[-1]
    # The stand-in is content with 0.12 m; the waffle drives 0.26 m/s.
    assert last["x_m"] == pytest.approx(1.0, abs=0.13)
    assert 3.0 < log.end_time_s < 6.0
    assert (log.samples["cycle_count"] == 0).all()
    facts = log.info["running_stack"]
    assert facts["command_type"] == "geometry_msgs/msg/TwistStamped"
    assert facts["missed_command_count"] == 0
    assert facts["command_count"] >= 50
    assert len(log.plans) == 1
    assert len(log.info["legs"]) == 1
    # Waypoints are sent one after another.
    assert [leg["goal"][0] for leg in again.info["legs"]] == [0.5, 0.9]
    assert [plan.leg for plan in again.plans] == [0, 1]
    with pytest.raises(Undefined, match="a running stack keeps its control cycles to itself"):
        cycle_times_ms(log)
    path = tmp_path / "log.parquet"
    log.write(path)
    assert TrialLog.read(path).info["running_stack"] == facts


def test_a_stack_that_listens_for_the_pose_localizes_the_robot_itself(domain):
    with stand_in(CYCLONE, domain, "--localizes"):
        log = run_trial(way(0.4), live(domain), robot=ROBOT)
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    assert log.info["running_stack"]["localization"] == "stack"


def test_without_a_stack_the_trial_ends_with_one_line(domain):
    log = run_trial(way(), live(domain, start_timeout_s=0.3), robot=ROBOT)
    assert log.outcome is Outcome.ERROR
    assert log.info["reason"] == (
        f"live: no stack in domain {domain} within 0.3 s: nobody listens to /goal_pose"
    )


def test_another_robot_in_the_domain_is_left_alone(domain):
    other = LiveDomain(domain)
    scans = other.publisher("/scan", SCAN, PLAIN)
    log = run_trial(way(), live(domain), robot=ROBOT)
    del scans
    other.close()
    assert log.outcome is Outcome.ERROR
    assert log.info["reason"] == (
        f"live: domain {domain} is in use by another robot: an unknown node publishes /scan; "
        "expected a domain without one"
    )


def test_a_listener_to_the_commands_is_refused_unless_it_is_allowed(domain):
    recorder = LiveDomain(domain)
    commands = recorder.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    refused = run_trial(way(), live(domain), robot=ROBOT)
    preset = live(domain, allows_listeners=True, start_timeout_s=0.1)
    allowed = run_trial(way(), preset, robot=ROBOT)
    del commands
    recorder.close()
    assert "listens to /cmd_vel and may be a robot" in refused.info["reason"]
    assert "nobody listens to /goal_pose" in allowed.info["reason"]


def test_a_listener_that_asks_for_more_is_named_in_the_log(domain):
    other = LiveDomain(domain)
    scans = other.subscription("/scan", SCAN, Quality(durability=TRANSIENT_LOCAL))
    log = run_trial(way(), live(domain, start_timeout_s=0.5), robot=ROBOT)
    del scans
    other.close()
    assert log.info["running_stack"]["faults"] == [
        "/scan: an unknown node asks for durability transient_local, drake_navbench offers "
        "volatile: nothing arrives"
    ]
    assert log.info["reason"].endswith("offers volatile: nothing arrives")


@pytest.mark.long
def test_a_stack_that_is_started_anew_in_a_trial_gets_the_goal_again(domain):
    with ThreadPoolExecutor() as pool, stand_in(CYCLONE, domain, "--quits-after", "40") as first:
        preset = live(domain, command_timeout_s=0.2)
        driving = pool.submit(run_trial, way(), preset, robot=ROBOT)
        first.wait()
        with stand_in(CYCLONE, domain):
            log = driving.result()
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    assert log.info["running_stack"]["restart_count"] == 1
    # The base stopped by itself in between.
    assert (log.samples["command_v_mps"] == 0.0).iloc[50:-10].any()


def test_a_domain_without_peers_hears_this_machine_alone(domain):
    other = LiveDomain(domain)
    sockets = list(domain_sockets(domain))
    devices = [one.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16) for one in sockets]
    for one in sockets:
        one.close()
    other.close()
    assert len(devices) >= 2
    assert all(device.rstrip(b"\0") == b"lo" for device in devices)
    with pytest.raises(InputError, match="open with the peers none; expected the same"):
        LiveDomain(domain, ["192.0.2.1"])


def test_wrong_input_is_one_line_before_anything_drives(domain, monkeypatch):
    with pytest.raises(InputError, match="two_floors: live is a running stack, which"):
        run_trial("two_floors", live(domain))
    through = way().model_copy(update={"navigation_mode": "navigate_through_poses"})
    with pytest.raises(InputError, match="one goal after another; navigation_mode: expected"):
        run_trial(through, live(domain), robot=ROBOT)
    log = run_trial(way(), live(domain, topics={"scam": "/front"}), robot=ROBOT)
    assert log.info["reason"] == (
        "live: topics: 'scam' is no topic of this robot; did you mean 'scan'?"
    )
    monkeypatch.setattr(live_extra, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'drake-navbench\[live\]'"):
        run_trial(way(), live(domain), robot=ROBOT)


def test_the_command_is_a_simulator_whose_log_is_exported(domain, tmp_path, capfd):
    out = str(tmp_path / "session")
    options = ["--no-page", "--duration", "0.3", "--domain", str(domain), "--robot", ROBOT]
    assert main(["live", "empty", *options, "--out", out]) == 0
    assert "Ended after 0.3 s" in capfd.readouterr().out
    assert main(["export", out, "--mcap"]) == 0
    assert main(["live", "empty", *options, "--out", out]) == 2
    assert main(["live", "--map", "map.yaml"]) == 2
    assert main(["live", "--frame", "wheel=w"]) == 2
    assert main(["run", "empty", "--controllers", "live", "--jobs", "2"]) == 2
    told = capfd.readouterr().err
    assert "--map and --start: expected both or none" in told
    assert "--frame wheel: expected one of map, odom, base, scan" in told
    assert "--jobs: the running stack live drives one trial at a time; expected 1, got 2" in told
