"""The robot's motion in a recording: its poses and velocities on one clock."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.quaternions import rotation_of, yaw_of
from drake_navbench.ros2.recordings.decoded_messages import Motion, Transform
from drake_navbench.ros2.recordings.planar_transforms import (
    Mounting,
    Track,
    TransformTree,
    composed,
    inverted,
)
from drake_navbench.ros2.recordings.recorded_columns import Column

Stamps = NDArray[np.int64]

NANOSECONDS = 1e9
# From message to message, stamp and time of receipt drift apart by no more than this.
CLOCK_JUMP_S = 1.0
# Messages of several senders may overtake each other by this much; more means a clock set back.
REORDERED_S = 0.5
MAP_FRAME = "map"
HOW_TO_CUT = "take another part of it with --start and --end"


@dataclass(frozen=True, eq=False)
class Clock:
    """Converts times of reception to the clock of the stamps, for messages without a stamp.

    origin_ns: the stamp that is second 0. receive_ns: (N,) when each odometry message was received.
    ahead_ns: (N,) its stamp minus receive_ns.
    """

    origin_ns: int
    receive_ns: Stamps
    ahead_ns: Stamps

    @classmethod
    def of(cls, column: Column) -> Clock:
        """Returns the clock of an odometry."""
        return cls(int(column.stamp_ns[0]), column.receive_ns, column.stamp_ns - column.receive_ns)

    def stamped(self, stamp_ns: Stamps) -> Array:
        """Returns stamps in seconds from the origin."""
        return np.asarray((stamp_ns - self.origin_ns) / NANOSECONDS)

    def received(self, receive_ns: Stamps) -> Array:
        """Returns the time at which messages without a stamp were received."""
        # We interpolate differences, as a float does not hold the nanoseconds since 1970.
        start_ns = self.receive_ns[0]
        known = (self.receive_ns - start_ns).astype(float)
        ahead_ns = (self.ahead_ns - self.ahead_ns[0]).astype(float)
        later_ns = np.interp((receive_ns - start_ns).astype(float), known, ahead_ns)
        since_ns = receive_ns + self.ahead_ns[0] - self.origin_ns
        return np.asarray((since_ns + later_ns) / NANOSECONDS)

    def times(self, column: Column) -> Array:
        """Returns the time of each message of a column, by its stamp where it has one."""
        stamped = self.stamped(column.stamp_ns)
        return np.where(column.stamp_ns >= 0, stamped, self.received(column.receive_ns))


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """The motion of a robot.

    time_s: (N,) of the samples, the stamps of `source`. world: the frame of the poses. pose: (N, 3)
    of the base, x m, y m, yaw rad unwrapped. twist: (N, 3) v m/s, w rad/s, vy m/s. estimated_pose,
    measured_twist: the pose and the twist that the controller got. source: the source of the poses
    in words. has_truth: whether pose and twist come from a simulator or a tracking system.
    """

    clock: Clock
    time_s: Array
    world: str
    base: str
    pose: Array
    estimated_pose: Array
    twist: Array
    measured_twist: Array
    source: str
    tree: TransformTree
    odom_frame: str
    odometry: Track
    has_truth: bool

    @cached_property
    def track(self) -> Track:
        """The pose over time."""
        return Track(self.time_s, self.pose)

    def in_world(self, frame: str, time_s: Array) -> Array | None:
        """Returns the poses of a frame in the world at some times, (M, 3); None where unknown.

        If the recording has a ground truth, its frame is the map, and the localisation is ignored.
        The pose of the odometry's frame then follows from the robot's poses in both: X_WO = X_WB
        X_BO.
        """
        if frame == self.world or (self.has_truth and frame == MAP_FRAME):
            return np.zeros((len(time_s), 3))
        joined = self.tree.poses(self.world, frame, time_s)
        if joined is not None and not (self.has_truth and frame == self.odom_frame):
            return joined
        # A frame in no chain with the base is reached by way of the robot.
        seen = self.base_in(frame, time_s)
        return None if seen is None else composed(self.track.at(time_s), inverted(seen))

    def base_in(self, frame: str, time_s: Array) -> Array | None:
        """Returns the poses of the robot's base in a frame, (M, 3); None where unknown."""
        if frame == self.odom_frame:
            return self.odometry.at(time_s)
        return self.tree.poses(frame, self.base, time_s)

    def mounting(self, frame: str) -> Mounting | None:
        """Returns the fixed pose of a sensor's frame in the base frame; None where unknown."""
        return self.tree.mounting(self.base, frame)


def recorded_motion(path: Path, columns: Mapping[str, Column]) -> RecordedMotion:
    """Returns the motion in a recording.

    The pose is the true one if it is recorded, else the robot's pose in the map by the transforms,
    else that of the odometry. Raises InputError where stamps run backwards or a clock jumps, and
    where the odometry is of several robots.
    """
    odometry = columns["odom"]
    if not odometry.values:
        raise InputError(f"{path}: no odometry in this part of the recording; {HOW_TO_CUT}")
    _require_one_robot(path, odometry)
    _require_steady_clock(path, "odometry", odometry)
    clock = Clock.of(odometry)
    first: Motion = odometry.values[0]
    tree = _tree(path, clock, columns)
    track, twist = _moves(clock, odometry)
    truth = columns.get("truth")
    has_truth = truth is not None and bool(truth.values)
    if truth is not None and has_truth:
        _require_steady_clock(path, "ground truth", truth)
        own, own_twist = _moves(clock, truth)
        world, source = truth.values[0].frame, "the recording's ground truth"
    else:
        own, own_twist = track, twist
        world, source = first.frame, f"odometry, {first.frame} to {first.child}"
    estimated = _localised(tree, first, own.time_s)
    pose = own.pose
    if estimated is not None and not has_truth:
        pose, world = estimated, MAP_FRAME
        source = f"transforms, {MAP_FRAME} to {first.child}"
    measured = np.column_stack([np.interp(own.time_s, track.time_s, c) for c in twist.T])
    return RecordedMotion(
        clock=clock,
        time_s=own.time_s,
        world=world,
        base=first.child,
        pose=pose,
        estimated_pose=track.at(own.time_s) if estimated is None else estimated,
        twist=own_twist,
        measured_twist=measured,
        source=source,
        tree=tree,
        odom_frame=first.frame,
        odometry=track,
        has_truth=has_truth,
    )


def _localised(tree: TransformTree, odometry: Motion, time_s: Array) -> Array | None:
    """Returns the robot's poses in the map by the transforms; None where they do not tell it."""
    pose = tree.poses(MAP_FRAME, odometry.child, time_s)
    if pose is not None:
        pose[:, 2] = np.unwrap(pose[:, 2])
    return pose


def _moves(clock: Clock, column: Column) -> tuple[Track, Array]:
    """Returns the poses and twists of an odometry, at rising times."""
    time_s = clock.stamped(column.stamp_ns)
    order = np.argsort(time_s, kind="stable")
    order = order[np.append(True, np.diff(time_s[order]) > 0.0)]
    pose = np.array([column.values[k].pose for k in order], dtype=float)
    pose[:, 2] = np.unwrap(pose[:, 2])
    twist = np.array([column.values[k].twist for k in order], dtype=float)
    return Track(time_s[order], pose), twist


def _tree(path: Path, clock: Clock, columns: Mapping[str, Column]) -> TransformTree:
    fixed: dict[str, tuple[str, Mounting]] = {}
    if "tf_static" in columns:
        for transform in columns["tf_static"].values:
            rotation = rotation_of(*transform.rotation)
            place = Mounting(rotation, np.array(transform.translation))
            fixed[transform.child] = (transform.parent, place)
    moving: dict[str, tuple[str, Track]] = {}
    sent = columns.get("tf")
    by_child: dict[str, list[int]] = defaultdict(list)
    for index, transform in enumerate(sent.values if sent else ()):
        by_child[transform.child].append(index)
    for child, rows in by_child.items():
        assert sent is not None
        values: list[Transform] = [sent.values[row] for row in rows]
        part = Column(sent.receive_ns[rows], sent.stamp_ns[rows], values)
        _require_order(path, f"transforms of {child}", part)
        moving[child] = (values[-1].parent, _track(clock, part))
    return TransformTree(moving, fixed)


def _track(clock: Clock, column: Column) -> Track:
    """Returns a moving frame's pose over time."""
    time_s = clock.stamped(column.stamp_ns)
    order = np.argsort(time_s, kind="stable")
    order = order[np.append(np.diff(time_s[order]) > 0.0, True)]
    places = np.array([column.values[k].translation for k in order], dtype=float)
    turns = np.array([column.values[k].rotation for k in order], dtype=float)
    yaw = np.unwrap(yaw_of(*turns.T))
    return Track(time_s[order], np.column_stack([places[:, :2], yaw]))


def _require_one_robot(path: Path, odometry: Column) -> None:
    frames = sorted({motion.child for motion in odometry.values})
    if len(frames) > 1:
        raise InputError(
            f"{path}: the odometry is of {len(frames)} robots, {', '.join(frames)}; expected one; "
            "choose another topic with --topics odom=TOPIC"
        )


def _require_order(path: Path, name: str, column: Column) -> None:
    """Raises InputError where stamps run backwards by more than REORDERED_S."""
    steps = np.diff(column.stamp_ns) / NANOSECONDS
    if len(steps) and steps.min() < -REORDERED_S:
        where = int(steps.argmin())
        _refuse(path, f"{name}: stamps run backwards by {-steps[where]:.3f} s", column, where)


def _require_steady_clock(path: Path, name: str, column: Column) -> None:
    """Raises InputError where stamps run backwards, or jump against the time of receipt."""
    steps = np.diff(column.stamp_ns) / NANOSECONDS
    if len(steps) and steps.min() < 0.0:
        where = int((steps < 0.0).argmax())
        _refuse(path, f"{name}: stamps run backwards by {-steps[where]:.3f} s", column, where)
    drift = np.abs(steps - np.diff(column.receive_ns) / NANOSECONDS)
    if len(drift) and drift.max() > CLOCK_JUMP_S:
        where = int(drift.argmax())
        jump = (
            steps[where] - (column.receive_ns[where + 1] - column.receive_ns[where]) / NANOSECONDS
        )
        _refuse(path, f"{name}: the clock jumps by {jump:.3f} s", column, where)


def _refuse(path: Path, fault: str, column: Column, where: int) -> None:
    since_s = (column.receive_ns[where + 1] - column.receive_ns[0]) / NANOSECONDS
    raise InputError(f"{path}: {fault}, {since_s:.3f} s after the first of them; {HOW_TO_CUT}")
