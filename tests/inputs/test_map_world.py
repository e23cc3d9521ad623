"""A map's occupied cells become boxes, and what is planned on is the map itself."""

from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import given
from hypothesis.extra.numpy import arrays
from PIL import Image

from drake_navbench.commands.command_line import EXIT_WRONG_INPUT
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.map_world import occupied_boxes
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import OCCUPIED, UNKNOWN
from drake_navbench.trial.planning import global_costmap, known_map

BLACK, WHITE, GREY = 0, 254, 205


def map_of(picture: list[str], resolution=0.5, origin=(0.0, 0.0)) -> OccupancyMap:
    """Returns a map from rows of '#', '.' and '?', the top row first."""
    values = {"#": OCCUPIED, ".": 0, "?": UNKNOWN}
    rows = [[values[sign] for sign in row] for row in reversed(picture)]
    return OccupancyMap(np.array(rows, dtype=np.int8), resolution, *origin)


def test_a_block_of_cells_is_one_box():
    (box,) = occupied_boxes(map_of(["....", ".##.", ".##."], origin=(10.0, -1.0)))
    # Columns 1 and 2, rows 0 and 1, of 0.5 m each.
    assert box.min == (10.5, -1.0)
    assert box.max == (11.5, 0.0)


def test_an_l_is_two_boxes_and_unknown_cells_are_none():
    boxes = occupied_boxes(map_of(["#?", "##"]))
    assert sorted((b.min, b.max) for b in boxes) == [
        ((0.0, 0.0), (1.0, 0.5)),
        ((0.0, 0.5), (0.5, 1.0)),
    ]


@given(arrays(np.bool_, (6, 7)))
def test_boxes_cover_the_occupied_cells_and_nothing_else(occupied):
    grid = OccupancyMap(np.where(occupied, OCCUPIED, 0).astype(np.int8), 1.0, 0.0, 0.0)
    boxes = occupied_boxes(grid)
    covered = np.zeros(occupied.shape, dtype=int)
    for box in boxes:
        (x0, y0), (x1, y1) = box.min, box.max
        covered[int(y0) : int(y1), int(x0) : int(x1)] += 1
    np.testing.assert_array_equal(covered, occupied.astype(int))


def write_map(folder: Path, grey: np.ndarray, **changes) -> Path:
    Image.fromarray(grey.astype(np.uint8)[::-1]).save(folder / "map.png")
    data = {
        "image": "map.png",
        "resolution": 0.1,
        "origin": [-1.0, -2.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(data | changes))
    return path


def write_scenario(folder: Path, **changes) -> Path:
    """Writes a scenario of 6 x 4 m: free, but for a pillar around (3, 0) and unknown beyond 4 m."""
    grey = np.full((40, 60), WHITE)
    grey[18:22, 38:42] = BLACK  # x 2.8 to 3.2 m, y -0.2 to 0.2 m
    grey[:, 50:] = GREY  # x from 4 m
    if not (folder / "map.yaml").exists():
        write_map(folder, grey)
    data = {
        "description": "a pillar",
        "world": {"map": "map.yaml"},
        "start": [0.0, 0.0, 0.0],
        "goal": [2.0, 1.0, 0.0],
    }
    path = folder / "pillar.yaml"
    path.write_text(yaml.safe_dump(data | changes))
    return path


ROBOT = Robot(
    description="round",
    robot_radius=0.3,
    navigation={"global_costmap": {"track_unknown_space": True}},
)


def test_the_truth_is_the_maps_occupied_cells(tmp_path):
    world = load_scenario(str(write_scenario(tmp_path))).true_world
    assert world.intersects(shapely.Point(3.0, 0.0))
    assert not world.intersects(shapely.Point(3.3, 0.0))
    # Nothing is known to stand in unknown space.
    assert not world.intersects(shapely.Point(4.5, 0.0))
    assert len(world.walls) == 1
    assert world.obstacles == ()


def test_the_planner_sees_the_map_on_its_own_grid_with_its_unknown_cells(tmp_path):
    costmap = global_costmap(load_scenario(str(write_scenario(tmp_path))), ROBOT)
    assert costmap.costs.shape == (40, 60)
    assert (costmap.origin_x, costmap.origin_y) == (-1.0, -2.0)
    assert costmap.costs[20, 40] == LETHAL
    assert costmap.costs[20, 55] == NO_INFORMATION
    assert costmap.costs[20, 5] == FREE


def test_known_obstacles_are_drawn_into_the_map_and_hidden_ones_are_not(tmp_path):
    scenario = write_scenario(
        tmp_path,
        world={
            "map": "map.yaml",
            "obstacles": [
                {"type": "box", "min": [1.0, 0.5], "max": [1.2, 0.7]},
                {
                    "type": "box",
                    "min": [1.0, -0.7],
                    "max": [1.2, -0.5],
                    "known_to_planner": False,
                },
            ],
        },
    )
    scenario = load_scenario(str(scenario))
    grid = known_map(scenario, ROBOT)
    assert grid.value_at(np.array([1.1, 0.6])) == OCCUPIED
    assert grid.value_at(np.array([1.1, -0.6])) == 0
    assert len(scenario.true_world.shapes) == 3


def refuse(capsys, tmp_path: Path, scenario: Path) -> str:
    """Runs a scenario that must be refused; returns the one line that says why."""
    results = tmp_path / "results"
    status = main([str(scenario), "--controllers", "rpp", "--out", str(results), "--quiet"])
    message = capsys.readouterr().err.strip()
    assert status == EXIT_WRONG_INPUT
    assert len(message.splitlines()) == 1
    assert not results.exists()
    return message


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"goal": [3.0, 0.0, 0.0]}, "goal: [3.0, 0.0] lies inside an obstacle"),
        ({"goal": [4.5, 0.0, 0.0]}, "goal: [4.5, 0.0] lies in unknown space"),
        ({"goal": [9.0, 0.0, 0.0]}, "goal: [9.0, 0.0] lies off the map"),
        ({"start": [2.6, 0.0, 0.0]}, "start: the robot's footprint"),
        ({"world": {"map": "nowhere.yaml"}}, "nowhere.yaml: cannot be read"),
    ],
)
def test_a_task_that_cannot_be_is_refused_in_one_line(capsys, tmp_path, changes, reason):
    assert reason in refuse(capsys, tmp_path, write_scenario(tmp_path, **changes))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"image": "nowhere.png"}, "image: no such file"),
        ({"resolution": 0.0}, "resolution: expected 0.001 to 100"),
        ({"resolution": 200.0}, "resolution: expected 0.001 to 100, got 200.0"),
    ],
)
def test_a_map_that_is_wrong_is_refused_in_one_line(capsys, tmp_path, changes, reason):
    write_map(tmp_path, np.full((40, 60), WHITE), **changes)
    assert reason in refuse(capsys, tmp_path, write_scenario(tmp_path))


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ({"type": "keepout"}, "either a mask or areas"),
        ({"type": "keepout", "mask": "nowhere.yaml"}, "nowhere.yaml: cannot be read"),
        ({"type": "keepout", "mask": "far.yaml"}, "is it in the frame of another map?"),
        ({"type": "keepout", "areas": [{"polygon": [[0, 1], [1, 1]]}]}, "at least 3 items"),
        (
            {"type": "keepout", "areas": [{"polygon": [[0, 0], [1, 1], [1, 0], [0, 1]]}]},
            "does not cross itself",
        ),
        (
            {"type": "keepout", "areas": [{"polygon": [[1.5, 0.5], [2.5, 0.5], [2.0, 1.5]]}]},
            "goal: [2.0, 1.0] lies in a keepout",
        ),
        ({"type": "kepout", "mask": "map.yaml"}, "'keepout'"),
    ],
)
def test_a_filter_that_is_wrong_is_refused_in_one_line(capsys, tmp_path, entry, reason):
    scenario = write_scenario(tmp_path, filters=[entry])
    good = yaml.safe_load((tmp_path / "map.yaml").read_text())
    (tmp_path / "far.yaml").write_text(yaml.safe_dump(good | {"origin": [50.0, 50.0, 0.0]}))
    assert reason in refuse(capsys, tmp_path, scenario)


def test_two_speed_filters_are_refused_in_one_line(capsys, tmp_path):
    entry = {"type": "speed_percent", "areas": [{"polygon": [[0, 0], [1, 0], [1, 1]]}]}
    message = refuse(capsys, tmp_path, write_scenario(tmp_path, filters=[entry, entry]))
    assert "expected one speed_filter at most, found 2" in message


def test_a_map_of_noise_is_refused_with_its_number_of_walls(monkeypatch):
    monkeypatch.setattr("drake_navbench.inputs.map_world.MAX_WALLS", 7)
    checkers = np.indices((4, 4)).sum(axis=0) % 2 * OCCUPIED
    with pytest.raises(InputError, match="its occupied cells make 8 rectangles, expected at most"):
        occupied_boxes(OccupancyMap(checkers.astype(np.int8), 0.05, 0.0, 0.0))
