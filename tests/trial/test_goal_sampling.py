"""Tasks that are drawn on a map can be driven, and are the same in every run."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.run import build_parser
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.task_check import check_task
from drake_navbench.navigation.velocity_smoother import VelocitySmootherParameters
from drake_navbench.trial.goal_sampling import MIN_DISTANCE_M, sample_tasks
from drake_navbench.trial.planning import make_plan

WARD = Path(__file__).parents[2] / "scenarios" / "maps" / "ward.yaml"
WHEELCHAIR = load_robot("wheelchair")


def test_every_drawn_task_can_be_planned():
    for task in sample_tasks(WARD, WHEELCHAIR, 4, seed=1):
        check_task(task, WHEELCHAIR)
        assert math.dist(task.start[:2], task.goal[:2]) >= MIN_DISTANCE_M
        assert task.suite is not None
        assert task.suite.name == "ward"
        assert len(make_plan(task, WHEELCHAIR, np.array(task.start))) > 10


def test_the_seed_alone_tells_which_are_drawn():
    def drawn(seed):
        return [(task.start, task.goal) for task in sample_tasks(WARD, WHEELCHAIR, 3, seed=seed)]

    assert drawn(5) == drawn(5)
    assert drawn(5) != drawn(6)


def test_a_robot_too_slow_for_its_way_has_twice_the_time_of_the_straight_one():
    """At 0.01 m/s 5 m take 500 s, and there is 600 s for a task on a map."""
    drive = WHEELCHAIR.drive.model_copy(update={"max_linear_velocity_mps": 0.01})
    slow = WHEELCHAIR.model_copy(update={"drive": drive})
    tasks = sample_tasks(WARD, slow, 5, seed=1)
    straight_s = [math.dist(task.start[:2], task.goal[:2]) / 0.01 for task in tasks]
    assert [task.timeout_s for task in tasks] == [
        max(600.0, math.ceil(2.0 * each_s)) for each_s in straight_s
    ]
    assert max(straight_s) > 600.0
    beside = sample_tasks(WARD, WHEELCHAIR, 5, seed=1, beside=[slow])
    assert [task.timeout_s for task in beside] == [task.timeout_s for task in tasks]
    usual = sample_tasks(WARD, WHEELCHAIR, 5, seed=1)
    assert {task.timeout_s for task in usual} == {600.0}
    assert [task.goal for task in usual] == [task.goal for task in tasks]


def test_a_velocity_smoother_may_be_what_makes_a_robot_slow():
    smoother = VelocitySmootherParameters(max_velocity=(0.02, 0.0, 1.0))
    navigation = WHEELCHAIR.navigation.model_copy(update={"velocity_smoother": smoother})
    slow = WHEELCHAIR.model_copy(update={"navigation": navigation})
    (task,) = sample_tasks(WARD, slow, 1, seed=1)
    straight_s = math.dist(task.start[:2], task.goal[:2]) / 0.02
    assert task.timeout_s == max(600.0, math.ceil(2.0 * straight_s))


def write_rooms(folder: Path) -> Path:
    """Writes a map of two rooms of 5 m x 5 m without a door between them."""
    grey = np.full((50, 101), 254, dtype=np.uint8)
    grey[:, 50] = 0
    Image.fromarray(grey).save(folder / "rooms.png")
    data = {"image": "rooms.png", "resolution": 0.1, "origin": [0.0, 0.0, 0.0]}
    data |= {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    path = folder / "rooms.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def test_no_pair_has_a_wall_between_its_two(tmp_path):
    robot = load_robot("round_robot")
    for task in sample_tasks(write_rooms(tmp_path), robot, 20, seed=0):
        assert (task.start[0] < 5.0) == (task.goal[0] < 5.0)


def test_a_body_that_reaches_beyond_the_costmaps_footprint_touches_at_no_drawn_place(tmp_path):
    """In rooms 5 m wide a trailer that reaches back 1 m has 3 m in the middle."""
    trailer = [(0.2, 0.2), (-1.0, 0.2), (-1.0, -0.2), (0.2, -0.2)]
    robot = load_robot("round_robot", {"collision_outline": trailer})
    for task in sample_tasks(write_rooms(tmp_path), robot, 10, seed=0):
        for x, y, _ in (task.start, task.goal):
            assert 1.0 < y < 4.0
            assert 1.0 < x < 4.0 or 6.1 < x < 9.1


def test_a_given_start_is_that_of_all_and_its_goals_lie_in_its_room(tmp_path):
    start = (7.0, 2.0, 0.5)
    robot = load_robot("round_robot")
    tasks = sample_tasks(write_rooms(tmp_path), robot, 10, seed=0, start=start)
    assert {task.start for task in tasks} == {start}
    assert all(task.goal[0] > 5.1 for task in tasks)


def test_a_map_without_room_names_the_ways_out(tmp_path):
    """Rooms of 5 m have no 8 m of free floor; one that is unknown has none for any robot."""
    path = write_rooms(tmp_path)
    wide = load_robot("round_robot", {"robot_radius": 4.0})
    ways = "a map with room for it, or --goals FILE with places of yours"
    with pytest.raises(InputError, match=f"connected; expected {ways}$"):
        sample_tasks(path, wide, 2, seed=0)
    with pytest.raises(InputError, match=f"expected another --start, {ways}$"):
        sample_tasks(path, wide, 2, seed=0, start=(7.0, 2.0, 0.5))
    # 205 is the grey of unknown cells; 1 of 101 columns is the wall.
    grey = np.full((50, 101), 205, dtype=np.uint8)
    grey[:, 50] = 0
    Image.fromarray(grey).save(tmp_path / "rooms.png")
    with pytest.raises(InputError, match=f"99% of the map is unknown: expected {ways}, or other"):
        sample_tasks(path, load_robot("round_robot"), 2, seed=0)


@pytest.mark.parametrize(
    ("fields", "said"),
    [({"free_thresh": 0.25}, r"free_thresh 0\.25"), ({"mode": "scale"}, "mode scale")],
)
def test_no_task_leads_where_the_maps_saver_knew_nothing(tmp_path, fields, said):
    """Nav2's older savers wrote free_thresh: 0.25, with which their grey of unknown is free.

    In mode scale its value is that of a cell which is 0% occupied: free as well.
    """
    grey = np.full((60, 100), 205, dtype=np.uint8)
    grey[:, :50] = 254
    Image.fromarray(grey).save(tmp_path / "hall.pgm")
    data = {"image": "hall.pgm", "resolution": 0.1, "origin": [0.0, 0.0, 0.0]}
    data |= {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196, **fields}
    (tmp_path / "hall.yaml").write_text(yaml.safe_dump(data))
    with pytest.warns(InputWarning, match=rf"hall\.yaml: {said} makes .* 50% of") as told:
        tasks = sample_tasks(tmp_path / "hall.yaml", load_robot("round_robot"), 20, seed=0)
    assert len(told) == 1
    assert all(place[0] < 5.0 for task in tasks for place in (task.start, task.goal))


@pytest.mark.parametrize(
    ("floor", "fields"),
    [
        # A drawing, whose whole floor has the grey that savers write for unknown.
        (205, {"free_thresh": 0.25}),
        # White is 1/255 dark: 0.4% of the way from 0 to 0.65, and so 1% occupied.
        (254, {"mode": "scale", "free_thresh": 0.0}),
    ],
)
@pytest.mark.filterwarnings("ignore::drake_navbench.errors.InputWarning")
def test_floor_that_nav2_takes_for_free_has_room(tmp_path, floor, fields):
    grey = np.full((60, 100), floor, dtype=np.uint8)
    grey[:, 50:] = 0
    Image.fromarray(grey).save(tmp_path / "hall.pgm")
    data = {"image": "hall.pgm", "resolution": 0.1, "origin": [0.0, 0.0, 0.0]}
    data |= {"negate": 0, "occupied_thresh": 0.65, **fields}
    (tmp_path / "hall.yaml").write_text(yaml.safe_dump(data))
    tasks = sample_tasks(tmp_path / "hall.yaml", load_robot("round_robot"), 20, seed=0)
    assert all(place[0] < 5.0 for task in tasks for place in (task.start, task.goal))


def test_a_map_without_room_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"--goals 2: .*no two places with .* m of free floor"):
        sample_tasks(write_rooms(tmp_path), WHEELCHAIR, 2, seed=0, start=(5.05, 2.0, 0.0))


def test_they_come_from_the_command_line_and_again_from_the_manifest():
    arguments = ["--map", str(WARD), "--goals", "2", "--controllers", "rpp", "--seed", "4"]
    request = request_from_arguments(build_parser().parse_args(arguments))
    assert request.campaign().scenarios == ["ward_1", "ward_2"]
    again = type(request).model_validate_json(request.model_dump_json())
    assert again.campaign().identity == request.campaign().identity
