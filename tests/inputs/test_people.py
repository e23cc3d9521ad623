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
        (
            {"start": [3.0, 3.0], "reaction": "scared", "model": "orca"},
            "persons[0].reaction: with model orca expected one of regular, impassive, oblivious",
        ),
        ({"start": [3.0, 3.0], "orca": {}}, "orca: expected model orca, got social_force"),
        ({"start": [3.0, 3.0], "model": "rvo"}, "model: input should be 'social_force' or 'orca'"),
        (
            {"start": [3.0, 3.0], "model": "orca", "orca": {"horizon_s": 2.0}},
            "orca.horizon_s: unknown field",
        ),
        (
            {"start": [3.0, 3.0], "model": "orca", "orca": {"time_horizon_s": 0.0}},
            "orca.time_horizon_s: input should be greater than 0",
        ),
    ],
)
def test_what_is_wrong_is_one_line(person, expected):
    of_all = {name: person[name] for name in ("model", "orca") if name in person}
    with pytest.raises(InputError) as raised:
        checked({name: person[name] for name in person.keys() - of_all}, **of_all)
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


def test_what_is_new_is_not_told_where_it_is_not_used():
    hall = checked({"start": [3.0, 3.0]})
    told = hall.model_dump(mode="json")["world"]["people"]
    assert set(told) == {"persons", "start_xy_std_m", "speed_std_mps"}


def test_who_would_not_begin_in_the_free_draws_again():
    somebody = [Person(start=(3.0, 3.0)), Person(start=(3.0, 4.0))]
    people = WalkingPeople(People(persons=somebody, start_xy_std_m=0.1))
    first = people.crowd(7).state[:, :2]
    # The first draw of the first person is taken.
    again = people.crowd(7, lambda place, radius_m: not np.array_equal(place, first[0]))
    assert (again.state[0, :2] != first[0]).all()
    np.testing.assert_array_equal(again.state[1, :2], first[1])
    np.testing.assert_array_equal(
        people.crowd(7, lambda place, radius_m: False).state[:, :2], [[3.0, 3.0], [3.0, 4.0]]
    )


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
