"""Recordings with the layout of a TurtleBot's, made of messages alone.

The robot drives 2 m straight ahead at 0.2 m/s, after 1 s at rest, and stands for 1 s. The odometry
begins at (0, 0, 0); the localisation puts that at (1, 2) in the map, turned to the left by a right
angle: in the map it drives from (1, 2) to (1, 4). On its left is a wall, 1 m away: in the map at
x = 0. The base is base_footprint, the scanner 0.05 m behind its middle and turned round.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from drake_navbench.kernels.grid import LETHAL
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.ros2.recordings.occupancy import occupancy_from_costs
from drake_navbench.ros2.recordings.rosbags_extra import ros2_types

START_NS = 1_650_000_000_000_000_000
SPEED_MPS, REST_S, DRIVE_S = 0.2, 1.0, 10.0
LENGTH_S = REST_S + DRIVE_S + 1.0
LENGTH_M = SPEED_MPS * DRIVE_S
MAP_TO_ODOM = (1.0, 2.0, 0.5 * math.pi)
WALL_Y_M = 1.0
SCANNER = (-0.05, 0.0, math.pi)
ACCEPTED, EXECUTING, SUCCEEDED, CANCELED, ABORTED = 1, 2, 4, 5, 6
ROBOT_YAML = """\
description: a small round robot
robot_radius: 0.105
drive: {max_linear_velocity_mps: 0.22, min_linear_velocity_mps: -0.22}
"""


class Entry(NamedTuple):
    """A message to be written. receive_ns: when it was received."""

    topic: str
    type: str
    receive_ns: int
    message: Any


class Ros1Maker(MessageMaker):
    """Makes messages of ROS 1, whose header counts."""

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS1_NOETIC)
        self.store.register(
            get_types_from_msg(
                "geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"
            )
        )
        self._types = self.store.types

    def header(self, stamp_ns: int, frame: str) -> Any:
        stamp = self.time(stamp_ns)
        return self.make("std_msgs/msg/Header", seq=0, stamp=stamp, frame_id=frame)


def stamp(time_s: float) -> int:
    """Returns the stamp of a time since the recording began."""
    return START_NS + round(time_s * 1e9)


def travelled(time_s: float) -> float:
    """Returns how far the robot has come, m."""
    return SPEED_MPS * float(np.clip(time_s - REST_S, 0.0, DRIVE_S))


def speed(time_s: float) -> float:
    return SPEED_MPS if REST_S <= time_s < REST_S + DRIVE_S else 0.0


def ranges_of(x_m: float) -> np.ndarray:
    """Returns 360 ranges that a scanner turned round sees of the wall, up to 3.5 m."""
    angles = -math.pi + math.radians(1.0) * np.arange(360)
    with np.errstate(divide="ignore"):
        ranges = WALL_Y_M / np.sin(angles + SCANNER[2])
    return np.where((ranges > 0.0) & (ranges < 3.5), ranges, np.inf).astype(np.float32)


def times(period_s: float) -> list[float]:
    return [period_s * k for k in range(round(LENGTH_S / period_s) + 1)]


def drive(make: MessageMaker) -> Iterable[Entry]:
    """Yields all that a TurtleBot's recorder hears of the drive."""
    tf = "tf2_msgs/msg/TFMessage"
    fixed = [
        make.transform(stamp(0.0), "base_footprint", "base_link", (0.0, 0.0, 0.0), 0.01),
        make.transform(stamp(0.0), "base_link", "base_scan", SCANNER, 0.17),
    ]
    yield Entry("/tf_static", tf, stamp(0.0), make.make(tf, transforms=fixed))
    for t in times(0.04):
        pose, twist = (travelled(t), 0.0, 0.0), (speed(t), 0.0)
        odometry = make.odometry(stamp(t), "odom", "base_footprint", pose, twist)
        yield Entry("/odom", "nav_msgs/msg/Odometry", stamp(t), odometry)
        moved = make.transform(stamp(t), "odom", "base_footprint", pose)
        yield Entry("/tf", tf, stamp(t), make.make(tf, transforms=[moved]))
    for t in times(0.05):
        located = make.transform(stamp(t), "map", "odom", MAP_TO_ODOM)
        yield Entry("/tf", tf, stamp(t), make.make(tf, transforms=[located]))
        command = make.twist(speed(t), 0.0)
        yield Entry("/cmd_vel", "geometry_msgs/msg/Twist", stamp(t), command)
    for t in times(0.2):
        scan = make.laser_scan(
            stamp(t),
            "base_scan",
            -math.pi + math.radians(1.0) * np.arange(360),
            ranges_of(travelled(t)),
            period_s=0.2,
            range_limits_m=(0.12, 3.5),
        )
        yield Entry("/scan", "sensor_msgs/msg/LaserScan", stamp(t), scan)
    for t in times(0.5):
        yield costmap(make, t)
    plan = np.column_stack(
        [np.full(41, 1.0), 2.0 + 0.05 * np.arange(41), np.full(41, 0.5 * math.pi)]
    )
    path = make.path(stamp(REST_S + 0.04), "map", plan)
    yield Entry("/plan", "nav_msgs/msg/Path", stamp(REST_S + 0.04), path)


def costmap(make: MessageMaker, t: float) -> Entry:
    """Returns a local costmap of 3 m in the odometry's frame, with the wall in one row of cells."""
    costs = np.zeros((60, 60), dtype=np.uint8)
    low_x = math.floor((travelled(t) - 1.5) / 0.05) * 0.05
    # Cells from y = 1.00 to 1.05: their centres are at 1.025.
    costs[round((WALL_Y_M + 1.5) / 0.05)] = LETHAL
    grid = make.occupancy_grid(
        stamp(t), "odom", occupancy_from_costs(costs), origin=(low_x, -1.5), resolution=0.05
    )
    return Entry("/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", stamp(t), grid)


def states(make: MessageMaker, *changes: tuple[float, int], goal: int = 1) -> Iterable[Entry]:
    """Yields the states of a goal at some times."""
    for t, status in changes:
        message = make.goal_status(stamp(changes[0][0]), bytes([goal] * 16), status)
        yield Entry(
            "/navigate_to_pose/_action/status",
            "action_msgs/msg/GoalStatusArray",
            stamp(t),
            message,
        )


def reached(make: MessageMaker) -> Iterable[Entry]:
    """Yields the states of a goal that the robot drove to."""
    return states(make, (REST_S, ACCEPTED), (REST_S, EXECUTING), (REST_S + DRIVE_S, SUCCEEDED))


def turtlebot(make: MessageMaker) -> list[Entry]:
    """Returns the whole recording."""
    return [*drive(make), *reached(make)]


def write_ros2(path: Path, entries: Iterable[Entry], *, plugin: str = "mcap") -> Path:
    """Writes a rosbag2 folder; plugin: mcap or sqlite3."""
    types = ros2_types()
    storage = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}[plugin]
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for entry in sorted(entries, key=lambda entry: entry.receive_ns):
            key = (entry.topic, entry.type)
            if key not in connections:
                connections[key] = writer.add_connection(*key, typestore=types)
            data = types.serialize_cdr(entry.message, entry.type)
            writer.write(connections[key], entry.receive_ns, data)
    return path


def write_ros1(path: Path, entries: Iterable[Entry], maker: Ros1Maker) -> Path:
    """Writes a bag of ROS 1."""
    with Ros1Writer(path) as writer:
        connections: dict[str, Any] = {}
        for entry in sorted(entries, key=lambda entry: entry.receive_ns):
            if entry.topic not in connections:
                connections[entry.topic] = writer.add_connection(
                    entry.topic, entry.type, typestore=maker.store
                )
            data = maker.store.serialize_ros1(entry.message, entry.type)
            writer.write(connections[entry.topic], entry.receive_ns, data)
    return path


def without(entries: Iterable[Entry], *topics: str) -> list[Entry]:
    """Returns all but the messages on some topics."""
    return [entry for entry in entries if entry.topic not in topics]


def renamed(entries: Iterable[Entry], new_name: Callable[[str], str]) -> list[Entry]:
    """Returns the same messages on other topics."""
    return [entry._replace(topic=new_name(entry.topic)) for entry in entries]
