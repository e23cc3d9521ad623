"""The messages that a simulated robot sends: clock, transforms, sensors, odometry and map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.ros2.live.domain import LATCHED, PLAIN, LiveDomain, Publisher
from drake_navbench.ros2.live.endpoints import Endpoint, OwnTopic, Quality, publishers_of
from drake_navbench.ros2.live.parameters import TOPIC_NAMES, LiveParameters
from drake_navbench.ros2.live.wire_types import type_hash
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.ros2.recordings.robot_description import urdf_of
from drake_navbench.trial.systems.running_stack import RobotReadings

TYPES: Mapping[str, tuple[str, Quality]] = {
    "clock": (topics.CLOCK.type, PLAIN),
    "tf": (topics.TF.type, PLAIN),
    "tf_static": (topics.TF_STATIC.type, LATCHED),
    "scan": (topics.SCAN.type, PLAIN),
    "odom": (topics.ODOMETRY.type, PLAIN),
    "map": (topics.MAP.type, LATCHED),
    "initialpose": (topics.ESTIMATE.type, PLAIN),
    "robot_description": (topics.ROBOT_DESCRIPTION.type, LATCHED),
    "goal_pose": (topics.GOAL.type, PLAIN),
}
CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"
# A publisher of one of these is a robot or a simulator of one.
TOLD_BY_A_ROBOT = ("clock", "scan", "odom")
# The variances of /initialpose, so that AMCL may start from a pose in the map.
INITIAL_VARIANCES = (0.05**2, 0.03**2)


class RobotTopics:
    """Publishes the readings of one simulated robot as messages.

    own: all topics with their types and qualities, to compare with discovered endpoints. sent_scan:
    the newest scan that was sent.
    """

    def __init__(self, domain: LiveDomain, parameters: LiveParameters, robot: Robot) -> None:
        self._domain = domain
        self._parameters = parameters
        self._robot = robot
        self._make = MessageMaker()
        self._publishers: dict[str, Publisher] = {}
        kinds = dict(TYPES) | {name: (CLOUD_TYPE, PLAIN) for name in robot.depth_sensors}
        extra = range(2, 2 + len(robot.lidar.further_poses))
        self._scans = ["scan", *(f"scan_{number}" for number in extra)]
        kinds |= {name: TYPES["scan"] for name in self._scans}
        self._kinds = kinds
        for name in parameters.topics:
            if name not in kinds and name not in TOPIC_NAMES:
                hint = nearest_name_hint(name, [*kinds, *TOPIC_NAMES])
                raise InputError(f"live: topics: {name!r} is no topic of this robot{hint}")
        self.sent_scan: Scan | None = None
        self._sent_clouds: dict[str, PointCloud] = {}

    @property
    def own(self) -> tuple[OwnTopic, ...]:
        """All topics that the robot publishes."""
        return tuple(
            OwnTopic(self._parameters.topic(name), (kind,), True, quality, (type_hash(kind),))
            for name, (kind, quality) in self._kinds.items()
        )

    @property
    def signs_of_a_robot(self) -> list[str]:
        """The topics that only a robot or a simulator publishes."""
        names = [*TOLD_BY_A_ROBOT, *self._scans[1:], *self._robot.depth_sensors]
        return [self._parameters.topic(name) for name in names]

    @property
    def lost_count(self) -> int:
        """Number of messages that a stopped listener did not take."""
        return sum(publisher.lost_count for publisher in self._publishers.values())

    def open(self, known_map: OccupancyMap, endpoints: list[Endpoint], stamp_ns: int) -> None:
        """Creates the publishers; sends the map, the fixed frames and the robot's description.

        The map and the description are left to the stack where it has publishers of them.
        """
        for name, (kind, quality) in self._kinds.items():
            topic = self._parameters.topic(name)
            may_be_theirs = name in ("map", "robot_description")
            if not (may_be_theirs and publishers_of(endpoints, topic)):
                self._publishers[name] = self._domain.publisher(topic, kind, quality)
        make, frames = self._make, self._parameters
        self._send("tf_static", make.make(topics.TF_STATIC.type, transforms=self._fixed(stamp_ns)))
        urdf = urdf_in_frames(urdf_of(self._robot, "robot"), frames)
        self._send("robot_description", make.make(topics.ROBOT_DESCRIPTION.type, data=urdf))
        origin = float(known_map.origin_x), float(known_map.origin_y)
        grid = make.occupancy_grid(
            stamp_ns,
            frames.map_frame,
            known_map.occupancy,
            origin=origin,
            resolution=float(known_map.resolution),
        )
        self._send("map", grid)

    def send_clock(self, stamp_ns: int) -> None:
        """Sends /clock."""
        self._send("clock", self._make.make(topics.CLOCK.type, clock=self._make.time(stamp_ns)))

    def send_motion(self, stamp_ns: int, sensed: RobotReadings, *, with_map: bool) -> None:
        """Sends /odom and /tf; with_map: with the transform from map to odometry."""
        make, frames, robot = self._make, self._parameters, self._robot
        pose, twist = sensed.odometry[:3], sensed.odometry[3:]
        transforms = [make.transform(stamp_ns, frames.odom_frame, frames.base_frame, pose)]
        if with_map:
            correction = sensed.map_from_odometry
            transforms.append(
                make.transform(stamp_ns, frames.map_frame, frames.odom_frame, correction)
            )
        self._send("tf", make.make(topics.TF.type, transforms=transforms))
        settings = robot.localization
        variances = (
            settings.linear_velocity_std_mps**2,
            settings.angular_velocity_std_radps**2,
        )
        odometry = make.odometry(
            stamp_ns, frames.odom_frame, frames.base_frame, pose, twist.tolist(), variances
        )
        self._send("odom", odometry)

    def send_new_readings(self, offset_ns: int, sensed: RobotReadings) -> None:
        """Sends the scans and clouds that have not been sent yet, with their own times."""
        if sensed.scan is not None and sensed.scan is not self.sent_scan:
            self.sent_scan = sensed.scan
            self._send_scan(offset_ns + nanoseconds(sensed.scan.time_s), sensed.scan)
        for name, cloud in sensed.clouds.items():
            if cloud is not self._sent_clouds.get(name):
                self._sent_clouds[name] = cloud
                self._send_cloud(offset_ns + nanoseconds(cloud.time_s), name, cloud)

    def send_readings_again(self, stamp_ns: int, sensed: RobotReadings) -> None:
        """Sends the newest scan and clouds with a new stamp: the world stands still."""
        self.sent_scan = sensed.scan
        self._sent_clouds = dict(sensed.clouds)
        if sensed.scan is not None:
            self._send_scan(stamp_ns, sensed.scan)
        for name, cloud in sensed.clouds.items():
            self._send_cloud(stamp_ns, name, cloud)

    def send_pose(self, name: str, stamp_ns: int, pose: Any) -> None:
        """Sends `goal_pose` or `initialpose`, x m, y m, yaw rad in the map frame."""
        make, frame = self._make, self._parameters.map_frame
        if name == "goal_pose":
            message = make.pose_stamped(stamp_ns, frame, pose)
        else:
            message = make.pose_with_covariance(stamp_ns, frame, pose, INITIAL_VARIANCES)
        self._send(name, message)

    def _send(self, name: str, message: Any) -> None:
        publisher = self._publishers.get(name)
        if publisher is not None:
            publisher.send(message)

    def _send_scan(self, stamp_ns: int, scan: Scan) -> None:
        lidar = self._robot.lidar
        for name, one in zip(self._scans, (scan, *scan.further), strict=True):
            message = self._make.laser_scan(
                stamp_ns,
                self._frame_of(name),
                one.angles_rad,
                one.ranges_m,
                period_s=lidar.period_s,
                range_limits_m=(lidar.range_min_m, lidar.range_max_m),
            )
            self._send(name, message)

    def _send_cloud(self, stamp_ns: int, name: str, cloud: PointCloud) -> None:
        points = points_in_sensor(cloud)
        self._send(name, self._make.point_cloud(stamp_ns, self._frame_of(name), points))

    def _frame_of(self, name: str) -> str:
        """Returns the frame of a sensor; the frame of a depth sensor looks level."""
        scan_frame = self._parameters.scan_frame
        if name in self._scans:
            return scan_frame + name.removeprefix("scan")
        return f"{name}_frame"

    def _fixed(self, stamp_ns: int) -> list[Any]:
        """Returns the transforms that never change."""
        make, frames, robot = self._make, self._parameters, self._robot
        lidar = robot.lidar
        # Robots with ROS have both frames, in either order.
        is_footprint = frames.base_frame == topics.FOOTPRINT_FRAME
        other = topics.BASE_FRAME if is_footprint else topics.FOOTPRINT_FRAME
        fixed = [make.transform(stamp_ns, frames.base_frame, other, (0.0, 0.0, 0.0))]
        fixed += [
            make.transform(stamp_ns, frames.base_frame, self._frame_of(name), pose, lidar.height_m)
            for name, pose in zip(self._scans, (lidar.pose, *lidar.further_poses), strict=True)
        ]
        fixed += [
            make.transform(
                stamp_ns, frames.base_frame, self._frame_of(name), sensor.pose, sensor.height_m
            )
            for name, sensor in robot.depth_sensors.items()
        ]
        return fixed


def points_in_sensor(cloud: PointCloud) -> Any:
    """Returns a cloud's points (N, 3) float32 m from its sensor, x along its level heading."""
    x, y, z = (cloud.points - cloud.origin).T
    cosine, sine = np.cos(cloud.yaw_rad), np.sin(cloud.yaw_rad)
    level = np.column_stack([cosine * x + sine * y, cosine * y - sine * x, z])
    return level.astype(np.float32)


def urdf_in_frames(urdf: str, frames: LiveParameters) -> str:
    """Returns a robot's description with its frames renamed as the parameters say."""
    names = {topics.BASE_FRAME: frames.base_frame, topics.LIDAR_FRAME: frames.scan_frame}
    root = ET.fromstring(urdf)
    for element in root.iter():
        for field in ("name", "link"):
            if element.tag in ("link", "parent", "child") and field in element.attrib:
                element.set(field, names.get(element.attrib[field], element.attrib[field]))
    return ET.tostring(root, encoding="unicode", xml_declaration=True)


def nanoseconds(time_s: float) -> int:
    """Returns a time as whole nanoseconds."""
    return round(time_s * 1e9)
