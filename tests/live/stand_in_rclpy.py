"""The stand-in stack as a node of the real rclpy: `python stand_in_rclpy.py [--stamped]`.

It runs in an environment of its own with ROS's wheels, where nothing of this package is installed.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import uuid
from contextlib import suppress
from pathlib import Path

import numpy as np
import rclpy
from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as PathMessage
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

sys.path.insert(0, str(Path(__file__).parent))

from stand_in_brain import EXECUTING, Brain

LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class StandIn(Node):
    """The topics of the stand-in, with the qualities that Nav2 asks for."""

    def __init__(self, *, stamped: bool, echo: bool, dies_after: int | None) -> None:
        use_time = Parameter("use_sim_time", Parameter.Type.BOOL, True)
        super().__init__("stand_in", parameter_overrides=[use_time])
        self._brain = Brain()
        self._stamped, self._echo = stamped, echo
        self._commands_left = dies_after
        self._goals: list[tuple[bytes, int]] = []
        self.create_subscription(Clock, "/clock", self._on_clock, 10)
        self.create_subscription(Odometry, "/odom", self._on_odometry, 10)
        self.create_subscription(OccupancyGrid, "/map", self._on_map, LATCHED)
        self.create_subscription(PoseStamped, "/goal_pose", self._on_goal, 10)
        self.create_subscription(LaserScan, "/scan", self._on_scan, qos_profile_sensor_data)
        self._command = self.create_publisher(TwistStamped if stamped else Twist, "/cmd_vel", 10)
        self._plan = self.create_publisher(PathMessage, "/plan", 10)
        self._status = self.create_publisher(
            GoalStatusArray, "/navigate_to_pose/_action/status", LATCHED
        )
        self._stamp = None

    def _on_scan(self, message) -> None:
        assert len(message.ranges)
        if self._echo:
            self._command.publish(self._twist(0.0, 0.0))

    def _on_map(self, message) -> None:
        info = message.info
        data = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
        position = info.origin.position
        self._brain.take_map(data, (position.x, position.y), info.resolution)

    def _on_odometry(self, message) -> None:
        self._brain.pose = planar(message.pose.pose)

    def _on_goal(self, message) -> None:
        self._goals = [(one, 6 if state == EXECUTING else state) for one, state in self._goals]
        self._brain.take_goal(planar(message.pose))
        self._goals = [*self._goals[-5:], (uuid.uuid4().bytes, EXECUTING)]
        self._tell()
        if self._brain.path is not None:
            plan = PathMessage()
            plan.header.frame_id = "map"
            for x, y in self._brain.path:
                pose = PoseStamped()
                pose.pose.position.x, pose.pose.position.y = float(x), float(y)
                plan.poses.append(pose)
            self._plan.publish(plan)

    def _on_clock(self, message) -> None:
        self._stamp = message.clock
        command = self._brain.tick(message.clock.sec + 1e-9 * message.clock.nanosec)
        if command is not None and not self._echo:
            self._command.publish(self._twist(*command))
            self._count_command()
        if self._goals and self._goals[-1][1] == EXECUTING != self._brain.state:
            self._goals[-1] = self._goals[-1][0], self._brain.state
            self._tell()

    def _count_command(self) -> None:
        """Dies after its last command, without a farewell."""
        if self._commands_left is None:
            return
        self._commands_left -= 1
        if self._commands_left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def _twist(self, v: float, w: float):
        twist = Twist()
        twist.linear.x, twist.angular.z = float(v), float(w)
        if not self._stamped:
            return twist
        stamped = TwistStamped()
        stamped.header.stamp, stamped.header.frame_id = self._stamp, "base_link"
        stamped.twist = twist
        return stamped

    def _tell(self) -> None:
        message = GoalStatusArray()
        for number, (goal_id, state) in enumerate(self._goals):
            info = GoalInfo()
            info.goal_id.uuid = list(goal_id)
            info.stamp.sec = number if self._stamp is None else self._stamp.sec
            info.stamp.nanosec = number
            message.status_list.append(GoalStatus(goal_info=info, status=int(state)))
        self._status.publish(message)


def planar(pose) -> tuple[float, float, float]:
    """Returns x m, y m and yaw rad of a pose."""
    q = pose.orientation
    return pose.position.x, pose.position.y, 2.0 * math.atan2(q.z, q.w)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--stamped", action="store_true")
    parser.add_argument("--echo", action="store_true", help="answer each scan with a standstill")
    parser.add_argument("--dies-after", type=int, metavar="COMMANDS", help="without a farewell")
    arguments = parser.parse_args()
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(
            StandIn(stamped=arguments.stamped, echo=arguments.echo, dies_after=arguments.dies_after)
        )


if __name__ == "__main__":
    main()
