"""The fields of a log that only missions over several floors have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import MISSION_COLUMNS
from drake_navbench.navigation.mission import FloorLeg, MissionProgress

Event = tuple[float, Any]


def mission_account(scenario: Scenario) -> dict[str, Any]:
    """Returns the header's `floors` and `mission`, and its `scenario` with goals in the world.

    A point (x, y) on a floor's map is (x, y) + `offset_m` in the world, the frame of all poses of a
    log.
    """
    *waypoints, goal = (list(pose) for pose in scenario.goals)
    described = scenario.model_dump(mode="json") | {"waypoints": waypoints, "goal": goal}
    floors = [
        {"name": floor.name, "offset_m": list(floor.offset), "bounds_m": list(floor.bounds)}
        for floor in scenario.placed_floors
    ]
    legs = [
        {"floor": leg.floor.name, "goal": list(leg.goal)}
        | (
            {}
            if leg.lift is None or leg.to is None or leg.arrival is None
            else {"lift": leg.lift.name, "to": leg.to.name, "arrival": list(leg.arrival)}
        )
        for leg in scenario.legs
    ]
    return {"scenario": described, "floors": floors, "mission": legs}


def mission_columns(
    mission: MissionProgress, time_s: NDArray[np.float64]
) -> dict[str, NDArray[np.int64]]:
    """Returns the columns of `MISSION_COLUMNS` for samples (N,) taken at these times."""
    floors = np.array([0, *(switch.floor for switch in mission.switches)])
    changes = [switch.time_s for switch in mission.switches]
    starts = [*(leg.start_time_s for leg in mission.legs), mission.leg_start_s]
    last_begun = max(len(mission.legs), mission.index + 1)
    # A sample at the instant of a change was taken before it.
    values = (
        floors[np.searchsorted(changes, time_s, side="left")],
        np.searchsorted(starts[1:last_begun], time_s, side="left"),
    )
    return {
        name: value.astype(np.int64) for name, value in zip(MISSION_COLUMNS, values, strict=True)
    }


def mission_events(
    mission: MissionProgress, events: Sequence[Event], end_s: float
) -> tuple[Event, ...]:
    """Returns the navigator's events with those of the lifts, in order, up to the trial's end."""
    of_lifts = [
        (time_s, {"lift": leg.lift, "event": name})
        for leg in mission.legs
        if isinstance(leg, FloorLeg)
        for time_s, name in leg.lift_events
        if time_s <= end_s
    ]
    return tuple(sorted([*events, *of_lifts], key=lambda event: event[0]))
