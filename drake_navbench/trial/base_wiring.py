"""The wiring of a robot's base."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydrake.geometry import SceneGraph
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_navbench.inputs.drive import AckermannDrive, DifferentialDrive, OmnidirectionalDrive
from drake_navbench.inputs.robot import Robot
from drake_navbench.trial.navigation_wiring import command_clock, connect_inputs
from drake_navbench.trial.systems.ackermann_base import AckermannBase
from drake_navbench.trial.systems.actuators import LimitedForce, SlippingWheels
from drake_navbench.trial.systems.delays import CommandLink
from drake_navbench.trial.systems.floor_transport import FloorTransport
from drake_navbench.trial.systems.mobile_base import MobileBase
from drake_navbench.trial.systems.omnidirectional_base import OmnidirectionalBase
from drake_navbench.trial.systems.wheelchair import Wheelchair
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S
from drake_navbench.trial.wiring import Wiring

if TYPE_CHECKING:
    from drake_navbench.trial.systems.caster_base import CasterBase
    from drake_navbench.trial.systems.multibody_base import MultibodyBase

    Base = MobileBase | CasterBase | MultibodyBase


def add_base(
    builder: DiagramBuilder,
    robot: Robot,
    scene_graph: SceneGraph,
    transport: FloorTransport | None = None,
) -> Base:
    """Adds the robot's base and carries its outline along in SceneGraph.

    transport: the system that carries the base between floors; None on one floor.
    """
    base = builder.AddNamedSystem("base", make_base(robot, scene_graph))
    pose = base.get_geometry_pose_output_port()
    if transport is not None:
        connect_inputs(builder, transport, base_geometry_pose=pose)
        connect_inputs(builder, transport, base_state=base.get_state_output_port())
        pose = transport.GetOutputPort("geometry_pose")
    builder.Connect(pose, scene_graph.get_source_pose_port(base.source_id))
    return base


def make_base(robot: Robot, scene_graph: SceneGraph) -> Base:
    """Returns the base that a robot file describes, its footprint registered in SceneGraph."""
    drive, footprint = robot.drive, robot.outline
    if isinstance(drive, OmnidirectionalDrive):
        return OmnidirectionalBase(drive, scene_graph, footprint=footprint)
    if isinstance(drive, AckermannDrive):
        return AckermannBase(drive, scene_graph, footprint=footprint)
    if drive.has_wheels:
        return _base_with_wheels(robot, drive, scene_graph)
    return Wheelchair(drive, scene_graph, footprint=footprint)


def _base_with_wheels(
    robot: Robot, drive: DifferentialDrive, scene_graph: SceneGraph
) -> CasterBase | MultibodyBase:
    kind: type[CasterBase] | type[MultibodyBase]
    # Imported late: most robots need no such base.
    if drive.physics == "planar_casters":
        from drake_navbench.trial.systems.caster_base import CasterBase

        kind = CasterBase
    else:
        from drake_navbench.trial.systems.multibody_base import MultibodyBase

        kind = MultibodyBase
    return kind(
        drive,
        robot.running_gear("robot"),
        scene_graph,
        footprint=robot.outline,
        rolling_resistance=robot.rolling_resistance_ratio,
    )


def add_way_to_wheels(
    wiring: Wiring, command: OutputPort, state: OutputPort
) -> tuple[OutputPort, tuple[CommandLink | SlippingWheels, ...]]:
    """Adds the link, the motors and the wheels that a command goes through.

    Returns the port of the command that the base obeys, and the systems that draw with a seed.
    """
    builder, robot, conditions = wiring.builder, wiring.robot, wiring.conditions
    seeded: list[CommandLink | SlippingWheels] = []
    if conditions.timing.any(lambda timing: timing.touches_commands):
        period_s, offset_s = command_clock(robot)
        link = CommandLink(conditions.timing, period_s=period_s, offset_s=offset_s)
        seeded.append(builder.AddNamedSystem("command_link", link))
        connect_inputs(builder, link, command=command)
        command = link.GetOutputPort("arrived")
    if conditions.actuators.any(lambda part: part.touches_wheels):
        wheels = SlippingWheels(conditions.actuators)
        seeded.append(builder.AddNamedSystem("wheels", wheels))
        connect_inputs(builder, wheels, command=command)
        command = wheels.GetOutputPort("obeyed")
    if conditions.actuators.any(lambda part: part.limits_force):
        motors = LimitedForce(
            conditions.actuators,
            mass_kg=robot.mass_kg or 0.0,
            bounds=robot.drive.bounds,
            offset_s=CONTROLLER_OFFSET_S,
        )
        builder.AddNamedSystem("motors", motors)
        connect_inputs(builder, motors, command=command, state=state)
        command = motors.GetOutputPort("reached")
    return command, tuple(seeded)
