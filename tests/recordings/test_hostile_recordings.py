"""Recordings made to take all memory, all time or the disk: one line each, soon."""

from __future__ import annotations

import struct
from pathlib import Path

import lz4.frame
import pytest
from robot_bags import turtlebot, write_ros2
from rosbags.rosbag2.storage_mcap import zstd

from drake_navbench.commands.main import main
from drake_navbench.errors import InputError
from drake_navbench.ros2.recordings import reading
from drake_navbench.ros2.recordings.bag_files import MCAP_END, MCAP_MAGIC, BagFiles

pytestmark = pytest.mark.usefixtures("real_workers")

ODOMETRY = "nav_msgs/msg/Odometry"
CLOCK_NS = 10**9
ZEROS = bytes(1 << 24)


def record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def described(definition: str, topic: str = "/odom") -> bytes:
    """Returns the records of a topic with a definition."""
    schema = struct.pack("<H", 1) + text(ODOMETRY) + text("ros2msg") + text(definition)
    channel = struct.pack("<HH", 0, 1) + text(topic) + text("cdr") + text("")
    return record(3, schema) + record(4, channel)


def message(data: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", 0, 0, CLOCK_NS, CLOCK_NS) + data)


def mcap(*records: bytes) -> bytes:
    header = record(1, text("ros2") + text(""))
    return b"".join([MCAP_MAGIC, header, *records, MCAP_END, MCAP_MAGIC])


def chunk(compression: str, packed: bytes, size: int) -> bytes:
    head = struct.pack("<QQQI", CLOCK_NS, CLOCK_NS, size, 0)
    return record(6, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


@pytest.fixture
def fails(tmp_path, robot_file, capsys):
    """Returns a function that imports a recording and returns the one line that is said."""

    def run(path: Path) -> str:
        out = tmp_path / "out"
        command = ["import-bag", str(path), "--out", str(out), "--robot", str(robot_file)]
        assert main([*command, "--no-report"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert not out.exists()
        return line

    return run


def nested(depth: int) -> str:
    """Returns a definition of 100 times 100 times ... arrays of float64."""
    parts = [f"pack/Level{depth - 1}[100] a"]
    for level in range(depth - 1, -1, -1):
        inner = f"pack/Level{level - 1}[100] a" if level else "float64[] a"
        parts.append(f"{'=' * 80}\nMSG: pack/Level{level}\n{inner}")
    return "\n".join(parts)


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("string[50000000] a", "is an array of 50000000, expected at most 10000"),
        (nested(5), "holds 1000000 values, expected at most 100000"),
        ("\n".join(f"int8 a{k}" for k in range(60_000)), "a message definition of "),
        ("\n".join(f"int8 a{k}" for k in range(2_000)), "has 2000 fields, expected at most 1000"),
        ("nav_msgs/msg/Odometry[] a", "nav_msgs/msg/Odometry holds itself"),
    ],
    ids=["array", "product", "text", "fields", "itself"],
)
def test_a_definition_that_makes_too_much_is_refused_before_it_is_built(
    definition, said, fails, tmp_path
):
    path = tmp_path / "small.mcap"
    path.write_bytes(mcap(described(definition), message(bytes(16))))
    assert said in fails(path)


def test_a_message_that_counts_a_billion_empty_things_ends(fails, tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "LEAST_MEMORY_BYTES", 100_000_000)
    definition = f"pack/None[] a\n{'=' * 80}\nMSG: pack/None\n"
    data = b"\x00\x01\x00\x00" + struct.pack("<I", 2**30)
    path = tmp_path / "small.mcap"
    path.write_bytes(mcap(described(definition), message(data)))
    assert path.stat().st_size < 400
    assert "small.mcap: " in fails(path)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_that_expands_stops_at_the_limit_of_memory(
    compression, fails, tmp_path, monkeypatch
):
    monkeypatch.setattr(reading, "LEAST_MEMORY_BYTES", 100_000_000)
    count = 40
    if compression == "zstd":
        packed = zstd.compress(ZEROS) * count
    else:
        packed = lz4.frame.compress(ZEROS * count)
    path = tmp_path / "small.mcap"
    path.write_bytes(mcap(chunk(compression, packed, count * len(ZEROS))))
    assert path.stat().st_size < 3_000_000
    assert "0.1 GB of memory" in fails(path)


def test_a_reading_that_takes_too_long_is_ended(fails, tmp_path, monkeypatch, make):
    monkeypatch.setattr(reading, "LEAST_TIME_S", 0.0)
    monkeypatch.setattr(reading, "TIME_PER_BYTE_S", 0.0)
    assert "no result after 0 s" in fails(write_ros2(tmp_path / "lab", turtlebot(make)))


def test_a_packed_file_may_not_unpack_to_more_than_the_limit(tmp_path):
    path = tmp_path / "lab.mcap.zstd"
    path.write_bytes(zstd.compress(ZEROS) * 3)
    (tmp_path / "scratch").mkdir()
    files = BagFiles(tmp_path / "scratch", 2 * len(ZEROS))
    with pytest.raises(InputError, match=r"unpacks to more than 0\.0336 GB"):
        files.ready(path)
    # Of several files together, too.
    (tmp_path / "other").mkdir()
    path.write_bytes(zstd.compress(ZEROS))
    files = BagFiles(tmp_path / "other", 2 * len(ZEROS))
    files.ready(path)
    files.ready(path)
    with pytest.raises(InputError, match="unpacks to more than"):
        files.ready(path)


def test_a_topic_with_line_ends_in_its_name_is_told_on_one_line(fails, tmp_path):
    definition = "float64 data"
    path = tmp_path / "small.mcap"
    topic = "/a\nerror: all is well\x1b[2J"
    path.write_bytes(mcap(described(definition, topic), message(bytes(16))))
    line = fails(path)
    assert "found: /a error: all is well\\x1b[2J" in line
