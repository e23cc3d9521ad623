"""The walks of the scenario recorded_crowd.

`python studies/record_crowd.py` writes scenarios/recordings/hall.csv, which it replays.

It is no recording of anybody: people who walk by the social force model through a hall, of whom a
camera would see those in a part of it, at the 2.5 Hz of the ETH and UCY recordings.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from drake_navbench.inputs.people import People, Person, WalkingPeople
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.kernels.social_force import step_people
from drake_navbench.kernels.walking import X, Y
from drake_navbench.trial.systems.walking_people import PEOPLE_PERIOD_S

SCENARIO = "recorded_crowd"
PAGE = Path(__file__).parents[1] / "scenarios" / "recordings" / "hall.csv"
SEED = 20
DURATION_S, PERIOD_S = 75.0, 0.4
# The corners of the part of the hall that is seen, and how far beyond it people come from, m.
LOW, HIGH = (-2.0, -3.2), (13.0, 3.2)
FARTHEST_M = 80.0
PERSON_COUNT = 24
CROSSING_SHARE = 0.3
NO_ROBOT = np.array([1e4, 0.0, 0.0, 0.0, 0.0, 0.5])


def crowd() -> WalkingPeople:
    """Returns people who walk through the hall, half of them each way, some of them in pairs."""
    generator = np.random.default_rng(SEED)
    persons: list[Person] = []
    while len(persons) < PERSON_COUNT:
        way = 1.0 if generator.random() < 0.5 else -1.0
        start_m, side = generator.uniform(3.0, FARTHEST_M), generator.choice([-1.0, 1.0])
        side_m = side * generator.uniform(1.2, 2.6)
        # Some change sides on their way.
        leaves_m = -side_m if generator.random() < CROSSING_SHARE else side_m
        edge_m = LOW[0] if way > 0.0 else HIGH[0]
        speed_mps = float(np.clip(generator.normal(1.25, 0.2), 0.7, 1.7))
        is_pair = generator.random() < 0.25
        for member in range(2 if is_pair else 1):
            y, end_y = (float(np.clip(at + 0.8 * member, -2.8, 2.8)) for at in (side_m, leaves_m))
            first_m, second_m = generator.uniform(1.0, 5.0), generator.uniform(6.0, 10.0)
            first_m, second_m = (first_m, second_m) if way > 0.0 else (second_m, first_m)
            persons.append(
                Person(
                    start=(float(edge_m - way * start_m), y),
                    goals=[(first_m, y), (second_m, end_y), (way * 300.0, end_y)],
                    speed_mps=speed_mps,
                    group=len(persons) - member if is_pair else None,
                    yaw_rad=0.0 if way > 0.0 else np.pi,
                )
            )
    return WalkingPeople(People(persons=persons))


def main() -> None:
    """Simulates the crowd and writes the people in the camera's view."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    people = crowd()
    world = load_scenario(SCENARIO).known_world
    now, traits, goals = people.crowd(SEED)
    robot_edges = np.empty((0, 4))
    lines = ["time_s,person,x_m,y_m"]
    steps = round(PERIOD_S / PEOPLE_PERIOD_S)
    for step in range(round(DURATION_S / PEOPLE_PERIOD_S) + 1):
        if step % steps == 0:
            for person, state in enumerate(now):
                place = state[[X, Y]]
                if (place >= LOW).all() and (place <= HIGH).all():
                    time_s = step * PEOPLE_PERIOD_S
                    lines.append(f"{time_s:.1f},{person + 1},{place[0]:.2f},{place[1]:.2f}")
        now = step_people(
            *(now, traits, goals, world.segments, world.circles),
            *(NO_ROBOT, robot_edges, PEOPLE_PERIOD_S),
        )
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")
    groups: dict[int, list[str]] = {}
    for index, group in enumerate(people.groups):
        groups.setdefault(group, []).append(str(index + 1))
    print(f"{PAGE}: {len(lines) - 1} rows")
    print("groups:", [names for group, names in groups.items() if group >= 0])


if __name__ == "__main__":
    main()
