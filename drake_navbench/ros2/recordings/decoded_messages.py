"""Plain values into which messages of a recording are decoded, one type for each role."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.quaternions import yaw_of
from drake_navbench.ros2.recordings.topics import SCALAR_COLUMNS


class Transform(NamedTuple):
    """A transform as it was sent. rotation: quaternion x, y, z, w. translation: x, y, z m."""

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


class Motion(NamedTuple):
    """An odometry. pose: x m, y m, yaw rad in `frame`. twist: v m/s, w rad/s, vy m/s in `child`."""

    frame: str
    child: str
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]


class Steered(NamedTuple):
    """A command to a car. speed: m/s. steering: angle of the front wheels, rad, left positive."""

    speed: float
    steering: float

    def twist(self, wheelbase_m: float) -> tuple[float, float, float]:
        """Returns v m/s, w rad/s, vy m/s of the rear axle's middle: w = v tan(steering) / L."""
        return self.speed, self.speed * math.tan(self.steering) / wheelbase_m, 0.0


class Beams(NamedTuple):
    """A scan. ranges_m: (B,) float32; inf or -inf where the sensor reports out of range."""

    frame: str
    angle_min: float
    increment: float
    ranges_m: NDArray[np.float32]


class Poses(NamedTuple):
    """A path (N, 3), or a single pose (1, 3), in a frame."""

    frame: str
    poses: Array


class Cells(NamedTuple):
    """An occupancy grid; origin: pose of the corner of cell (0, 0).

    The cells are kept packed: a recording holds thousands of local costmaps that are mostly free.
    """

    frame: str
    packed: bytes
    shape: tuple[int, int]
    origin: tuple[float, float, float]
    resolution: float

    @property
    def occupancy(self) -> NDArray[np.int8]:
        """(rows, columns) the occupancies, -1 to 100."""
        return np.frombuffer(zlib.decompress(self.packed), dtype=np.int8).reshape(self.shape)


class State(NamedTuple):
    """The state of a goal: the goal's id, and the number of its status in the message."""

    goal: str
    status: int


Decoded = list[tuple[int, Any]]


def is_usable(value: Any) -> bool:
    """Returns whether the numbers of a message's poses and velocities are finite."""
    match value:
        case Transform():
            return all(map(math.isfinite, (*value.translation, *value.rotation)))
        case Motion():
            return all(map(math.isfinite, (*value.pose, *value.twist)))
        case Beams():
            return math.isfinite(value.angle_min) and math.isfinite(value.increment)
        case Poses():
            return bool(np.isfinite(value.poses).all())
        case Cells():
            numbers = (*value.origin, value.resolution)
            is_sized = min(value.shape) > 0 and value.resolution > 0.0
            return is_sized and all(map(math.isfinite, numbers))
        case tuple() if not isinstance(value, State):
            return all(map(math.isfinite, value))
        case _:
            return True


def _stamp(header: Any) -> int:
    stamp = header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _frame(name: str) -> str:
    """Returns a frame's name as ROS 2 writes it, without the slash of old."""
    return name.lstrip("/")


def _pose(pose: Any) -> tuple[float, float, float]:
    q = pose.orientation
    return pose.position.x, pose.position.y, float(yaw_of(q.x, q.y, q.z, q.w))


def _twist(twist: Any) -> tuple[float, float, float]:
    """Returns v m/s, w rad/s, vy m/s."""
    return twist.linear.x, twist.angular.z, twist.linear.y


def _odometry(message: Any) -> Decoded:
    motion = Motion(
        _frame(message.header.frame_id),
        _frame(message.child_frame_id),
        _pose(message.pose.pose),
        _twist(message.twist.twist),
    )
    return [(_stamp(message.header), motion)]


def _transforms(message: Any) -> Decoded:
    rows = []
    for entry in message.transforms:
        t, q = entry.transform.translation, entry.transform.rotation
        transform = Transform(
            _frame(entry.header.frame_id),
            _frame(entry.child_frame_id),
            (t.x, t.y, t.z),
            (q.x, q.y, q.z, q.w),
        )
        rows.append((_stamp(entry.header), transform))
    return rows


def _command(message: Any) -> Decoded:
    # A stamp of zero stands for the time of receipt.
    stamp = _stamp(message.header) if hasattr(message, "header") else -1
    given = getattr(message, "twist", None) or getattr(message, "drive", None) or message
    is_steered = hasattr(given, "steering_angle")
    value = Steered(given.speed, given.steering_angle) if is_steered else _twist(given)
    return [(stamp if stamp > 0 else -1, value)]


def _scan(message: Any) -> Decoded:
    ranges = np.array(message.ranges, dtype=np.float32)
    with np.errstate(invalid="ignore"):
        ranges[ranges < message.range_min] = -np.inf
        # Drivers before REP 117 write the largest range, or 0, where nothing came back.
        ranges[ranges >= message.range_max] = np.inf
    beams = Beams(
        _frame(message.header.frame_id),
        float(message.angle_min),
        float(message.angle_increment),
        ranges,
    )
    return [(_stamp(message.header), beams)]


def _path(message: Any) -> Decoded:
    poses = np.array([_pose(entry.pose) for entry in message.poses], dtype=float).reshape(-1, 3)
    frame = message.header.frame_id
    if not frame and message.poses:
        frame = message.poses[0].header.frame_id
    stamp = _stamp(message.header)
    return [(stamp if stamp > 0 else -1, Poses(_frame(frame), poses))]


def _goal(message: Any) -> Decoded:
    stamped = message.goal.target_pose if hasattr(message, "goal") else message
    pose = np.array([_pose(stamped.pose)])
    return [(-1, Poses(_frame(stamped.header.frame_id), pose))]


def _grid(message: Any) -> Decoded:
    info = message.info
    shape = (int(info.height), int(info.width))
    data = np.asarray(message.data, dtype=np.int8).reshape(shape)
    packed = zlib.compress(data.tobytes(), level=1)
    # A resolution is sent as float32; 0.05 comes as 0.0500000007.
    resolution = float(str(np.float32(info.resolution)))
    frame = _frame(message.header.frame_id)
    cells = Cells(frame, packed, shape, _pose(info.origin), resolution)
    stamp = _stamp(message.header)
    return [(stamp if stamp > 0 else -1, cells)]


# The states of actionlib in the numbers of ROS 2: pending, active, preempted, succeeded, aborted,
# rejected, preempting, recalling, recalled, lost.
ROS1_STATES = {0: 1, 1: 2, 2: 5, 3: 4, 4: 6, 5: 6, 6: 3, 7: 3, 8: 5, 9: 6}


def _status(message: Any) -> Decoded:
    rows: Decoded = []
    for entry in message.status_list:
        if hasattr(entry, "goal_info"):
            goal = bytes(np.asarray(entry.goal_info.goal_id.uuid, dtype=np.uint8)).hex()
            rows.append((-1, State(goal, int(entry.status))))
        else:
            rows.append((-1, State(entry.goal_id.id, ROS1_STATES[int(entry.status)])))
    return rows


def _datum(message: Any) -> Decoded:
    return [(-1, message.data)]


DECODERS: Mapping[str, Callable[[Any], Decoded]] = {
    "odom": _odometry,
    "truth": _odometry,
    "tf": _transforms,
    "tf_static": _transforms,
    "command": _command,
    "scan": _scan,
    "plan": _path,
    "costmap": _grid,
    "goal": _goal,
    "map": _grid,
    "status": _status,
    "trial": _datum,
    **dict.fromkeys(SCALAR_COLUMNS, _datum),
}
