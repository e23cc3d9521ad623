"""Models of people in crowds compared: `python studies/people_models.py` makes a page.

It writes docs/people_models.md and docs/images/people_models.svg. A corridor that closes on itself,
people of Weidmann's free speeds in it: how fast they are at which density, and whether lanes form
where half of them come the other way.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drake_navbench.analysis.figures.choice import SVG
from drake_navbench.analysis.figures.style import figure_style, new_figure, write_figure
from drake_navbench.inputs.people import OrcaSettings
from drake_navbench.kernels import walking
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.orca import step_orca
from drake_navbench.kernels.orca_edges import linked_edges
from drake_navbench.kernels.social_force import step_people
from drake_navbench.kernels.walking import VX, YAW, X, Y
from drake_navbench.trial.systems.walking_people import PEOPLE_PERIOD_S

PAGE = Path(__file__).parents[1] / "docs" / "people_models.md"
FIGURE = PAGE.parent / "images" / "people_models.svg"
LENGTH_M, WIDTH_M, RADIUS_M = 12.0, 3.0, 0.2
# A person within this of one end of the corridor also acts on people near the other end, m.
REACH_M = 5.0
DURATION_S, SETTLED_S = 40.0, 20.0
COUNTERFLOW_S = 60.0
# Weidmann 1993: mean and spread of free speeds, and of his curve.
FREE_MPS, FREE_STD_MPS, SLOWEST_MPS = 1.34, 0.26, 0.6
SLOPE_PER_M2, JAM_PER_M2 = 1.913, 5.4
DENSITIES_PER_M2 = (0.5, 1.0, 1.5, 2.0)
COUNTERFLOW_PER_M2 = (0.5, 1.0)
# With which the social force model gives that curve, and how near to it counts.
TIME_GAP_S, BAND = 0.7, 0.2
SEEDS = range(3)
MODELS = ("social_force", "orca")
LANE_HALF_WIDTH_M = 0.3
NO_ROBOT = np.array([1e4, 0.0, 0.0, 0.0, 0.0, 0.5])

HEADER = f"""\
# Models of people in crowds

With HuNavSim's constants people hardly slow down in a crowd that walks one way, nor do they with
ORCA; `time_gap_s: 0.7` brings both within 20% of Weidmann's speeds. In counterflow the social force
model with a time gap gets stuck at 1 person/m2.

Made by `python studies/people_models.py`: {LENGTH_M:g} m of a corridor {WIDTH_M:g} m wide that
closes on itself, bodies of {RADIUS_M:g} m, free speeds of {FREE_MPS} m/s with a spread of
{FREE_STD_MPS} m/s (Weidmann, "Transporttechnik der Fussgaenger", 1993), {len(SEEDS)} seeds each.

## Speed against density

Mean speed [m/s] after {SETTLED_S:g} s, all in one direction, beside Weidmann's curve
v = {FREE_MPS} (1 - exp(-{SLOPE_PER_M2} (1/density - 1/{JAM_PER_M2}))). Bold: within
{BAND:.0%} of it.
"""
SPEED_END = f"""
![Speed against density](images/{FIGURE.name})

With HuNavSim's constants people hardly slow down: where all walk one way, nobody is in the way.
ORCA keeps bodies apart, and nothing else. What slows a crowd is the room that a step takes.
`time_gap_s` gives it to both models: the speed of the collision-free speed model of Tordeux,
Chraibi and Seyfried (Traffic and Granular Flow '15; arXiv 1512.05597), (distance to whoever is
ahead - 0.3 m) / time gap. They have 1 s; here {TIME_GAP_S:g} s was chosen for the social force
model to give Weidmann's curve.

## Lanes in counterflow

Half of them walk the other way. The order is that of Nowak and Schadschneider (2012) after Rex and
Loewen (2007): the mean over people of ((those going one's way - the others) / all)^2 among all
within {LANE_HALF_WIDTH_M:g} m to the side, less what it is where directions are dealt out at
random, so that 0 is no lane and 1 are perfect lanes. Mean of the second half of
{COUNTERFLOW_S:g} s.
"""
LANES_END = """
Where people by the social force model keep a time gap to those who come towards them as well, they
get stuck at 1 person/m2: a time gap is for crowds that walk one way, or for ORCA.
"""


class Flow(NamedTuple):
    """Mean speed along everybody's own direction, m/s, and the order of lanes, 1 perfect."""

    speed_mps: float
    lane_order: float


def weidmann_mps(density_per_m2: float) -> float:
    """Returns Weidmann's mean speed at a density, m/s."""
    room = 1.0 / density_per_m2 - 1.0 / JAM_PER_M2
    return FREE_MPS * (1.0 - math.exp(-SLOPE_PER_M2 * room))


def lane_order(sides_m: Array, ways: Array, generator: np.random.Generator) -> float:
    """Returns the order of people in lanes, from 0 (as if at random) to 1.

    sides_m: (P,) across the corridor. ways: (P,) 1 or -1 along it.
    """
    beside = np.abs(sides_m[:, None] - sides_m) <= LANE_HALF_WIDTH_M

    def order(ways: Array) -> float:
        return float(np.mean((beside @ ways / beside.sum(axis=1)) ** 2))

    at_random = np.mean([order(generator.permutation(ways)) for _ in range(20)])
    return float((order(ways) - at_random) / (1.0 - at_random))


def flow(
    model: str, density_per_m2: float, seed: int, *, time_gap_s: float, is_counterflow: bool = False
) -> Flow:
    """Returns speed and lanes of the people in the corridor once they have settled."""
    generator = np.random.default_rng(seed)
    people = _placed(round(density_per_m2 * LENGTH_M * WIDTH_M), generator)
    ways = np.ones(len(people))
    if is_counterflow:
        ways[: len(ways) // 2] = -1.0
    people[:, YAW] = np.where(ways > 0.0, 0.0, np.pi)
    speeds = generator.normal(FREE_MPS, FREE_STD_MPS, len(people))
    speeds = np.clip(speeds, SLOWEST_MPS, walking.TOP_SPEED_MPS)
    duration_s = COUNTERFLOW_S if is_counterflow else DURATION_S
    steps, settled = round(duration_s / PEOPLE_PERIOD_S), 0.5 * duration_s
    seen_mps, orders = [], []
    for step in range(steps):
        people = _later(model, people, ways, speeds, time_gap_s)
        if step * PEOPLE_PERIOD_S < settled:
            continue
        seen_mps.append(np.mean(people[:, VX] * ways))
        if is_counterflow and step % 20 == 0:
            orders.append(lane_order(people[:, Y], ways, generator))
    return Flow(float(np.mean(seen_mps)), float(np.mean(orders)) if orders else math.nan)


def _placed(count: int, generator: np.random.Generator) -> Array:
    """Returns (P, 8) people on a lattice, a little off it, in no order."""
    across = WIDTH_M - 2.0 * RADIUS_M
    columns = math.ceil(math.sqrt(count * LENGTH_M / across))
    rows = -(-count // columns)
    cells = generator.permutation(columns * rows)[:count]
    off = generator.uniform(0.3, 0.7, (count, 2))
    people = np.zeros((count, walking.STATE_SIZE))
    people[:, X] = (cells % columns + off[:, 0]) * LENGTH_M / columns
    people[:, Y] = (cells // columns + off[:, 1]) * across / rows - 0.5 * across
    return people


def _later(model: str, people: Array, ways: Array, speeds: Array, time_gap_s: float) -> Array:
    """Returns (P, 8) the people a period later, in a corridor whose two ends are joined."""
    count = len(people)
    first = np.flatnonzero(people[:, X] < REACH_M)
    last = np.flatnonzero(people[:, X] > LENGTH_M - REACH_M)
    rows = np.concatenate([np.arange(count), first, last])
    everybody = people[rows]
    everybody[count : count + len(first), X] += LENGTH_M
    everybody[count + len(first) :, X] -= LENGTH_M
    traits = np.zeros((len(rows), walking.TRAIT_SIZE))
    traits[:, walking.SPEED], traits[:, walking.RADIUS] = speeds[rows], RADIUS_M
    traits[:, walking.REACTION], traits[:, walking.GROUP] = walking.OBLIVIOUS, -1
    traits[:, walking.FIRST_GOAL] = np.arange(len(rows))
    traits[:, walking.PAST_GOAL] = np.arange(len(rows)) + 1
    traits[:, walking.TIME_GAP] = time_gap_s
    goals = everybody[:, [X, Y]] + np.outer(100.0 * ways[rows], [1.0, 0.0])
    half, far = 0.5 * WIDTH_M, 1e3
    if model == "orca":
        above = np.array([[-far, half], [far, half], [far, half + 1.0], [-far, half + 1.0]])
        below = above - [0.0, WIDTH_M + 1.0]
        after = step_orca(
            *(everybody, traits, goals, (linked_edges([above, below]), np.empty((0, 5)))),
            *(NO_ROBOT[:5], OrcaSettings().as_array, PEOPLE_PERIOD_S, PEOPLE_PERIOD_S),
        )
    else:
        walls = np.array([[-far, -half, far, -half], [far, half, -far, half]])
        after = step_people(
            *(everybody, traits, goals, walls, np.empty((0, 3)), NO_ROBOT, np.empty((0, 4))),
            PEOPLE_PERIOD_S,
        )
    after[:, X] %= LENGTH_M
    return after[:count]


def _columns() -> list[tuple[str, float, str]]:
    """Returns model, time gap s and title of each column."""
    gaps = ((0.0, ""), (TIME_GAP_S, f", time gap {TIME_GAP_S:g} s"))
    return [(model, gap, f"{model}{text}") for model in MODELS for gap, text in gaps]


def main() -> None:
    """Drives all of it and writes page and figure."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    columns = _columns()
    titles = " | ".join(title for *_, title in columns)
    lines = [HEADER, f"| persons/m2 | Weidmann | {titles} |", "|---:" * (len(columns) + 2) + "|"]
    means: dict[str, list[float]] = {title: [] for *_, title in columns}
    for density in DENSITIES_PER_M2:
        wanted, cells = weidmann_mps(density), []
        for model, gap, title in columns:
            flows = [flow(model, density, seed, time_gap_s=gap) for seed in SEEDS]
            mean = float(np.mean([one.speed_mps for one in flows]))
            means[title].append(mean)
            is_near = abs(mean - wanted) <= BAND * wanted
            cells.append(f"**{mean:.2f}**" if is_near else f"{mean:.2f}")
        lines.append(f"| {density:g} | {wanted:.2f} | {' | '.join(cells)} |")
        print(lines[-1])
    _draw(means)
    lines += [SPEED_END, f"| persons/m2 | | {titles} |", "|---:|---" + "|---:" * len(columns) + "|"]
    for density in COUNTERFLOW_PER_M2:
        flows_of = [
            [flow(model, density, seed, time_gap_s=gap, is_counterflow=True) for seed in SEEDS]
            for model, gap, _ in columns
        ]
        for field, name in (("lane_order", "order"), ("speed_mps", "speed [m/s]")):
            cells = [f"{np.mean([getattr(one, field) for one in own]):.2f}" for own in flows_of]
            lines.append(f"| {density:g} | {name} | {' | '.join(cells)} |")
            print(lines[-1])
    PAGE.write_text("\n".join([*lines, LANES_END]), encoding="utf-8")


def _draw(means: dict[str, list[float]]) -> None:
    with figure_style():
        figure, (axes,) = new_figure()
        densities = np.linspace(0.3, 2.3, 100)
        curve = np.array([weidmann_mps(density) for density in densities])
        axes.fill_between(
            densities, (1.0 - BAND) * curve, (1.0 + BAND) * curve, color="0.9", label=f"{BAND:.0%}"
        )
        axes.plot(densities, curve, color="0.4", lw=1.0, label="Weidmann 1993")
        for marker, (title, speeds_mps) in zip("osv^", means.items(), strict=True):
            axes.plot(DENSITIES_PER_M2, speeds_mps, marker=marker, ms=5, lw=0.8, label=title)
        axes.set_xlabel("persons/m$^2$")
        axes.set_ylabel("speed [m/s]")
        axes.set_ylim(0.0, 1.7)
        axes.legend(fontsize=7)
        write_figure(figure, FIGURE.with_suffix(""), (SVG,))


if __name__ == "__main__":
    main()
