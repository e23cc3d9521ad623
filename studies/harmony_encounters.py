"""Encounters: somebody who does not see the robot walks straight on to where it will be.

`python studies/harmony_encounters.py --seed N --count M` drives M encounters for each walking speed
and prints how many end in a touch, in how many of these the robot is at rest, and the same of those
that found it driving before (docs/harmony.md). With --rows FILE it goes on where FILE ends; --judge
FILE drives nothing. --map nav2 leaves the costmaps Nav2's defaults, with
which cells that somebody has left stay where no beam has a hit behind them. --room puts
walls around: a hall that holds all encounters, or a ward, which leaves those out that begin outside
or within WALL_M of a wall.

What is asked was written down before it was driven; the one-sided 95% limits tell how sure it is:

- at least 90% at 1.0 m/s and 80% at 1.4 m/s of the touches find the robot at rest: seed 34, 500
  encounters for each speed, clearing beams, no room, each driven once;
- the same shares again: seeds 351, 352 and so on, 60 encounters for each speed and seed, as many as
  the time allows; they count together, and the page tells them beside those of seed 34;
- once more, for the code of then: seeds 3601 to 3620, 250 encounters for each speed and seed:
  10,000, clearing beams, no room; the shares must be reached on each side (ahead, left, behind,
  right), too, and the rows stay in docs/harmony_encounters.csv;
- with Nav2's map in the hall and in the ward: the same shares, seed 35, 160 for each speed; below
  these shares, or if fewer than 30 touch, the page does not say that it works there.

Encounters come in an order by chance. Where the time for a drive is over before its last one, those
driven until then count, all of them, and the page says how many.
"""

from __future__ import annotations

import argparse
import itertools
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import shapely
from harmony_judgement import OURS
from harmony_living import CLEARED, OPTION
from numpy.typing import NDArray
from scipy import stats

from drake_navbench import run_trial
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.world import Wall
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

WALKING_MPS = (1.0, 1.4)
# The robot's speed, and the way that it loses while it speeds up, m/s and m.
SPEED_MPS, START_LOSS_M = 0.5, 0.35
# A person starts at rest and loses this time while speeding up; walks on for so long, s.
STEP_OFF_S, WALKS_ON_S = 0.5, 6.0
MAPS = {"clearing": CLEARED, "nav2": {}}
# Corners of the rooms, m. All walls of the hall, a regular polygon about the meetings, are within
# the lidar's 12 m of where the robot drives, all walls of the ward from 1 s on.
HALL_M, HALL_X, SIDES = 9.6, 2.4, 16
ANGLES = 2.0 * math.pi * (np.arange(SIDES) + 0.5) / SIDES
ROOMS = {
    "hall": np.column_stack([HALL_X + HALL_M * np.cos(ANGLES), HALL_M * np.sin(ANGLES)]),
    "ward": np.array([[-6.5, -3.5], [11.9, -3.5], [11.9, 3.5], [-6.5, 3.5]]),
}
WALL_M = 0.5
# The sides from which somebody comes, rad off the robot's heading, each 90 degrees wide.
SIDES_OF_ROBOT = {"ahead": 0.0, "left": math.pi / 2.0, "behind": math.pi, "right": -math.pi / 2.0}
# At rest, m/s and rad/s; under way, m/s, so long before the touch, s.
REST_MPS, REST_RADPS = 0.02, 0.05
DRIVES_MPS, BEFORE_S = 0.3, 1.5


class Met(NamedTuple):
    """An encounter: side it comes from, rad off the robot's heading; what the robot does, or NaN.

    v_mps, w_radps: at the touch. before_mps: BEFORE_S earlier.
    """

    bearing_rad: float
    v_mps: float
    w_radps: float
    before_mps: float
    outcome: str

    @property
    def touches(self) -> bool:
        """Whether they touch."""
        return self.outcome == Outcome.COLLIDED.value

    @property
    def is_at_rest(self) -> bool:
        """Whether the robot is at rest when they touch."""
        return self.touches and abs(self.v_mps) <= REST_MPS and abs(self.w_radps) <= REST_RADPS


def encounter(seed: int, number: int, count: int, walking_mps: float) -> tuple[float, Scenario]:
    """Returns the bearing, rad, and the scenario of an encounter of `count`, spread over sides.

    The person walks straight to a point that a robot that drives on would cover then.
    """
    random = np.random.default_rng((49, seed, number))
    bearing = 2.0 * math.pi * (number + random.uniform()) / count - math.pi
    meet_s = random.uniform(4.0, 6.0)
    on_robot = np.array([random.uniform(-0.15, 0.75), random.uniform(-0.2, 0.2)])
    meeting = np.array([SPEED_MPS * meet_s - START_LOSS_M, 0.0]) + on_robot
    whence = np.array([math.cos(bearing), math.sin(bearing)])
    start = meeting + walking_mps * (meet_s - STEP_OFF_S) * whence
    goal = meeting - walking_mps * WALKS_ON_S * whence
    person = {
        "start": start.tolist(),
        "yaw_rad": math.remainder(bearing + math.pi, 2.0 * math.pi),
        "goals": [goal.tolist()],
        "repeats": False,
        "speed_mps": walking_mps,
        "reaction": "oblivious",
    }
    return bearing, Scenario(
        name="encounter",
        description="Somebody walks on to where the robot will be",
        world={"people": {"persons": [person]}},
        plan={"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        goal=(9.0, 0.0, 0.0),
        timeout_s=meet_s + WALKS_ON_S,
    )


def in_room(scenario: Scenario, room: NDArray[np.float64] | None) -> Scenario | None:
    """Returns an encounter between the walls of a room, whose corners (K, 2) are in m, if any.

    None if the person begins outside or too near to a wall; their way ends as near to one.
    """
    if room is None:
        return scenario
    people = scenario.world.people
    assert people is not None
    (person,) = people.persons
    free = shapely.Polygon(room).buffer(-WALL_M)
    if not free.covers(shapely.Point(person.start)):
        return None
    way = free.intersection(shapely.LineString([person.start, person.goals[0]]))
    person = person.model_copy(update={"goals": [way.coords[-1]]})
    ends = zip(room.tolist(), np.roll(room, -1, axis=0).tolist(), strict=True)
    walls = [Wall(type="wall", start=start, end=end) for start, end in ends]
    people = people.model_copy(update={"persons": [person]})
    world = scenario.world.model_copy(update={"obstacles": walls, "people": people})
    return scenario.model_copy(update={"world": world})


def met(bearing_rad: float, log: TrialLog) -> Met:
    """Returns the encounter that a log holds."""
    samples = log.samples
    last = samples.iloc[-1]
    # Who touches it sooner meets a robot that has hardly started.
    since_s = max(last["time_s"] - BEFORE_S, samples["time_s"].iloc[0])
    before = samples[samples["time_s"] <= since_s].iloc[-1]
    v_mps, w_radps = float(last["v_mps"]), float(last["w_radps"])
    return Met(bearing_rad, v_mps, w_radps, float(before["v_mps"]), log.outcome.value)


def summary(found: list[Met]) -> str:
    """Returns a sentence on what encounters came to."""
    touched = [one for one in found if one.touches]
    at_rest = sum(one.is_at_rest for one in touched)
    if not touched:
        return f"none of {len(found)} touch"
    least = stats.binomtest(at_rest, len(touched), alternative="greater").proportion_ci().low
    fastest_mps = max(abs(one.v_mps) for one in touched)
    drove = [one.is_at_rest for one in touched if one.before_mps > DRIVES_MPS]
    return (
        f"{len(touched)} of {len(found)} touch; the robot is at rest in {at_rest} of them (more "
        f"than {least:.1%} at 95%), at most {fastest_mps:.2f} m/s fast in any; where it was faster "
        f"than {DRIVES_MPS:g} m/s {BEFORE_S:g} s before, in {sum(drove)} of {len(drove)}"
    )


def main() -> None:
    """Drives encounters or reads rows, and prints what they came to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, nargs="+", default=[], metavar="N")
    parser.add_argument("--count", type=int, default=32, help="encounters for each seed and speed")
    parser.add_argument("--walking", type=float, nargs="+", default=WALKING_MPS, metavar="MPS")
    parser.add_argument("--controller", default=f"{OURS}:{OPTION}=true")
    parser.add_argument("--map", choices=MAPS, default="clearing")
    parser.add_argument("--room", choices=ROOMS)
    parser.add_argument("--rows", type=Path, metavar="FILE", help="keeps a row for each; goes on")
    parser.add_argument("--judge", type=Path, nargs="+", metavar="FILE", help="drives nothing")
    arguments = parser.parse_args()
    if (not arguments.seed) == (arguments.judge is None):
        parser.error("expected --seed or --judge FILE, and not both")
    missing = [path for path in arguments.judge or () if not path.is_file()]
    if missing:
        parser.error(f"--judge {missing[0]}: no such file")
    if arguments.judge is not None:
        rows = pd.concat([pd.read_csv(path) for path in arguments.judge], ignore_index=True)
        tell(rows)
        return
    rows = pd.DataFrame()
    if arguments.rows is not None and arguments.rows.exists():
        rows = pd.read_csv(arguments.rows)
    driven = (
        set() if rows.empty else set(zip(rows.walking_mps, rows.seed, rows.number, strict=True))
    )
    for walking_mps, seed in itertools.product(arguments.walking, arguments.seed):
        order = np.random.default_rng((49, seed)).permutation(arguments.count).tolist()
        for number in [one for one in order if (walking_mps, seed, one) not in driven]:
            found = drive(arguments, walking_mps, seed, number)
            if found is None:
                continue
            row = pd.DataFrame(
                [{"walking_mps": walking_mps, "seed": seed, "number": number} | found._asdict()]
            )
            rows = pd.concat([rows, row], ignore_index=True)
            if arguments.rows is not None:
                row.to_csv(
                    arguments.rows, mode="a", header=not arguments.rows.exists(), index=False
                )
            print(f"{walking_mps:g} m/s, {seed}, {number}: {found}", flush=True)
    tell(rows)


def drive(arguments: argparse.Namespace, walking_mps: float, seed: int, number: int) -> Met | None:
    """Returns an encounter; None if it does not begin within the room."""
    bearing, outdoors = encounter(seed, number, arguments.count, walking_mps)
    scenario = in_room(outdoors, ROOMS.get(arguments.room))
    if scenario is None:
        return None
    scenario = scenario.model_copy(update={"robot_overrides": MAPS[arguments.map]})
    log = run_trial(scenario, arguments.controller, number, keeps_costmaps=False)
    if log.outcome is Outcome.ERROR:
        # Else it would count as an encounter without a touch.
        reason = log.info["reason"]
        raise SystemExit(f"encounter {seed}, {number} at {walking_mps:g} m/s failed: {reason}")
    return met(bearing, log)


def tell(rows: pd.DataFrame) -> None:
    """Prints the sentence on all rows of each walking speed, and those on each side."""
    for walking_mps, part in rows.groupby("walking_mps"):
        found = [Met(*row) for row in part[list(Met._fields)].itertuples(index=False)]
        print(f"walking {walking_mps:g} m/s: {summary(found)}")
        for name, side in SIDES_OF_ROBOT.items():
            beside = [one for one in found if math.cos(one.bearing_rad - side) > math.sqrt(0.5)]
            print(f"  {name}: {summary(beside)}", flush=True)


if __name__ == "__main__":
    main()
