"""Makes ROS 2 messages of poses, paths, grids and lines.

Conventions: REP 103 and 105; a planar pose has z = 0 and a quaternion about z; the twist of an
odometry is in the body frame; row 0 of a grid is its lowest y, its origin a corner of cell (0, 0).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.ros2.recordings.rosbags_extra import ros2_types

Rgba = tuple[float, float, float, float]
Pose = Sequence[float] | Array

NANOSECONDS_PER_SECOND = 1_000_000_000
LINE_STRIP, LINE_LIST = 4, 5
COVARIANCE_SIZE = 36
# The value of FLOAT32 in sensor_msgs/PointField.
POINT_FIELD_FLOAT32 = 7
# Indices of the variances of x, y and yaw in a covariance of x, y, z, roll, pitch, yaw.
X_X, Y_Y, YAW_YAW = 0, 7, 35


class LineStyle(NamedTuple):
    """The look of a marker of lines; kind: LINE_STRIP, or LINE_LIST for pairs of points."""

    namespace: str
    kind: int
    width_m: float
    rgba: Rgba


class MessageMaker:
    """Makes messages whose header has a stamp in nanoseconds; frames are given by name."""

    def __init__(self) -> None:
        self._types = ros2_types().types
        self._empty_pose = self.pose((0.0, 0.0, 0.0))

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Returns a message of any type, such as 'std_msgs/msg/Float64'."""
        return self._types[type_name](**fields)

    def time(self, stamp_ns: int) -> Any:
        """Returns builtin_interfaces/Time."""
        sec, nanosec = divmod(stamp_ns, NANOSECONDS_PER_SECOND)
        return self.make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)

    def header(self, stamp_ns: int, frame: str) -> Any:
        """Returns std_msgs/Header."""
        return self.make("std_msgs/msg/Header", stamp=self.time(stamp_ns), frame_id=frame)

    def vector(self, x: float, y: float, z: float) -> Any:
        """Returns geometry_msgs/Vector3."""
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def point(self, x: float, y: float) -> Any:
        """Returns geometry_msgs/Point on the floor."""
        return self.make("geometry_msgs/msg/Point", x=x, y=y, z=0.0)

    def quaternion(self, yaw: float) -> Any:
        """Returns geometry_msgs/Quaternion of a turn about z."""
        return self.make(
            "geometry_msgs/msg/Quaternion",
            x=0.0,
            y=0.0,
            z=math.sin(0.5 * yaw),
            w=math.cos(0.5 * yaw),
        )

    def pose(self, pose: Pose) -> Any:
        """Returns geometry_msgs/Pose of (3,) x m, y m, yaw rad."""
        return self.make(
            "geometry_msgs/msg/Pose",
            position=self.point(float(pose[0]), float(pose[1])),
            orientation=self.quaternion(float(pose[2])),
        )

    def pose_stamped(self, stamp_ns: int, frame: str, pose: Pose) -> Any:
        """Returns geometry_msgs/PoseStamped."""
        header = self.header(stamp_ns, frame)
        return self.make("geometry_msgs/msg/PoseStamped", header=header, pose=self.pose(pose))

    def path(self, stamp_ns: int, frame: str, poses: Array) -> Any:
        """Returns nav_msgs/Path of (N, 3) poses; each carries the header, as some tools expect."""
        header = self.header(stamp_ns, frame)
        stamped = [
            self.make("geometry_msgs/msg/PoseStamped", header=header, pose=self.pose(pose))
            for pose in poses
        ]
        return self.make("nav_msgs/msg/Path", header=header, poses=stamped)

    def transform(self, stamp_ns: int, frame: str, child: str, pose: Pose, z: float = 0.0) -> Any:
        """Returns geometry_msgs/TransformStamped: where the child lies in the frame."""
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.vector(float(pose[0]), float(pose[1]), z),
            rotation=self.quaternion(float(pose[2])),
        )
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp_ns, frame),
            child_frame_id=child,
            transform=transform,
        )

    def twist(self, v: float, w: float, vy: float = 0.0) -> Any:
        """Returns geometry_msgs/Twist of v m/s forward, w rad/s and vy m/s to the left."""
        return self.make(
            "geometry_msgs/msg/Twist",
            linear=self.vector(v, vy, 0.0),
            angular=self.vector(0.0, 0.0, w),
        )

    def twist_stamped(self, stamp_ns: int, frame: str, *twist: float) -> Any:
        """Returns geometry_msgs/TwistStamped; twist: as for `twist`."""
        header = self.header(stamp_ns, frame)
        return self.make("geometry_msgs/msg/TwistStamped", header=header, twist=self.twist(*twist))

    def odometry(
        self,
        stamp_ns: int,
        frame: str,
        child: str,
        pose: Pose,
        twist: Sequence[float],
        twist_variances: Sequence[float] = (0.0, 0.0),
    ) -> Any:
        """Returns nav_msgs/Odometry; twist: v, w and vy in the child's frame."""
        covariance = np.zeros(COVARIANCE_SIZE)
        covariance[X_X], covariance[YAW_YAW] = twist_variances
        return self.make(
            "nav_msgs/msg/Odometry",
            header=self.header(stamp_ns, frame),
            child_frame_id=child,
            pose=self._with_covariance(pose, (0.0, 0.0)),
            twist=self.make(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self.twist(*twist),
                covariance=covariance,
            ),
        )

    def pose_with_covariance(
        self, stamp_ns: int, frame: str, pose: Pose, variances: tuple[float, float]
    ) -> Any:
        """Returns geometry_msgs/PoseWithCovarianceStamped; variances: of x and y, of yaw."""
        return self.make(
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            header=self.header(stamp_ns, frame),
            pose=self._with_covariance(pose, variances),
        )

    def occupancy_grid(
        self,
        stamp_ns: int,
        frame: str,
        occupancy: NDArray[np.int8],
        *,
        origin: tuple[float, float],
        resolution: float,
    ) -> Any:
        """Returns nav_msgs/OccupancyGrid of (rows, columns) -1 to 100."""
        rows, columns = occupancy.shape
        info = self.make(
            "nav_msgs/msg/MapMetaData",
            map_load_time=self.time(stamp_ns),
            resolution=resolution,
            width=columns,
            height=rows,
            origin=self.pose((*origin, 0.0)),
        )
        data = np.ascontiguousarray(occupancy, dtype=np.int8).reshape(-1)
        header = self.header(stamp_ns, frame)
        return self.make("nav_msgs/msg/OccupancyGrid", header=header, info=info, data=data)

    def laser_scan(
        self,
        stamp_ns: int,
        frame: str,
        angles_rad: Array,
        ranges_m: NDArray[np.float32],
        *,
        period_s: float,
        range_limits_m: tuple[float, float],
    ) -> Any:
        """Returns sensor_msgs/LaserScan; all beams of a scan are taken at once."""
        steps = max(len(angles_rad) - 1, 1)
        return self.make(
            "sensor_msgs/msg/LaserScan",
            header=self.header(stamp_ns, frame),
            angle_min=float(angles_rad[0]),
            angle_max=float(angles_rad[-1]),
            angle_increment=float(angles_rad[-1] - angles_rad[0]) / steps,
            time_increment=0.0,
            scan_time=period_s,
            range_min=range_limits_m[0],
            range_max=range_limits_m[1],
            ranges=np.ascontiguousarray(ranges_m, dtype=np.float32),
            intensities=np.empty(0, dtype=np.float32),
        )

    def point_cloud(self, stamp_ns: int, frame: str, points: NDArray[np.float32]) -> Any:
        """Returns sensor_msgs/PointCloud2 of (N, 3) x, y, z m."""
        size = points.itemsize
        fields = [
            self.make(
                "sensor_msgs/msg/PointField",
                name=name,
                offset=size * place,
                datatype=POINT_FIELD_FLOAT32,
                count=1,
            )
            for place, name in enumerate("xyz")
        ]
        return self.make(
            "sensor_msgs/msg/PointCloud2",
            header=self.header(stamp_ns, frame),
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=False,
            point_step=3 * size,
            row_step=3 * size * len(points),
            data=np.frombuffer(points.astype("<f4").tobytes(), dtype=np.uint8),
            is_dense=True,
        )

    def polygon(self, stamp_ns: int, frame: str, corners: Array) -> Any:
        """Returns geometry_msgs/PolygonStamped of (K, 2) m."""
        points = [
            self.make("geometry_msgs/msg/Point32", x=float(x), y=float(y), z=0.0)
            for x, y in corners
        ]
        return self.make(
            "geometry_msgs/msg/PolygonStamped",
            header=self.header(stamp_ns, frame),
            polygon=self.make("geometry_msgs/msg/Polygon", points=points),
        )

    def color(self, rgba: Rgba) -> Any:
        """Returns std_msgs/ColorRGBA."""
        return self.make("std_msgs/msg/ColorRGBA", **dict(zip("rgba", rgba, strict=True)))

    def lines(
        self,
        stamp_ns: int,
        frame: str,
        points: Array,
        style: LineStyle,
        colors: Sequence[Rgba] = (),
    ) -> Any:
        """Returns visualization_msgs/MarkerArray with one marker of (N, 2) points, m.

        colors: one a point; none: all have the colour of the style.
        """
        named = {rgba: self.color(rgba) for rgba in {style.rgba, *colors}}
        marker = self.make(
            "visualization_msgs/msg/Marker",
            header=self.header(stamp_ns, frame),
            ns=style.namespace,
            id=0,
            type=style.kind,
            action=0,
            pose=self._empty_pose,
            scale=self.vector(style.width_m, 0.0, 0.0),
            color=named[style.rgba],
            lifetime=self.make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            frame_locked=False,
            points=[self.point(float(x), float(y)) for x, y in points],
            colors=[named[color] for color in colors],
            texture_resource="",
            texture=self.make(
                "sensor_msgs/msg/CompressedImage",
                header=self.header(0, ""),
                format="",
                data=np.empty(0, dtype=np.uint8),
            ),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=self.make(
                "visualization_msgs/msg/MeshFile", filename="", data=np.empty(0, dtype=np.uint8)
            ),
            mesh_use_embedded_materials=False,
        )
        return self.make("visualization_msgs/msg/MarkerArray", markers=[marker])

    def diagnostics(
        self, stamp_ns: int, name: str, hardware: str, values: Mapping[str, Any]
    ) -> Any:
        """Returns diagnostic_msgs/DiagnosticArray with one status."""
        pairs = [
            self.make("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
            for key, value in values.items()
        ]
        status = self.make(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=0,
            name=name,
            message="",
            hardware_id=hardware,
            values=pairs,
        )
        header = self.header(stamp_ns, "")
        return self.make("diagnostic_msgs/msg/DiagnosticArray", header=header, status=[status])

    def goal_status(self, accepted_ns: int, goal_id: bytes, status: int) -> Any:
        """Returns action_msgs/GoalStatusArray of one goal; goal_id: 16 bytes."""
        info = self.make(
            "action_msgs/msg/GoalInfo",
            goal_id=self.make(
                "unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(goal_id, dtype=np.uint8)
            ),
            stamp=self.time(accepted_ns),
        )
        entry = self.make("action_msgs/msg/GoalStatus", goal_info=info, status=status)
        return self.make("action_msgs/msg/GoalStatusArray", status_list=[entry])

    def _with_covariance(self, pose: Pose, variances: tuple[float, float]) -> Any:
        covariance = np.zeros(COVARIANCE_SIZE)
        covariance[X_X] = covariance[Y_Y] = variances[0]
        covariance[YAW_YAW] = variances[1]
        return self.make(
            "geometry_msgs/msg/PoseWithCovariance", pose=self.pose(pose), covariance=covariance
        )
