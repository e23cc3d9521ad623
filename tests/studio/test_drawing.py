"""Drawing is steps between contents that the loader takes."""

from __future__ import annotations

import pytest

from drake_navbench.errors import InputError
from drake_navbench.studio import drawing
from drake_navbench.studio.drawing import EMPTY_FLOOR, Drawing
from drake_navbench.studio.drawing_tools import Hold, dragged, with_way
from drake_navbench.studio.messages import DrawnScenario
from drake_navbench.studio.scene_items import items_of

WALL = drawing.wall((3.0, -2.0), (3.0, 2.0))


def test_a_place_is_snapped_to_the_grid():
    assert drawing.snapped(1.024, 0.05) == 1.0
    assert drawing.snapped(1.026, 0.05) == 1.05
    assert drawing.snapped(1.0264, 0.0) == 1.026


def test_steps_are_undone_and_done_again_until_another_one_is_made():
    one = Drawing({"goal": [1.0, 0.0, 0.0]})
    one.change(drawing.with_entry(one.content, ("goal",), [2.0, 0.0, 0.0]))
    one.change(drawing.with_entry(one.content, ("goal",), [3.0, 0.0, 0.0]))
    assert one.undo()
    assert one.content["goal"][0] == 2.0
    assert one.redo()
    assert one.content["goal"][0] == 3.0
    assert one.undo()
    assert one.undo()
    assert not one.undo()
    assert not one.is_changed
    one.change(drawing.with_entry(one.content, ("goal",), [9.0, 0.0, 0.0]))
    assert not one.redo()
    assert one.is_changed


def test_a_wall_is_the_first_obstacle_of_a_scenario_without_a_world():
    content = drawing.with_added({"goal": [1, 0, 0]}, ("world", "obstacles"), WALL)
    assert content["world"] == {"obstacles": [WALL]}


def test_a_door_of_80_cm_leaves_two_walls_with_the_fields_of_the_one():
    high = {**WALL, "height_m": 2.5}
    parts = drawing.with_door([high], (3.0, -0.4), (3.05, 0.4))
    assert [(part["start"], part["end"]) for part in parts] == [
        ([3.0, -2.0], [3.0, -0.4]),
        ([3.0, 0.4], [3.0, 2.0]),
    ]
    assert {part["height_m"] for part in parts} == {2.5}


def test_a_door_in_a_thin_box_leaves_two_boxes():
    thin = drawing.box((0.0, 2.5), (8.0, 2.6))
    parts = drawing.with_door([thin], (3.0, 2.55), (4.0, 2.55))
    assert [(part["min"], part["max"]) for part in parts] == [
        ([0.0, 2.5], [3.0, 2.6]),
        ([4.0, 2.5], [8.0, 2.6]),
    ]


@pytest.mark.parametrize("obstacles", [[], [WALL], [drawing.box((0.0, 0.0), (2.0, 2.0))]])
def test_a_door_beside_every_wall_is_refused(obstacles):
    with pytest.raises(InputError, match="a door needs a wall"):
        drawing.with_door(obstacles, (5.0, 0.0), (5.0, 1.0))


def test_everything_of_a_person_moves():
    person = {"name": "nurse", "start": [0.0, 0.0], "goals": [[1.0, 0.0], [1.0, 1.0]]}
    moved = drawing.moved(person, (0.5, -0.5))
    assert moved == {"name": "nurse", "start": [0.5, -0.5], "goals": [[1.5, -0.5], [1.5, 0.5]]}
    assert drawing.moved([1.0, 2.0, 0.3], (1.0, 1.0)) == [2.0, 3.0, 0.3]


def test_two_areas_of_one_kind_share_a_filter_and_the_last_takes_it_along():
    area = drawing.area((1.0, 1.0), (0.0, 0.0), 40)
    assert area == {"polygon": [[0, 0], [1, 0], [1, 1], [0, 1]], "value": 40}
    once = drawing.with_area({}, (), "speed_percent", area)
    twice = drawing.with_area(once, (), "speed_percent", area)
    assert [len(entry["areas"]) for entry in twice["filters"]] == [2]
    left = drawing.without(twice, ("filters", 0, "areas", 0))
    assert drawing.without(left, ("filters", 0, "areas", 0)) == {}


def test_the_last_person_takes_people_along():
    content = {"world": {"people": {"persons": [{"start": [0, 0]}]}, "obstacles": []}}
    left = drawing.without(content, ("world", "people", "persons", 0))
    assert left == {"world": {"obstacles": []}}


def test_the_start_cannot_be_deleted():
    with pytest.raises(InputError, match="start: a scenario needs it"):
        drawing.without({"start": [0, 0, 0]}, ("start",))


def test_a_pose_looks_where_the_mouse_was_drawn_to():
    assert drawing.pose((1.0, 1.0), (1.0, 2.0), [0, 0, 0.3]) == [1.0, 1.0, 1.571]
    assert drawing.pose((1.0, 1.0), (1.0, 1.0), [0, 0, 0.3]) == [1.0, 1.0, 0.3]


def hold(tool) -> Hold:
    return Hold(tool, (), 50, 0.5)


def test_a_cart_goes_to_each_click_at_its_speed_with_its_front_ahead():
    content = EMPTY_FLOOR
    for number, click in enumerate([(2.0, -2.0), (2.0, 2.0), (0.0, 2.0)]):
        content = with_way(content, hold("Cart"), click, goes_on=number > 0)
    (cart,) = content["world"]["moving_obstacles"]
    # 4 m and 2 m at 0.5 m/s; it looks along +y, then along -x.
    assert [(w["time_s"], w["position"], w["yaw_rad"]) for w in cart["waypoints"]] == [
        (0.0, [2.0, -2.0], 1.571),
        (8.0, [2.0, 2.0], 1.571),
        (12.0, [0.0, 2.0], 3.142),
    ]
    # Where it already is it does not go again.
    assert with_way(content, hold("Cart"), (0.0, 2.0), goes_on=True) == content
    (moving,) = [item for item in items_of(content) if item.kind == "moving"]
    # 1.0 m long along +y, 0.6 m wide.
    assert moving.outline.min(axis=0) == pytest.approx([1.7, -2.5], abs=1e-3)
    assert moving.way[-1].tolist() == [0.0, 2.0]
    DrawnScenario(content, "drawn.yaml").scenario()


def test_the_cart_turns_the_shorter_way():
    cart = drawing.moving_box((0.0, 0.0))
    for place in ((-1.0, 0.2), (-2.0, 0.0)):
        cart = drawing.moved_on(cart, place, 0.5)
    turns = [entry["yaw_rad"] for entry in cart["waypoints"]]
    assert turns[2] - turns[1] == pytest.approx(0.395, abs=1e-3)


def test_a_waypoint_is_a_goal_before_the_goal_which_the_loader_takes():
    content = dragged(EMPTY_FLOOR, hold("Waypoint"), (2.0, 1.0), (2.0, 2.0))
    assert content["waypoints"] == [[2.0, 1.0, 1.571]]
    assert content["navigation_mode"] == "navigate_to_pose"
    goals = DrawnScenario(content, "drawn.yaml").scenario().goals
    assert goals == ((2.0, 1.0, 1.571), (5.0, 0.0, 0.0))
    through = EMPTY_FLOOR | {"navigation_mode": "navigate_through_poses"}
    content = dragged(through, hold("Waypoint"), (2.0, 1.0), (2.0, 2.0))
    assert content["navigation_mode"] == "navigate_through_poses"
    assert "waypoints" not in drawing.without(content, ("waypoints", 0))


def test_a_start_that_the_file_leaves_out_is_the_loaders_and_can_be_moved():
    content = {"goal": [5.0, 0.0, 0.0]}
    assert drawing.entry_at(content, ("start",)) == [0.0, 0.0, 0.0]
    moved = dragged(content, hold("Move")._replace(picked=("start",)), (0.0, 0.0), (1.0, 0.5))
    assert moved["start"] == [1.0, 0.5, 0.0]
