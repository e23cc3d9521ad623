"""The wiring of the costmap filters that act elsewhere than in a costmap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydrake.systems.framework import OutputPort

from drake_navbench.navigation.costmaps.filter_masks import FilterMask, FilterName
from drake_navbench.trial.navigation_wiring import connect_inputs
from drake_navbench.trial.systems.binary_filter import BinaryFilter
from drake_navbench.trial.systems.controller_server import ControllerServer
from drake_navbench.trial.systems.running_stack import RunningStackSystem
from drake_navbench.trial.systems.speed_filter import SpeedFilter
from drake_navbench.trial.timing import COSTMAP_OFFSET_S
from drake_navbench.trial.wiring import Wiring


def add_filters(
    wiring: Wiring,
    masks: Sequence[FilterMask],
    estimate: OutputPort,
    server: ControllerServer | RunningStackSystem,
) -> tuple[SpeedFilter | BinaryFilter, ...]:
    """Adds the filters that act elsewhere than in a costmap, where the scenario has any.

    Each runs at the rate of the costmap that lists it; if both list it, at the local one's rate. A
    running stack has filters of its own.
    """
    if isinstance(server, RunningStackSystem):
        return ()
    builder, floors, navigation = wiring.builder, wiring.floors, wiring.robot.navigation
    speed_filter = binary_filter = None
    if floors is not None:
        masks = [mask for of_floor in floors.masks for mask in of_floor]
    # One system for each kind of filter; it knows the masks of all floors.
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
    filters = tuple(system for system in (speed_filter, binary_filter) if system is not None)
    for system in filters:
        connect_inputs(builder, system, estimate=estimate)
    if speed_filter is not None:
        connect_inputs(builder, server, speed_limit=speed_filter.GetOutputPort("speed_limit"))
    return filters
