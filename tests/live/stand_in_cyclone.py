"""The stand-in stack over Cyclone DDS: `python stand_in_cyclone.py DOMAIN [--stamped]`."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import uuid
from contextlib import suppress
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from stand_in_brain import Brain

from drake_navbench.ros2.live.domain import LATCHED, LiveDomain
from drake_navbench.ros2.live.stack_topics import TWIST, TWIST_STAMPED, _planar
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker


class CycloneStack:
    """The topics of the stand-in."""

    def __init__(self, domain: LiveDomain, *, stamped: bool, echo: bool) -> None:
        self._echo, self._domain = echo, domain
        self._pose, self._poses_told = None, 0
        self.command_count = 0
        self._make = MessageMaker()
        self._brain = Brain()
        self._stamped = stamped
        self._clock = domain.subscription("/clock", topics.CLOCK.type)
        self._odometry = domain.subscription("/odom", topics.ODOMETRY.type)
        self._scan = domain.subscription("/scan", topics.SCAN.type)
        self._map = domain.subscription("/map", topics.MAP.type, LATCHED)
        self._goal = domain.subscription("/goal_pose", topics.GOAL.type)
        self._command = domain.publisher("/cmd_vel", TWIST_STAMPED if stamped else TWIST)
        self._plan = domain.publisher("/plan", topics.PLAN.type)
        self._status = domain.publisher(
            topics.NAVIGATE_STATUS.name, topics.NAVIGATE_STATUS.type, LATCHED
        )
        self._goals: list[tuple[bytes, int, int]] = []

    def localize(self) -> None:
        """Takes on the transform from map to odometry, from when it is told a pose."""
        self._pose = self._domain.subscription("/initialpose", topics.ESTIMATE.type)
        self._transforms = self._domain.publisher("/tf", topics.TF.type)

    def _send_transform(self, stamp_ns: int) -> None:
        """Sends that transform; the pose told first is forgotten, as by an inactive AMCL."""
        self._poses_told += len(self._pose.take())
        if self._poses_told > 1:
            transform = self._make.transform(stamp_ns, "map", "odom", (0.0, 0.0, 0.0))
            self._transforms.send(self._make.make(topics.TF.type, transforms=[transform]))

    def spin_once(self) -> None:
        """Waits for the next clock and works."""
        (self._scan if self._echo else self._clock).wait(0.5)
        for message in self._map.take():
            grid = message.decoded()
            data = np.asarray(grid.data).reshape(grid.info.height, grid.info.width)
            origin = grid.info.origin.position
            self._brain.take_map(data, (origin.x, origin.y), grid.info.resolution)
        for message in self._odometry.take()[-1:]:
            self._brain.pose = _planar(message.decoded().pose.pose)
        scans = self._scan.take()
        if self._echo and scans and scans[-1].decoded().ranges is not None:
            self._command.send(self._make.twist(0.0, 0.0))
        ticks = self._clock.take()
        for message in self._goal.take():
            stamp_ns = nanoseconds(ticks[-1].decoded().clock) if ticks else 0
            self._take_goal(message.decoded(), stamp_ns)
        for message in ticks[-1:]:
            self._work(nanoseconds(message.decoded().clock))

    def _take_goal(self, message, stamp_ns: int) -> None:
        self._goals = [(one, 6 if state == 2 else state, ns) for one, state, ns in self._goals]
        self._brain.take_goal(_planar(message.pose))
        self._goals = [*self._goals[-5:], (uuid.uuid4().bytes, 2, stamp_ns)]
        self._tell()
        if self._brain.path is not None:
            poses = np.column_stack([self._brain.path, np.zeros(len(self._brain.path))])
            self._plan.send(self._make.path(stamp_ns, "map", poses))

    def _work(self, stamp_ns: int) -> None:
        if self._pose is not None:
            self._send_transform(stamp_ns)
        if self._pose is not None and self._poses_told < 2:
            return
        command = self._brain.tick(stamp_ns / 1e9)
        if command is not None and not self._echo:
            self.command_count += 1
            if self._stamped:
                self._command.send(self._make.twist_stamped(stamp_ns, "base_link", *command))
            else:
                self._command.send(self._make.twist(*command))
        if self._goals and self._goals[-1][1] == 2 and self._brain.state != 2:
            goal_id, _, accepted_ns = self._goals[-1]
            self._goals[-1] = goal_id, self._brain.state, accepted_ns
            self._tell()

    def _tell(self) -> None:
        """Sends the states of all goals, as an action server does."""
        entries = [
            self._make.goal_status(ns, goal_id, state).status_list[0]
            for goal_id, state, ns in self._goals
        ]
        message = self._make.make(topics.NAVIGATE_STATUS.type, status_list=entries)
        self._status.send(message)


def nanoseconds(stamp) -> int:
    """Returns a builtin_interfaces/Time as nanoseconds."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("domain", type=int)
    parser.add_argument("--stamped", action="store_true")
    parser.add_argument("--quits-after", type=int, metavar="COMMANDS")
    parser.add_argument("--dies-after", type=int, metavar="COMMANDS", help="without a farewell")
    parser.add_argument("--localizes", action="store_true", help="as AMCL does")
    parser.add_argument("--echo", action="store_true", help="answer each scan with a standstill")
    arguments = parser.parse_args()
    stack = CycloneStack(
        LiveDomain(arguments.domain), stamped=arguments.stamped, echo=arguments.echo
    )
    if arguments.localizes:
        stack.localize()
    with suppress(KeyboardInterrupt):
        while arguments.quits_after is None or stack.command_count < arguments.quits_after:
            stack.spin_once()
            if stack.command_count == arguments.dies_after:
                os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    main()
