"""The parts of `drake_navbench.ros2.live` that need no domain."""

from __future__ import annotations

import math
import os
import tempfile

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from drake_navbench.errors import InputError
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.ros2.live import clock_file
from drake_navbench.ros2.live.clock_file import FIRST_STAMP_NS, GAP_NS, ClockFile
from drake_navbench.ros2.live.endpoints import (
    BEST_EFFORT,
    TRANSIENT_LOCAL,
    Endpoint,
    OwnTopic,
    Quality,
    may_be_robots,
    mismatches,
    robots_there,
)
from drake_navbench.ros2.live.goal_watch import GoalEntry, GoalState, GoalWatch
from drake_navbench.ros2.live.pace import Pace
from drake_navbench.ros2.live.parameters import LiveParameters
from drake_navbench.ros2.live.robot_topics import points_in_sensor, urdf_in_frames
from drake_navbench.ros2.live.wire_types import dds_topic, dds_type, ros_topic, ros_type, type_hash

SCAN = "sensor_msgs/msg/LaserScan"


class Wall:
    """A wall clock that only goes on when somebody sleeps, or by hand."""

    def __init__(self):
        self.now_s = 100.0

    def now(self):
        return self.now_s

    def sleep(self, duration_s):
        self.now_s += duration_s


def pace(rate, wall):
    return Pace(rate, command_period_s=0.05, patience_s=0.2, now=wall.now, sleep=wall.sleep)


def test_names_of_topics_and_types_are_those_of_ros_in_dds():
    assert dds_topic("/scan") == "rt/scan"
    assert ros_topic("rt/robot1/scan") == "/robot1/scan"
    assert ros_topic("rq/node/get_parametersRequest") is None
    assert dds_type(SCAN) == "sensor_msgs::msg::dds_::LaserScan_"
    assert ros_type("sensor_msgs::msg::dds_::LaserScan_") == SCAN
    assert ros_type("Chatter") == "Chatter"


def test_the_type_hash_is_that_of_ros():
    # As ros-sensor-msgs 5.5.1 (Kilted) has it in share/sensor_msgs/msg/LaserScan.json.
    expected = "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"
    assert type_hash(SCAN) == expected


def test_at_rate_2_a_second_of_the_simulation_takes_half_a_second():
    wall = Wall()
    held = pace(2.0, wall)
    held.begin(0.0)
    for step in range(1, 101):
        held.hold(0.01 * step)
    assert wall.now_s == pytest.approx(100.5)


def test_a_simulation_that_stalls_does_not_hurry_afterwards():
    wall = Wall()
    held = pace(1.0, wall)
    held.begin(0.0)
    wall.sleep(3.0)
    held.hold(0.01)
    assert held.late_count == 1
    held.hold(0.02)
    assert wall.now_s == pytest.approx(103.01)


def test_at_rate_max_only_the_step_of_a_command_waits():
    held = pace(None, Wall())
    held.begin(0.0)
    waits = [held.patience_for_command_s(0.01 * step) for step in range(1, 8)]
    assert waits == [0.0, 0.0, 0.0, 0.0, 0.2, 0.2, 0.2]
    held.note_command(0.05, has_come=True)
    assert held.patience_for_command_s(0.06) == 0.0
    assert held.patience_for_command_s(0.10) == 0.2


def test_at_rate_max_a_stack_that_sends_nothing_gets_the_pace_of_the_wall_clock():
    wall = Wall()
    held = pace(None, wall)
    held.begin(0.0)
    held.hold(0.05)
    assert wall.now_s == 100.0
    held.note_command(0.05, has_come=False)
    assert held.patience_for_command_s(0.10) == 0.0
    held.hold(0.15)
    assert wall.now_s == pytest.approx(100.10)
    held.note_command(0.15, has_come=True)
    held.hold(0.16)
    assert wall.now_s == pytest.approx(100.10)
    assert held.facts()["missed_command_count"] == 1


def entry(number, state, accepted_ns=0):
    return GoalEntry(bytes([number]), state, accepted_ns)


def test_the_goal_that_was_not_there_before_is_followed():
    goals = GoalWatch()
    goals.note([entry(1, GoalState.SUCCEEDED)])
    goals.expect()
    goals.note([entry(1, GoalState.SUCCEEDED)])
    assert not goals.is_taken
    goals.note([entry(1, GoalState.SUCCEEDED), entry(2, GoalState.EXECUTING)])
    assert goals.is_taken
    assert goals.any_active
    goals.note([entry(1, GoalState.SUCCEEDED), entry(2, GoalState.ABORTED)])
    assert goals.state is GoalState.ABORTED
    assert not goals.any_active


def test_of_two_new_goals_the_later_one_is_followed():
    goals = GoalWatch()
    goals.expect()
    goals.note([entry(7, GoalState.ABORTED, 10), entry(3, GoalState.EXECUTING, 20)])
    assert goals.state is GoalState.EXECUTING


def test_a_quality_that_does_not_match_is_told_with_both_sides_words():
    ours = OwnTopic("/scan", (SCAN,), True, Quality())
    asks = Quality(durability=TRANSIENT_LOCAL)
    listener = Endpoint("/scan", SCAN, False, asks, node="/local_costmap")
    assert mismatches([listener], [ours]) == [
        "/scan: node /local_costmap asks for durability transient_local, drake_navbench offers "
        "volatile: nothing arrives"
    ]
    modest = Endpoint("/scan", SCAN, False, Quality(BEST_EFFORT))
    assert mismatches([modest], [ours]) == []


def test_another_type_and_another_definition_of_a_type_are_told():
    status = "action_msgs/msg/GoalStatusArray"
    ours = OwnTopic("/status", (status,), False, Quality(), ("RIHS01_aa",))
    other = Endpoint("/status", "std_msgs/msg/String", True, node="/mine")
    assert mismatches([other], [ours]) == [
        "/status: node /mine publishes std_msgs/msg/String, drake_navbench expects "
        "action_msgs/msg/GoalStatusArray"
    ]
    changed = Endpoint("/status", status, True, type_hash="RIHS01_bb")
    assert mismatches([changed], [ours]) == [
        f"/status: an unknown node has another {status} than drake_navbench: RIHS01_bb against "
        "RIHS01_aa"
    ]
    # Humble tells no hash.
    assert mismatches([changed._replace(type_hash="")], [ours]) == []


def test_who_publishes_a_scan_or_obeys_commands_is_another_robot():
    scanner = Endpoint("/scan", SCAN, True, node="/hokuyo")
    base = Endpoint("/cmd_vel", "geometry_msgs/msg/Twist", False)
    planner = Endpoint("/plan", "nav_msgs/msg/Path", True)
    there = [scanner, base, planner]
    assert robots_there(there, ["/clock", "/scan"]) == ["node /hokuyo publishes /scan"]
    assert may_be_robots(there, "/cmd_vel") == [
        "an unknown node listens to /cmd_vel and may be a robot that would drive"
    ]


def test_the_clock_of_a_domain_never_goes_back_and_has_one_user(tmp_path, monkeypatch):
    monkeypatch.setattr(clock_file, "FREE_PATIENCE_S", 0.0)
    first = ClockFile(5, tmp_path)
    assert first.first_stamp_ns == FIRST_STAMP_NS + 0 * GAP_NS
    with pytest.raises(InputError, match="domain 5: another drake_navbench drives there"):
        ClockFile(5, tmp_path)
    first.close(40_000_000_000)
    again = ClockFile(5, tmp_path)
    assert again.first_stamp_ns == 40_000_000_000 + GAP_NS
    again.close(again.first_stamp_ns)


def test_a_process_that_is_killed_leaves_a_later_stamp_than_it_sent(tmp_path):
    killed = ClockFile(5, tmp_path)
    sent_ns = killed.first_stamp_ns + 200_000_000_000
    killed.keep(sent_ns)
    killed._file.close()
    assert ClockFile(5, tmp_path).first_stamp_ns > sent_ns


def test_the_clock_is_not_kept_where_another_user_could_choose_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "live-domain-5").write_text("42", encoding="ascii")
    (tmp_path / f"drake_navbench-{os.getuid()}").symlink_to(tmp_path / "theirs")
    ClockFile(5).close(FIRST_STAMP_NS)
    assert (tmp_path / "theirs" / "live-domain-5").read_text(encoding="ascii") == "42"


def test_a_namespace_stands_before_every_topic_but_the_clock():
    parameters = LiveParameters(namespace="/robot1", topics={"scan": "/front"})
    assert parameters.topic("odom") == "/robot1/odom"
    assert parameters.topic("clock") == "/clock"
    assert parameters.topic("scan") == "/front"
    assert parameters.topic("goal_status") == "/robot1/navigate_to_pose/_action/status"


@pytest.mark.parametrize(
    "wrong",
    [{"domain": 233}, {"rate": 0.0}, {"rate": "fast"}, {"namespace": "robot1"}, {"rat": 1.0}],
)
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        LiveParameters(**wrong)


def test_points_are_sent_as_their_sensor_sees_them():
    # A sensor at (1, 2, 0.3) that looks along y: a point 2 m ahead and 1 m to the left of it.
    cloud = PointCloud(np.array([1.0, 2.0, 0.3]), np.array([[0.0, 4.0, 0.5]]), 0.0, math.pi / 2)
    assert points_in_sensor(cloud) == pytest.approx(np.array([[2.0, 1.0, 0.2]]))


def test_the_description_has_the_names_of_the_frames():
    urdf = '<robot name="r"><link name="base_link"/><joint name="j"><parent link="base_link"/>'
    urdf += '<child link="base_scan"/></joint></robot>'
    changed = urdf_in_frames(urdf, LiveParameters(base_frame="b", scan_frame="s"))
    assert '<link name="b"' in changed
    assert '<parent link="b"' in changed
    assert '<child link="s"' in changed
