"""The wiring of observers, which measure, record and show a trial, and do not change it."""

from __future__ import annotations

from collections.abc import Callable

from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer

from drake_navbench.logs.moment import Moment
from drake_navbench.trial.navigation_wiring import Signals, connect_inputs, connect_world
from drake_navbench.trial.systems.clearance import Clearance
from drake_navbench.trial.systems.controller_server import ControllerServer
from drake_navbench.trial.systems.moving_world import MovingWorld
from drake_navbench.trial.systems.navigator import Navigator
from drake_navbench.trial.systems.recorder import SIGNAL_SIZES, Recorder
from drake_navbench.trial.systems.running_stack import RunningStackSystem
from drake_navbench.trial.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.systems.viewer import Viewer
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S
from drake_navbench.trial.wiring import Wiring

CLEARANCE_PERIOD_S = 0.05
CLEARANCE_OFFSET_S = CONTROLLER_OFFSET_S
RECORDER_PERIOD_S = 0.02


def add_clearance(
    wiring: Wiring,
    moving_world: MovingWorld | None,
    signals: Signals,
    costmap: OutputPort | None,
) -> Clearance:
    """Adds the system that measures the robot's distance to the obstacles."""
    builder = wiring.builder
    clearance = builder.AddNamedSystem(
        "clearance",
        Clearance(
            wiring.world,
            footprint=wiring.robot.outline,
            period_s=CLEARANCE_PERIOD_S,
            offset_s=CLEARANCE_OFFSET_S,
            floor_clock=wiring.floor_clock,
        ),
    )
    connect_inputs(builder, clearance, state=signals.state)
    if costmap is not None:
        connect_inputs(builder, clearance, costmap=costmap)
    connect_world(builder, signals, clearance)
    if moving_world is not None:
        connect_inputs(builder, clearance, moving=moving_world.GetOutputPort("outlines"))
    return clearance


def add_recorder(
    builder: DiagramBuilder,
    navigator: Navigator | TreeNavigator | RunningStackSystem,
    server: ControllerServer | RunningStackSystem,
    moving_world: MovingWorld | None,
    signals: Signals,
    *,
    command: OutputPort,
    distances: OutputPort,
    costmap: OutputPort | None,
) -> Recorder:
    """Adds the recorder, which listens to a behaviour tree and to people where there are any.

    command: the last command before the link to the wheels. costmap: None: not recorded.
    """
    person_count = 0 if moving_world is None else moving_world.person_count
    recorder = builder.AddNamedSystem(
        "recorder", Recorder(period_s=RECORDER_PERIOD_S, person_count=person_count)
    )
    # One port is read sooner than four.
    signals_in_one = builder.AddNamedSystem("recorded_signals", Multiplexer(SIGNAL_SIZES))
    for index, port in enumerate((signals.state, signals.estimate, command, distances)):
        builder.Connect(port, signals_in_one.get_input_port(index))
    connect_inputs(
        builder,
        recorder,
        signals=signals_in_one.get_output_port(),
        scan=signals.scan,
        server_state=server.GetOutputPort("server_state"),
    )
    if costmap is not None:
        connect_inputs(builder, recorder, costmap=costmap)
    connect_world(builder, signals, recorder)
    if isinstance(navigator, TreeNavigator):
        navigator_state = navigator.GetOutputPort("navigator_state")
        connect_inputs(builder, recorder, navigator_state=navigator_state)
    if moving_world is not None and person_count:
        connect_inputs(builder, recorder, people=moving_world.GetOutputPort("people"))
    return recorder


def add_viewer(
    builder: DiagramBuilder,
    watch: Callable[[Moment], None],
    navigator: Navigator | TreeNavigator | RunningStackSystem,
    server: ControllerServer | RunningStackSystem,
    moving_world: MovingWorld | None,
    signals: Signals,
    costmap: OutputPort | None,
) -> Viewer:
    """Adds the system that hands each sample to `watch`."""
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
        server_state=server.GetOutputPort("server_state"),
    )
    if costmap is not None:
        connect_inputs(builder, viewer, costmap=costmap)
    connect_world(builder, signals, viewer)
    if moving_world is not None:
        connect_inputs(builder, viewer, moving_poses=moving_world.GetOutputPort("poses"))
    return viewer
