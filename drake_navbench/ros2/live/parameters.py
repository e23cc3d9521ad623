"""The parameters of the column `live`."""

from __future__ import annotations

import re
from typing import Literal

from pydantic import Field, field_validator

from drake_navbench.controller import ControllerParameters

# The largest domain: DDS computes ports from its number, and higher numbers have none.
MAX_DOMAIN = 232
# The topics that may be renamed, by the names under which docs/live.md lists them.
TOPIC_NAMES: dict[str, str] = {
    "clock": "/clock",
    "tf": "/tf",
    "tf_static": "/tf_static",
    "scan": "/scan",
    "odom": "/odom",
    "map": "/map",
    "initialpose": "/initialpose",
    "robot_description": "/robot_description",
    "goal_pose": "/goal_pose",
    "cmd_vel": "/cmd_vel",
    "plan": "/plan",
    "goal_status": "/navigate_to_pose/_action/status",
}
# The topics that all robots of a system share.
GLOBAL_TOPICS = ("clock",)
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


class LiveParameters(ControllerParameters):
    """The domain of a running stack, the names of its topics and frames, and the pace."""

    domain: int = Field(0, ge=0, le=MAX_DOMAIN, description="DDS domain, as ROS_DOMAIN_ID.")
    peers: tuple[str, ...] = Field(
        (),
        description="Addresses of other machines to speak to. Without any, nothing leaves this "
        "machine.",
    )
    namespace: str = Field(
        "", description="Namespace of the robot, such as /robot1, before all topics but /clock."
    )
    topics: dict[str, str] = Field(
        default_factory=dict,
        description="Other names of topics, by the last part of the usual ones, as scan: /front. "
        "Depth sensors go by their names in the robot file.",
    )
    map_frame: str = Field("map", min_length=1, description="Name of the map frame.")
    odom_frame: str = Field("odom", min_length=1, description="Name of the odometry frame.")
    base_frame: str = Field("base_link", min_length=1, description="Name of the robot's frame.")
    scan_frame: str = Field("base_scan", min_length=1, description="Name of the scanner's frame.")
    rate: float | Literal["max"] = Field(
        1.0,
        description="Simulated seconds a second; max: as fast as the stack sends its commands.",
    )
    clock_period_s: float = Field(
        0.01, ge=0.001, le=0.1, description="Time between two messages of /clock [s]."
    )
    odom_period_s: float = Field(
        0.02, ge=0.001, le=1.0, description="Time between two messages of /odom and /tf [s]."
    )
    command_period_s: float = Field(
        0.05, gt=0.0, le=1.0, description="Time between two commands of the stack [s]."
    )
    patience_s: float = Field(
        0.2,
        gt=0.0,
        le=10.0,
        description="Wall-clock time that the clock waits for a command at rate max [s].",
    )
    command_timeout_s: float = Field(
        1.0, ge=0.0, description="Age of a command at which the base stops by itself [s]; 0: never."
    )
    localization: Literal["auto", "benchmark", "stack"] = Field(
        "auto",
        description="Who sends the transform from map to odometry. auto: the stack where it "
        "listens to /initialpose.",
    )
    sends_goal: bool = Field(
        True, description="Send the scenario's goal; false: whoever likes sends goals."
    )
    allows_listeners: bool = Field(
        False,
        description="Drive although others listen to /cmd_vel, such as a recorder. Only where none "
        "of them is a robot: it would drive, too.",
    )
    start_timeout_s: float = Field(
        60.0, gt=0.0, description="Wall-clock time for the stack to take the goal [s]."
    )
    settle_s: float = Field(
        1.0,
        ge=0.0,
        description="Time for which the stack sees the robot stand at the start before the goal "
        "is sent [s].",
    )
    restart_timeout_s: float = Field(
        20.0,
        gt=0.0,
        description="Wall-clock time for a stack that went away in a trial to come back [s].",
    )

    @field_validator("rate")
    @classmethod
    def _check_rate(cls, rate: float | str) -> float | str:
        if isinstance(rate, float) and not 0.01 <= rate <= 1000.0:
            raise ValueError(f"expected max or 0.01 to 1000, got {rate:g}")
        return rate

    @field_validator("namespace")
    @classmethod
    def _check_namespace(cls, namespace: str) -> str:
        if namespace and not _NAME.fullmatch(namespace):
            raise ValueError(f"expected a name such as /robot1, got {namespace!r}")
        return namespace

    @field_validator("topics")
    @classmethod
    def _check_topics(cls, topics: dict[str, str]) -> dict[str, str]:
        for name, topic in topics.items():
            if not _NAME.fullmatch(topic):
                raise ValueError(f"{name}: expected a topic such as /front/scan, got {topic!r}")
        return topics

    def topic(self, name: str) -> str:
        """Returns the topic for a name of TOPIC_NAMES, or for a sensor's name."""
        if name in self.topics:
            return self.topics[name]
        usual = TOPIC_NAMES.get(name, f"/{name}")
        return usual if name in GLOBAL_TOPICS else self.namespace + usual
