"""What is taken from a recording: for each role a topic, decoded into plain arrays.

Times are seconds from the first message of the recording, on the clock of the stamps: that of the
computer, or of the simulator. What carries no stamp is brought to that clock by when it was
received, as the odometry, which carries one, was stamped and received.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.recordings.bag_source import BagSource
from drake_navbench.recordings.planar_transforms import yaw_of

Array = NDArray[np.float64]

TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
STATUS_TYPES = ("action_msgs/msg/GoalStatusArray", "actionlib_msgs/msg/GoalStatusArray")
NANOSECONDS = 1e9


class Role(NamedTuple):
    """What a topic is for. names: where it usually is, the likeliest first. types: accepted."""

    names: tuple[str, ...]
    types: tuple[str, ...]


ROLES: Mapping[str, Role] = {
    "odom": Role(("/odom", "/odometry/filtered", "/odometry"), ("nav_msgs/msg/Odometry",)),
    "truth": Role(
        ("/ground_truth/odom", "/ground_truth/state", "/base_pose_ground_truth"),
        ("nav_msgs/msg/Odometry",),
    ),
    "tf": Role(("/tf",), TF_TYPES),
    "tf_static": Role(("/tf_static",), TF_TYPES),
    "command": Role(
        ("/cmd_vel", "/cmd_vel_smoothed", "/cmd_vel_nav"),
        ("geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/Twist"),
    ),
    "scan": Role(("/scan", "/base_scan"), ("sensor_msgs/msg/LaserScan",)),
    "plan": Role(
        (
            "/plan",
            "/received_global_plan",
            "/move_base/NavfnROS/plan",
            "/move_base/GlobalPlanner/plan",
        ),
        ("nav_msgs/msg/Path",),
    ),
    "costmap": Role(
        ("/local_costmap/costmap", "/move_base/local_costmap/costmap"),
        ("nav_msgs/msg/OccupancyGrid",),
    ),
    "goal": Role(
        ("/goal_pose", "/move_base/goal", "/move_base_simple/goal"),
        ("geometry_msgs/msg/PoseStamped", "move_base_msgs/msg/MoveBaseActionGoal"),
    ),
    "map": Role(("/map",), ("nav_msgs/msg/OccupancyGrid",)),
    "status": Role(
        (
            "/navigate_to_pose/_action/status",
            "/navigate_through_poses/_action/status",
            "/follow_path/_action/status",
            "/move_base/status",
        ),
        STATUS_TYPES,
    ),
    "trial": Role(("/drake_navbench/trial",), ("std_msgs/msg/String",)),
    "clearance_m": Role(("/drake_navbench/clearance_m",), ("std_msgs/msg/Float64",)),
    "obstacle_cell_distance_m": Role(
        ("/drake_navbench/obstacle_cell_distance_m",), ("std_msgs/msg/Float64",)
    ),
    "obstacle_corner_distance_m": Role(
        ("/drake_navbench/obstacle_corner_distance_m",), ("std_msgs/msg/Float64",)
    ),
    "cycle_count": Role(("/drake_navbench/cycle_count",), ("std_msgs/msg/Float64",)),
    "compute_time_ms": Role(("/drake_navbench/compute_time_ms",), ("std_msgs/msg/Float64",)),
    "compute_cpu_time_ms": Role(
        ("/drake_navbench/compute_cpu_time_ms",), ("std_msgs/msg/Float64",)
    ),
}


def choose_topics(
    source: BagSource, given: Mapping[str, str], namespace: str | None
) -> dict[str, str]:
    """Returns role -> topic of what there is in a recording.

    given: what the user says of single roles; '' for none. namespace: of the robot, where its
    topics have one; found where there is only one. Raises InputError where a topic that is named is
    not there, has another type, or the topics are those of several robots.
    """
    for role in given:
        if role not in ROLES:
            raise InputError(f"--topics {role}: unknown role{nearest_name_hint(role, ROLES)}")
    prefix = _prefix(source, namespace) if "odom" not in given else _as_prefix(namespace)
    chosen: dict[str, str] = {}
    for role, (names, types) in ROLES.items():
        if role in given:
            topic = given[role]
            if not topic:
                continue
            if topic not in source.topics:
                hint = nearest_name_hint(topic, source.topics)
                raise InputError(f"{source.path}: --topics {role}={topic}: no message on it{hint}")
        else:
            # Maps and transforms are often shared by all robots.
            candidates = [f"{prefix}{name}" for name in names] + list(names)
            present = [name for name in candidates if name in source.topics]
            fitting = [name for name in present if source.topics[name] in types]
            if not present:
                continue
            topic = (fitting or present)[0]
        if source.topics[topic] not in types:
            raise InputError(
                f"{source.path}: {topic} ({role}): has messages of {source.topics[topic]}, "
                f"expected {' or '.join(types)}"
            )
        chosen[role] = topic
    if "odom" not in chosen:
        found = ", ".join(sorted(source.topics)[:40])
        raise InputError(
            f"{source.path}: no odometry on {' or '.join(ROLES['odom'].names)}; name its topic "
            f"with --topics odom=TOPIC; found: {found}"
        )
    return chosen


def _as_prefix(namespace: str | None) -> str:
    return f"/{namespace.strip('/')}" if namespace and namespace.strip("/") else ""


def _prefix(source: BagSource, namespace: str | None) -> str:
    """Returns what stands before a robot's topics: nothing, or its namespace."""
    role = ROLES["odom"]
    if namespace is not None:
        return _as_prefix(namespace)
    if any(source.topics.get(name) in role.types for name in role.names):
        return ""
    apart = set(ROLES["truth"].names)
    prefixes = sorted(
        {
            topic.removesuffix(name)
            for topic, kind in source.topics.items()
            for name in role.names
            if kind in role.types and topic.endswith(name) and topic not in apart
        }
    )
    if len(prefixes) > 1:
        raise InputError(
            f"{source.path}: holds {len(prefixes)} robots: {', '.join(prefixes)}; choose one with "
            "--namespace"
        )
    return prefixes[0] if prefixes else ""


class Column(NamedTuple):
    """What came in on one topic.

    receive_ns: (N,) int64. stamp_ns: (N,) int64, -1 where a message carries none. values: decoded.
    """

    receive_ns: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    values: list[Any]


def read_columns(
    source: BagSource, topics: Mapping[str, str], start_ns: int | None, end_ns: int | None
) -> dict[str, Column]:
    """Returns role -> what was received in [start, end) ns; latched roles from the beginning on."""
    role_of = {topic: role for role, topic in topics.items()}
    kept: dict[str, list[tuple[int, int, Any]]] = {role: [] for role in topics}
    latched = {topic for topic, role in role_of.items() if role in LATCHED_ROLES}
    for names, begin in ((latched, None), (set(role_of) - latched, start_ns)):
        for topic, receive_ns, message in source.read(names, begin, end_ns):
            role = role_of[topic]
            try:
                kept[role] += [(receive_ns, *entry) for entry in DECODERS[role](message)]
            except (AttributeError, TypeError, ValueError, IndexError) as error:
                raise InputError(
                    f"{source.path}: {topic} ({role}): a message of {source.topics[topic]} "
                    f"without what is expected: {error}"
                ) from error
    columns = {}
    for role, rows in kept.items():
        rows.sort(key=lambda row: row[0])
        received = np.array([row[0] for row in rows], dtype=np.int64)
        stamps = np.array([row[1] for row in rows], dtype=np.int64)
        columns[role] = Column(received, stamps, [row[2] for row in rows])
    return columns


# These were told before the part that is taken; who looks later still has them.
LATCHED_ROLES = frozenset({"tf_static", "map", "trial", "status", "goal", "plan"})


class Transform(NamedTuple):
    """A transform as it was sent. rotation: quaternion x, y, z, w. translation: x, y, z m."""

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


class Motion(NamedTuple):
    """An odometry. pose: x m, y m, yaw rad in the frame. twist: v, w and vy in the child's."""

    frame: str
    child: str
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]


class Beams(NamedTuple):
    """A scan. ranges_m: (B,) float32; what the sensor calls out of range is inf or -inf."""

    frame: str
    angle_min: float
    increment: float
    ranges_m: NDArray[np.float32]


class Poses(NamedTuple):
    """A path, or a single pose: (N, 3) in a frame."""

    frame: str
    poses: Array


class Cells(NamedTuple):
    """An occupancy grid; origin: pose of the corner of cell (0, 0).

    It is kept packed: a recording holds thousands of local costmaps that are mostly free.
    """

    frame: str
    packed: bytes
    shape: tuple[int, int]
    origin: tuple[float, float, float]
    resolution: float

    @property
    def occupancy(self) -> NDArray[np.int8]:
        """(rows, columns) -1 to 100."""
        return np.frombuffer(zlib.decompress(self.packed), dtype=np.int8).reshape(self.shape)


class State(NamedTuple):
    """What a goal's state was: its id and the number in the message."""

    goal: str
    status: int


Decoded = list[tuple[int, Any]]


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
    if not hasattr(message, "header"):
        return [(-1, _twist(message))]
    # A stamp of zero says: when it is received.
    stamp = _stamp(message.header)
    return [(stamp if stamp > 0 else -1, _twist(message.twist))]


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
    "clearance_m": _datum,
    "obstacle_cell_distance_m": _datum,
    "obstacle_corner_distance_m": _datum,
    "cycle_count": _datum,
    "compute_time_ms": _datum,
    "compute_cpu_time_ms": _datum,
}
