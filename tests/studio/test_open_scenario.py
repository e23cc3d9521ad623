"""Every file that the loader takes is opened, drawn and saved again, and nothing of it is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_navbench.commands import studio
from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import SCENARIO_FILES
from drake_navbench.studio import drawing
from drake_navbench.studio.goal_ways import ways_between
from drake_navbench.studio.messages import DrawnScenario
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.open_scenario import OpenScenario, files_of
from drake_navbench.studio.scene_items import item_at, items_of
from drake_navbench.studio.tasks import check_drawing, open_scenario

MAPS = Path(__file__).parents[2] / "scenarios" / "maps"


@pytest.fixture
def scenario(tmp_path) -> OpenScenario:
    return OpenScenario(OpenFolder.at(tmp_path))


@pytest.mark.parametrize("name", SCENARIO_FILES.names)
def test_a_built_in_scenario_is_opened_and_saved_to_the_last_byte(scenario, tmp_path, name):
    scenario.open("built-in", name)
    items = items_of(scenario.drawing.content, scenario.floor)
    assert {item.kind for item in items} >= {"start"}
    scenario.save(f"{name}.yaml")
    saved = (tmp_path / f"{name}.yaml").read_bytes()
    assert saved == SCENARIO_FILES.find(name).read_bytes()
    drawn = DrawnScenario(scenario.drawing.content, scenario.path)
    ground = open_scenario(drawn)
    assert (ground is None) == (drawn.scenario().places[0].map is None)


def test_steps_that_are_not_saved_are_dropped_at_the_second_choice_only(scenario):
    scenario.change(drawing.with_entry(scenario.drawing.content, ("goal",), [4.0, 0.0, 0.0]))
    with pytest.raises(InputError, match=r"drawn\.yaml: has steps that are not saved"):
        scenario.open("built-in", "doorway")
    assert scenario.drawing.content["goal"][0] == 4.0
    scenario.open("built-in", "doorway")
    assert scenario.name == "doorway.yaml"
    scenario.open("built-in", "empty")


def test_what_the_loader_refuses_is_no_step(scenario):
    wrong = drawing.with_added(
        scenario.drawing.content, ("world", "obstacles"), drawing.wall((1, 1), (1, 1))
    )
    with pytest.raises(InputError, match=r"drawn\.yaml: world\.obstacles\[0\].*coincide"):
        scenario.change(wrong)
    assert not scenario.drawing.is_changed


def test_the_check_says_what_the_loader_says(scenario):
    content = drawing.with_added(
        scenario.drawing.content, ("world", "obstacles"), drawing.box((-0.2, -0.2), (0.2, 0.2))
    )
    (fault,) = check_drawing(DrawnScenario(content, scenario.path), "wheelchair").faults
    assert fault == (
        "scenario drawn: start: the robot's footprint at [0.0, 0.0, 0.0] overlaps an obstacle; "
        "expected free space"
    )


def room(scenario, door_m: float) -> DrawnScenario:
    """Returns a corridor 4 m wide with a wall across it and a door in the middle."""
    content = scenario.drawing.content
    walls = [
        drawing.wall((-2, 2), (7, 2)),
        drawing.wall((-2, -2), (7, -2)),
        drawing.wall((-2, -2), (-2, 2)),
        drawing.wall((7, -2), (7, 2)),
        drawing.wall((2.5, -2), (2.5, 2)),
    ]
    if door_m:
        walls = drawing.with_door(walls, (2.5, -0.5 * door_m), (2.5, 0.5 * door_m))
    return DrawnScenario(drawing.with_entry(content, ("world", "obstacles"), walls), scenario.path)


def test_a_drawing_without_a_way_is_told(scenario):
    (fault,) = check_drawing(room(scenario, 0.0), "wheelchair").faults
    assert fault.startswith("scenario drawn: no way to [5.0, 0.0]: ")


def test_a_door_narrower_than_the_robot_is_told_and_a_wide_one_is_not(scenario):
    """The wheelchair is 0.6 m wide."""
    assert check_drawing(room(scenario, 0.5), "wheelchair").faults
    checked = check_drawing(room(scenario, 1.0), "wheelchair")
    assert checked.faults == ()
    (plan,) = checked.plans
    assert plan[-1] == pytest.approx([5.0, 0.0], abs=0.05)


def test_a_map_outside_the_folder_is_not_opened(tmp_path):
    (tmp_path / "map.yaml").write_text("image: map.pgm\n")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "a.yaml").write_text("world: {map: ../map.yaml}\ngoal: [1, 0, 0]\n")
    scenario = OpenScenario(OpenFolder.at(tmp_path / "mine"))
    with pytest.raises(InputError, match=r"\.\./map\.yaml: lies outside"):
        scenario.open("file", "a.yaml")


def test_files_are_told_apart_by_their_fields(scenario, tmp_path):
    (tmp_path / "a.yaml").write_text("goal: [1, 0, 0]\n")
    (tmp_path / "b.yaml").write_text("image: b.pgm\n")
    (tmp_path / "c.yaml").write_text("controller_server:\n  ros__parameters: {}\n")
    folder = OpenFolder.at(tmp_path)
    assert [files_of(folder, kind) for kind in ("scenario", "map", "nav2", "robot")] == [
        ["a.yaml"],
        ["b.yaml"],
        ["c.yaml"],
        [],
    ]


def test_a_click_takes_the_pose_before_the_wall_and_the_smaller_before_the_larger():
    content = {
        "world": {
            "obstacles": [
                drawing.box((-3, -3), (3, 3)),
                drawing.box((1, 1), (2, 2)),
            ]
        },
        "start": [1.5, 1.5, 0.0],
        "goal": [5.0, 0.0, 0.0],
    }
    items = items_of(content)
    assert item_at(items, (1.5, 1.6)).place == ("start",)
    assert item_at(items, (1.1, 1.9)).place == ("world", "obstacles", 1)
    assert item_at(items, (-2.0, 0.0)).place == ("world", "obstacles", 0)
    assert item_at(items, (4.0, 2.0)) is None


def test_the_ways_between_the_places_of_a_file_can_be_opened(tmp_path):
    for suffix in (".yaml", ".png"):
        (tmp_path / f"ward{suffix}").write_bytes((MAPS / f"ward{suffix}").read_bytes())
    places = tmp_path / "places.yaml"
    places.write_text(
        "waypoints:\n- {x: 4.3, y: -1.5, yaw: 0.0}\n- {x: 7.6, y: -1.7, yaw: 0.0}\n"
        "- {x: 9.3, y: 0.1, yaw: 1.5}\n"
    )
    folder = OpenFolder.at(tmp_path)
    ways = ways_between(folder, tmp_path / "ward.yaml", places, "wheelchair")
    assert [(way["start"], way["goal"]) for way in ways.values()] == [
        ([4.3, -1.5, 0.0], [7.6, -1.7, 0.0]), ([7.6, -1.7, 0.0], [9.3, 0.1, 1.5]),
    ]  # fmt: skip
    scenario = OpenScenario(folder)
    scenario.open_new(ways["ward_1"], "ward_1.yaml")
    drawn = DrawnScenario(scenario.drawing.content, scenario.path).scenario()
    assert drawn.world.map == "ward.yaml"
    assert drawn.navigation_mode == "navigate_to_pose"


def test_the_map_of_the_ways_lies_in_the_folder(tmp_path):
    (tmp_path / "places.yaml").write_text("waypoints:\n- {x: 4.3, y: -1.5}\n- {x: 7.6, y: -1.7}\n")
    with pytest.raises(InputError, match="lies outside"):
        ways_between(
            OpenFolder.at(tmp_path), MAPS / "ward.yaml", tmp_path / "places.yaml", "wheelchair"
        )


@pytest.mark.parametrize("option", ["--map", "--goals"])
def test_map_and_places_are_given_together(option, tmp_path, capsys):
    assert studio.main([str(tmp_path), option, "file.yaml"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "--map and --goals FILE: expected both or none"
