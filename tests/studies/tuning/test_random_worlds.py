"""A random world is a function of its number."""

from __future__ import annotations

from drake_navbench.studies.tuning.guards import BOXES, random_world


def test_a_number_gives_the_same_world_again_and_another_number_another():
    first, again, other = random_world(7), random_world(7), random_world(8)
    assert first == again
    assert first.world != other.world
    assert first.name == "random_world_7"


def test_a_world_has_two_walls_and_boxes_between_start_and_goal():
    for number in range(20):
        scenario = random_world(number)
        walls, boxes = scenario.world.obstacles[:2], scenario.world.obstacles[2:]
        assert [wall.min[1] for wall in walls] == [-2.7, 2.5]
        assert len(boxes) == BOXES
        assert all(box.min[0] >= 1.3 and box.max[0] <= 7.0 for box in boxes)
        assert abs(scenario.goal[1]) <= 1.2
