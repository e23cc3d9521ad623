"""The wiring of the localization, between the base and all systems that read its pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort

from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.trial.navigation_wiring import Signals, connect_inputs
from drake_navbench.trial.systems.amcl import Amcl
from drake_navbench.trial.systems.delays import LateOdometry
from drake_navbench.trial.systems.localization import HeldNoise, Localization
from drake_navbench.trial.systems.scripted_localization import ScriptedLocalization
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S, COSTMAP_OFFSET_S
from drake_navbench.trial.wiring import Wiring

FRAMES = ("odometry_from_world", "map_from_odometry")


@dataclass(frozen=True)
class LocalizationSystem:
    """The systems of the localization.

    noise: adds noise to the base's state. If map and odometry frame are one, it is the whole
    localization, and `scripted` is None. amcl: if not None, it finds the pose in place of
    `scripted`. late: the systems that delay outputs, by the output's name.
    """

    noise: Localization | HeldNoise
    scripted: ScriptedLocalization | None = None
    amcl: Amcl | None = None
    late: Mapping[str, LateOdometry] = field(default_factory=dict)

    def signals(self, state: OutputPort, scan: OutputPort) -> Signals:
        """Returns the ports of a trial; state, scan: those of the true state and the scans."""
        if self.scripted is None:
            estimate = self.delayed_output("estimate", self.noise)
            return Signals(
                state=state,
                estimate=estimate,
                scan=scan,
                odometry=state,
                odometry_estimate=estimate,
            )
        names = ("estimate", "odometry", "odometry_estimate", *FRAMES)
        ports = {name: self.delayed_output(name, self.scripted) for name in names}
        if self.amcl is not None:
            for name in ("estimate", "map_from_odometry"):
                ports[name] = self.amcl.GetOutputPort(name)
        return Signals(state=state, scan=scan, **ports)

    def connect_scan(self, builder: DiagramBuilder, scan: OutputPort) -> None:
        """Connects the scan to AMCL, where the robot is localized by it."""
        if self.amcl is not None:
            connect_inputs(builder, self.amcl, scan=scan)

    def connect_wheels(self, builder: DiagramBuilder, gains: OutputPort) -> None:
        """Connects the wheels' gains to an odometry that counts the wheels' turns."""
        if self.scripted is not None and self.scripted.HasInputPort("wheel_gains"):
            connect_inputs(builder, self.scripted, wheel_gains=gains)

    def delayed_output(self, name: str, system: LeafSystem | Diagram) -> OutputPort:
        """Returns an output of a system, or of the system that delays this output."""
        late = self.late.get(name)
        return system.GetOutputPort(name) if late is None else late.GetOutputPort("late_estimate")

    def set_start(self, root_context: Context, pose: NDArray[np.float64], seed: int) -> None:
        """Sets the seed, and the frames for a robot that starts at a true pose (3,)."""
        for system in (self.noise, *self.late.values()):
            own = system.GetMyMutableContextFromRoot(root_context)
            own.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
        if self.scripted is not None:
            own = self.scripted.GetMyMutableContextFromRoot(root_context)
            self.scripted.set_start(own, pose, seed)
        if self.amcl is not None:
            own = self.amcl.GetMyMutableContextFromRoot(root_context)
            self.amcl.set_start(own, pose, seed)


def add_localization(
    wiring: Wiring, state: OutputPort, known_map: OccupancyMap | None
) -> LocalizationSystem:
    """Adds the localization that a robot's settings ask for, behind the port of the true state.

    known_map: AMCL's map.
    """
    builder, conditions, floors = wiring.builder, wiring.conditions, wiring.floors
    moves_sideways = wiring.robot.drive.lateral_speed_mps > 0.0
    if not conditions.has_frames:
        exact = Localization(
            conditions.localization, offset_s=CONTROLLER_OFFSET_S, moves_sideways=moves_sideways
        )
        plain = builder.AddNamedSystem("localization", exact)
        connect_inputs(builder, plain, state=state)
        return LocalizationSystem(plain, late=_late(wiring, plain, ("estimate",)))
    noise = HeldNoise(
        conditions.localization, offset_s=CONTROLLER_OFFSET_S, moves_sideways=moves_sideways
    )
    held = builder.AddNamedSystem("localization_noise", noise)
    scripted = builder.AddNamedSystem(
        "localization",
        ScriptedLocalization(
            conditions.localization,
            offset_s=CONTROLLER_OFFSET_S,
            floor_clock=wiring.floor_clock,
            wheel_separation_m=conditions.actuators.at(0.0).wheel_separation_m,
        ),
    )
    connect_inputs(builder, scripted, state=state, noise=held.GetOutputPort("noise"))
    late = _late(wiring, scripted, ("estimate", "odometry_estimate"))
    if known_map is None or conditions.localization.at(0.0).amcl is None:
        return LocalizationSystem(held, scripted, late=late)
    amcl = builder.AddNamedSystem(
        "amcl",
        Amcl(
            conditions.localization,
            conditions.lidar.at(0.0),
            known_map,
            offset_s=COSTMAP_OFFSET_S,
            floors=() if floors is None else floors.known_maps,
            floor_clock=wiring.floor_clock,
        ),
    )
    if floors is not None:
        connect_inputs(builder, amcl, state=state)
    system = LocalizationSystem(held, scripted, amcl, late)
    told = system.delayed_output("odometry_estimate", scripted)
    connect_inputs(builder, amcl, odometry_estimate=told)
    return system


def _late(
    wiring: Wiring, system: Localization | ScriptedLocalization, names: Sequence[str]
) -> dict[str, LateOdometry]:
    """Adds the systems that delay these outputs, by name, where the odometry is late."""
    late: dict[str, LateOdometry] = {}
    timing, clock = wiring.conditions.timing, wiring.floor_clock
    if not timing.any(lambda timing: timing.delays_odometry):
        return late
    for name in names:
        late[name] = wiring.builder.AddNamedSystem(
            f"late_{name}",
            LateOdometry(timing, offset_s=CONTROLLER_OFFSET_S, floor_clock=clock),
        )
        connect_inputs(wiring.builder, late[name], estimate=system.GetOutputPort(name))
    return late
