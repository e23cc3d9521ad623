"""Exported trials, read by a reader that shares no code with the writer."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recorded_trials import short_trial

from drake_navbench.commands.main import main
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.world import Box, World
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.logs.log import TrialLog
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.ros2.recordings.occupancy import (
    costs_from_occupancy,
    map_of_world,
    occupancy_from_costs,
)
from drake_navbench.ros2.recordings.recorded_columns import ROLES
from drake_navbench.ros2.recordings.robot_description import urdf_of
from drake_navbench.ros2.recordings.rosbags_extra import ros2_types
from drake_navbench.ros2.recordings.topics import SCALARS, Topic
from drake_navbench.ros2.recordings.trial_messages import TIME_ZERO_NS, TrialMessages
from drake_navbench.trial.trial import run_trial

REPOSITORY = Path(__file__).parents[2]
LAYOUTS = REPOSITORY / "drake_navbench" / "ros2" / "recordings" / "layouts"
TOPICS = [one for one in vars(topics).values() if isinstance(one, Topic)] + list(SCALARS.values())


@pytest.fixture(scope="module")
def log_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "trial_000.parquet"
    short_trial().write(path)
    return path


@pytest.fixture(scope="module")
def bag(log_file, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("out")
    assert main(["export", str(log_file), "--mcap", "--out", str(out)]) == 0
    return out / "trial_000"


@pytest.fixture(scope="module")
def messages(bag) -> list:
    """Returns (schema, channel, message, decoded) of everything in the bag, in its order."""
    with (bag / "trial_000.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        return list(reader.iter_decoded_messages())


def of(messages, topic: str) -> list:
    return [decoded for _, channel, _, decoded in messages if channel.topic == topic]


def seconds(stamp) -> float:
    return (stamp.sec * 10**9 + stamp.nanosec - TIME_ZERO_NS) / 1e9


def yaw_of(quaternion) -> float:
    return 2.0 * math.atan2(quaternion.z, quaternion.w)


def test_an_independent_reader_decodes_every_message_by_the_schemas_in_the_file(messages):
    types = {schema.name: schema for schema, *_ in messages}
    assert {schema.encoding for schema in types.values()} == {"ros2msg"}
    assert {(c.topic, s.name) for s, c, *_ in messages} <= {(t.name, t.type) for t in TOPICS}
    # All topics but those of what this trial has not: samples, navigator, what moves.
    missing = {t.name for t in TOPICS} - {channel.topic for _, channel, *_ in messages}
    assert missing == {
        "/moving_obstacles",
        "/navigate_to_pose/_action/status",
        "/navigate_through_poses/_action/status",
        "/trajectories",
    }


def test_metadata_counts_the_messages_and_names_the_hashes_of_their_types(bag, messages):
    text = (bag / "metadata.yaml").read_text(encoding="utf-8")
    told = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert told["storage_identifier"] == "mcap"
    assert told["relative_file_paths"] == ["trial_000.mcap"]
    counts = Counter(channel.topic for _, channel, *_ in messages)
    topics = {entry["topic_metadata"]["name"]: entry for entry in told["topics_with_message_count"]}
    assert {name: entry["message_count"] for name, entry in topics.items()} == counts
    # The hashes that ROS 2 itself has for these types begin so.
    hashes = {
        name: entry["topic_metadata"]["type_description_hash"] for name, entry in topics.items()
    }
    for name, begin in (
        ("/cmd_vel", "5f0fcd4f81d5d06a"),
        ("/odom", "3cc97dc7fb7502f8"),
        ("/plan", "1957a5bb3cee5da6"),
        ("/map", "8d348150c12913a3"),
        ("/scan", "64c191398013af96"),
        ("/tf", "e369d0f05a23ae52"),
        ("/local_costmap/published_footprint", "b7cf07932f1523d4"),
    ):
        assert hashes[name].startswith(f"RIHS01_{begin}")


def test_chunks_are_compressed_and_can_be_searched(bag):
    with (bag / "trial_000.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary.chunk_indexes
    assert {index.compression for index in summary.chunk_indexes} == {"zstd"}


def test_stamps_never_run_backwards_and_are_the_times_of_the_recording(messages):
    last: dict[str, int] = {}
    for _, channel, message, _ in messages:
        assert message.log_time >= last.get(channel.topic, TIME_ZERO_NS)
        last[channel.topic] = message.log_time
    log = short_trial()
    assert [seconds(m.header.stamp) for m in of(messages, "/odom")] == pytest.approx(
        log.samples["time_s"].tolist(), abs=1e-9
    )


def test_poses_and_twists_are_those_of_the_log(messages):
    samples = short_trial().samples
    for topic, twist in (
        ("/odom", ("measured_v_mps", "measured_w_radps")),
        ("/ground_truth/odom", ("v_mps", "w_radps")),
    ):
        told = of(messages, topic)
        assert [m.pose.pose.position.x for m in told] == samples["x_m"].tolist()
        yaw = [yaw_of(m.pose.pose.orientation) for m in told]
        assert yaw == pytest.approx(samples["yaw_rad"].tolist(), abs=1e-12)
        assert [m.twist.twist.linear.x for m in told] == samples[twist[0]].tolist()
        assert [m.twist.twist.angular.z for m in told] == samples[twist[1]].tolist()
    estimate = of(messages, "/amcl_pose")
    assert [m.pose.pose.position.y for m in estimate] == samples["estimated_y_m"].tolist()


def test_covariances_are_squares_of_the_robot_s_standard_deviations():
    """In m and m/s 0.1 and 0.2, in rad and rad/s 0.3 and 0.4: x and v at 0, yaw and w at 35."""
    log = short_trial()
    log = replace(log, info=deepcopy(log.info))
    log.info["robot"]["localization"] |= {
        "xy_std_m": 0.1,
        "linear_velocity_std_mps": 0.2,
        "yaw_std_rad": 0.3,
        "angular_velocity_std_radps": 0.4,
    }
    sent = {topic.name: message for topic, _, message in TrialMessages(log, MessageMaker())}
    place, speed = sent["/amcl_pose"].pose.covariance, sent["/odom"].twist.covariance
    assert (place[0], place[7], place[35]) == pytest.approx((0.01, 0.01, 0.09))
    assert (speed[0], speed[35]) == pytest.approx((0.04, 0.16))


def test_a_compute_time_is_told_of_every_cycle_and_another_scalar_where_it_changes():
    log = short_trial()
    steady = {"compute_time_ms": 2.0, "clearance_m": 0.5}
    log = replace(log, samples=log.samples.assign(**steady))
    told = Counter(topic.name for topic, *_ in TrialMessages(log, MessageMaker()))
    cycles = log.samples["cycle_count"].nunique()
    assert cycles > 1
    assert told["/drake_navbench/compute_time_ms"] == cycles
    assert told["/drake_navbench/clearance_m"] == 1


def test_a_command_has_a_stamp_before_the_motion_that_it_causes(messages):
    """The first sample that shows it shows the base move already: it was given 0.02 s before."""
    samples = short_trial().samples
    row = int((samples["command_v_mps"] != 0.0).to_numpy().argmax())
    assert samples["v_mps"][row] > samples["v_mps"][row - 1] == 0.0
    first = next(m for m in of(messages, "/cmd_vel") if m.twist.linear.x != 0.0)
    given_s = samples["time_s"][row - 1] + 0.001
    assert seconds(first.header.stamp) == pytest.approx(given_s, abs=1e-9)


def test_the_transforms_place_the_base_where_the_controller_was_told(
    messages,
):
    samples = short_trial().samples
    for message, row in zip(of(messages, "/tf"), samples.itertuples(), strict=True):
        first, second = message.transforms
        assert (first.header.frame_id, first.child_frame_id) == ("map", "odom")
        assert (second.header.frame_id, second.child_frame_id) == ("odom", "base_link")
        turn = yaw_of(first.transform.rotation)
        x, y = second.transform.translation.x, second.transform.translation.y
        told_x = first.transform.translation.x + x * math.cos(turn) - y * math.sin(turn)
        assert told_x == pytest.approx(row.estimated_x_m, abs=1e-12)
    (static,) = of(messages, "/tf_static")
    assert {(t.header.frame_id, t.child_frame_id) for t in static.transforms} == {
        ("base_link", "base_footprint"),
        ("base_link", "base_scan"),
    }


def test_a_scan_has_the_beams_of_the_log(messages):
    log = short_trial()
    told = of(messages, "/scan")
    assert len(told) == len(log.scans)
    for message, scan in zip(told, log.scans, strict=True):
        np.testing.assert_array_equal(np.array(message.ranges, np.float32), scan.ranges_m)
        angles = message.angle_min + message.angle_increment * np.arange(len(message.ranges))
        np.testing.assert_allclose(angles, scan.angles_rad, atol=1e-4)


def test_the_local_costmap_is_drawn_where_it_lies(messages):
    log = short_trial()
    told = of(messages, "/local_costmap/costmap")
    assert len(told) == len(log.costmaps) > 1
    for message, costmap in zip(told, log.costmaps, strict=True):
        grid = np.array(message.data, dtype=np.int8).reshape(
            message.info.height, message.info.width
        )
        np.testing.assert_array_equal(grid == 100, costmap.costs == LETHAL)
        assert message.info.origin.position.x == costmap.origin_x
        assert message.info.resolution == pytest.approx(costmap.resolution)


def test_the_map_shows_what_the_planner_knows_the_right_way_up(messages):
    shapes = short_trial().info["obstacles"]
    assert not any(shape["known_to_planner"] for shape in shapes)
    (unknown,) = of(messages, "/map")
    assert set(unknown.data) == {0}
    box = Box(type="box", min=(1.0, -2.0), max=(3.0, -1.5))
    grid = map_of_world(World((box,)), np.array([[0.0, 0.0], [4.0, 5.0]]), 1.0)
    rows, columns = np.nonzero(grid.costs == 100)
    x = grid.origin_x + (columns + 0.5) * grid.resolution
    y = grid.origin_y + (rows + 0.5) * grid.resolution
    assert [x.min(), y.min(), x.max(), y.max()] == pytest.approx([1.0, -2.0, 3.0, -1.5], abs=0.05)
    assert [grid.origin_x, grid.origin_y] == pytest.approx([-1.0, -3.0])


def test_the_states_of_the_goal_tell_when_the_task_began_and_how_it_ended(messages):
    log = short_trial()
    states = [
        (message.log_time, decoded.status_list[0].status)
        for _, channel, message, decoded in messages
        if channel.topic == "/follow_path/_action/status"
    ]
    assert log.outcome == "aborted"
    assert [status for _, status in states] == [1, 2, 6]
    assert states[2][0] - TIME_ZERO_NS == round(log.end_time_s * 1e9)


def test_every_control_cycle_has_its_compute_time(messages):
    log = short_trial()
    cycles = log.samples["cycle_count"].to_numpy()
    told = [m.data for m in of(messages, "/drake_navbench/compute_time_ms")]
    # The first message tells of the time before the first cycle.
    assert told[1:] == log.samples["compute_time_ms"][np.diff(cycles, prepend=0) > 0].tolist()


@pytest.mark.parametrize("robot", ["wheelchair", "round_robot"])
def test_the_urdf_has_the_outline_and_the_lidar_of_the_robot(robot):
    robot = load_robot(robot)
    root = ET.fromstring(urdf_of(robot, "robot"))
    links = {link.get("name") for link in root.findall("link")}
    joints = [
        (j.find("parent").get("link"), j.find("child").get("link")) for j in root.findall("joint")
    ]
    assert links == {"base_link", "base_footprint", "base_scan"}
    assert joints == [("base_link", "base_footprint"), ("base_link", "base_scan")]
    if robot.robot_radius is not None:
        (cylinder,) = root.findall("link[@name='base_link']/visual/geometry/cylinder")
        assert float(cylinder.get("radius")) == robot.robot_radius
        return
    walls = root.findall("link[@name='base_link']/visual")
    lengths = [float(wall.find("geometry/box").get("size").split()[0]) for wall in walls]
    edges = np.hypot(*(np.roll(robot.outline, -1, axis=0) - robot.outline).T)
    assert lengths == pytest.approx(edges)


def test_costs_come_back_as_the_same_occupancy():
    costs = np.arange(256, dtype=np.uint8)
    told = occupancy_from_costs(costs)
    # Costmap2DPublisher's values.
    assert told[[0, 1, 4, 128, 252, 253, 254, 255]].tolist() == [0, 1, 2, 50, 98, 99, 100, -1]
    back = costs_from_occupancy(told)
    np.testing.assert_array_equal(occupancy_from_costs(back), told)
    assert back[[0, 253, 254, 255]].tolist() == [0, 253, 254, 255]


def test_sampled_trajectories_are_lines_coloured_by_their_cost(log_file, tmp_path):
    log = short_trial()
    samples = np.zeros((3, 4, 3))
    samples[..., 1] = np.arange(3)[:, None]
    left = {"sampled_trajectories": samples, "sampled_costs": np.array([2.0, np.nan, 1.0])}
    drawn = TrialLog(log.samples, log.plans, log.info, diagnostics=((0.1, left),))
    drawn.write(tmp_path / "log.parquet")
    assert main(["export", str(tmp_path / "log.parquet"), "--mcap"]) == 0
    with (tmp_path / "log" / "log.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        ((*_, message),) = reader.iter_decoded_messages(topics=["/trajectories"])
    (marker,) = message.markers
    # Three lines of three pieces, two points each; refused ones in a colour of their own.
    assert len(marker.points) == len(marker.colors) == 18
    refused = {point.y for point, c in zip(marker.points, marker.colors, strict=True) if c.r > 0.89}
    assert refused == {1.0}


def test_the_layouts_show_topics_and_fields_that_there_are():
    types = ros2_types().fielddefs
    by_name = {topic.name: topic.type for topic in TOPICS}

    def require_field(topic: str, fields: list[str]) -> None:
        kind = by_name[topic]
        for field in fields:
            (definition,) = [d for name, d in types[kind][1] if name == field]
            kind = definition[1] if isinstance(definition[1], str) else definition[1][0]

    layout = json.loads((LAYOUTS / "foxglove_layout.json").read_text())
    panels = set(
        re.findall(r'"((?:3D|Plot|DiagnosticStatusPanel)!\w+)"', json.dumps(layout["layout"]))
    )
    assert panels == set(layout["configById"])
    assert set(layout["configById"]["3D!trial"]["topics"]) <= set(by_name)
    for panel in layout["configById"].values():
        for path in panel.get("paths", []):
            topic, *fields = path["value"].split(".")
            require_field(topic, fields)
    curves = ET.fromstring((LAYOUTS / "plotjuggler_layout.xml").read_text()).iter("curve")
    names = [curve.get("name") for curve in curves]
    assert len(names) == 9
    for name in names:
        topic = max((t for t in by_name if name.startswith(f"{t}/")), key=len)
        require_field(topic, name.removeprefix(f"{topic}/").split("/"))


def test_the_page_about_recordings_names_every_topic_and_where_roles_are_looked_for():
    page = (REPOSITORY / "docs" / "recordings.md").read_text(encoding="utf-8")
    for topic in TOPICS:
        assert f"`{topic.name}`" in page, topic.name
    for role in ROLES.keys() - {"trial", *SCALARS}:
        assert f"`{role}`" in page, role


def test_plain_files_hold_the_samples(log_file, tmp_path):
    assert main(["export", str(log_file), "--csv", "--tum", "--out", str(tmp_path)]) == 0
    samples = short_trial().samples
    lines = (tmp_path / "trial_000.csv").read_text().splitlines()
    assert lines[0].split(",") == list(samples.columns)
    assert len(lines) == len(samples) + 1
    truth = np.loadtxt(tmp_path / "trial_000_truth.tum")
    assert truth.shape == (len(samples), 8)
    np.testing.assert_array_equal(truth[:, :3], samples[["time_s", "x_m", "y_m"]])
    estimate = np.loadtxt(tmp_path / "trial_000_estimate.tum")
    yaw = 2.0 * np.arctan2(estimate[:, 6], estimate[:, 7])
    np.testing.assert_allclose(yaw, samples["estimated_yaw_rad"], atol=1e-12)


def test_equal_logs_give_equal_bags(bag, log_file, tmp_path):
    assert main(["export", str(log_file), "--mcap", "--out", str(tmp_path)]) == 0
    for name in ("trial_000.mcap", "metadata.yaml"):
        assert (tmp_path / "trial_000" / name).read_bytes() == (bag / name).read_bytes()


def test_what_cannot_be_exported_is_one_line_and_leaves_nothing(
    log_file, tmp_path, capsys, monkeypatch
):
    def fails(*arguments: str) -> str:
        assert main(["export", *arguments, "--out", str(tmp_path / "out")]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        return line

    assert "expected --mcap, --csv or --tum" in fails(str(log_file))
    assert "no such file or folder" in fails(str(tmp_path / "none"), "--csv")
    assert "not a results folder" in fails(str(tmp_path), "--mcap")
    empty = short_trial()
    TrialLog(empty.samples.iloc[:0], (), dict(empty.info)).write(tmp_path / "empty.parquet")
    assert "ended before its first sample" in fails(str(tmp_path / "empty.parquet"), "--mcap")
    monkeypatch.setattr("drake_navbench.ros2.recordings.rosbags_extra.find_spec", lambda name: None)
    assert fails(str(log_file), "--mcap").endswith("pip install 'drake-navbench[bags]'")
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_no_bag_is_not_replaced(log_file, tmp_path, capsys):
    (tmp_path / "trial_000").mkdir()
    (tmp_path / "trial_000" / "mine.txt").write_text("mine")
    assert main(["export", str(log_file), "--mcap", "--out", str(tmp_path)]) == 2
    assert "exists and is not a bag" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "trial_000").iterdir()] == ["mine.txt"]


@pytest.fixture(scope="module")
def drifted():
    """Returns the log of a robot whose odometry drifts and which a bias misplaces on the map."""
    overrides = {"localization": {"drift": 0.3, "yaw_drift": 0.2, "y_bias_m": 0.2}}
    robot = load_robot("wheelchair", overrides)
    return run_trial("restricted_small", "rpp", seed=3, robot=robot, wants_diagnostics=True)


def test_a_drifting_odometry_has_its_own_frame_in_the_bag(drifted):
    samples = drifted.samples
    told: dict[str, list] = {}
    for topic, _, message in TrialMessages(drifted, MessageMaker()):
        told.setdefault(topic.name, []).append(message)
    for message, row in zip(told["/tf"], samples.itertuples(), strict=True):
        jump, carried = message.transforms
        place = carried.transform.translation
        assert (place.x, place.y) == (row.odometry_x_m, row.odometry_y_m)
        turn = yaw_of(jump.transform.rotation)
        x = jump.transform.translation.x + place.x * math.cos(turn) - place.y * math.sin(turn)
        assert x == pytest.approx(row.estimated_x_m, abs=1e-12)
    positions = [message.pose.pose.position.x for message in told["/odom"]]
    assert positions == samples["odometry_x_m"].tolist()
    assert told["/odom"][0].header.frame_id == "odom"
    # What is true is told in the map, what the controller drove by in the odometry's frame.
    assert {message.header.frame_id for message in told["/ground_truth/odom"]} == {"map"}
    assert told["/obstacles"][0].markers[0].header.frame_id == "map"
    assert told["/lookahead_point"][0].header.frame_id == "odom"
    outline = told["/local_costmap/published_footprint"][-1].polygon.points
    centre = np.mean([[point.x, point.y] for point in outline], axis=0)
    stamp_s = drifted.costmaps[-1].stamp_s
    row = samples.iloc[(samples["time_s"] - stamp_s).abs().argmin()]
    off = seen_from(row.x_m, row.y_m, row.yaw_rad, centre) - seen_from(
        row.odometry_x_m, row.odometry_y_m, row.odometry_yaw_rad, centre
    )
    assert np.hypot(*off) > 0.02
    mean = load_robot("wheelchair").padded_outline.mean(axis=0)
    seen = seen_from(row.odometry_x_m, row.odometry_y_m, row.odometry_yaw_rad, centre)
    assert seen == pytest.approx(mean, abs=0.02)


def seen_from(x, y, yaw, point):
    """Returns a point as seen from a pose."""
    away = point - np.array([x, y])
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([cos * away[0] + sin * away[1], cos * away[1] - sin * away[0]])


def test_of_recorded_people_only_those_are_drawn_who_are_there(tmp_path):
    (tmp_path / "crowd.csv").write_text(
        "time_s,person,x_m,y_m\n0,a,3,3\n0.5,a,3,3.5\n0,b,5,3\n2,b,5,4\n", encoding="utf-8"
    )
    (tmp_path / "hall.yaml").write_text(
        "description: a hall\nworld: {people: {recording: crowd.csv}}\n"
        "goal: [8.0, 0.0, 0.0]\ntimeout_s: 1.0\n",
        encoding="utf-8",
    )
    run_trial(str(tmp_path / "hall.yaml"), "rpp").write(tmp_path / "trial.parquet")
    out = tmp_path / "out"
    assert main(["export", str(tmp_path / "trial.parquet"), "--mcap", "--out", str(out)]) == 0
    with next(out.rglob("*.mcap")).open("rb") as file:
        decoded = list(
            make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        )
    drawn = [
        [(point.x, point.y) for marker in message.markers for point in marker.points]
        for _, channel, _, message in decoded
        if channel.topic == "/moving_obstacles"
    ]
    counts = [len(points) for points in drawn]
    assert counts[0] == 2 * counts[-1] > 0
    assert max(abs(x) for points in drawn for x, _ in points) < 6.0
