"""The floors of a trial, and the clock by which its systems notice a change of floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.systems.framework import DiagramBuilder

from drake_navbench.inputs.floors import FloorSight, sight_of
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layered_costmap import LayeredCostmap
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.lift_ride import draw_ride
from drake_navbench.navigation.mission import MissionFollower, MissionLeg, RideLeg
from drake_navbench.trial.planning import global_layers, known_map
from drake_navbench.trial.systems.floor_aware import FloorAware, FloorClock
from drake_navbench.trial.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.timing import FLOOR_OFFSET_S, NAVIGATOR_OFFSET_S


@dataclass(frozen=True)
class TrialFloors:
    """The floors of a trial, each at its index, and the legs of the mission.

    Sequences have one entry a floor. sights: the surroundings that sensors may see. static_maps:
    for the local costmap's static layer. known_maps: for AMCL. masks: masks of the filters. layers:
    layers of the global costmap.
    """

    legs: tuple[MissionLeg, ...]
    sights: tuple[FloorSight, ...]
    static_maps: tuple[OccupancyMap | None, ...]
    known_maps: tuple[OccupancyMap, ...]
    masks: tuple[tuple[FilterMask, ...], ...]
    layers: tuple[LayeredCostmap, ...]
    tick_s: float

    @property
    def clock(self) -> FloorClock:
        """The instants at which the floor may change."""
        return FloorClock(self.tick_s, FLOOR_OFFSET_S)

    def masks_named(self, filter_name: str) -> list[FilterMask | None]:
        """Returns the mask of each floor for a filter, None for a floor without it."""
        return [
            next((mask for mask in masks if mask.filter_name == filter_name), None)
            for masks in self.masks
        ]


def trial_floors(scenario: Scenario, robot: Robot, seed: int) -> TrialFloors | None:
    """Returns the floors of the trial with this seed, None where the scenario has none."""
    if not scenario.floors:
        return None
    floors = scenario.placed_floors
    known = tuple(known_map(floor.scenario, robot) for floor in floors)
    is_static = robot.navigation.local_costmap.is_active("static_layer")
    return TrialFloors(
        legs=drawn_legs(scenario, seed),
        sights=tuple(sight_of(floor, floors) for floor in floors),
        static_maps=known if is_static else (None,) * len(floors),
        known_maps=known,
        masks=tuple(floor.scenario.filter_masks for floor in floors),
        layers=tuple(global_layers(floor.scenario, robot) for floor in floors),
        tick_s=tick_period_s(robot.navigation),
    )


def drawn_legs(scenario: Scenario, seed: int) -> tuple[MissionLeg, ...]:
    """Returns the legs of a mission with the rides of the trial with this seed."""
    legs = []
    for index, leg in enumerate(scenario.legs):
        then = None
        if leg.lift is not None and leg.to is not None and leg.arrival is not None:
            ride = draw_ride(leg.lift, seed, index)
            then = RideLeg(leg.lift.name, leg.to.index, leg.arrival, ride)
        legs.append(MissionLeg(leg.goal, leg.floor.index, leg.floor.name, then))
    return tuple(legs)


def tick_period_s(navigation: NavigationSettings) -> float:
    """Returns the time between two ticks of the behaviour tree, s."""
    return navigation.behavior_tree.tick_period_s(
        1.0 / navigation.controller_server.controller_frequency,
        1.0 / navigation.behavior_server.cycle_frequency,
    )


def mission_follower(floors: TrialFloors, navigation: NavigationSettings) -> MissionFollower:
    """Returns the system that begins each leg after the one before."""
    return MissionFollower(
        floors.legs,
        navigation.waypoint_follower,
        tick_s=floors.tick_s,
        lead_s=NAVIGATOR_OFFSET_S - FLOOR_OFFSET_S,
    )


def connect_floors(
    builder: DiagramBuilder, navigator: TreeNavigator, systems: Sequence[object]
) -> None:
    """Connects the navigator's `floor_switch` to systems that know floors."""
    switch = navigator.GetOutputPort("floor_switch")
    for system in systems:
        if isinstance(system, FloorAware) and system.knows_floors:
            builder.Connect(switch, system.GetInputPort("floor_switch"))
