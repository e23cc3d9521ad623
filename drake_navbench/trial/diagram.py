"""The wiring of one trial, one paragraph a system.

`make docs` writes the picture of it, as Drake draws it, to docs/.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System

from drake_navbench.controller import Controller
from drake_navbench.explanation import ControlCycle
from drake_navbench.inputs.faults import Conditions, conditions_of
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import register_obstacles
from drake_navbench.logs.moment import Moment
from drake_navbench.navigation.checker_settings import make_goal_checker, make_progress_checker
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.path_handler import PathHandler
from drake_navbench.trial.base_wiring import add_base, add_way_to_wheels
from drake_navbench.trial.filter_wiring import add_filters
from drake_navbench.trial.floors import connect_floors
from drake_navbench.trial.localization_wiring import LocalizationSystem, add_localization
from drake_navbench.trial.navigation_wiring import (
    Signals,
    add_command_chain,
    add_navigation,
    add_running_stack,
    connect_frame,
    connect_inputs,
    connect_senses,
)
from drake_navbench.trial.recording_wiring import add_clearance, add_recorder, add_viewer
from drake_navbench.trial.sensor_wiring import add_moving_world, add_sensors
from drake_navbench.trial.spec import FollowPlan, NavigateToPoses
from drake_navbench.trial.systems.actuators import SlippingWheels
from drake_navbench.trial.systems.binary_filter import BinaryFilter
from drake_navbench.trial.systems.clearance import Clearance
from drake_navbench.trial.systems.compute_clock import ComputeClock, ComputeTimes
from drake_navbench.trial.systems.controller_server import ControllerServer
from drake_navbench.trial.systems.delays import CommandLink
from drake_navbench.trial.systems.floor_transport import FloorTransport
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.local_costmap import LocalCostmap
from drake_navbench.trial.systems.moving_world import MovingWorld
from drake_navbench.trial.systems.navigator import Navigator
from drake_navbench.trial.systems.range_sensors import RangeSensors
from drake_navbench.trial.systems.recorder import Recorder
from drake_navbench.trial.systems.running_stack import RunningStack, RunningStackSystem, StackTask
from drake_navbench.trial.systems.speed_filter import SpeedFilter
from drake_navbench.trial.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S, COSTMAP_OFFSET_S
from drake_navbench.trial.wiring import Wiring

if TYPE_CHECKING:
    from drake_navbench.trial.base_wiring import Base


@dataclass(frozen=True)
class TrialDiagram:
    """A built diagram, and the systems in it that a trial or a test talks to.

    A running stack is navigator and controller server in one, and has costmaps of its own.
    own_systems: all systems but those of `Observers.add_systems`.
    """

    diagram: Diagram
    base: Base
    lidar: Lidar
    localization: LocalizationSystem
    local_costmap: LocalCostmap | None
    navigator: Navigator | TreeNavigator | RunningStackSystem
    controller_server: ControllerServer | RunningStackSystem
    clearance: Clearance
    recorder: Recorder
    moving_world: MovingWorld | None = None
    filters: tuple[SpeedFilter | BinaryFilter, ...] = ()
    to_wheels: tuple[CommandLink | SlippingWheels, ...] = ()
    transport: FloorTransport | None = None
    range_sensors: RangeSensors | None = None
    own_systems: tuple[System, ...] = ()

    @property
    def state_system(self) -> Base | FloorTransport:
        """The system that outputs the true state in the world: the base, or `transport`."""
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
        sensors = (self.lidar,) if self.range_sensors is None else (self.lidar, self.range_sensors)
        seeded = (*sensors, *self.to_wheels)
        if not isinstance(self.controller_server, RunningStackSystem):
            seeded = (*seeded, self.controller_server)
        for system in seeded:
            own = system.GetMyMutableContextFromRoot(context)
            own.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
        if self.moving_world is not None:
            moving_context = self.moving_world.GetMyMutableContextFromRoot(context)
            self.moving_world.set_seed(moving_context, seed, start_pose)
        return context


class Observers(NamedTuple):
    """The functions that watch a trial, and whether its costmaps are recorded.

    watch: is called with the present moment whenever the recorder samples. keeps_costmaps: whether
    the recorder keeps the local costmaps. on_cycle: is called with every control cycle. takes_over:
    is called before every cycle; a controller that it returns drives from then on, and so changes
    the motion. It returns None otherwise. add_systems: is called once with the builder of the
    wired trial, to add systems that watch it.
    """

    watch: Callable[[Moment], None] | None = None
    keeps_costmaps: bool = True
    on_cycle: Callable[[ControlCycle], None] | None = None
    takes_over: Callable[[float], Controller | None] | None = None
    add_systems: Callable[[DiagramBuilder], None] | None = None


class TrialMaps(NamedTuple):
    """The maps that a robot has of its world.

    static, masks: maps of the static layers and of the filters of its costmaps. known: the map of
    AMCL.
    """

    static: OccupancyMap | None = None
    known: OccupancyMap | None = None
    masks: Sequence[FilterMask] = ()


def build_trial_diagram(
    robot: Robot,
    world: World,
    controller: Controller | RunningStack,
    *,
    task: FollowPlan | NavigateToPoses | StackTask,
    maps: TrialMaps | None = None,
    conditions: Conditions | None = None,
    compute_times_ms: ComputeTimes | None = None,
    observers: Observers | None = None,
) -> TrialDiagram:
    """Wires one trial: from the base over its sensors to the command, and back to the base.

    task: the robot's task, which decides on the navigator, or on a running stack in its place.
    maps: the scenario's maps; by default none. conditions: the settings of the robot's parts at
    each time; by default those of its file. compute_times_ms: times of all cycles, which replace
    measured ones. observers: the observers of the trial; by default costmaps are kept.
    """
    maps, observers = maps or TrialMaps(), observers or Observers()
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
    register_obstacles(scene_graph, world)

    conditions, floors = conditions or conditions_of(robot), NavigateToPoses.floors_of(task)
    wiring = Wiring(builder, scene_graph, robot, world, conditions, floors)

    transport = _add_transport(wiring)
    base = add_base(builder, robot, scene_graph, transport)
    state = _state_of(base, transport)
    localization = add_localization(wiring, state, maps.known)
    moving_world = add_moving_world(wiring, state)
    lidar, range_sensors, signals = add_sensors(wiring, state, localization, moving_world)

    times = ComputeClock(conditions.timing, compute_times_ms)
    driver = _add_driver(wiring, controller, task, maps, signals, times, observers)
    navigator, server, command = driver.navigator, driver.server, driver.command
    to_wheels = _add_way_to_base(wiring, command, base, localization, state)
    filters = add_filters(wiring, maps.masks, signals.estimate, server)

    clearance = add_clearance(wiring, moving_world, signals, driver.costmap)
    recorder = _add_recorder(wiring, driver, moving_world, signals, clearance, observers)
    if isinstance(navigator, TreeNavigator) and floors is not None:
        connect_floors(builder, navigator, builder.GetSystems())

    own_systems = tuple(builder.GetSystems())
    if observers.add_systems is not None:
        observers.add_systems(builder)
    diagram = builder.Build()
    diagram.set_name("trial")
    return TrialDiagram(
        diagram=diagram,
        base=base,
        lidar=lidar,
        localization=localization,
        local_costmap=driver.local_costmap,
        navigator=navigator,
        controller_server=server,
        clearance=clearance,
        recorder=recorder,
        moving_world=moving_world,
        filters=filters,
        to_wheels=to_wheels,
        transport=transport,
        range_sensors=range_sensors,
        own_systems=own_systems,
    )


class _Driver(NamedTuple):
    """The systems that decide on a robot's motion, and the port of its command."""

    navigator: Navigator | TreeNavigator | RunningStackSystem
    server: ControllerServer | RunningStackSystem
    command: OutputPort
    local_costmap: LocalCostmap | None = None

    @property
    def costmap(self) -> OutputPort | None:
        """The port of the local costmap, None with a running stack."""
        return None if self.local_costmap is None else self.local_costmap.GetOutputPort("costmap")


def _add_transport(wiring: Wiring) -> FloorTransport | None:
    """Adds the system that carries the base between floors, where there are several."""
    if wiring.floor_clock is None:
        return None
    return wiring.builder.AddNamedSystem("transport", FloorTransport(wiring.floor_clock))


def _add_driver(
    wiring: Wiring,
    controller: Controller | RunningStack,
    task: FollowPlan | NavigateToPoses | StackTask,
    maps: TrialMaps,
    signals: Signals,
    clock: ComputeClock,
    observers: Observers,
) -> _Driver:
    """Adds costmaps, controller server, navigator and the chain behind them, or a running stack."""
    builder, robot = wiring.builder, wiring.robot
    if isinstance(task, StackTask) or isinstance(controller, RunningStack):
        stack = add_running_stack(builder, controller, task, signals)
        return _Driver(stack, stack, stack.GetOutputPort("command"))
    local_costmap = _add_local_costmap(wiring, signals, maps)
    costmap = local_costmap.GetOutputPort("costmap")
    server = _add_controller_server(builder, robot, controller, signals, costmap, clock, observers)
    navigator, command = add_navigation(
        builder, robot, task, signals, local_costmap=local_costmap, server=server
    )
    command = add_command_chain(builder, robot, signals, command)
    return _Driver(navigator, server, command, local_costmap)


def _add_recorder(
    wiring: Wiring,
    driver: _Driver,
    moving_world: MovingWorld | None,
    signals: Signals,
    clearance: Clearance,
    observers: Observers,
) -> Recorder:
    """Adds the recorder and, where somebody watches, the viewer."""
    builder, navigator, server = wiring.builder, driver.navigator, driver.server
    recorder = add_recorder(
        builder,
        navigator,
        server,
        moving_world,
        signals,
        command=driver.command,
        distances=clearance.GetOutputPort("distances"),
        costmap=driver.costmap if observers.keeps_costmaps else None,
    )
    if observers.watch is not None:
        add_viewer(
            builder, observers.watch, navigator, server, moving_world, signals, driver.costmap
        )
    return recorder


def _state_of(base: Base, transport: FloorTransport | None) -> OutputPort:
    """Returns the port of the true state in the world."""
    if transport is None:
        return base.get_state_output_port()
    return transport.GetOutputPort("state")


def _add_way_to_base(
    wiring: Wiring,
    command: OutputPort,
    base: Base,
    localization: LocalizationSystem,
    state: OutputPort,
) -> tuple[CommandLink | SlippingWheels, ...]:
    """Adds the systems between command and base.

    Returns those of them that draw random numbers by the trial's seed.
    """
    obeyed, seeded = add_way_to_wheels(wiring, command, state)
    wiring.builder.Connect(obeyed, base.get_command_input_port())
    for system in seeded:
        if isinstance(system, SlippingWheels):
            localization.connect_wheels(wiring.builder, system.GetOutputPort("gains"))
    return seeded


def _add_local_costmap(wiring: Wiring, signals: Signals, maps: TrialMaps) -> LocalCostmap:
    """Adds the local costmap."""
    builder, robot, floors = wiring.builder, wiring.robot, wiring.floors
    local_costmap = builder.AddNamedSystem(
        "local_costmap",
        LocalCostmap(
            robot.navigation.local_costmap,
            robot.lidar,
            footprint=robot.padded_outline,
            offset_s=COSTMAP_OFFSET_S,
            static_map=maps.static,
            masks=maps.masks,
            floors=(
                () if floors is None else tuple(zip(floors.static_maps, floors.masks, strict=True))
            ),
            floor_clock=wiring.floor_clock,
        ),
    )
    connect_inputs(builder, local_costmap, state=signals.odometry)
    connect_senses(builder, signals, local_costmap)
    connect_frame(builder, signals, local_costmap)
    return local_costmap


def _add_controller_server(
    builder: DiagramBuilder,
    robot: Robot,
    controller: Controller,
    signals: Signals,
    costmap: OutputPort,
    clock: ComputeClock,
    observers: Observers,
) -> ControllerServer:
    """Adds the server that hosts the controller."""
    navigation = robot.navigation
    server = builder.AddNamedSystem(
        "controller_server",
        ControllerServer(
            controller,
            navigation.controller_server,
            path_handler=PathHandler(navigation.path_handler),
            goal_checker=make_goal_checker(navigation.goal_checker),
            progress_checker=make_progress_checker(navigation.progress_checker),
            offset_s=CONTROLLER_OFFSET_S,
            moves_sideways=robot.drive.lateral_speed_mps > 0.0,
            clock=clock,
        ),
    )
    server.listen(observers.on_cycle, observers.takes_over)
    connect_inputs(builder, server, odometry_estimate=signals.odometry_estimate, costmap=costmap)
    connect_frame(builder, signals, server)
    return server
