"""The robot in its world without a navigation stack; an environment steps it from outside."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus

from drake_navbench.errors import InputError
from drake_navbench.inputs.faults import conditions_of
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import register_obstacles
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.scan import Scan
from drake_navbench.kernels.swept_contact import clearance_at
from drake_navbench.trial.base_wiring import add_base
from drake_navbench.trial.contact_watch import ContactWatch
from drake_navbench.trial.navigation_wiring import connect_inputs
from drake_navbench.trial.simulation import INTEGRATION
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.lifetime import release, weakly_bound
from drake_navbench.trial.systems.localization import Localization
from drake_navbench.trial.systems.ports import COMMAND_SIZE
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S, MAX_STEP_S


class RobotSimulation:
    """A trial's base, lidar and localization, wired as in a trial, with the command left open.

    The command is taken at the instants of a trial's controller server: first at
    CONTROLLER_OFFSET_S, then once a `period_s`. One diagram serves all episodes: to build one takes
    as long as to drive a hundred steps. `reset` puts its Context back.

    period_s: time between two commands, s.
    """

    def __init__(self, robot: Robot, world: World, *, period_s: float) -> None:
        if not conditions_of(robot).are_plain:
            raise InputError(
                "robot: localization, actuators, timing: drift of the odometry, faults of the "
                "wheels and late messages exist in trials alone, not in environments"
            )
        builder = DiagramBuilder()
        scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
        register_obstacles(scene_graph, world)
        self._base = add_base(builder, robot, scene_graph)
        state = self._base.get_state_output_port()
        self._lidar = builder.AddNamedSystem("lidar", Lidar(Timeline.constant(robot.lidar), world))
        connect_inputs(builder, self._lidar, state=state)
        self._localization = builder.AddNamedSystem(
            "localization",
            Localization(
                Timeline.constant(robot.localization),
                offset_s=CONTROLLER_OFFSET_S,
                moves_sideways=robot.drive.lateral_speed_mps > 0.0,
            ),
        )
        connect_inputs(builder, self._localization, state=state)
        self._diagram = builder.Build()
        self._robot = robot
        self._period_s = period_s
        self._footprint = np.ascontiguousarray(robot.outline)
        self._simulator = Simulator(self._diagram)
        ApplySimulatorConfig(INTEGRATION, self._simulator)
        self._simulator.set_monitor(weakly_bound(self._end_at_contact))
        context = self._simulator.get_mutable_context()
        self._base_context = self._base.GetMyMutableContextFromRoot(context)
        self._lidar_context = self._lidar.GetMyMutableContextFromRoot(context)
        self._localization_context = self._localization.GetMyMutableContextFromRoot(context)
        self._state_port = state
        self._scan_port = self._lidar.GetOutputPort("scan")
        self._estimate_port = self._localization.GetOutputPort("estimate")
        self._whole_command = np.zeros(COMMAND_SIZE)
        self._command_port = self._base.get_command_input_port()
        self.reset(np.zeros(3), seed=0, world=world)

    def reset(self, start_pose: Array, *, seed: int, world: World) -> None:
        """Puts the robot at rest at (3,) x m, y m, yaw rad, and waits for the first command.

        world: the obstacles from now on; SceneGraph keeps those that it was built with, for
        drawing.
        """
        self._world = world
        self._contact_watch = ContactWatch(
            self._robot.drive, world, footprint=self._footprint, max_step_s=MAX_STEP_S
        )
        self._steps = 0
        context = self._simulator.get_mutable_context()
        context.SetTime(0.0)
        self._diagram.SetDefaultContext(context)
        self._base.set_pose(self._base_context, start_pose)
        for system, own in (
            (self._lidar, self._lidar_context),
            (self._localization, self._localization_context),
        ):
            own.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
        seen = self._lidar_context.get_mutable_abstract_parameter(self._lidar.world_parameter)
        visible = world.visible_from(self._robot.lidar.height_m)
        seen.set_value((visible.segments, visible.circles))
        self._set_command(np.zeros(COMMAND_SIZE))
        self._simulator.Initialize()
        self._simulator.AdvanceTo(CONTROLLER_OFFSET_S)

    def step(self, command: Array) -> None:
        """Drives one period with a command (2,) v m/s, w rad/s; a touch ends it at that time.

        A third number is vy m/s, for a base that moves sideways.
        """
        self._steps += 1
        self._set_command(command)
        self._simulator.AdvanceTo(CONTROLLER_OFFSET_S + self._steps * self._period_s)

    def close(self) -> None:
        """Frees the diagram; nothing can be driven afterwards."""
        release(self._diagram.GetSystems())

    @property
    def has_collided(self) -> bool:
        """Whether the outline has touched an obstacle."""
        return self._contact_watch.contact is not None

    @property
    def driven_s(self) -> float:
        """Time since the first command, s; after a touch, up to the touch."""
        contact = self._contact_watch.contact
        now_s = self._simulator.get_context().get_time() if contact is None else contact.time_s
        return max(0.0, now_s - CONTROLLER_OFFSET_S)

    @property
    def state(self) -> Array:
        """(6,) the true x m, y m, yaw rad, v m/s, w rad/s, vy m/s; after a touch, those at it."""
        contact = self._contact_watch.contact
        if contact is not None:
            return contact.state
        return self._state_port.Eval(self._base_context)

    @property
    def estimate(self) -> Array:
        """(6,) the estimated state that a controller gets."""
        return self._estimate_port.Eval(self._localization_context)

    @property
    def scan(self) -> Scan:
        """The last scan."""
        return self._scan_port.Eval(self._lidar_context)

    def clearance_m(self, limit_m: float) -> float:
        """Returns the distance of the true outline to standing obstacles, m; at most `limit_m`."""
        if self.has_collided:
            return 0.0
        x, y, yaw = self.state[:3]
        edges, circles = self._world.segments, self._world.circles
        found_m = clearance_at(self._footprint, x, y, yaw, edges, circles, limit_m)
        return min(float(found_m), limit_m)

    def _set_command(self, command: Array) -> None:
        self._whole_command[: command.size] = command
        self._command_port.FixValue(self._base_context, self._whole_command)

    def _end_at_contact(self, context: Context) -> EventStatus | None:
        watch = self._contact_watch
        time_s = context.get_time()
        if time_s >= watch.idle_until_s:
            watch.look(time_s, self._state_port.Eval(self._base_context))
        if watch.contact is not None:
            return EventStatus.ReachedTermination(self._diagram, "collided")
        return None
