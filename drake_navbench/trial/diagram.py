"""The wiring of one trial, one paragraph a system.

`make docs` writes the picture of it, as Drake draws it, to docs/.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort

from drake_navbench.controller import Controller
from drake_navbench.costmaps.costmap_settings import FilterName
from drake_navbench.costmaps.filter_masks import FilterMask
from drake_navbench.costmaps.map_file import OccupancyMap
from drake_navbench.inputs.faults import Conditions, conditions_of
from drake_navbench.inputs.robot import NavigationSettings, Robot
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import register_obstacles
from drake_navbench.moment import Moment
from drake_navbench.navigation.checker_settings import make_goal_checker, make_progress_checker
from drake_navbench.navigation.path_handler import PathHandler
from drake_navbench.systems.actuators import SlippingWheels
from drake_navbench.systems.binary_filter import BinaryFilter
from drake_navbench.systems.clearance import Clearance
from drake_navbench.systems.compute_clock import ComputeTimes
from drake_navbench.systems.controller_server import ControllerServer
from drake_navbench.systems.delays import CommandLink
from drake_navbench.systems.depth_sensors import DepthSensors
from drake_navbench.systems.floor_aware import FloorClock
from drake_navbench.systems.floor_transport import FloorTransport
from drake_navbench.systems.lidar import Lidar
from drake_navbench.systems.local_costmap import LocalCostmap
from drake_navbench.systems.moving_world import MovingWorld
from drake_navbench.systems.navigator import Navigator
from drake_navbench.systems.recorder import Recorder
from drake_navbench.systems.speed_filter import SpeedFilter
from drake_navbench.systems.tree_navigator import TreeNavigator
from drake_navbench.systems.viewer import Viewer
from drake_navbench.trial.base_wiring import add_base
from drake_navbench.trial.floors import TrialFloors, connect_floors
from drake_navbench.trial.localization_wiring import LocalizationSystem, add_localization
from drake_navbench.trial.navigation_wiring import (
    Signals,
    add_command_chain,
    add_navigation,
    connect_frame,
    connect_inputs,
    connect_world,
)
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S, COSTMAP_OFFSET_S
from drake_navbench.trial.wheel_wiring import add_way_to_wheels

if TYPE_CHECKING:
    from drake_navbench.trial.base_wiring import Base

CLEARANCE_PERIOD_S = 0.05
CLEARANCE_OFFSET_S = CONTROLLER_OFFSET_S
RECORDER_PERIOD_S = 0.02


@dataclass(frozen=True)
class TrialDiagram:
    """A built diagram, and the systems in it that a trial or a test talks to."""

    diagram: Diagram
    base: Base
    lidar: Lidar
    localization: LocalizationSystem
    local_costmap: LocalCostmap
    navigator: Navigator | TreeNavigator
    controller_server: ControllerServer
    clearance: Clearance
    recorder: Recorder
    moving_world: MovingWorld | None = None
    speed_filter: SpeedFilter | None = None
    binary_filter: BinaryFilter | None = None
    to_wheels: tuple[CommandLink | SlippingWheels, ...] = ()
    transport: FloorTransport | None = None

    @property
    def state_system(self) -> Base | FloorTransport:
        """What tells the true state in the world: the base, or what carries it between floors."""
        return self.base if self.transport is None else self.transport

    @property
    def state_port(self) -> OutputPort:
        """The port of the true state of `state_system`."""
        return _state_of(self.base, self.transport)

    def create_context(self, start_pose: NDArray[np.float64], seed: int) -> Context:
        """Returns a context with the robot at rest at (3,) x m, y m, yaw rad, and the seed set."""
        context = self.diagram.CreateDefaultContext()
        self.base.set_pose(self.base.GetMyMutableContextFromRoot(context), start_pose)
        self.localization.set_start(context, start_pose, seed)
        for system in (self.lidar, self.controller_server, *self.to_wheels):
            own = system.GetMyMutableContextFromRoot(context)
            own.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
        if self.moving_world is not None:
            moving_context = self.moving_world.GetMyMutableContextFromRoot(context)
            self.moving_world.set_seed(moving_context, seed, start_pose)
        return context


def build_trial_diagram(
    robot: Robot,
    world: World,
    controller: Controller,
    *,
    task: FollowPlan | NavigateToPoses,
    static_map: OccupancyMap | None = None,
    known_map: OccupancyMap | None = None,
    filter_masks: Sequence[FilterMask] = (),
    conditions: Conditions | None = None,
    compute_times_ms: ComputeTimes | None = None,
    watch: Callable[[Moment], None] | None = None,
    keeps_costmaps: bool = True,
) -> TrialDiagram:
    """Wires one trial.

    task: what the robot is to do, and so which navigator there is.
    static_map, filter_masks: what the layers and filters of the local costmap know beforehand.
    known_map: what AMCL knows; it needs one.
    conditions: what holds for the robot's parts at which time; as in its file where not given.
    compute_times_ms: of all cycles, in place of those that are measured.
    watch: is called with what is to be seen whenever the recorder samples.
    keeps_costmaps: whether the recorder keeps the local costmaps.
    """
    builder = DiagramBuilder()

    scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
    register_obstacles(scene_graph, world)

    floors = NavigateToPoses.floors_of(task)
    clock = None if floors is None else floors.clock
    transport = None
    if clock is not None:
        transport = builder.AddNamedSystem("transport", FloorTransport(clock))
    base = add_base(builder, robot, scene_graph, transport)
    state = _state_of(base, transport)

    conditions = conditions or conditions_of(robot)
    localization = add_localization(builder, robot, conditions, state, known_map, floors)
    moving_world = _add_moving_world(builder, robot, world, scene_graph, state)

    sights = () if floors is None else floors.sights
    lidar = builder.AddNamedSystem(
        "lidar",
        Lidar(conditions.lidar, world, conditions.timing, floors=sights, floor_clock=clock),
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
    signals = replace(signals, clouds=clouds)

    local_costmap = _add_local_costmap(builder, robot, static_map, filter_masks, floors)
    connect_inputs(builder, local_costmap, state=signals.odometry, scan=scan)
    connect_frame(builder, signals, local_costmap)
    if signals.clouds is not None:
        connect_inputs(builder, local_costmap, clouds=signals.clouds)
    costmap = local_costmap.GetOutputPort("costmap")

    server = _add_controller_server(builder, robot, controller, conditions.timing, compute_times_ms)
    connect_inputs(builder, server, estimate=signals.odometry_estimate, costmap=costmap)
    connect_frame(builder, signals, server)

    navigator, command = add_navigation(
        builder, robot, task, signals, local_costmap=local_costmap, server=server
    )
    command = add_command_chain(builder, robot, signals, command)
    to_wheels, seeded = add_way_to_wheels(builder, robot, conditions, command, state)
    builder.Connect(to_wheels, base.get_command_input_port())
    for system in seeded:
        if isinstance(system, SlippingWheels):
            localization.connect_wheels(builder, system.GetOutputPort("gains"))

    speed_filter, binary_filter = _add_filters(
        builder, robot.navigation, filter_masks, signals.estimate, floors
    )
    if speed_filter is not None:
        connect_inputs(builder, server, speed_limit=speed_filter.GetOutputPort("speed_limit"))

    clearance = _add_clearance(builder, robot, world, moving_world, signals, clock)
    connect_inputs(builder, clearance, costmap=costmap)

    recorder = _add_recorder(builder, navigator, moving_world, signals)
    connect_inputs(builder, recorder, command=command)
    connect_inputs(builder, recorder, distances=clearance.GetOutputPort("distances"))
    connect_inputs(builder, recorder, server_state=server.GetOutputPort("server_state"))
    if keeps_costmaps:
        connect_inputs(builder, recorder, costmap=costmap)

    if watch is not None:
        viewer = _add_viewer(builder, watch, navigator, moving_world, signals)
        connect_inputs(builder, viewer, costmap=costmap)
        connect_inputs(builder, viewer, server_state=server.GetOutputPort("server_state"))

    if isinstance(navigator, TreeNavigator) and floors is not None:
        connect_floors(builder, navigator, builder.GetSystems())

    diagram = builder.Build()
    diagram.set_name("trial")
    return TrialDiagram(
        diagram=diagram,
        base=base,
        lidar=lidar,
        localization=localization,
        local_costmap=local_costmap,
        navigator=navigator,
        controller_server=server,
        clearance=clearance,
        recorder=recorder,
        moving_world=moving_world,
        speed_filter=speed_filter,
        binary_filter=binary_filter,
        to_wheels=seeded,
        transport=transport,
    )


def _state_of(base: Base, transport: FloorTransport | None) -> OutputPort:
    """Returns the port of the true state in the world."""
    if transport is None:
        return base.get_state_output_port()
    return transport.GetOutputPort("state")


def _add_moving_world(
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


def _add_local_costmap(
    builder: DiagramBuilder,
    robot: Robot,
    static_map: OccupancyMap | None,
    filter_masks: Sequence[FilterMask],
    floors: TrialFloors | None,
) -> LocalCostmap:
    """Adds the local costmap."""
    return builder.AddNamedSystem(
        "local_costmap",
        LocalCostmap(
            robot.navigation.local_costmap,
            robot.lidar,
            footprint=robot.padded_outline,
            offset_s=COSTMAP_OFFSET_S,
            static_map=static_map,
            masks=filter_masks,
            floors=(
                () if floors is None else tuple(zip(floors.static_maps, floors.masks, strict=True))
            ),
            floor_clock=None if floors is None else floors.clock,
        ),
    )


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


def _add_clearance(
    builder: DiagramBuilder,
    robot: Robot,
    world: World,
    moving_world: MovingWorld | None,
    signals: Signals,
    floor_clock: FloorClock | None,
) -> Clearance:
    """Adds what measures the distance to the obstacles."""
    clearance = builder.AddNamedSystem(
        "clearance",
        Clearance(
            world,
            footprint=robot.outline,
            period_s=CLEARANCE_PERIOD_S,
            offset_s=CLEARANCE_OFFSET_S,
            floor_clock=floor_clock,
        ),
    )
    connect_inputs(builder, clearance, state=signals.state)
    connect_world(builder, signals, clearance)
    if moving_world is not None:
        connect_inputs(builder, clearance, moving=moving_world.GetOutputPort("outlines"))
    return clearance


def _add_recorder(
    builder: DiagramBuilder,
    navigator: Navigator | TreeNavigator,
    moving_world: MovingWorld | None,
    signals: Signals,
) -> Recorder:
    """Adds the recorder, which listens to a behaviour tree and to people where there are any."""
    person_count = 0 if moving_world is None else moving_world.person_count
    recorder = builder.AddNamedSystem(
        "recorder", Recorder(period_s=RECORDER_PERIOD_S, person_count=person_count)
    )
    connect_inputs(
        builder, recorder, state=signals.state, scan=signals.scan, estimate=signals.estimate
    )
    connect_world(builder, signals, recorder)
    if isinstance(navigator, TreeNavigator):
        navigator_state = navigator.GetOutputPort("navigator_state")
        connect_inputs(builder, recorder, navigator_state=navigator_state)
    if moving_world is not None and person_count:
        connect_inputs(builder, recorder, people=moving_world.GetOutputPort("people"))
    return recorder


def _add_viewer(
    builder: DiagramBuilder,
    watch: Callable[[Moment], None],
    navigator: Navigator | TreeNavigator,
    moving_world: MovingWorld | None,
    signals: Signals,
) -> Viewer:
    """Adds what hands each sample to `watch`."""
    moving_count = 0 if moving_world is None else moving_world.body_count
    viewer = builder.AddNamedSystem(
        "viewer", Viewer(watch, period_s=RECORDER_PERIOD_S, moving_count=moving_count)
    )
    connect_inputs(
        builder,
        viewer,
        state=signals.state,
        scan=signals.scan,
        plan=navigator.GetOutputPort("plan"),
    )
    connect_world(builder, signals, viewer)
    if moving_world is not None:
        connect_inputs(builder, viewer, moving_poses=moving_world.GetOutputPort("poses"))
    return viewer


def _add_controller_server(
    builder: DiagramBuilder,
    robot: Robot,
    controller: Controller,
    timing: Timeline[TimingSettings],
    compute_times_ms: ComputeTimes | None,
) -> ControllerServer:
    """Adds the server that hosts the controller."""
    navigation = robot.navigation
    return builder.AddNamedSystem(
        "controller_server",
        ControllerServer(
            controller,
            navigation.controller_server,
            path_handler=PathHandler(navigation.path_handler),
            goal_checker=make_goal_checker(navigation.goal_checker),
            progress_checker=make_progress_checker(navigation.progress_checker),
            offset_s=CONTROLLER_OFFSET_S,
            moves_sideways=robot.drive.lateral_speed_mps > 0.0,
            timing=timing,
            compute_times_ms=compute_times_ms,
        ),
    )


def _add_filters(
    builder: DiagramBuilder,
    navigation: NavigationSettings,
    masks: Sequence[FilterMask],
    estimate: OutputPort,
    floors: TrialFloors | None,
) -> tuple[SpeedFilter | None, BinaryFilter | None]:
    """Adds the filters that act elsewhere than in a costmap, where the scenario has any.

    Each runs at the rate of the costmap that lists it, the local one where both do.
    """
    speed_filter = binary_filter = None
    if floors is not None:
        masks = [mask for of_floor in floors.masks for mask in of_floor]
    # One of each name: it knows the masks of all floors.
    first_of_each: dict[FilterName, FilterMask] = {}
    for mask in masks:
        first_of_each.setdefault(mask.filter_name, mask)
    for name, mask in first_of_each.items():
        costmaps = (navigation.local_costmap, navigation.global_costmap)
        listing = next((costmap for costmap in costmaps if costmap.is_active(name)), None)
        if listing is None:
            continue
        options: dict[str, Any] = {
            "period_s": 1.0 / listing.update_frequency,
            "offset_s": COSTMAP_OFFSET_S,
        }
        if floors is not None:
            options |= {"floors": floors.masks_named(name), "floor_clock": floors.clock}
        if name == "speed_filter":
            speed_filter = builder.AddNamedSystem(name, SpeedFilter(mask, **options))
        elif name == "binary_filter":
            binary_filter = builder.AddNamedSystem(
                name, BinaryFilter(mask, listing.binary_filter, **options)
            )
    for system in filter(None, (speed_filter, binary_filter)):
        connect_inputs(builder, system, estimate=estimate)
    return speed_filter, binary_filter
