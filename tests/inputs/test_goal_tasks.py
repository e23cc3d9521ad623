"""The ways between a file's places are tasks, on a map and in a world."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import pytest

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.run import build_parser
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.goal_file import read_goal_file
from drake_navbench.inputs.goal_tasks import given_tasks
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.task_check import check_task

WARD = Path(__file__).parents[2] / "scenarios" / "maps" / "ward.yaml"
ROUND = load_robot("round_robot")
LONG = load_robot("wheelchair")


def tasks(folder, text, *, robots=(ROUND,), start=None, name="waypoints.yaml"):
    path = folder / name
    path.write_text(text)
    return given_tasks(read_goal_file(path), WARD, robots, start=start)


def test_each_way_from_place_to_place_is_a_task(tmp_path):
    found = tasks(tmp_path, "goals: [[0, 0, 0], [4, -1, 1.5], [8, -1, -1.5]]")
    assert [(task.start, task.goal) for task in found] == [
        ((0.0, 0.0, 0.0), (4.0, -1.0, 1.5)),
        ((4.0, -1.0, 1.5), (8.0, -1.0, -1.5)),
    ]
    assert [task.name for task in found] == ["ward_1", "ward_2"]
    assert found[1].description == "ward.yaml: from goals[1] to goals[2]"
    assert {task.suite.name for task in found} == {"ward"}


@pytest.mark.parametrize(
    ("text", "start"),
    [
        ("goals: [[4, -1, 1.5]]\ninitial_pose: {x: 0, y: 0, yaw: 0.5}", None),
        ("goals: [[4, -1, 1.5]]\ninitial_pose: {x: 7, y: 0, yaw: 0.5}", (0.0, 0.0, 0.5)),
    ],
)
def test_the_first_way_begins_at_the_start_of_file_or_command_line(tmp_path, text, start):
    (task,) = tasks(tmp_path, text, start=start)
    assert (task.start, task.goal) == ((0.0, 0.0, 0.5), (4.0, -1.0, 1.5))


def test_places_without_headings_face_the_way_and_the_same_place_twice_is_one(tmp_path):
    with pytest.warns(InputWarning, match="no place has a heading"):
        first, second = tasks(tmp_path, "0 0\n4 0\n4 0\n4 -2\n", name="path.txt")
    assert (first.start, first.goal) == ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0))
    assert (second.start, second.goal) == ((4.0, 0.0, 0.0), (4.0, -2.0, -math.pi / 2.0))


def test_a_way_that_a_patrol_repeats_is_one_task(tmp_path):
    there, back = "[0, 0, 0]", "[4, -1, 1.5]"
    with pytest.warns(InputWarning, match="2 of 4 ways repeat an earlier one; each is driven once"):
        found = tasks(tmp_path, f"goals: [{there}, {back}, {there}, {back}, {there}]")
    assert [task.goal[0] for task in found] == [4.0, 0.0]


def test_a_place_where_the_robot_cannot_stand_is_told_and_left_out(tmp_path):
    """A wheelchair at (-1, 0) has its front in the wall, the round robot has room."""
    text = "a: [0, 0, 0]\nb: [1.5, 2, 0]\nc: [-1, 0, 3.14]\nd: [99, 0, 0]\ne: [4, -1, 0]"
    with pytest.warns(InputWarning, match="left out") as told:
        found = tasks(tmp_path, text, robots=(ROUND, LONG))
    assert str(told[0].message) == (
        f"{tmp_path}/waypoints.yaml: left out: b (1.500, 2.000) lies inside an obstacle; "
        "c (-1.000, 0.000) lies where the robot's footprint overlaps an obstacle; "
        "d (99.000, 0.000) lies off the map"
    )
    assert [task.description for task in found] == ["ward.yaml: from a to e"]


def test_a_start_without_a_heading_is_free_for_a_long_robot(tmp_path):
    """It comes to (-0.95, 0) facing the wall, and departs in a heading in which it has room."""
    with pytest.warns(InputWarning, match="no place has a heading"):
        found = tasks(tmp_path, "2 0\n-0.95 0\n2 -1\n", robots=(LONG,), name="path.txt")
    for task in found:
        check_task(task, LONG)


def test_each_edge_of_a_graph_is_a_task(tmp_path):
    text = "{nodes: [{id: a, x: 0, y: 0}, {id: b, x: 4, y: 0}], edges: [[b, a], [a, b]]}"
    with pytest.warns(InputWarning, match="no place has a heading"):
        found = tasks(tmp_path, text)
    assert [task.description[11:] for task in found] == ["from b to a", "from a to b"]
    assert found[0].start == (4.0, 0.0, math.pi)
    turned = text.replace("y: 0", "y: 0, yaw: 0")
    with pytest.raises(InputError, match="--start: each edge"):
        tasks(tmp_path, turned, start=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("goals: [[0, 0, 0]]", "no way between two of its 1 places"),
        ("goals: [[0, 0, 0], [0, 0, 0]]", "no way between two of its 2 places"),
        ("goals: [[99, 0, 0], [50, 0, 0]]", "expected places on the map"),
        (
            f"goals: {[[0, 0, 0.001 * i] for i in range(1001)]}",
            "1001 places; expected at most 1000",
        ),
    ],
)
def test_files_without_a_way_are_one_line(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as refused:
        tasks(tmp_path, text)
    assert str(refused.value).startswith(f"{tmp_path}/waypoints.yaml: ")


def test_the_points_of_a_path_are_told(tmp_path):
    with pytest.warns(InputWarning, match="3 of 4 ways are shorter than 0.25 m"):
        tasks(tmp_path, "0 0 0\n0.1 0 0\n0.2 0 0\n0.3 0 0\n4 0 0\n", name="path.csv")


WORLD = """<sdf version="1.6"><world name="w"><model name="box"><static>true</static>
<pose>2 0 0.5 0 0 0</pose><link name="l"><collision name="c"><geometry><box><size>1 1 1</size>
</box></geometry></collision></link></model></world></sdf>"""


def test_map_and_world_take_them_from_the_command_line_and_again_from_the_manifest(tmp_path):
    world, goals = tmp_path / "box.world", tmp_path / "goals.csv"
    world.write_text(WORLD)
    goals.write_text("0,0,0\n2,0,0\n4,-1,0\n")
    for place in (["--map", str(WARD)], [str(world)]):
        options = [*place, "--goals", str(goals), "--robot", "round_robot", "--controllers", "rpp"]
        request = request_from_arguments(build_parser().parse_args(options))
        again = type(request).model_validate_json(request.model_dump_json())
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", InputWarning)
            found = again.shown().scenarios
        ends = [(task.start[:2], task.goal[:2]) for task in found]
        if place[0] == "--map":
            assert ends == [((0.0, 0.0), (2.0, 0.0)), ((2.0, 0.0), (4.0, -1.0))]
        else:
            assert ends == [((0.0, 0.0), (4.0, -1.0))]
            assert "line 2 (2.000, 0.000) lies inside an obstacle" in str(told[0].message)


def test_places_on_the_earth_lie_in_a_world_that_tells_its_origin(tmp_path):
    # A second of arc on the equator: 30.92 m to the east.
    goals = tmp_path / "gps.yaml"
    goals.write_text(
        "waypoints:\n- {latitude: 0, longitude: 10, yaw: 0}\n"
        f"- {{latitude: 0, longitude: {10 + 1 / 3600}, yaw: 0}}\n"
    )
    origin = (
        "<spherical_coordinates><latitude_deg>0</latitude_deg><longitude_deg>10</longitude_deg>"
        "<heading_deg>{}</heading_deg></spherical_coordinates></world>"
    )
    shifted = WORLD.replace("<pose>2 0", "<pose>9 0")

    def ways(content: str, *more: Path):
        world = tmp_path / "earth.world"
        world.write_text(content)
        options = [*map(str, (world, *more)), "--goals", str(goals), "--robot", "round_robot"]
        options += ["--controllers", "rpp"]
        return request_from_arguments(build_parser().parse_args(options)).shown().scenarios

    (task,) = ways(shifted.replace("</world>", origin.format(180)))
    assert task.start[:2] == (0.0, 0.0)
    assert task.goal == (pytest.approx(30.92, abs=0.01), 0.0, 0.0)
    # A second world, whose origin lies a second of arc further to the east.
    further = tmp_path / "further.world"
    further.write_text(
        shifted.replace("</world>", origin.format(180)).replace(">10<", f">{10 + 1 / 3600}<")
    )
    _, task = ways(shifted.replace("</world>", origin.format(180)), further)
    assert task.start[:2] == (pytest.approx(-30.92, abs=0.01), 0.0)
    with pytest.raises(InputError, match="heading_deg 90; expected 0 or 180"):
        ways(shifted.replace("</world>", origin.format(90)))
    with pytest.raises(InputError, match="expected a Gazebo world with <spherical_coordinates>"):
        ways(shifted)


@pytest.mark.parametrize("given", ["0", "2.5", "many"])
def test_neither_a_number_nor_a_file_is_one_line(given, capsys):
    with pytest.raises(SystemExit):
        build_parser().parse_args(["--map", str(WARD), "--goals", given])
    assert f"--goals: got '{given}', expected a whole number of at" in capsys.readouterr().err
