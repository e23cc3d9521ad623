"""Somebody who walks straight into a robot under way, in closed loop as the worlds are driven.

python tests/controllers/harmony/harmony_person.py --count 100 prints how often it is at rest.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np
from harmony_worlds import (
    BASE,
    PERIOD_S,
    STEP_S,
    controller_with,
    costmap_around,
    edges_of,
    gap_of,
)

from drake_navbench.controller import ControllerError, Observation
from drake_navbench.controllers.harmony import HarmonyParameters
from drake_navbench.controllers.harmony.base_response import follow

SPEED_MPS, FROM_M, WIDTH_M, LONGEST_S = 0.5, 3.0, 0.4, 12.0
# Nav2's local costmap is updated five times a second.
MAP_PERIOD_S = 0.2
# Slower than this the robot is at rest, but for the last centimetre of its braking, m/s.
AT_REST_MPS = 0.02
# Between axle and front: whom they walk to.
MIDDLE_M = 0.3


def speed_at_contact(
    bearing: float, walking_mps: float, *, from_m: float = FROM_M, **parameters: object
) -> float | None:
    """Returns how fast the robot is, m/s, when somebody walks into it; None where nobody does.

    They come from so far off its heading, rad, and always to where it is; they do not give way.
    from_m: of the robot's middle at the start, m. parameters: of harmony.
    """
    settings = HarmonyParameters(**parameters)
    controller = controller_with(settings)
    x = np.arange(0.0, SPEED_MPS * LONGEST_S + 6.0, 0.05)
    plan = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    state, memory = np.array([0.0, 0.0, 0.0, SPEED_MPS, 0.0]), controller.initial_memory()
    person = np.array([MIDDLE_M + from_m * math.cos(bearing), from_m * math.sin(bearing)])
    for cycle in range(round(LONGEST_S / PERIOD_S)):
        middle = state[:2] + MIDDLE_M * np.array([math.cos(state[2]), math.sin(state[2])])
        person += walking_mps * PERIOD_S * (middle - person) / np.hypot(*(middle - person))
        boxes = np.array([[*(person - 0.5 * WIDTH_M), *(person + 0.5 * WIDTH_M)]])
        if cycle % round(MAP_PERIOD_S / PERIOD_S) == 0:
            seen_map = replace(costmap_around(boxes, state[0], state[1]), stamp_s=cycle * PERIOD_S)
        nearest = int(np.argmin(np.hypot(*(plan[:, :2] - state[:2]).T)))
        seen = Observation(
            time_s=cycle * PERIOD_S,
            pose=state[:3].copy(),
            twist=state[3:].copy(),
            plan=plan[nearest : nearest + 41],
            plan_id=1,
            costmap=seen_map,
            goal=plan[-1],
        )
        try:
            command, memory, _ = controller.step(seen, memory)
        except ControllerError as error:
            command = np.zeros(2)
            memory = memory if error.memory is None else error.memory
        for _ in range(round(PERIOD_S / STEP_S)):
            if gap_of(edges_of(boxes), state) == 0.0:
                return abs(float(state[3]))
            follow(BASE, state, float(command[0]), float(command[1]), STEP_S)
    return None


def encounters(count: int, walking_mps: float, first: int = 0) -> list[float | None]:
    """Returns the robot's speed at contact, m/s, in encounters from random sides and distances."""
    found = []
    for number in range(first, first + count):
        random = np.random.default_rng((49, number))
        bearing, from_m = random.uniform(-math.pi, math.pi), random.uniform(1.5, 4.0)
        speed = speed_at_contact(bearing, walking_mps, from_m=from_m, track_moving=True)
        found.append(speed)
    return found


def main() -> None:
    """Prints in how many encounters the robot was at rest, and the others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--walking", type=float, nargs="+", default=[1.0, 1.4], metavar="MPS")
    arguments = parser.parse_args()
    for walking_mps in arguments.walking:
        speeds = encounters(arguments.count, walking_mps, arguments.first)
        met = [speed for speed in speeds if speed is not None]
        under_way = sorted(speed for speed in met if speed > AT_REST_MPS)
        print(
            f"walking {walking_mps:g} m/s: {len(met)} of {len(speeds)} meet the robot, "
            f"{len(met) - len(under_way)} of them at rest; the others at "
            f"{', '.join(f'{speed:.2f}' for speed in under_way) or '-'} m/s"
        )


if __name__ == "__main__":
    main()
