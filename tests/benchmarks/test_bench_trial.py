"""How much faster than real time a whole trial runs, on one core, once warm."""

import numpy as np
import pytest
from PIL import Image

from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario, scenario_on_map
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

# A large public map of a building has so many cells, rows and columns.
MAP_SHAPE = (1006, 1674)
ROOM, DOOR = 110, 30
FREE, WALL = 254, 0
MAP = (
    "{image: building.png, resolution: 0.05, origin: [0.0, 0.0, 0.0], negate: 0, "
    "occupied_thresh: 0.65, free_thresh: 0.196}"
)


def write_building(folder):
    """Writes a map of rooms in rows, each with a door to its neighbours; returns its file."""
    rng = np.random.default_rng(4)
    rows, columns = MAP_SHAPE
    pixels = np.full(MAP_SHAPE, FREE, np.uint8)
    walls = [(slice(None), slice(x, x + 3)) for x in range(ROOM, columns - ROOM // 2, ROOM)]
    walls += [(slice(y, y + 3), slice(None)) for y in range(ROOM, rows - ROOM // 2, ROOM)]
    for wall in walls:
        pixels[wall] = WALL
    for y, x in walls:
        for room in range(0, max(rows, columns), ROOM):
            begin = room + ROOM // 3 + int(rng.integers(-10, 11))
            door = slice(begin, begin + DOOR)
            pixels[(door, x) if y == slice(None) else (y, door)] = FREE
    pixels[:3], pixels[-3:], pixels[:, :3], pixels[:, -3:] = WALL, WALL, WALL, WALL
    Image.fromarray(pixels).save(folder / "building.png")
    path = folder / "building.yaml"
    path.write_text(MAP)
    return path


def bench_trial(benchmark, scenario, robot, preset, rounds=5):
    spec = TrialSpec(scenario, load_robot(robot), load_preset(preset), seed=1)
    log = benchmark.pedantic(simulate, args=[spec], rounds=rounds, warmup_rounds=1)
    benchmark.extra_info["times_faster_than_real_time"] = round(
        log.end_time_s / benchmark.stats.stats.median, 1
    )
    return log


@pytest.mark.parametrize("preset", ["rpp", "dwb", "teb", "mppi", "mppi_nav2"])
def test_bench_static_obstacles(benchmark, preset):
    bench_trial(benchmark, load_scenario("static_obstacles"), "wheelchair", preset)


def test_bench_little_but_the_trial(benchmark):
    """RPP takes 2% of this: 360 beams, a costmap 6 m wide. Expected: 100 times real time."""
    bench_trial(benchmark, load_scenario("empty"), "wheelchair", "rpp")


def test_bench_replanning_across_a_building(benchmark, tmp_path):
    """A plan a second over a map of 1674 x 1006 cells. Expected: 28 times real time."""
    path = write_building(tmp_path)
    scenario = scenario_on_map(path, (2.5, 2.5, 0.0), (80.0, 47.5, 0.0))
    log = bench_trial(benchmark, scenario, "turtlebot4", "rpp", rounds=2)
    assert log.outcome == "succeeded"
    benchmark.extra_info["plans"] = len(log.plans)


@pytest.mark.parametrize("robot", ["wheelchair", "wheelchair_casters", "wheelchair_multibody"])
def test_bench_physics(benchmark, robot):
    """Expected: casters in the plane 60 times real time, multibody 30 times."""
    bench_trial(benchmark, load_scenario("static_obstacles"), robot, "rpp")
