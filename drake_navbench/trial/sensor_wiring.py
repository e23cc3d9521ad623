"""The wiring of the world's moving bodies, and of the sensors that see them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_navbench.inputs.robot import Robot
from drake_navbench.trial.floors import TrialFloors
from drake_navbench.trial.localization_wiring import LocalizationSystem
from drake_navbench.trial.navigation_wiring import Signals, connect_inputs
from drake_navbench.trial.systems.depth_sensors import DepthSensors
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.moving_world import MovingWorld
from drake_navbench.trial.systems.range_sensors import RangeSensors
from drake_navbench.trial.wiring import Wiring


def add_moving_world(wiring: Wiring, state: OutputPort) -> MovingWorld | None:
    """Adds the world's moving bodies, if there are any, and shows them in SceneGraph."""
    builder, scene_graph, robot, world = wiring[:4]
    if not world.moving_count:
        return None
    moving = builder.AddNamedSystem(
        "moving_world",
        MovingWorld(
            world, scene_graph, footprint=robot.outline, scan_height_m=robot.lidar.height_m
        ),
    )
    connect_inputs(builder, moving, state=state)
    builder.Connect(
        moving.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(moving.source_id)
    )
    return moving


def add_sensors(
    wiring: Wiring,
    state: OutputPort,
    localization: LocalizationSystem,
    moving_world: MovingWorld | None,
) -> tuple[Lidar, RangeSensors | None, Signals]:
    """Adds the sensors, and connects the scans to the localization.

    Returns the lidar, the range sensors, and the output ports of the robot and all its sensors.
    """
    builder, _, robot, world, conditions, floors = wiring
    lidar = builder.AddNamedSystem(
        "lidar", Lidar(conditions.lidar, world, conditions.timing, **_on_floors(floors))
    )
    scan = lidar.GetOutputPort("scan")
    signals = localization.signals(state, scan)
    localization.connect_scan(builder, scan)
    connect_inputs(builder, lidar, state=state)
    if signals.has_frames:
        connect_inputs(builder, lidar, odometry=signals.odometry)
    if moving_world is not None:
        connect_inputs(builder, lidar, moving=moving_world.GetOutputPort("scanned"))
    clouds = ranges = range_sensors = None
    if robot.depth_sensors:
        depth_sensors = builder.AddNamedSystem(
            "depth_sensors", DepthSensors(robot.depth_sensors, world, **_on_floors(floors))
        )
        _connect(builder, depth_sensors, signals, moving_world)
        clouds = depth_sensors.GetOutputPort("clouds")
    if robot.range_sensors:
        range_sensors = builder.AddNamedSystem(
            "range_sensors",
            RangeSensors(
                robot.range_sensors, world, keep_s=_longest_cycle_s(robot), **_on_floors(floors)
            ),
        )
        _connect(builder, range_sensors, signals, moving_world)
        ranges = range_sensors.GetOutputPort("ranges")
    return lidar, range_sensors, replace(signals, clouds=clouds, ranges=ranges)


def _on_floors(floors: TrialFloors | None) -> dict[str, Any]:
    """Returns a sensor's arguments for several floors; none where there is one."""
    return {} if floors is None else {"floors": floors.sights, "floor_clock": floors.clock}


def _longest_cycle_s(robot: Robot) -> float:
    """Returns the time between two updates of the slower costmap, s."""
    navigation = robot.navigation
    costmaps = navigation.local_costmap, navigation.global_costmap
    return max(1.0 / costmap.update_frequency for costmap in costmaps)


def _connect(
    builder: DiagramBuilder,
    sensors: DepthSensors | RangeSensors,
    signals: Signals,
    moving_world: MovingWorld | None,
) -> None:
    """Connects sensors that see shapes with their heights."""
    connect_inputs(builder, sensors, state=signals.state)
    if signals.has_frames:
        connect_inputs(builder, sensors, odometry=signals.odometry)
    if moving_world is not None:
        connect_inputs(builder, sensors, moving=moving_world.GetOutputPort("solids"))
