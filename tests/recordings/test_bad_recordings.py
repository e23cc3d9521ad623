"""Recordings that cannot be taken: one line each, exit status 2, nothing half-written."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from robot_bags import (
    CANCELED,
    Entry,
    drive,
    renamed,
    stamp,
    states,
    turtlebot,
    without,
    write_ros2,
)
from rosbags.rosbag2.storage_mcap import zstd

from drake_navbench.commands.main import main
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.ros2.recordings.bag_files import MCAP_MAGIC

pytestmark = pytest.mark.usefixtures("without_curves")

MOVED = "nav_msgs/msg/Odometry"


class Import:
    """Imports into a folder that must not be there after a failure."""

    def __init__(self, folder: Path, robot: Path, capsys) -> None:
        self.out, self._robot, self._capsys = folder / "out", robot, capsys

    def __call__(self, path: Path, *more: str) -> int:
        command = ["import-bag", str(path), "--out", str(self.out), "--robot", str(self._robot)]
        return main([*command, "--no-report", *more])

    def fails(self, path: Path, *more: str) -> str:
        """Returns the one line that is said."""
        assert self(path, *more) == 2
        (line,) = self._capsys.readouterr().err.splitlines()
        assert not line.startswith("Traceback")
        assert not self.out.exists()
        return line


@pytest.fixture
def importing(tmp_path, robot_file, capsys) -> Import:
    return Import(tmp_path, robot_file, capsys)


@pytest.fixture
def bag(make, tmp_path):
    """Returns a function that writes a recording of some messages."""

    def write(entries, name: str = "lab") -> Path:
        return write_ros2(tmp_path / name, entries)

    return write


def test_without_odometry_what_is_there_is_told(importing, bag, make):
    line = importing.fails(bag(without(turtlebot(make), "/odom")))
    assert "no odometry on /odom or /odometry/filtered" in line
    assert "--topics odom=TOPIC" in line
    assert "found: /cmd_vel, /local_costmap/costmap, /navigate_to_pose/_action/status" in line


def test_a_goal_that_was_never_worked_on_makes_no_task(importing, bag, make):
    entries = [*drive(make), *states(make, (3.0, CANCELED))]
    assert "its goals have no state of being driven to" in importing.fails(bag(entries))


@pytest.mark.parametrize(
    ("topic", "header_of", "told"),
    [
        ("/odom", lambda message: message.header, "odometry: stamps run backwards by 2.960 s, 5.0"),
        ("/tf", lambda message: message.transforms[0].header, ": stamps run backwards by "),
    ],
)
def test_stamps_that_run_backwards_are_told(topic, header_of, told, importing, bag, make):
    entries = turtlebot(make)
    for entry in entries:
        if entry.topic == topic and entry.receive_ns == stamp(5.0):
            header_of(entry.message).stamp = make.time(stamp(2.0))
    line = importing.fails(bag(entries))
    assert told in line
    assert "s after the first of them; take another part of it with --start and --end" in line


def test_a_jump_of_the_clock_is_told_and_can_be_cut_out(importing, bag, make):
    entries = turtlebot(make)
    for entry in entries:
        if entry.topic == "/odom" and entry.receive_ns >= stamp(9.0):
            entry.message.header.stamp = make.time(entry.receive_ns + 3_600 * 10**9)
    path = bag(entries)
    assert "odometry: the clock jumps by 3600.000 s, 9.000 s after" in importing.fails(path)
    # The transforms go on: only what is before the jump is taken.
    assert importing(path, "--start", "2", "--end", "7") == 0


def test_two_robots_are_told_with_how_to_choose_one(importing, bag, make):
    entries = [
        entry
        for name in ("r1", "r2")
        for entry in renamed(turtlebot(make), lambda topic, n=name: f"/{n}{topic}")
    ]
    line = importing.fails(bag(entries))
    assert "holds 2 robots: /r1, /r2; choose one with --namespace" in line


def test_two_robots_on_one_topic_are_told(importing, bag, make):
    entries = turtlebot(make)
    other = make.odometry(stamp(3.0), "odom", "r2/base_link", (0.0, 0.0, 0.0), (0.0, 0.0))
    entries.append(Entry("/odom", MOVED, stamp(3.0), other))
    line = importing.fails(bag(entries))
    assert "the odometry is of 2 robots, base_footprint, r2/base_link" in line


def test_a_topic_of_another_type_is_told(importing, bag, make):
    path = bag(turtlebot(make))
    line = importing.fails(path, "--topics", "odom=/scan")
    assert "/scan (odom): has messages of sensor_msgs/msg/LaserScan, expected nav_msgs" in line
    for given, told in (
        (["scan=/scn"], "no message on it; did you mean '/scan'?"),
        (["scam=/scan"], "unknown role; did you mean 'scan'?"),
        (["/odom"], "expected ROLE=TOPIC"),
        (["odom=/a", "odom=/b"], "--topics 'odom=/b': odom is given twice"),
    ):
        assert told in importing.fails(path, "--topics", *given)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"float64 x\n", b"floot64 x\n"),
        (b"string child_frame_id", b"string child_fname_id"),
        (b"float64 x\n", b"float64 y\n"),
    ],
    ids=["unknown type", "unknown field", "doubled field"],
)
def test_an_unknown_definition_is_told(old, new, importing, bag, make):
    path = bag(turtlebot(make))
    file = path / "lab.mcap"
    content = file.read_bytes()
    assert old in content
    file.write_bytes(content.replace(old, new))
    line = importing.fails(path)
    assert "message definition not understood" in line or "lacks an expected field" in line


def test_definitions_of_other_topics_are_no_matter(importing, bag, make):
    entries = turtlebot(make)
    lidar = make.make("std_msgs/msg/Float64", data=1.0)
    entries.append(Entry("/firmware/state", "std_msgs/msg/Float64", stamp(1.0), lidar))
    path = bag(entries)
    file = path / "lab.mcap"
    content = file.read_bytes()
    name, other = b"std_msgs/msg/Float64", b"vendors/msg/Unknown7"
    assert len(name) == len(other)
    file.write_bytes(content.replace(name, other).replace(b"float64 data", b"flort64 data"))
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(name.decode(), other.decode()))
    assert importing(path) == 0


def test_of_a_file_that_was_cut_off_what_is_whole_is_read_and_the_loss_told(
    importing, bag, make, capsys
):
    path = bag(chunked(make))
    whole = (path / "lab.mcap").read_bytes()
    cut = path.parent / "cut.mcap"
    cut.write_bytes(whole[: int(0.7 * len(whole))])
    assert importing(cut, "--start", "1.5") == 0
    said = capsys.readouterr()
    assert "warning: " in said.err
    assert "cut off: the last " in said.err
    log = TrialLog.read(ResultsFolder(importing.out).log_path("cut", "recording", 0))
    # Of 12 s some 70%, less 1.5 s.
    assert 4.0 < log.end_time_s < 8.0
    assert log.info["recording"]["losses"]


def chunked(make) -> list[Entry]:
    """Returns the recording with so much in it that a file has several pieces."""
    entries = turtlebot(make)
    noise = np.random.default_rng(0)
    for k in range(60):
        grid = make.occupancy_grid(
            stamp(0.2 * k),
            "map",
            noise.integers(0, 100, (400, 400)).astype(np.int8),
            origin=(0.0, 0.0),
            resolution=0.05,
        )
        kind = "nav_msgs/msg/OccupancyGrid"
        entries.append(Entry("/global_costmap/costmap", kind, stamp(0.2 * k), grid))
    return entries


@pytest.mark.parametrize("kept", [0, 8, 9, 60, 300])
def test_of_a_file_cut_off_at_its_beginning_nothing_is_left(kept, importing, bag, make):
    path = bag(turtlebot(make)) / "lab.mcap"
    cut = path.parent.parent / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:kept])
    assert "cut.mcap" in importing.fails(cut)


@pytest.mark.parametrize(
    ("topic", "spoil"),
    [
        ("/odom", lambda message: setattr(message.pose.pose.position, "x", math.nan)),
        ("/odom", lambda message: setattr(message.twist.twist.angular, "z", math.inf)),
        ("/tf", lambda message: setattr(message.transforms[0].transform.rotation, "w", math.nan)),
        ("/scan", lambda message: setattr(message, "angle_increment", math.nan)),
        ("/local_costmap/costmap", lambda message: setattr(message.info, "resolution", 0.0)),
        ("/cmd_vel", lambda message: setattr(message.linear, "x", math.nan)),
    ],
)
def test_a_message_of_what_is_no_number_is_left_out_and_told(
    topic, spoil, importing, bag, make, capsys
):
    entries = turtlebot(make)
    spoil([entry for entry in entries if entry.topic == topic][20].message)
    assert importing(bag(entries)) == 0
    assert f"{topic}: 1 of " in capsys.readouterr().err
    log = TrialLog.read(ResultsFolder(importing.out).log_path("lab", "recording", 0))
    assert np.isfinite(log.samples[["x_m", "v_mps", "command_v_mps"]].to_numpy()).all()
    assert log.info["recording"]["losses"]


def test_poses_far_from_the_origin_are_told(importing, bag, make):
    entries = turtlebot(make)
    for entry in entries:
        if entry.topic == "/tf" and entry.message.transforms[0].header.frame_id == "map":
            entry.message.transforms[0].transform.translation.x = 4.5e5
    assert "poses reach 450000 m from the origin" in importing.fails(bag(entries))


def test_a_plan_without_poses_leaves_no_goal_but_a_trial_to_look_at(importing, bag, make):
    entries = turtlebot(make)
    for entry in entries:
        if entry.topic == "/plan":
            entry.message.poses = []
    assert importing(bag(entries)) == 0
    assert main(["report", str(importing.out), "--jobs", "1", "--figures", "key"]) == 0
    path = ResultsFolder(importing.out).log_path("lab", "recording", 0)
    assert main(["replay", str(path)]) == 0


def test_damage_in_the_middle_is_told(importing, bag, make):
    path = bag(turtlebot(make)) / "lab.mcap"
    content = bytearray(path.read_bytes())
    for place in range(2_000, len(content) - 2_000, 997):
        content[place] ^= 0xFF
    path.write_bytes(bytes(content))
    assert str(path.parent) in importing.fails(path.parent)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.txt", b"text", "expected .mcap, .db3, .bag or a rosbag2 folder"),
        ("a.mcap", b"no", "not a readable recording"),
        ("a.mcap", MCAP_MAGIC, "not a readable recording"),
        ("a.db3", b"SQLite format 3\0", "not a readable recording"),
        ("a.db3", b"", "not a readable recording"),
        ("a.mcap", b"version https://git-lfs.github.com/spec/v1\n", "run git lfs pull"),
        ("a.bag", b"#ROSBAG V2.0\n", "not a readable recording"),
        ("a.bag", b"", "not a readable recording"),
    ],
)
def test_what_is_no_recording_is_told(name, content, said, importing, tmp_path):
    (tmp_path / name).write_bytes(content)
    assert said in importing.fails(tmp_path / name)


def test_other_wrong_input_is_told(importing, bag, make, tmp_path):
    assert "no such file or folder" in importing.fails(tmp_path / "none.mcap")
    (tmp_path / "empty").mkdir()
    assert "not a recording" in importing.fails(tmp_path / "empty")
    (tmp_path / "empty" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert "metadata.yaml names are not there" in importing.fails(tmp_path / "empty")
    path = bag(turtlebot(make))
    assert "--start 99: expected 0 to 12.000 s" in importing.fails(path, "--start", "99")
    line = importing.fails(path, "--start", "6", "--end", "5")
    assert "--end 5: expected more than --start 6" in line
    line = importing.fails(path, "--start", "6", "--end", "6.05")
    assert "--start and --end leave 0.050 s, expected at least 0.1 s" in line
    assert "none.yaml: cannot be read" in importing.fails(
        path, "--map", str(tmp_path / "none.yaml")
    )
    command = ["import-bag", str(path), "--out", str(tmp_path / "out")]
    assert main(command) == 2
    assert not (tmp_path / "out").exists()


def test_a_missing_robot_is_told_before_the_messages_are_read(bag, make, tmp_path, capsys):
    # No goal was worked on, which only the messages tell.
    path = bag([*drive(make), *states(make, (3.0, CANCELED))])
    assert main(["import-bag", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "outline and limits; name its file with --robot" in capsys.readouterr().err
    command = ["import-bag", str(tmp_path / "none"), "--robot", "nosuch", "--out", "out"]
    assert main(command) == 2
    assert "robot 'nosuch' is not known" in capsys.readouterr().err


def test_a_wrong_recording_among_others_leaves_nothing(importing, bag, make, tmp_path):
    good, bad = bag(turtlebot(make)), bag(drive(make), "bad")
    command = ["import-bag", str(good), str(bad), "--out", str(importing.out)]
    assert main([*command, "--robot", "wheelchair", "--no-report"]) == 2
    assert not importing.out.exists()


def test_a_folder_that_holds_something_else_is_left_alone(importing, bag, make):
    importing.out.mkdir()
    (importing.out / "mine.txt").write_text("mine")
    assert importing(bag(turtlebot(make))) == 2
    assert [path.name for path in importing.out.iterdir()] == ["mine.txt"]


def test_the_robot_of_another_version_is_told(bag, make, tmp_path, capsys):
    trial = {"info": {"robot": {"wings": 2}}, "events": [], "plan_legs": []}
    header = make.make("std_msgs/msg/String", data=json.dumps(trial))
    entry = Entry("/drake_navbench/trial", "std_msgs/msg/String", stamp(0.0), header)
    path = bag([*turtlebot(make), entry])
    assert main(["import-bag", str(path), "--out", str(tmp_path / "out")]) == 2
    assert f"{path}: the trial's robot: wings: " in capsys.readouterr().err


def test_a_file_in_place_of_the_folder_is_told(importing, bag, make, capsys):
    importing.out.write_text("mine")
    assert importing(bag(turtlebot(make))) == 2
    assert f"{importing.out}: " in capsys.readouterr().err
    assert importing.out.read_text() == "mine"


def test_without_the_library_one_line_says_how_to_get_it(importing, bag, make, monkeypatch):
    path = bag(turtlebot(make))
    monkeypatch.setattr("drake_navbench.ros2.recordings.rosbags_extra.find_spec", lambda name: None)
    assert importing.fails(path).endswith("pip install 'drake-navbench[bags]'")


def test_a_folder_packed_file_by_file_is_read(importing, bag, make):
    path = bag(turtlebot(make))
    file = path / "lab.mcap"
    (path / "lab.mcap.zstd").write_bytes(zstd.compress(file.read_bytes()))
    file.unlink()
    metadata = path / "metadata.yaml"
    text = metadata.read_text().replace("lab.mcap", "lab.mcap.zstd")
    text = text.replace("compression_format: ''", "compression_format: zstd")
    metadata.write_text(text.replace("compression_mode: ''", "compression_mode: FILE"))
    assert importing(path) == 0
    log = TrialLog.read(ResultsFolder(importing.out).log_path("lab", "recording", 0))
    assert log.end_time_s == pytest.approx(10.0, abs=0.1)


def test_a_packed_file_is_read_by_itself(importing, bag, make, tmp_path):
    file = bag(turtlebot(make)) / "lab.mcap"
    packed = tmp_path / "packed.mcap.zstd"
    packed.write_bytes(zstd.compress(file.read_bytes()))
    assert importing(packed) == 0


@pytest.mark.parametrize("name", ["drive.mcap", "drive.sqlite", "drive"])
def test_a_recording_of_another_name_is_known_by_its_first_bytes(name, importing, make, tmp_path):
    folder = write_ros2(tmp_path / "lab", turtlebot(make), plugin="sqlite3")
    path = tmp_path / name
    path.write_bytes((folder / "lab.db3").read_bytes())
    assert importing(path) == 0


def test_a_file_that_was_named_anew_in_its_folder_is_read(importing, bag, make, capsys):
    path = bag(turtlebot(make))
    (path / "lab.mcap").rename(path / "tuesday.mcap")
    assert importing(path) == 0
    assert "metadata.yaml: names files that are missing" in capsys.readouterr().err


def test_a_folder_whose_files_are_pointers_tells_how_to_get_them(importing, bag, make):
    path = bag(turtlebot(make))
    (path / "lab.mcap").write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
    assert "run git lfs pull" in importing.fails(path)


def test_a_topic_of_another_type_that_nobody_named_is_left_out_and_told(
    importing, bag, make, capsys
):
    entries = without(turtlebot(make), "/local_costmap/costmap")
    grid = make.make("std_msgs/msg/Float64", data=1.0)
    entries.append(Entry("/local_costmap/costmap", "std_msgs/msg/Float64", stamp(1.0), grid))
    assert importing(bag(entries)) == 0
    said = capsys.readouterr().err
    assert "/local_costmap/costmap (costmap): has messages of std_msgs/msg/Float64" in said
    assert said.rstrip().endswith("left out")


def test_commands_without_a_stamp_are_found_by_their_usual_name(importing, bag, make, capsys):
    entries = renamed(
        turtlebot(make), lambda topic: "/cmd_vel_unstamped" if topic == "/cmd_vel" else topic
    )
    assert importing(bag(entries)) == 0
    assert "no commands" not in capsys.readouterr().out


def test_topics_that_could_be_the_commands_are_offered(importing, bag, make, capsys):
    entries = renamed(
        turtlebot(make), lambda topic: "/base/steer" if topic == "/cmd_vel" else topic
    )
    assert importing(bag(entries)) == 0
    assert "by its type it could be /base/steer: name it with" in capsys.readouterr().err


def test_without_states_of_a_goal_the_time_of_motion_is_offered(importing, bag, make):
    # It drives from 1 s to 11 s, with a sample each 0.04 s.
    line = importing.fails(bag(drive(make)))
    assert "no states of a goal" in line
    assert "cut by hand with --start and --end" in line
    assert line.endswith("it moves from 1.0 to 11.0 s: --start 1.0 --end 11.0")
    assert importing(bag(drive(make), "again"), "--start", "1.0", "--end", "11.0") == 0
