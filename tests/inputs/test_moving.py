"""Ways of what moves are typed, within bounds, and lead through free space."""

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.typed_files.typed_yaml import validate

WALL = {"type": "box", "min": [2.0, 1.0], "max": [4.0, 1.2]}


def cart(*waypoints, **fields):
    points = [{"time_s": t, "position": [x, y]} for t, x, y in waypoints]
    return {"type": "box", "size_m": [1.0, 0.6], "waypoints": points} | fields


def scenario(*moving, obstacles=()):
    data = {
        "name": "hall",
        "description": "a hall",
        "world": {"obstacles": list(obstacles), "moving_obstacles": list(moving)},
        "goal": [8.0, 0.0, 0.0],
    }
    return validate(Scenario, data, "hall.yaml")


def checked(*moving, obstacles=()):
    hall = scenario(*moving, obstacles=obstacles)
    check_task(hall, hall.load_robot("wheelchair"))
    return hall


def fault(*moving, obstacles=()):
    with pytest.raises(InputError) as raised:
        checked(*moving, obstacles=obstacles)
    line = str(raised.value)
    assert "\n" not in line
    return line


def test_times_of_waypoints_must_rise():
    line = fault(cart((1.0, 3.0, 3.0), (1.0, 4.0, 3.0)))
    assert line.startswith(
        "hall.yaml: world.moving_obstacles[0].box: waypoints[1].time_s: expected"
    )


def test_nothing_moves_faster_than_can_be_meant():
    assert "at most 20 m/s" in fault(cart((0.0, 3.0, 3.0), (1.0, 3.0, 50.0)))


def test_what_repeats_ends_where_it_began():
    line = fault(cart((0.0, 3.0, 3.0), (1.0, 4.0, 3.0), (2.0, 4.0, 4.0), repeats=True))
    assert "repeats: expected three waypoints or more" in line


def test_a_misspelt_field_is_named():
    assert "unknown field" in fault(cart((0.0, 3.0, 3.0), speed=3.0))


def test_a_way_through_a_wall_is_refused():
    line = fault(cart((0.0, 3.0, 3.0), (5.0, 3.0, -3.0)), obstacles=[WALL])
    assert line == (
        "scenario hall: world.moving_obstacles[0].waypoints[1]: the way there leads through an "
        "obstacle; expected free space"
    )


def test_what_never_moves_must_not_stand_in_a_wall():
    assert "leads through an obstacle" in fault(cart((0.0, 3.0, 1.1)), obstacles=[WALL])


def test_nothing_may_begin_on_the_robot():
    assert "begins where the robot's footprint is" in fault(cart((3.0, 0.5, 0.0), (9.0, 5.0, 0.0)))


def test_a_way_beside_the_wall_is_fine():
    hall = checked(cart((0.0, 1.4, 3.0), (5.0, 1.4, -3.0)), obstacles=[WALL])
    assert len(hall.world.moving_obstacles) == 1


def test_a_world_that_stands_still_is_told_as_ever():
    """So that logs and identities of trials are what they were."""
    assert set(scenario().model_dump()["world"]) == {"map", "obstacles"}


def test_a_lidar_sees_what_moves_where_it_is_solid_and_high_enough():
    way = (0.0, 3.0, 3.0)
    hall = scenario(
        cart(way), cart(way, material="glass"), cart(way, height_m=0.1), cart(way, height_m=0.4)
    )
    seen = hall.true_world.moving.seen_at(0.2)
    # Four edges each of the first and of the last, which keep their numbers.
    assert seen.edges[:, 0].tolist() == [0.0] * 4 + [3.0] * 4
    told = hall.model_dump()["world"]["moving_obstacles"]
    assert ["material" in thing for thing in told] == [False, True, False, False]
    assert "material: input should be 'solid' or 'glass'" in fault(cart(way, material="wood"))
