"""The messages that come from a running stack: commands, plans, and the state of its goals."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.plans import Plan
from drake_navbench.ros2.live.domain import LATCHED, LiveDomain, Subscription
from drake_navbench.ros2.live.endpoints import (
    BEST_EFFORT,
    RELIABLE,
    Endpoint,
    OwnTopic,
    Quality,
    listeners_of,
    publishers_of,
)
from drake_navbench.ros2.live.goal_watch import GoalEntry, GoalState, GoalWatch
from drake_navbench.ros2.live.parameters import LiveParameters
from drake_navbench.ros2.live.wire_types import WireMessage, type_hash
from drake_navbench.ros2.recordings import topics

TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
STATUS_TYPE = topics.NAVIGATE_STATUS.type


class StackTopics:
    """The subscriptions to a running stack.

    goals: the course of the goal. plans: the received plans, the newest last. command_count:
    commands so far. command_type: type of the last command, Twist or TwistStamped; '' before the
    first.
    """

    def __init__(self, domain: LiveDomain, parameters: LiveParameters) -> None:
        self._domain = domain
        self._command_topic = parameters.topic("cmd_vel")
        self._status_topic = parameters.topic("goal_status")
        self._plan_topic = parameters.topic("plan")
        self._goal_topic = parameters.topic("goal_pose")
        self._tf_topic, self._odom_frame = parameters.topic("tf"), parameters.odom_frame
        self._status = domain.subscription(self._status_topic, STATUS_TYPE, LATCHED)
        self._plan = domain.subscription(self._plan_topic, topics.PLAN.type)
        self._commands: dict[str, Subscription] = {}
        self._qualities: dict[str, Quality] = {}
        self._transforms: Subscription | None = None
        self._has_localized = False
        self.command_type = ""
        self.command_count = 0
        self.goals = GoalWatch()
        self.plans: list[Plan] = []

    @property
    def own(self) -> tuple[OwnTopic, ...]:
        """All topics that it listens to, as the stack must publish them."""
        commands = (TWIST, TWIST_STAMPED)
        hashes = tuple(map(type_hash, commands))
        return (
            OwnTopic(self._command_topic, commands, False, Quality(BEST_EFFORT), hashes),
            OwnTopic(self._status_topic, (STATUS_TYPE,), False, LATCHED, (type_hash(STATUS_TYPE),)),
        )

    def missing(self, endpoints: Sequence[Endpoint]) -> list[str]:
        """Returns a sentence for each endpoint of a stack that is missing in the domain."""
        found = []
        if not listeners_of(endpoints, self._goal_topic):
            found.append(f"nobody listens to {self._goal_topic}")
        for topic in (self._status_topic, self._command_topic):
            if not publishers_of(endpoints, topic):
                found.append(f"nobody publishes {topic}")
        return found

    def follow(self, endpoints: Sequence[Endpoint]) -> None:
        """Listens to the commands with the stack's types and qualities of service."""
        publishers = publishers_of(endpoints, self._command_topic)
        for kind in (TWIST, TWIST_STAMPED):
            offered = {one.quality.reliability for one in publishers if one.type == kind}
            # A subscription that asks for best effort only matches every publisher.
            quality = Quality(BEST_EFFORT if BEST_EFFORT in offered else RELIABLE)
            if offered and self._qualities.get(kind) != quality:
                subscription = self._domain.subscription(self._command_topic, kind, quality)
                subscription.wait_with(self._status)
                for other in self._commands.values():
                    other.wait_with(subscription)
                    subscription.wait_with(other)
                self._commands[kind], self._qualities[kind] = subscription, quality

    def newest_command(self, patience_s: float) -> Array | None:
        """Returns the newest command, v m/s, w rad/s, vy m/s; None where none has come.

        patience_s: wall-clock time to wait for a command; a stack whose goal has ended sends none
        and is not waited for. A command that is not finite is ignored.
        """
        deadline = time.monotonic() + patience_s
        received = self._taken()
        waited_on = next(iter(self._commands.values()), None)
        while not received and waited_on is not None and not self.goals.has_ended:
            left_s = deadline - time.monotonic()
            if left_s <= 0.0:
                break
            waited_on.wait(left_s)
            self._read_states()
            received = self._taken()
        for one in reversed(received):
            with suppress(ValueError):
                twist = one.decoded()
                self.command_type = one.type_name
                twist = twist.twist if one.type_name == TWIST_STAMPED else twist
                command = np.array([twist.linear.x, twist.angular.z, twist.linear.y])
                if np.isfinite(command).all():
                    self.command_count += len(received)
                    return command
        return None

    def has_localized(self) -> bool:
        """Returns whether the stack has sent the transform from map to odometry.

        Only for a stack that localizes: the benchmark does not send that transform then.
        """
        if self._transforms is None:
            topic, kind = self._tf_topic, topics.TF.type
            self._transforms = self._domain.subscription(topic, kind, hears_own=False)
        for received in self._transforms.take():
            with suppress(ValueError):
                for one in received.decoded().transforms:
                    self._has_localized |= one.child_frame_id == self._odom_frame
        return self._has_localized

    def forget_localization(self) -> None:
        """Forgets the received transform from map to odometry, as the stack was started anew."""
        self._has_localized = False

    def _taken(self) -> list[WireMessage]:
        """Returns the commands that have come since the last call, of any type."""
        return [one for subscription in self._commands.values() for one in subscription.take()]

    def read(self, time_s: float, leg: int) -> None:
        """Reads the plans and the states of the goals that have come.

        time_s: time of the simulation. leg: the number of the goal that the plans lead to.
        """
        self._read_states()
        for received in self._plan.take()[-1:]:
            with suppress(ValueError):
                poses = np.array([_planar(one.pose) for one in received.decoded().poses])
                if len(poses) > 1 and np.isfinite(poses).all():
                    poses.flags.writeable = False
                    self.plans.append(Plan(time_s, poses, leg))

    def _read_states(self) -> None:
        for received in self._status.take():
            with suppress(ValueError):
                self.goals.note(map(_entry, received.decoded().status_list))


def _entry(status: Any) -> GoalEntry:
    accepted = status.goal_info.stamp
    known = {state.value for state in GoalState}
    return GoalEntry(
        bytes(status.goal_info.goal_id.uuid),
        GoalState(status.status if status.status in known else 0),
        accepted.sec * 1_000_000_000 + accepted.nanosec,
    )


def _planar(pose: Any) -> tuple[float, float, float]:
    """Returns x m, y m and yaw rad of a geometry_msgs/Pose."""
    q = pose.orientation
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return pose.position.x, pose.position.y, yaw
