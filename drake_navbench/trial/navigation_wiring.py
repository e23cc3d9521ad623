"""The wiring of optional parts between a command and the wheels, by a robot or a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from pydrake.systems.framework import DiagramBuilder, LeafSystem, OutputPort

from drake_navbench.controller import Controller
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.description import NAVIGATE_THROUGH_POSES
from drake_navbench.navigation.monitor_sources import Mountings
from drake_navbench.navigation.planner import cost_of_pose, is_path_valid
from drake_navbench.navigation.poses_follower import PosesFollower
from drake_navbench.navigation.waypoint_follower import WaypointFollower
from drake_navbench.trial.floors import mission_follower, tick_period_s
from drake_navbench.trial.planning import path_smoother_of
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses
from drake_navbench.trial.systems.behavior_server import BehaviorServer
from drake_navbench.trial.systems.collision_monitor import CollisionMonitorSystem
from drake_navbench.trial.systems.controller_server import ControllerServer
from drake_navbench.trial.systems.costmap_system import CostmapSystem
from drake_navbench.trial.systems.global_costmap import GlobalCostmap
from drake_navbench.trial.systems.local_costmap import LocalCostmap
from drake_navbench.trial.systems.navigator import Navigator
from drake_navbench.trial.systems.running_stack import RunningStack, RunningStackSystem, StackTask
from drake_navbench.trial.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.systems.velocity_smoother import VelocitySmootherSystem
from drake_navbench.trial.timing import (
    BEHAVIOR_OFFSET_S,
    CONTROLLER_OFFSET_S,
    COSTMAP_OFFSET_S,
    MONITOR_OFFSET_S,
    NAVIGATOR_OFFSET_S,
    SMOOTHER_OFFSET_S,
)


@dataclass(frozen=True)
class Signals:
    """The output ports of the robot and its sensors, to which most systems connect.

    state: the true state in the world frame. estimate: the estimated state in the map frame.
    odometry, odometry_estimate: the true and the estimated state in the odometry frame.
    odometry_from_world: the pose of the world frame in the odometry frame. map_from_odometry: the
    pose of the odometry frame in the map frame. Where the odometry has no frame of its own, these
    two are None, and odometry and odometry_estimate are state and estimate. clouds: the point
    clouds of the depth sensors, None without such sensors. ranges: the readings of the range
    sensors, likewise.
    """

    state: OutputPort
    estimate: OutputPort
    scan: OutputPort
    odometry: OutputPort
    odometry_estimate: OutputPort
    odometry_from_world: OutputPort | None = None
    map_from_odometry: OutputPort | None = None
    clouds: OutputPort | None = None
    ranges: OutputPort | None = None

    @property
    def has_frames(self) -> bool:
        """Whether the odometry has a frame of its own."""
        return self.map_from_odometry is not None


def connect_inputs(builder: DiagramBuilder, system: LeafSystem, **inputs: OutputPort) -> None:
    """Connects the inputs of a system by name."""
    for name, port in inputs.items():
        builder.Connect(port, system.GetInputPort(name))


def connect_senses(builder: DiagramBuilder, signals: Signals, costmap: CostmapSystem) -> None:
    """Connects all of the robot's sensors to a costmap."""
    senses = {"scan": signals.scan, "clouds": signals.clouds, "ranges": signals.ranges}
    there = {name: port for name, port in senses.items() if port is not None}
    connect_inputs(builder, costmap, **there)


def connect_frame(builder: DiagramBuilder, signals: Signals, system: LeafSystem) -> None:
    """Connects the odometry frame's pose in the map frame to a system, where they differ."""
    if signals.map_from_odometry is not None:
        connect_inputs(builder, system, map_from_odometry=signals.map_from_odometry)


def connect_world(builder: DiagramBuilder, signals: Signals, system: LeafSystem) -> None:
    """Connects the pose of the world in the odometry frame to a system, where the two differ."""
    if signals.odometry_from_world is not None:
        connect_inputs(builder, system, odometry_from_world=signals.odometry_from_world)


def add_navigation(
    builder: DiagramBuilder,
    robot: Robot,
    task: FollowPlan | NavigateToPoses,
    signals: Signals,
    *,
    local_costmap: LocalCostmap,
    server: ControllerServer,
) -> tuple[Navigator | TreeNavigator, OutputPort]:
    """Adds the navigator of a task, with its planner and servers, around a controller server.

    Returns the navigator and the port of the command.
    """
    if isinstance(task, FollowPlan):
        navigator = builder.AddNamedSystem("navigator", Navigator(task.make_plan))
        state = server.GetOutputPort("server_state")
        connect_inputs(builder, navigator, estimate=signals.estimate, server_state=state)
        command = server.GetOutputPort("command")
    else:
        navigator, command = _add_tree_navigation(
            builder, robot, task, signals, local_costmap=local_costmap, server=server
        )
    connect_inputs(builder, server, plan=navigator.GetOutputPort("plan"))
    return navigator, command


def _add_tree_navigation(
    builder: DiagramBuilder,
    robot: Robot,
    task: NavigateToPoses,
    signals: Signals,
    *,
    local_costmap: LocalCostmap,
    server: ControllerServer,
) -> tuple[TreeNavigator, OutputPort]:
    """Adds the navigator, the global costmap and the behaviours around a controller server.

    Returns the navigator and the port of the command, the controller's or a behaviour's.
    """
    navigation = robot.navigation
    outline = robot.padded_outline
    global_costmap = _add_global_costmap(builder, robot, task, signals)
    navigator = builder.AddNamedSystem(
        "navigator",
        TreeNavigator(
            navigation.behavior_tree,
            _follower_of(task, navigation),
            Board(
                task.make_plan,
                partial(is_path_valid, footprint=outline, is_circle=robot.is_circle),
                path_smoother_of(robot),
                partial(cost_of_pose, footprint=outline),
                navigation.behavior_tree.nav2_release,
            ),
            period_s=tick_period_s(navigation),
            offset_s=NAVIGATOR_OFFSET_S,
        ),
    )
    behaviors = builder.AddNamedSystem(
        "behavior_server",
        BehaviorServer(
            navigation.behavior_server,
            footprint=outline,
            offset_s=BEHAVIOR_OFFSET_S,
        ),
    )
    connect_inputs(
        builder,
        navigator,
        estimate=signals.estimate,
        global_costmap=global_costmap.GetOutputPort("costmap"),
        server_state=server.GetOutputPort("server_state"),
        behavior_status=behaviors.GetOutputPort("status"),
    )
    connect_inputs(
        builder,
        behaviors,
        odometry_estimate=signals.odometry_estimate,
        costmap=local_costmap.GetOutputPort("costmap"),
        goal=navigator.GetOutputPort("behavior_goal"),
        controller_command=server.GetOutputPort("command"),
    )
    clear_local = navigator.GetOutputPort("clear_local")
    connect_inputs(builder, server, clear_request=clear_local)
    connect_inputs(builder, local_costmap, clear_request=clear_local)
    connect_inputs(builder, global_costmap, clear_request=navigator.GetOutputPort("clear_global"))
    return navigator, behaviors.GetOutputPort("command")


def _follower_of(task: NavigateToPoses, navigation: NavigationSettings) -> WaypointFollower:
    """Returns the order in which the goals of a task are driven to."""
    if task.floors is not None:
        return mission_follower(task.floors, navigation)
    if task.navigator == NAVIGATE_THROUGH_POSES:
        return PosesFollower(task.goals)
    return WaypointFollower(task.goals, navigation.waypoint_follower)


def _add_global_costmap(
    builder: DiagramBuilder, robot: Robot, task: NavigateToPoses, signals: Signals
) -> GlobalCostmap:
    """Adds the global costmap, but not the systems that clear it."""
    floors = task.floors
    costmap = builder.AddNamedSystem(
        "global_costmap",
        GlobalCostmap(
            task.global_layers,
            pose=task.start_pose,
            period_s=1.0 / robot.navigation.global_costmap.update_frequency,
            offset_s=COSTMAP_OFFSET_S,
            floors=() if floors is None else floors.layers,
            floor_clock=None if floors is None else floors.clock,
        ),
    )
    # White noise, if any, moves the robot in the global costmap only where it also moves the
    # frames.
    position = signals.estimate if signals.has_frames else signals.state
    connect_inputs(builder, costmap, state=position)
    connect_senses(builder, signals, costmap)
    connect_frame(builder, signals, costmap)
    return costmap


def add_command_chain(
    builder: DiagramBuilder, robot: Robot, signals: Signals, command: OutputPort
) -> OutputPort:
    """Adds the velocity smoother and the collision monitor, where the robot has them.

    Returns the port of the command for the wheels; `command_clock` returns the period
    and the offset of its changes.
    """
    navigation = robot.navigation
    period_s = 1.0 / navigation.controller_server.controller_frequency
    if navigation.velocity_smoother is not None:
        smoother = builder.AddNamedSystem(
            "velocity_smoother",
            VelocitySmootherSystem(navigation.velocity_smoother, offset_s=SMOOTHER_OFFSET_S),
        )
        connect_inputs(builder, smoother, command=command, estimate=signals.estimate)
        command = smoother.GetOutputPort("smoothed_command")
        period_s = navigation.velocity_smoother.period_s
    if navigation.collision_monitor is not None:
        monitor = builder.AddNamedSystem(
            "collision_monitor",
            CollisionMonitorSystem(
                navigation.collision_monitor,
                Mountings(
                    robot.lidar.pose,
                    {name: sensor.pose for name, sensor in robot.range_sensors.items()},
                ),
                footprint=robot.padded_outline,
                period_s=period_s,
                offset_s=MONITOR_OFFSET_S,
            ),
        )
        connect_inputs(builder, monitor, command=command, scan=signals.scan)
        connect_inputs(builder, monitor, state=signals.odometry)
        if signals.ranges is not None:
            connect_inputs(builder, monitor, ranges=signals.ranges)
        command = monitor.GetOutputPort("safe_command")
    return command


def command_clock(robot: Robot) -> tuple[float, float]:
    """Returns the period and the offset, s, of the last stage that a command goes through."""
    navigation = robot.navigation
    period_s = 1.0 / navigation.controller_server.controller_frequency
    offset_s = CONTROLLER_OFFSET_S
    if navigation.velocity_smoother is not None:
        period_s = navigation.velocity_smoother.period_s
        offset_s = SMOOTHER_OFFSET_S
    if navigation.collision_monitor is not None:
        offset_s = MONITOR_OFFSET_S
    return period_s, offset_s


def add_running_stack(
    builder: DiagramBuilder,
    stack: Controller | RunningStack,
    task: FollowPlan | NavigateToPoses | StackTask,
    signals: Signals,
) -> RunningStackSystem:
    """Adds the system that tells a running stack what the robot senses and obeys its commands."""
    if not (isinstance(stack, RunningStack) and isinstance(task, StackTask)):
        raise TypeError("a running stack and its task belong together")
    system = builder.AddNamedSystem("running_stack", RunningStackSystem(stack, task))
    connect_inputs(
        builder, system, state=signals.state, estimate=signals.estimate, scan=signals.scan
    )
    if signals.map_from_odometry is not None:
        connect_inputs(
            builder,
            system,
            odometry_estimate=signals.odometry_estimate,
            map_from_odometry=signals.map_from_odometry,
        )
    if signals.clouds is not None:
        connect_inputs(builder, system, clouds=signals.clouds)
    return system
