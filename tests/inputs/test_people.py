"""People in a scenario file: typed, in free space, the same for every controller."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.people import People, Person, WalkingPeople, scanned_discs
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.typed_files.typed_yaml import validate

WALL = {"type": "box", "min": [2.0, 1.0], "max": [4.0, 1.2]}


def checked(*persons, **people):
    data = {
        "name": "hall",
        "description": "a hall",
        "world": {"obstacles": [WALL], "people": {"persons": list(persons)} | people},
        "goal": [8.0, 0.0, 0.0],
    }
    hall = validate(Scenario, data, "hall.yaml")
    check_task(hall, hall.load_robot("wheelchair"))
    return hall


@pytest.mark.parametrize(
    ("person", "expected"),
    [
        ({"start": [0.2, 0.1]}, "persons[0].start: [0.2, 0.1] is where the robot's footprint is"),
        ({"start": [3.0, 1.1]}, "persons[0].start: [3.0, 1.1] is inside an obstacle"),
        (
            {"start": [3.0, 3.0], "goals": [[3.0, -3.0]]},
            "persons[0].goals: the straight way from [3.0, 3.0] to [3.0, -3.0] leads through",
        ),
        ({"start": [3.0, 3.0], "reaction": "angry"}, "reaction: input should be 'regular'"),
        ({"start": [3.0, 3.0], "speed_mps": 5.0}, "less than or equal to 2"),
    ],
)
def test_what_is_wrong_is_one_line(person, expected):
    with pytest.raises(InputError) as raised:
        checked(person)
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


def test_the_way_back_counts_where_it_repeats():
    round_the_wall = [[1.0, 3.0], [1.0, -2.0], [5.0, -2.0]]
    with pytest.raises(InputError, match="leads through an obstacle"):
        checked({"start": [3.0, 3.0], "goals": round_the_wall})
    checked({"start": [3.0, 3.0], "goals": round_the_wall, "repeats": False})


def test_people_are_a_function_of_the_seed():
    somebody = [Person(start=(3.0, 3.0), goals=[(5.0, 3.0)]), Person(start=(3.0, 4.0))]
    people = WalkingPeople(People(persons=somebody, start_xy_std_m=0.1, speed_std_mps=0.1))
    np.testing.assert_array_equal(people.crowd(7).state, people.crowd(7).state)
    assert (people.crowd(7).state[:, :2] != people.crowd(8).state[:, :2]).all()
    drawn = np.array([people.crowd(seed).state[0, :2] for seed in range(400)])
    np.testing.assert_allclose(drawn.std(axis=0), 0.1, rtol=0.15)


def test_a_scanner_below_the_hip_sees_two_legs_and_above_it_a_trunk():
    poses = np.array([[2.0, 1.0, np.pi / 2]])
    legs = scanned_discs(poses, np.array([0.0]), np.array([0.0]), 0.2)
    # Standing with its back to -y: the left leg is at smaller x.
    np.testing.assert_allclose(legs, [[1.89, 1.0, 0.06], [2.11, 1.0, 0.06]], atol=1e-12)
    # A quarter of a stride of 1.3 m on, at 1 m/s, the left foot is 0.28 m ahead.
    legs = scanned_discs(poses, np.array([0.325]), np.array([1.0]), 0.2)
    np.testing.assert_allclose(legs[:, 1], [1.28, 0.72])
    trunk = scanned_discs(poses, np.array([0.325]), np.array([1.0]), 1.2)
    np.testing.assert_allclose(trunk, [[2.0, 1.0, 0.18]])
