"""Trials that every search drives for touches alone: a closed way and random worlds.

Their metrics do not count. In a closed way the robot has to stop: a controller that touches there
does not keep the robot's outline off obstacles. Random worlds are worlds for which no parameters
were made.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.analysis.numbers import counted
from drake_navbench.analysis.statistics import CONFIDENCE
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.typed_files.typed_yaml import validate

# The closed ways; the first one in which the robot has room to start is used. They have noise, so
# that every seed differs.
CLOSED_WAYS = ("restricted_small_noisy", "restricted_large_noisy")
# The number of random worlds that each configuration drives that is left after the race.
WORLDS_IN_SEARCH = 4
# More worlds than anybody drives with one seed, so that no world is driven with two seeds.
WORLDS_OF_A_SEED = 10**6
SUITE = "random worlds"
BOXES = 6
# The corners of the boxes' area: between the walls, past the start and in front of the goal, m.
LOWEST_CORNER, HIGHEST_CORNER = (1.3, -2.4), (6.4, 1.9)
SMALLEST_SIDE_M, LARGEST_SIDE_M = 0.15, 0.6
WALLS_AT_M, HALF_WALL_M = 2.6, 0.1
WALLS_FROM_M, WALLS_TO_M = -1.5, 9.5
GOAL_X_M, GOAL_Y_M = 8.0, 1.2
TIMEOUT_S = 60.0


class Guards(NamedTuple):
    """Scenarios in which a configuration may not touch anything.

    closed: the closed way. worlds: the random worlds. left_out: by kind, why there is no such
    scenario.
    """

    closed: tuple[Scenario, ...]
    worlds: tuple[Scenario, ...]
    left_out: dict[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the scenarios."""
        return tuple(scenario.name for scenario in (*self.closed, *self.worlds))


def guards_for(baseline: Preset, robot: str, *, seed: int, first: int, worlds: int) -> Guards:
    """Returns the closed way, and `worlds` random worlds of a seed from number `first` on.

    Scenarios in which the robot has no room at its start are left out.
    """
    ways = [load_scenario(name) for name in CLOSED_WAYS]
    begin = seed * WORLDS_OF_A_SEED + first
    random = [random_world(number) for number in range(begin, begin + worlds)]
    left_out: dict[str, str] = {}
    closed = _with_room(ways, "closed way", baseline, robot, left_out)
    return Guards(
        closed[:1], _with_room(random, "random worlds", baseline, robot, left_out), left_out
    )


def guard_specs(
    scenarios: Sequence[Scenario], column: Preset, robot: str, seed: int
) -> list[TrialSpec]:
    """Returns one trial of a column in each scenario."""
    if not scenarios:
        return []
    planned = plan_campaign(
        scenarios, [column], trials=1, seed=seed, robot=robot, keeps_costmaps=False
    )
    return list(planned.specs)


def touches_of(rows: Sequence[Mapping[str, Any]]) -> Counter[str]:
    """Returns the number of trials with a touch, by scenario."""
    return Counter(str(row["scenario"]) for row in rows if row["outcome"] == Outcome.COLLIDED)


def told(touches: Mapping[str, int]) -> str:
    """Returns the touches by scenario in words: 'doorway (3 trials), random_world_7 (1 trial)'."""
    return ", ".join(f"{name} ({counted(count, 'trial')})" for name, count in touches.items())


def rate_at_most(trials: int) -> float:
    """Returns the upper bound (95%) of the rate of touches after `trials` trials without a touch.

    The bound is exact: at a higher rate, no touch in so many trials has a probability below 5%.
    """
    return 1.0 - (1.0 - CONFIDENCE) ** (1.0 / trials) if trials else 1.0


def _with_room(
    scenarios: Sequence[Scenario],
    kind: str,
    baseline: Preset,
    robot: str,
    left_out: dict[str, str],
) -> tuple[Scenario, ...]:
    """Returns the scenarios that can be planned; if there is none, adds the reason to left_out."""
    found, reasons = [], []
    for scenario in scenarios:
        try:
            guard_specs([scenario], baseline, robot, 0)
        except InputError as error:
            reasons.append(str(error))
        else:
            found.append(scenario)
    if reasons and not found:
        left_out[kind] = reasons[0]
    return tuple(found)


def random_world(number: int) -> Scenario:
    """Returns the world of a number; in some of them the robot may find no way."""
    random = np.random.default_rng(number)
    obstacles = [
        {
            "type": "box",
            "min": [WALLS_FROM_M, side - HALF_WALL_M],
            "max": [WALLS_TO_M, side + HALF_WALL_M],
        }
        for side in (-WALLS_AT_M, WALLS_AT_M)
    ]
    for _ in range(BOXES):
        low = random.uniform(LOWEST_CORNER, HIGHEST_CORNER)
        high = low + random.uniform(SMALLEST_SIDE_M, LARGEST_SIDE_M, 2)
        obstacles.append(
            {"type": "box", "min": low.round(3).tolist(), "max": high.round(3).tolist()}
        )
    name = f"random_world_{number}"
    data = {
        "description": f"Random world {number}: {BOXES} boxes between two walls",
        "world": {"obstacles": obstacles},
        "goal": [GOAL_X_M, round(float(random.uniform(-GOAL_Y_M, GOAL_Y_M)), 3), 0.0],
        "timeout_s": TIMEOUT_S,
        "suite": {"name": SUITE},
        "name": name,
    }
    return validate(Scenario, data, name)
