"""The wiring of what moves in the world, and of the sensors that see it."""

from __future__ import annotations

from dataclasses import replace

from pydrake.geometry import SceneGraph
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_navbench.inputs.faults import Conditions
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.world import World
from drake_navbench.systems.depth_sensors import DepthSensors
from drake_navbench.systems.lidar import Lidar
from drake_navbench.systems.moving_world import MovingWorld
from drake_navbench.trial.floors import TrialFloors
from drake_navbench.trial.localization_wiring import LocalizationSystem
from drake_navbench.trial.navigation_wiring import Signals, connect_inputs


def add_moving_world(
    builder: DiagramBuilder,
    robot: Robot,
    world: World,
    scene_graph: SceneGraph,
    state: OutputPort,
) -> MovingWorld | None:
    """Adds what moves in the world, if anything does, and shows it in SceneGraph."""
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
    builder: DiagramBuilder,
    robot: Robot,
    world: World,
    *,
    conditions: Conditions,
    state: OutputPort,
    localization: LocalizationSystem,
    moving_world: MovingWorld | None,
    floors: TrialFloors | None,
) -> tuple[Lidar, Signals]:
    """Adds the lidar and the depth sensors, and lets the localization have the scans.

    Returns the lidar, and the ports of the robot and all its senses.
    """
    lidar = builder.AddNamedSystem(
        "lidar",
        Lidar(
            conditions.lidar,
            world,
            conditions.timing,
            floors=() if floors is None else floors.sights,
            floor_clock=None if floors is None else floors.clock,
        ),
    )
    scan = lidar.GetOutputPort("scan")
    signals = localization.signals(state, scan)
    localization.connect_scan(builder, scan)
    connect_inputs(builder, lidar, state=state)
    if signals.has_frames:
        connect_inputs(builder, lidar, odometry=signals.odometry)
    if moving_world is not None:
        connect_inputs(builder, lidar, moving=moving_world.GetOutputPort("scanned"))
    clouds = _add_depth_sensors(builder, robot, world, moving_world, signals, floors)
    return lidar, replace(signals, clouds=clouds)


def _add_depth_sensors(
    builder: DiagramBuilder,
    robot: Robot,
    world: World,
    moving_world: MovingWorld | None,
    signals: Signals,
    floors: TrialFloors | None,
) -> OutputPort | None:
    """Adds the sensors that send points, and returns the port of their clouds, if there are any."""
    if not robot.depth_sensors:
        return None
    sensors = builder.AddNamedSystem(
        "depth_sensors",
        DepthSensors(
            robot.depth_sensors,
            world,
            floors=() if floors is None else floors.sights,
            floor_clock=None if floors is None else floors.clock,
        ),
    )
    connect_inputs(builder, sensors, state=signals.state)
    if signals.has_frames:
        connect_inputs(builder, sensors, odometry=signals.odometry)
    if moving_world is not None:
        connect_inputs(builder, sensors, moving=moving_world.GetOutputPort("solids"))
    return sensors.GetOutputPort("clouds")
