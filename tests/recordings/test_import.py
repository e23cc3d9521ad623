"""Recordings of robots as trials: what is taken from them, and what they cannot tell."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from robot_bags import (
    ABORTED,
    ACCEPTED,
    CANCELED,
    DRIVE_S,
    EXECUTING,
    LENGTH_M,
    REST_S,
    Entry,
    Ros1Maker,
    drive,
    renamed,
    states,
    turtlebot,
    without,
    write_ros1,
    write_ros2,
)
from rosbags.interfaces import MessageDefinitionFormat

from drake_navbench.analysis.metrics.registry import all_metrics, measure_all
from drake_navbench.commands.main import main
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.ros2.recordings.bag_source import KEPT_TYPES, BagSource
from drake_navbench.ros2.recordings.import_bags import ImportRequest, read_recording
from drake_navbench.trial.trial import run_trial

pytestmark = pytest.mark.usefixtures("without_curves")

SOLID_MAP = """\
image: map.pgm
resolution: 0.05
origin: [-1.0, 0.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


@pytest.fixture(scope="module")
def bag(make, tmp_path_factory) -> Path:
    return write_ros2(tmp_path_factory.mktemp("bags") / "lab", turtlebot(make))


@pytest.fixture(scope="module")
def log(bag, robot_file) -> TrialLog:
    (log,) = read_recording(bag, ImportRequest(robot=str(robot_file))).logs
    return log


def import_one(path: Path, entries, robot_file, **request) -> TrialLog:
    write_ros2(path, entries)
    (log,) = read_recording(path, ImportRequest(robot=str(robot_file), **request)).logs
    return log


def test_a_task_is_what_lies_between_the_states_of_its_goal(log):
    assert log.outcome is Outcome.SUCCEEDED
    assert log.end_time_s == pytest.approx(DRIVE_S)
    times = log.samples["time_s"].to_numpy()
    # 25 Hz; one sample more than lie within, where there is one.
    assert times[0] == pytest.approx(0.0, abs=1e-9)
    assert np.diff(times) == pytest.approx(0.04)
    assert times[-1] == pytest.approx(DRIVE_S + 0.04)


def test_the_pose_is_where_the_transforms_place_the_robot_in_the_map(log):
    samples = log.samples
    assert samples["x_m"].to_numpy() == pytest.approx(1.0)
    assert samples["y_m"].iloc[0] == pytest.approx(2.0)
    assert samples["y_m"].iloc[-1] == pytest.approx(2.0 + LENGTH_M)
    assert samples["yaw_rad"].to_numpy() == pytest.approx(0.5 * math.pi)
    assert log.info["recording"]["pose"] == "transforms, map to base_footprint"


def test_metrics_of_the_drive_are_those_that_can_be_computed_by_hand(log):
    values = measure_all(log)
    for name, value in (
        ("time_to_goal_s", DRIVE_S),
        ("driven_length_m", LENGTH_M),
        ("cross_track_error_max_m", 0.0),
        ("heading_error_max_deg", 0.0),
        ("goal_position_error_m", 0.0),
        ("avg_linear_speed", 0.2),
        ("max_velocity", 100.0 * 0.2 / 0.22),
        # The wall is 1 m from the middle; of hits straight to the left and right of that.
        ("min_scan_clearance_m", 1.0 - 0.105),
        # A row of cells from 1.00 to 1.05 m.
        ("min_cell_centre_distance_m", 1.025),
    ):
        assert values[name].value == pytest.approx(value, abs=2e-3), name


def test_what_a_recording_cannot_tell_is_empty_with_its_reason(log):
    values = measure_all(log)
    for name in ("min_clearance_m", "clearance_p05_m", "danger_time_ratio"):
        assert math.isnan(values[name].value)
        assert "does not contain the true positions of all obstacles" in values[name].reason
    assert "obstacles" in values["time_to_collision_min_s"].reason
    assert "the controller's compute times" in values["compute_time_p50_ms"].reason
    assert "no map was given" in values["min_map_clearance_m"].reason
    undefined = {entry.name for entry in all_metrics() if math.isnan(values[entry.name].value)}
    assert all(values[name].reason for name in undefined)


def test_scans_and_costmaps_lie_in_the_map(log):
    assert len(log.scans) == 51
    scan = log.scans[0]
    # 0.05 m behind the middle of a robot that looks along y, and turned round.
    assert scan.sensor_pose[:2] == pytest.approx([1.0, 1.95])
    # The wall stands at x = 0 in the map.
    assert np.abs(scan.hits[:, 0]).max() < 1e-5
    costmap = log.costmaps[0]
    centres = costmap.lethal_centres
    assert len(centres) == 60
    assert centres[:, 0] == pytest.approx(-0.025, abs=1e-6)
    assert centres[:, 1].mean() == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("kind", ["sqlite3", "bare mcap", "bare db3", "no metadata", "ros1"])
def test_every_kind_of_recording_gives_the_same_trial(kind, make, bag, log, robot_file, tmp_path):
    path = tmp_path / "lab"
    if kind == "ros1":
        maker = Ros1Maker()
        path = path.with_suffix(".bag")
        write_ros1(path, ros1_turtlebot(maker), maker)
    elif kind in ("sqlite3", "bare db3"):
        write_ros2(path, turtlebot(make), plugin="sqlite3")
        path = path / "lab.db3" if kind == "bare db3" else path
    else:
        path.mkdir()
        (path / "lab.mcap").write_bytes((bag / "lab.mcap").read_bytes())
        path = path / "lab.mcap" if kind == "bare mcap" else path
    (other,) = read_recording(path, ImportRequest(robot=str(robot_file))).logs
    assert_same_samples(other, log)


def assert_same_samples(one: TrialLog, other: TrialLog) -> None:
    np.testing.assert_allclose(one.samples, other.samples, atol=1e-9)
    assert one.outcome == other.outcome
    assert len(one.scans) == len(other.scans)
    assert [c.costs.tobytes() for c in one.costmaps] == [c.costs.tobytes() for c in other.costmaps]
    np.testing.assert_allclose(one.plans[0].poses, other.plans[0].poses, atol=1e-12)


def ros1_turtlebot(maker: Ros1Maker) -> list[Entry]:
    """Returns the recording as move_base would leave it: a status five times a second."""
    entries = without(drive(maker), "/plan")
    plan = next(entry for entry in drive(maker) if entry.topic == "/plan")
    entries.append(plan._replace(topic="/move_base/NavfnROS/plan"))
    for k in range(61):
        t = 0.2 * k
        if t < REST_S - 1e-9:
            continue
        status = 1 if t < REST_S + DRIVE_S - 1e-9 else 3
        goal = maker.make(
            "actionlib_msgs/msg/GoalID", stamp=maker.time(0), id="/move_base-1-1650000000.0"
        )
        entry = maker.make("actionlib_msgs/msg/GoalStatus", goal_id=goal, status=status, text="")
        message = maker.make(
            "actionlib_msgs/msg/GoalStatusArray",
            header=maker.header(0, ""),
            status_list=[entry],
        )
        receive_ns = plan.receive_ns - round((REST_S + 0.04) * 1e9) + round(t * 1e9)
        kind = "actionlib_msgs/msg/GoalStatusArray"
        entries.append(Entry("/move_base/status", kind, receive_ns, message))
    return entries


def test_every_goal_is_a_task_and_how_each_ended_is_told(make, robot_file, tmp_path):
    entries = [
        *drive(make),
        *states(make, (1.0, ACCEPTED), (1.1, EXECUTING), (3.0, ABORTED), goal=1),
        *states(make, (4.0, ACCEPTED), (4.0, EXECUTING), (5.0, CANCELED), goal=2),
        *states(make, (6.0, EXECUTING), goal=3),
    ]
    write_ros2(tmp_path / "tour", entries)
    request = ImportRequest(robot=str(robot_file))
    logs = read_recording(tmp_path / "tour", request).logs
    assert [log.outcome for log in logs] == ["aborted", "aborted", "timed_out"]
    assert [log.info["reason"] for log in logs] == [
        "the navigation gave up",
        "the goal was cancelled",
        "the recording ended before the task",
    ]
    assert [log.end_time_s for log in logs] == pytest.approx([2.0, 1.0, 6.0])
    assert logs[0].info["start_time_s"] == pytest.approx(0.1)
    assert [log.info["trial"] for log in logs] == [0, 1, 2]


def test_a_task_can_be_cut_by_hand(make, robot_file, tmp_path):
    entries = list(drive(make))
    log = import_one(tmp_path / "a", entries, robot_file, start_s=2.0, end_s=6.0)
    assert log.end_time_s == pytest.approx(4.0)
    assert log.samples["y_m"].iloc[0] == pytest.approx(2.2)
    # The plan was made before; its end is the goal, 1 m ahead of where the robot was at 6 s.
    assert log.outcome is Outcome.TIMED_OUT
    assert "1.000 m from the goal" in log.info["reason"] or "0.992" in log.info["reason"]
    whole = import_one(tmp_path / "b", entries, robot_file, start_s=1.0)
    assert whole.outcome is Outcome.SUCCEEDED


def test_without_commands_plan_scan_and_costmap_there_is_still_a_trial(make, robot_file, tmp_path):
    topics = ("/cmd_vel", "/plan", "/scan", "/local_costmap/costmap", "/tf", "/tf_static")
    log = import_one(tmp_path / "bare", without(turtlebot(make), *topics), robot_file)
    values = measure_all(log)
    assert values["driven_length_m"].value == pytest.approx(LENGTH_M)
    assert values["duration_s"].value == pytest.approx(DRIVE_S)
    for name, reason in (
        ("avg_linear_speed", "no commands"),
        ("command_v_variation_mps", "no commands"),
        ("cross_track_error_max_m", "no plan"),
        ("goal_position_error_m", "neither a plan nor a goal"),
        ("min_scan_clearance_m", "no scan"),
        ("min_cell_centre_distance_m", "no local costmap"),
        ("min_obstacle_distance", "no local costmap"),
    ):
        assert math.isnan(values[name].value), name
        assert reason in values[name].reason, name
    assert log.info["recording"]["pose"] == "odometry, odom to base_footprint"


def test_a_map_gives_the_clearance_from_the_map(bag, robot_file, tmp_path):
    # The wall of the map stands from x = -0.2 to -0.1: 1.1 m from the way.
    image = np.full((120, 80), 254, dtype=np.uint8)
    image[:, 16:18] = 0
    (tmp_path / "map.pgm").write_bytes(b"P5\n80 120\n255\n" + image.tobytes())
    (tmp_path / "map.yaml").write_text(SOLID_MAP)
    request = ImportRequest(robot=str(robot_file), map_file=tmp_path / "map.yaml")
    (log,) = read_recording(bag, request).logs
    values = measure_all(log)
    assert values["min_map_clearance_m"].value == pytest.approx(1.1 - 0.105, abs=1e-3)
    assert math.isnan(values["min_clearance_m"].value)


CAR_YAML = """\
description: a small car
robot_radius: 0.105
drive: {type: ackermann, wheelbase_m: 0.5, min_turning_radius_m: 1.0}
"""


def steered(make, robot_file, path: Path):
    """Imports the drive with its commands as steering angles, of which tan is 0.25."""
    car = "ackermann_msgs/msg/AckermannDriveStamped"

    def with_angle(entry: Entry) -> Entry:
        if entry.topic != "/cmd_vel":
            return entry
        drive = make.make(
            "ackermann_msgs/msg/AckermannDrive",
            steering_angle=math.atan(0.25),
            steering_angle_velocity=0.0,
            speed=entry.message.linear.x,
            acceleration=0.0,
            jerk=0.0,
        )
        message = make.make(car, header=make.header(entry.receive_ns, ""), drive=drive)
        return entry._replace(topic="/drive", type=car, message=message)

    write_ros2(path, map(with_angle, turtlebot(make)), plugin="sqlite3")
    return read_recording(path, ImportRequest(robot=str(robot_file)))


def test_steering_angles_are_turn_rates_of_a_car(make, tmp_path):
    (tmp_path / "car.yaml").write_text(CAR_YAML)
    (log,) = steered(make, tmp_path / "car.yaml", tmp_path / "bag").logs
    middle = log.samples.iloc[len(log.samples) // 2]
    # tan(angle) / wheelbase = 0.25 / 0.5 m: 0.5 rad for each metre.
    assert middle["command_v_mps"] == pytest.approx(0.2)
    assert middle["command_w_radps"] == pytest.approx(0.1)


def test_steering_angles_without_a_wheelbase_are_left_out_with_a_line(make, robot_file, tmp_path):
    found = steered(make, robot_file, tmp_path / "bag")
    (line,) = (line for line in found.losses if "/drive (command)" in line)
    assert "need the wheelbase" in line
    assert found.drive is None


def test_other_topics_can_be_named_and_left_out(make, robot_file, tmp_path):
    entries = renamed(turtlebot(make), lambda name: "/wheel/odometry" if name == "/odom" else name)
    topics = {"odom": "/wheel/odometry", "scan": ""}
    log = import_one(tmp_path / "named", entries, robot_file, topics=topics)
    assert log.end_time_s == pytest.approx(DRIVE_S)
    assert log.scans == ()


def test_a_simulators_odometry_may_be_the_truth_as_well(bag, robot_file):
    request = ImportRequest(robot=str(robot_file), topics={"truth": "/odom"})
    (log,) = read_recording(bag, request).logs
    # Without it the pose is that of the localisation, from (1, 2) to (1, 4).
    assert log.samples["x_m"].iloc[[0, -1]].to_list() == pytest.approx([0.0, LENGTH_M], abs=0.01)
    assert log.samples["estimated_y_m"].iloc[-1] == pytest.approx(2.0 + LENGTH_M, abs=0.01)


def test_one_robot_of_two_is_chosen_by_its_namespace(make, robot_file, tmp_path):
    shared = ("/tf", "/tf_static")
    entries = [
        entry
        for name in ("a", "b")
        for entry in renamed(turtlebot(make), lambda t, n=name: t if t in shared else f"/{n}{t}")
    ]
    log = import_one(tmp_path / "two", entries, robot_file, namespace="b")
    assert log.info["recording"]["topics"]["odom"] == "/b/odom"
    one = renamed(turtlebot(make), lambda topic: topic if topic in shared else f"/only{topic}")
    assert import_one(tmp_path / "one", one, robot_file).end_time_s == pytest.approx(DRIVE_S)


def test_stamps_of_a_simulator_count_whatever_the_computers_clock_says(make, robot_file, tmp_path):
    # Received at half the speed, as of a simulator that runs slowly.
    begun = turtlebot(make)[0].receive_ns
    slow = [
        entry._replace(receive_ns=begun + 2 * (entry.receive_ns - begun))
        for entry in turtlebot(make)
    ]
    log = import_one(tmp_path / "slow", slow, robot_file)
    assert log.end_time_s == pytest.approx(DRIVE_S, abs=1e-3)
    assert measure_all(log)["driven_length_m"].value == pytest.approx(LENGTH_M, abs=0.01)


def test_a_scanner_upside_down_sees_the_wall_on_the_same_side(make, robot_file, tmp_path):
    entries = without(turtlebot(make), "/tf_static", "/scan")
    mounting = make.transform(0, "base_footprint", "base_scan", (0.0, 0.0, 0.0))
    # Half a turn about x: its beams count to the right.
    mounting.transform.rotation = make.make(
        "geometry_msgs/msg/Quaternion", x=1.0, y=0.0, z=0.0, w=0.0
    )
    tf = "tf2_msgs/msg/TFMessage"
    entries.append(Entry("/tf_static", tf, 1, make.make(tf, transforms=[mounting])))
    for entry in turtlebot(make):
        if entry.topic == "/scan":
            angles = -math.pi + math.radians(1.0) * np.arange(360)
            with np.errstate(divide="ignore"):
                ranges = 1.0 / np.sin(-angles)
            ranges[(ranges <= 0.0) | (ranges > 3.5)] = np.inf
            entry.message.ranges = ranges.astype(np.float32)
            entries.append(entry)
    log = import_one(tmp_path / "upside", entries, robot_file)
    assert np.abs(log.scans[0].hits[:, 0]).max() < 1e-5


@pytest.mark.long
def test_import_report_compare_and_replay_serve_recording_and_simulation_side_by_side(
    bag, robot_file, tmp_path, capsys
):
    results = ResultsFolder(tmp_path / "results")
    results.write_log(run_trial("empty", "rpp", keeps_costmaps=False))
    results.write_manifest({"scenarios": ["empty"], "controllers": ["rpp"]})
    command = ["import-bag", str(bag), "--robot", str(robot_file), "--scenario", "empty"]
    command += ["--out", str(results.path), "--no-report"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "without clearance_m: a recording does not contain" in said
    assert main(["report", str(results.path), "--jobs", "1", "--figures", "all"]) == 0
    report = (results.path / "report.html").read_text()
    assert "recording" in report
    assert "does not contain the true positions of all obstacles" in report
    assert main(["compare", str(results.path), str(results.path), "--jobs", "1"]) == 0
    recorded = results.log_path("empty", "recording", 0)
    assert main(["replay", str(recorded)]) == 0
    assert "local costmap" in recorded.with_suffix(".html").read_text()
    # Once more: beside the first, not over it.
    assert main(command) == 0
    assert results.log_path("empty", "recording", 1).exists()
    assert len(results.read_manifest()["recordings"]) == 2


def test_the_same_definitions_have_one_code_and_others_their_own():
    source = BagSource(Path("lab.mcap"), (), is_ros1=False)

    def types_of(text: str):
        definition = SimpleNamespace(data=text, format=MessageDefinitionFormat.MSG)
        topic = SimpleNamespace(topic="/a", msgtype="lab/msg/A", msgdef=definition)
        return source._types_of([topic])

    for number in range(KEPT_TYPES):
        types_of(f"int64 x{number}\n")
    whole, real = types_of("int64 x\n"), types_of("float64 x\n")
    assert types_of("int64 x\n") is whole
    # 2.0, behind the four bytes that tell the order of the others.
    data = bytes([0, 1, 0, 0]) + struct.pack("<d", 2.0)
    assert real.deserialize_cdr(data, "lab/msg/A").x == 2.0
    assert whole.deserialize_cdr(data, "lab/msg/A").x == 2**62
