"""Makes the messages of a trial from its log, as a recorder of a real robot would receive them.

Without drift of the odometry, the frame `odom` is the simulation's world. The transform from `map`
to `odom` is the error of the localisation, so that the transform from `map` to `base_link` is the
estimated pose that the controller got. The true pose is in /ground_truth/odom.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from drake_navbench.analysis.metrics.movers import is_there, movers_of
from drake_navbench.analysis.metrics.moving import look_times
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.world import Obstacle, World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.poses import carrier_pose, place_outline
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import ODOMETRY_COLUMNS, UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.intention_messages import LINE_WIDTH_M, intentions
from drake_navbench.ros2.recordings.messages import (
    LINE_LIST,
    NANOSECONDS_PER_SECOND,
    LineStyle,
    MessageMaker,
)
from drake_navbench.ros2.recordings.occupancy import map_of_world, occupancy_from_costs
from drake_navbench.ros2.recordings.robot_description import urdf_of
from drake_navbench.ros2.recordings.topics import BASE_FRAME, MAP_FRAME, ODOM_FRAME, Message

# Trials begin on 2024-01-01, as tools take a time of 0 for "not set". All begin alike, so that
# equal logs give equal bags and two trials can be laid over each other.
TIME_ZERO_NS = 1_704_067_200 * NANOSECONDS_PER_SECOND
# The numbers of action_msgs/GoalStatus.
ACCEPTED, EXECUTING, SUCCEEDED, ABORTED = 1, 2, 4, 6
# The time from the sample before it to a command, in the stamps.
GIVEN_AFTER_NS = 1_000_000
MAP_MARGIN_M = 1.0
TRUE_COLUMNS = ("x_m", "y_m", "yaw_rad")

STANDING = LineStyle("obstacles", LINE_LIST, LINE_WIDTH_M, (0.45, 0.47, 0.5, 1.0))
MOVING = LineStyle("moving_obstacles", LINE_LIST, LINE_WIDTH_M, (0.8, 0.52, 0.2, 1.0))


def stamp_ns(time_s: float) -> int:
    """Returns the stamp of a time in a trial, ns."""
    return TIME_ZERO_NS + round(time_s * NANOSECONDS_PER_SECOND)


@dataclass(frozen=True, eq=False)
class TrialMessages:
    """All messages of a trial. The log needs at least one sample."""

    log: TrialLog
    maker: MessageMaker

    @cached_property
    def robot(self) -> Robot:
        """The robot of the log."""
        return Robot.model_validate(self.log.info["robot"])

    @cached_property
    def world(self) -> World:
        """The world of the log's standing obstacles."""
        return World(tuple(TypeAdapter(list[Obstacle]).validate_python(self.log.obstacles)))

    @cached_property
    def has_frames(self) -> bool:
        """Whether the odometry has a frame of its own; else its frame is the world's."""
        return ODOMETRY_COLUMNS.keys() <= set(self.log.samples.columns)

    @property
    def world_frame(self) -> str:
        """The frame of the true poses."""
        return MAP_FRAME if self.has_frames else ODOM_FRAME

    @property
    def intention_frame(self) -> str:
        """The frame of the pose that the controller got."""
        return ODOM_FRAME if self.has_frames else MAP_FRAME

    @property
    def odometry_columns(self) -> tuple[str, ...]:
        """The columns of x m, y m and yaw rad in the odometry's frame."""
        return tuple(ODOMETRY_COLUMNS) if self.has_frames else TRUE_COLUMNS

    @property
    def start_ns(self) -> int:
        """The stamp of the first sample."""
        return stamp_ns(self.log.samples["time_s"].iloc[0])

    def __iter__(self) -> Iterator[Message]:
        """Yields topic, stamp in ns and message; topic by topic, each in order of time."""
        yield from self._standing()
        yield from self._status()
        yield from self._samples()
        yield from self._scalars()
        yield from self._scans()
        yield from self._plans()
        yield from self._costmaps()
        yield from self._diagnostics()
        yield from self._moving()

    def _standing(self) -> Iterator[Message]:
        """Yields the messages that are sent once, at the start: fixed frames, robot, map, goal."""
        make, start = self.maker, self.start_ns
        lidar = make.transform(
            start, BASE_FRAME, topics.LIDAR_FRAME, self.robot.lidar.pose, self.robot.lidar.height_m
        )
        ground = make.transform(start, BASE_FRAME, topics.FOOTPRINT_FRAME, (0.0, 0.0, 0.0))
        transforms = make.make("tf2_msgs/msg/TFMessage", transforms=[ground, lidar])
        yield topics.TF_STATIC, start, transforms
        urdf = urdf_of(self.robot, "robot")
        yield topics.ROBOT_DESCRIPTION, start, make.make("std_msgs/msg/String", data=urdf)
        yield topics.TRIAL, start, make.make("std_msgs/msg/String", data=self._as_json())
        yield topics.MAP, start, self._map()
        goal = self.log.info["scenario"]["goal"]
        yield topics.GOAL, start, make.pose_stamped(start, MAP_FRAME, goal)
        edges = _edges(shape.outline for shape in self.world.shapes)
        yield topics.OBSTACLES, start, make.lines(start, self.world_frame, edges, STANDING)

    def _as_json(self) -> str:
        """Returns the parts of a log that no message carries, as JSON: header, events, legs."""
        events = [{"time_s": time_s} | dict(event) for time_s, event in self.log.events]
        legs = [plan.leg for plan in self.log.plans]
        return json.dumps(
            {"info": dict(self.log.info), "events": events, "plan_legs": legs}, sort_keys=True
        )

    def _map(self) -> Any:
        known = World(tuple(shape for shape in self.world.shapes if shape.known_to_planner))
        scenario = self.log.info["scenario"]
        ends = [self.log.samples[["x_m", "y_m"]].to_numpy(), np.array([scenario["goal"][:2]])]
        grid = map_of_world(known, np.vstack(ends), MAP_MARGIN_M)
        return self.maker.occupancy_grid(
            self.start_ns,
            MAP_FRAME,
            grid.costs,
            origin=(grid.origin_x, grid.origin_y),
            resolution=grid.resolution,
        )

    def _status(self) -> Iterator[Message]:
        """Yields the states of the goal, by which readers of recordings cut them into tasks."""
        info = self.log.info
        mode = info["scenario"].get("navigation_mode", "follow_path")
        topic = topics.STATUS_OF_MODE[mode]
        goal_id = sha256(self._as_json().encode()).digest()[:16]
        last = SUCCEEDED if self.log.outcome is Outcome.SUCCEEDED else ABORTED
        for time_ns, status in (
            (self.start_ns, ACCEPTED),
            (stamp_ns(info["start_time_s"]), EXECUTING),
            (stamp_ns(self.log.end_time_s), last),
        ):
            yield topic, time_ns, self.maker.goal_status(self.start_ns, goal_id, status)

    def _samples(self) -> Iterator[Message]:
        """Yields the messages of each sample: clock, transforms, odometry and commands.

        A command that a sample shows was given after the sample before, often just after it; it is
        stamped so. A later stamp would show a base that moves before it is told to.
        """
        make, settings = self.maker, self.robot.localization
        variances = (settings.xy_std_m**2, settings.yaw_std_rad**2)
        twist_variances = (
            settings.linear_velocity_std_mps**2,
            settings.angular_velocity_std_radps**2,
        )
        sent: tuple[float, ...] | None = None
        cycle = before = 0
        for row in self.log.samples.itertuples(index=False):
            now = stamp_ns(row.time_s)
            truth = (row.x_m, row.y_m, row.yaw_rad)
            told = (row.estimated_x_m, row.estimated_y_m, row.estimated_yaw_rad)
            measured = _twist(row, "measured_")
            carried = tuple(getattr(row, name) for name in self.odometry_columns)
            correction = (0.0, 0.0, 0.0) if told == carried else carrier_pose(told, carried)
            transforms = [
                make.transform(now, MAP_FRAME, ODOM_FRAME, correction),
                make.transform(now, ODOM_FRAME, BASE_FRAME, carried),
            ]
            yield topics.CLOCK, now, make.make("rosgraph_msgs/msg/Clock", clock=make.time(now))
            yield topics.TF, now, make.make("tf2_msgs/msg/TFMessage", transforms=transforms)
            odometry = make.odometry(
                now, ODOM_FRAME, BASE_FRAME, carried, measured, twist_variances
            )
            yield topics.ODOMETRY, now, odometry
            moved = make.odometry(now, self.world_frame, BASE_FRAME, truth, _twist(row))
            yield topics.TRUTH, now, moved
            pose = make.pose_with_covariance(now, MAP_FRAME, told, variances)
            yield topics.ESTIMATE, now, pose
            command = _twist(row, "command_")
            if command != sent or row.cycle_count != cycle:
                given = now if sent is None else before + GIVEN_AFTER_NS
                yield topics.COMMAND, given, make.twist_stamped(given, BASE_FRAME, *command)
            sent, cycle, before = command, row.cycle_count, now

    def _scalars(self) -> Iterator[Message]:
        """Yields the log's numeric columns without a ROS message, each where its value changes."""
        times = self.log.samples["time_s"].to_numpy()
        cycles = self.log.samples["cycle_count"].to_numpy()
        for column, topic in topics.SCALARS.items():
            values = self.log.samples[column].to_numpy(dtype=float)
            is_new = np.append(True, values[1:] != values[:-1])
            if column in UNREPEATABLE_COLUMNS:
                is_new[1:] |= cycles[1:] != cycles[:-1]
            for row in np.flatnonzero(is_new):
                number = self.maker.make("std_msgs/msg/Float64", data=float(values[row]))
                yield topic, stamp_ns(times[row]), number

    def _scans(self) -> Iterator[Message]:
        settings = self.robot.lidar
        for scan in self.log.scans:
            now = stamp_ns(scan.time_s)
            message = self.maker.laser_scan(
                now,
                topics.LIDAR_FRAME,
                scan.angles_rad,
                scan.ranges_m,
                period_s=settings.period_s,
                range_limits_m=(settings.range_min_m, settings.range_max_m),
            )
            yield topics.SCAN, now, message

    def _plans(self) -> Iterator[Message]:
        for plan in self.log.plans:
            # The first sample has seen the plan that was given before it.
            now = max(stamp_ns(plan.time_s), self.start_ns)
            message = self.maker.path(now, MAP_FRAME, plan.poses)
            yield topics.PLAN, now, message
            yield topics.RECEIVED_PLAN, now, message

    def _costmaps(self) -> Iterator[Message]:
        samples = self.log.samples
        times = samples["time_s"].to_numpy()
        columns = [samples[name].to_numpy() for name in self.odometry_columns]
        for costmap in self.log.costmaps:
            now = stamp_ns(costmap.stamp_s)
            grid = self.maker.occupancy_grid(
                now,
                ODOM_FRAME,
                occupancy_from_costs(costmap.costs),
                origin=(costmap.origin_x, costmap.origin_y),
                resolution=costmap.resolution,
            )
            yield topics.COSTMAP, now, grid
            pose = [float(np.interp(costmap.stamp_s, times, column)) for column in columns]
            corners = place_outline(self.robot.padded_outline, pose)
            yield topics.FOOTPRINT, now, self.maker.polygon(now, ODOM_FRAME, corners)

    def _diagnostics(self) -> Iterator[Message]:
        hardware = str(self.log.info["controller"])
        for time_s, left in self.log.diagnostics:
            now = stamp_ns(time_s)
            plain = {key: value for key, value in left.items() if not _is_array(value)}
            if plain:
                message = self.maker.diagnostics(now, "controller", hardware, plain)
                yield topics.DIAGNOSTICS, now, message
            yield from intentions(self.maker, now, self.intention_frame, left)
        for time_s, event in self.log.events:
            now = stamp_ns(time_s)
            message = self.maker.diagnostics(now, "navigator", hardware, event)
            yield topics.DIAGNOSTICS, now, message

    def _moving(self) -> Iterator[Message]:
        """Yields the outlines of the moving obstacles and people, ten times a second."""
        movers = movers_of(self.log)
        if not movers.body_count:
            return
        looks = look_times(self.log)
        for time_s, poses in zip(looks, movers.poses_at(looks), strict=True):
            now = stamp_ns(time_s)
            edges = _edges(
                place_outline(outline, pose)
                for outline, pose, own in zip(movers.outlines, poses, is_there(poses), strict=True)
                if own
            )
            yield topics.MOVING, now, self.maker.lines(now, self.world_frame, edges, MOVING)


def _twist(row: Any, prefix: str = "") -> tuple[float, float, float]:
    """Returns v m/s, w rad/s and vy m/s of a sample; vy is 0 where the log has none."""
    v, w = getattr(row, f"{prefix}v_mps"), getattr(row, f"{prefix}w_radps")
    return v, w, getattr(row, f"{prefix}vy_mps", 0.0)


def _edges(outlines: Iterable[Array]) -> Array:
    """Returns the edges of closed outlines (K, 2) m as pairs of points (P, 2) m."""
    closed = (np.hstack([outline, np.roll(outline, -1, axis=0)]) for outline in outlines)
    return np.vstack([np.empty((0, 4)), *closed]).reshape(-1, 2)


def _is_array(value: object) -> bool:
    return isinstance(value, list | np.ndarray)
