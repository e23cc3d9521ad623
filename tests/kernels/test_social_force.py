"""People walk by the social force model, and react to a robot as they are said to."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.inputs.people import REACTIONS, People, Person, WalkingPeople
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.social_force import social_force, step_people
from drake_navbench.kernels.walking import TIME_GAP, VX, VY, YAW, X, Y, pace_behind_others

STEP_S = 0.05
NO_EDGES, NO_CIRCLES = np.empty((0, 4)), np.empty((0, 3))
CORNERS = np.array([[-0.55, -0.3], [0.55, -0.3], [0.55, 0.3], [-0.55, 0.3]])


def robot_at(x, y, *, yaw=0.0, velocity=(0.0, 0.0)):
    """Returns a chair of 1.1 m by 0.6 m as the kernel takes it."""
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    turned = CORNERS @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
    outline = turned + np.array([x, y])
    edges = np.hstack([outline, np.roll(outline, -1, axis=0)])
    return np.array([x, y, yaw, *velocity, 0.55]), edges


FAR_AWAY = robot_at(500.0, 0.0)
# Of a robot on somebody's way.
NOT_OUT_OF_THE_WAY = {"threatening", "curious", "oblivious"}


def walk(*persons, duration_s, edges=NO_EDGES, robot=FAR_AWAY):
    """Returns (T, P, 8) the ways of people, the first row where they begin."""
    crowd = WalkingPeople(People(persons=list(persons))).crowd(seed=0)
    rows = [crowd.state]
    for _ in range(round(duration_s / STEP_S)):
        rows.append(
            step_people(
                read_only(rows[-1]), crowd.traits, crowd.goals, edges, NO_CIRCLES, *robot, STEP_S
            )
        )
    return np.array(rows)


def to_the_right(**fields):
    return Person(**{"start": (0.0, 0.0), "goals": [(50.0, 0.0)]} | fields)


def gaps_to_chair(way, robot):
    """Returns the least distance of a person's body to the chair's outline at each step, m."""
    x, y = way[:, X] - robot[0][0], way[:, Y] - robot[0][1]
    outside = np.maximum(np.abs(np.column_stack([x, y])) - [0.55, 0.3], 0.0)
    return np.hypot(*outside.T) - 0.3


def test_somebody_alone_comes_to_the_wanted_speed():
    way = walk(to_the_right(speed_mps=1.2), duration_s=3.0)[:, 0]
    # dv = 2 (1.2 - v) / 0.5 dt: a fifth of what lacks, each step of 0.05 s.
    np.testing.assert_allclose(way[1:4, VX], 1.2 * (1.0 - 0.8 ** np.arange(1, 4)))
    assert way[-1, VX] == pytest.approx(1.2, abs=1e-5)
    np.testing.assert_allclose(way[:, Y], 0.0)


def test_who_has_no_goal_stays():
    way = walk(Person(start=(1.0, 2.0)), duration_s=1.0)[:, 0]
    np.testing.assert_allclose(way[-1, :2], [1.0, 2.0])


def test_goals_come_one_after_another_and_again():
    there = Person(start=(0.0, 0.0), goals=[(2.0, 0.0), (0.0, 0.0)], speed_mps=1.0)
    way = walk(there, duration_s=12.0)[:, 0]
    turns = np.count_nonzero(np.diff(np.sign(way[20:, VX])) != 0)
    assert turns >= 3
    assert 1.6 < way[:, X].max() < 2.2


def test_the_social_force_of_two_at_rest_a_metre_apart():
    # |D| = 1, so B = 0.35 m, and the angle is 0: f = -exp(-1 / 0.35).
    fx, fy = social_force(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    assert fx == pytest.approx(-math.exp(-1.0 / 0.35))
    assert fy == 0.0


places, speeds = st.floats(-5.0, 5.0), st.floats(-2.0, 2.0)


@settings(max_examples=200, deadline=None)
@given(x=places, y=places, vx=speeds, vy=speeds, wx=speeds, wy=speeds)
def test_the_social_force_is_that_of_the_other_turned_round(x, y, vx, vy, wx, wy):
    one = social_force(0.0, 0.0, vx, vy, x, y, wx, wy)
    other = social_force(x, y, wx, wy, 0.0, 0.0, vx, vy)
    np.testing.assert_allclose(one, np.negative(other), atol=1e-9)


def test_two_who_meet_give_way_and_do_not_touch():
    comes = Person(start=(10.0, 0.1), goals=[(-50.0, 0.0)], yaw_rad=np.pi)
    ways = walk(to_the_right(), comes, duration_s=12.0)
    apart = np.hypot(*(ways[:, 0, :2] - ways[:, 1, :2]).T)
    assert apart.min() > 0.6
    assert ways[-1, 0, X] > 9.0
    assert ways[-1, 1, X] < 1.0


def test_a_wall_stops_somebody_where_the_forces_balance():
    wall = np.array([[5.0, -50.0, 5.0, 50.0]])
    way = walk(to_the_right(speed_mps=1.0), duration_s=20.0, edges=wall)[:, 0]
    # 2 * 1 / 0.5 = 10 exp(-(d - 0.3) / 0.2).
    assert 5.0 - way[-1, X] == pytest.approx(0.3 + 0.2 * math.log(2.5), abs=1e-3)


def test_a_group_stays_together_and_strangers_do_not_come():
    group = [Person(start=(0.0, 2.0 * i), group=1) for i in (-1, 1)]
    ways = walk(*group, duration_s=10.0)
    apart = np.hypot(*(ways[:, 0, :2] - ways[:, 1, :2]).T)
    assert apart[-1] < 2.0
    strangers = [Person(start=(0.0, 2.0 * i)) for i in (-1, 1)]
    ways = walk(*strangers, duration_s=10.0)
    assert np.hypot(*(ways[-1, 0, :2] - ways[-1, 1, :2])) > 3.9


@pytest.mark.parametrize("reaction", sorted(set(REACTIONS) - NOT_OUT_OF_THE_WAY))
def test_nobody_on_the_way_walks_into_the_chair(reaction):
    robot = robot_at(5.0, 0.05)
    way = walk(to_the_right(reaction=reaction), duration_s=15.0, robot=robot)[:, 0]
    assert gaps_to_chair(way, robot).min() > 0.05


def test_the_oblivious_walk_as_if_there_were_no_robot():
    person = to_the_right(reaction="oblivious")
    ways = [walk(person, duration_s=9.0, robot=one) for one in (FAR_AWAY, robot_at(5.0, 0.05))]
    np.testing.assert_array_equal(*ways)


def test_the_regular_go_round_the_robot_sooner_than_the_impassive():
    robot = robot_at(5.0, 0.05, velocity=(-0.5, 0.0))
    aside = {
        reaction: np.abs(
            walk(to_the_right(reaction=reaction), duration_s=3.0, robot=robot)[:, 0, Y]
        ).max()
        for reaction in ("regular", "impassive")
    }
    assert aside["regular"] > 2.0 * aside["impassive"]


def test_the_surprised_stop_and_look_for_30_s():
    robot = robot_at(3.0, 2.0)
    way = walk(to_the_right(reaction="surprised"), duration_s=32.0, robot=robot)[:, 0]
    np.testing.assert_allclose(way[20:590, VX], 0.0)
    assert way[100, YAW] == pytest.approx(math.atan2(2.0, 3.0), abs=0.05)
    assert way[-1, VX] > 0.5


def test_who_does_not_see_the_robot_does_not_react():
    behind = robot_at(-3.0, 0.0)
    way = walk(to_the_right(reaction="surprised"), duration_s=2.0, robot=behind)[:, 0]
    assert way[-1, VX] > 0.9


def test_the_curious_come_to_a_metre_and_a_half():
    robot = robot_at(0.0, 0.0)
    curious = Person(start=(6.0, 0.5), yaw_rad=np.pi, reaction="curious")
    way = walk(curious, duration_s=25.0, robot=robot)[:, 0]
    distance = np.hypot(way[:, X], way[:, Y])
    assert distance.min() == pytest.approx(1.5, abs=0.1)
    # A child slows down as it comes near: 1.8 m/s d / 10 m.
    speeds_mps = np.hypot(way[:, VX], way[:, VY])
    assert speeds_mps.max() < 1.8 * 6.1 / 10.0


def test_the_scared_keep_farther_away():
    robot = robot_at(0.0, 0.0)
    scared = Person(start=(2.0, 0.0), yaw_rad=np.pi, goals=[(-20.0, 0.0)], reaction="scared")
    regular = scared.model_copy(update={"reaction": "regular"})
    for duration_s, least_m in ((1.0, 0.5), (4.0, 1.0)):
        ways = [walk(p, duration_s=duration_s, robot=robot)[:, 0] for p in (scared, regular)]
        nearest = [np.hypot(way[:, X], way[:, Y]).min() for way in ways]
        assert nearest[0] > nearest[1]
        assert nearest[0] > least_m


def test_who_threatens_stands_in_the_robots_way():
    robot = robot_at(0.0, 0.0, yaw=np.pi / 2)
    threat = Person(start=(2.0, 3.0), yaw_rad=-2.0, reaction="threatening")
    way = walk(threat, duration_s=10.0, robot=robot)[:, 0]
    # 1.1 m ahead of the front, 0.55 m from the centre, which looks along y.
    np.testing.assert_allclose(way[-1, :2], [0.0, 1.65], atol=0.15)
    assert gaps_to_chair(way[:, [1, 0]], robot).min() > 0.0


def paced(*others, time_gap_s=1.0):
    """Returns the pace along x of one at the origin who would like 1.4 m/s behind others."""
    people = np.zeros((1 + len(others), 8))
    people[1:, :2] = others
    return pace_behind_others(0, people, time_gap_s, 1.0, 0.0, 1.4)


def test_one_keeps_a_time_gap_to_the_nearest_ahead():
    # (1 m - 0.3 m) / 1 s; who is aside by more than 0.3 m, or behind, does not count.
    assert paced((1.0, 0.0), (3.0, 0.0)) == pytest.approx(0.7)
    assert paced((1.0, 0.0), time_gap_s=2.0) == pytest.approx(0.35)
    assert paced((1.0, 0.31), (-1.0, 0.0)) == 1.4
    assert paced((0.2, 0.1)) == 0.0
    assert paced((1.0, 0.0), time_gap_s=0.0) == 1.4


def test_who_follows_somebody_slow_with_a_time_gap_is_as_slow():
    slow = Person(start=(3.0, 0.0), goals=[(90.0, 0.0)], speed_mps=0.5)
    fast = Person(start=(0.0, 0.0), goals=[(90.0, 0.0)], speed_mps=1.5)
    for model in ("social_force", "orca"):
        people = People(model=model, persons=[fast, slow], time_gap_s=1.0)
        traits = WalkingPeople(people).crowd(seed=0).traits
        np.testing.assert_array_equal(traits[:, TIME_GAP], 1.0)
    crowd = WalkingPeople(People(persons=[fast, slow], time_gap_s=1.0)).crowd(seed=0)
    people = crowd.state
    for _ in range(300):
        people = step_people(
            read_only(people), crowd.traits, crowd.goals, NO_EDGES, NO_CIRCLES, *FAR_AWAY, STEP_S
        )
    assert people[0, VX] == pytest.approx(0.5, abs=0.02)
