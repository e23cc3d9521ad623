"""People who walk by ORCA give way to each other, to walls, and to a robot as they are said to."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.inputs.people import OrcaSettings, People, Person, WalkingPeople
from drake_navbench.kernels.orca import step_orca
from drake_navbench.kernels.orca_edges import linked_edges
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.walking import ASIDE, VX, VY, YAW, X, Y

STEP_S = 0.05
NO_EDGES, NO_DISCS = linked_edges([]), np.empty((0, 5))
FAR_AWAY = np.array([500.0, 0.0, 0.0, 0.0, 0.63])
# A disc round about a chair of 1.1 m by 0.6 m.
CHAIR = np.array([5.0, 0.05, 0.0, 0.0, math.hypot(0.55, 0.3)])


def crowd_of(*persons, aside=0.0, seed=0):
    crowd = WalkingPeople(People(model="orca", persons=list(persons))).crowd(seed)
    if aside is not None:
        crowd.traits[:, ASIDE] = aside
    return crowd


def walk(crowd, duration_s, *, edges=NO_EDGES, discs=NO_DISCS, robot=FAR_AWAY, **orca):
    """Returns (T, P, 8) the ways of people, the first row where they begin."""
    rows = [crowd.state]
    settings_ = OrcaSettings(**{"margin_m": 0.0} | orca).as_array
    for step in range(round(duration_s / STEP_S)):
        moved = discs.copy()
        moved[:, :2] += (step + 1) * STEP_S * discs[:, 2:4]
        world = ((edges, moved), robot, settings_, STEP_S, STEP_S)
        rows.append(step_orca(read_only(rows[-1]), crowd.traits, crowd.goals, *world))
    return np.array(rows)


def gaps(ways):
    """Returns (T, pairs) the distance between each two bodies of 0.3 m, m."""
    first, second = np.triu_indices(ways.shape[1], k=1)
    apart = ways[:, first, :2] - ways[:, second, :2]
    return np.hypot(apart[..., 0], apart[..., 1]) - 0.6


def to_the_right(**fields):
    return Person(**{"start": (0.0, 0.0), "goals": [(50.0, 0.0)]} | fields)


def test_somebody_alone_goes_straight_at_the_wanted_speed_and_stops_at_the_goal():
    there = to_the_right(goals=[(3.0, 0.0)], speed_mps=1.2)
    way = walk(crowd_of(there), 6.0)[:, 0]
    np.testing.assert_allclose(way[1:40, VX], 1.2)
    np.testing.assert_allclose(way[:, Y], 0.0, atol=1e-12)
    # Within 0.3 m of a goal one is there.
    assert 2.64 < way[-1, X] < 3.0
    assert way[-1, VX] == 0.0


def test_goals_come_one_after_another_and_again():
    there = to_the_right(goals=[(2.0, 0.0), (0.0, 0.0)])
    way = walk(crowd_of(there), 12.0)[:, 0]
    assert np.count_nonzero(np.diff(np.sign(way[5:, VX])) != 0) >= 3
    assert way[:, X].max() < 2.2


@pytest.mark.parametrize("aside_m", [0.0, 0.1, -0.4])
def test_two_who_meet_head_on_pass_without_contact(aside_m):
    comes = Person(start=(10.0, aside_m), goals=[(-50.0, 0.0)], yaw_rad=np.pi)
    # Where nothing tells one side from the other, what everybody draws does.
    ways = walk(crowd_of(to_the_right(), comes, aside=None), 14.0)
    # A half-plane is broken by rounding alone.
    assert gaps(ways).min() > -1e-6
    assert ways[-1, 0, X] > 9.0
    assert ways[-1, 1, X] < 1.0


def test_they_keep_a_margin():
    comes = Person(start=(10.0, 0.1), goals=[(-50.0, 0.0)], yaw_rad=np.pi)
    ways = walk(crowd_of(to_the_right(), comes), 12.0, margin_m=0.15)
    assert gaps(ways).min() == pytest.approx(0.15, abs=2e-3)


def test_each_does_half_of_it():
    comes = Person(start=(10.0, 0.2), goals=[(-40.0, 0.2)], yaw_rad=np.pi)
    ways = walk(crowd_of(to_the_right(), comes), 8.0)
    # Turned by half a turn about (5, 0.1) each is the other.
    np.testing.assert_allclose(ways[:, 0, X], 10.0 - ways[:, 1, X], atol=1e-9)
    np.testing.assert_allclose(ways[:, 0, Y], 0.2 - ways[:, 1, Y], atol=1e-9)


def scene(generator, count=6):
    """Returns the persons of a scene, one in each cell of a lattice, with goals across it."""
    places = 1.5 * np.stack(np.meshgrid(np.arange(3), np.arange(2)), axis=-1).reshape(-1, 2)
    starts = places[:count] + generator.uniform(-0.3, 0.3, (count, 2))
    goals = generator.uniform(-6.0, 6.0, (count, 2))
    return [
        Person(start=tuple(start), goals=[tuple(goal)], speed_mps=speed)
        for start, goal, speed in zip(
            starts.tolist(), goals.tolist(), generator.uniform(0.5, 1.5, count), strict=True
        )
    ]


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_a_mirrored_scene_gives_mirrored_ways(seed):
    persons = scene(np.random.default_rng(seed))
    mirrored = [
        p.model_copy(
            update={
                "start": (p.start[0], -p.start[1]),
                "goals": [(x, -y) for x, y in p.goals],
            }
        )
        for p in persons
    ]
    wall = np.array([[-3.0, 3.0], [4.0, 3.0], [4.0, 3.2], [-3.0, 3.2]])
    ways = walk(crowd_of(*persons, aside=0.01), 3.0, edges=linked_edges([wall]))
    mirror = wall[::-1] * [1.0, -1.0]
    others = walk(crowd_of(*mirrored, aside=-0.01), 3.0, edges=linked_edges([mirror]))
    signs = np.array([1.0, -1.0, -1.0, 1.0, -1.0])
    # Small differences of rounding grow from step to step.
    np.testing.assert_allclose(ways[:30, :, : VY + 1], others[:30, :, : VY + 1] * signs, atol=1e-6)


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_nobody_exceeds_the_top_speed_or_runs_into_another(seed):
    crowd = crowd_of(*scene(np.random.default_rng(seed)), aside=None, seed=seed)
    ways = walk(crowd, 8.0, max_speed_ratio=1.2)
    speeds = np.hypot(ways[..., VX], ways[..., VY])
    assert (speeds <= 1.2 * crowd.traits[:, 0] + 1e-9).all()
    assert gaps(ways).min() > -1e-3


@pytest.mark.parametrize("count", [4, 11, 20])
def test_a_circle_of_people_all_get_to_the_other_side(count):
    turns = 2.0 * np.pi * np.arange(count) / count
    persons = [
        Person(
            start=(6.0 * math.cos(turn), 6.0 * math.sin(turn)),
            goals=[(-6.0 * math.cos(turn), -6.0 * math.sin(turn))],
        )
        for turn in turns.tolist()
    ]
    crowd = crowd_of(*persons, aside=None)
    ways = walk(crowd, 40.0, max_neighbours=count)
    assert gaps(ways).min() > -1e-3
    assert np.hypot(*(ways[-1, :, :2] - crowd.goals).T).max() < 0.31


def clearance_m(ways, ring):
    """Returns the least distance of somebody's place to a polygon's border, m."""
    best = np.inf
    for start, end in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        along = end - start
        share = np.clip(((ways[..., :2] - start) @ along) / (along @ along), 0.0, 1.0)
        off = ways[..., :2] - start - share[..., None] * along
        best = min(best, np.hypot(off[..., 0], off[..., 1]).min())
    return best


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_nobody_walks_through_walls(seed):
    generator = np.random.default_rng(seed)
    # An L of which one corner is not convex, with goals behind it.
    ring = np.array([[-4.0, 4.0], [4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 8.0], [-4.0, 8.0]])
    ring = ring + generator.uniform(-0.5, 0.5, ring.shape)
    persons = [
        p.model_copy(update={"goals": [(float(x), 12.0)]})
        for p, x in zip(scene(generator), generator.uniform(-2.0, 8.0, 6), strict=True)
    ]
    ways = walk(crowd_of(*persons, aside=None, seed=seed), 12.0, edges=linked_edges([ring]))
    assert clearance_m(ways, ring) > 0.3 - 1e-3
    # They did come as far as the wall.
    assert ways[-1, :, Y].max() > 3.0


def test_people_pass_a_door_one_after_another():
    left = np.array([[-5.0, 4.0], [-0.5, 4.0], [-0.5, 4.2], [-5.0, 4.2]])
    right = left + np.array([5.5, 0.0])
    persons = [
        Person(start=(0.8 * i, 0.3 * abs(i)), goals=[(0.1 * i, 4.1), (0.8 * i, 9.0)], repeats=False)
        for i in range(-2, 3)
    ]
    ways = walk(crowd_of(*persons, aside=None), 30.0, edges=linked_edges([left, right]))
    assert (ways[-1, :, Y] > 8.0).all()
    assert min(clearance_m(ways, left), clearance_m(ways, right)) > 0.3 - 1e-3
    assert gaps(ways).min() > -1e-3


@pytest.mark.parametrize("reaction", ["regular", "impassive"])
def test_who_does_not_ignore_it_goes_round_a_robot_at_rest(reaction):
    way = walk(crowd_of(to_the_right(reaction=reaction)), 12.0, robot=CHAIR)[:, 0]
    gap_m = np.hypot(*(way[:, :2] - CHAIR[:2]).T) - CHAIR[4] - 0.3
    assert gap_m.min() > -2e-3
    assert way[-1, X] > 8.0


def test_the_oblivious_walk_straight_into_it():
    way = walk(crowd_of(to_the_right(reaction="oblivious")), 8.0, robot=CHAIR)[:, 0]
    np.testing.assert_allclose(way[:, Y], 0.0, atol=1e-12)
    assert way[-1, X] > 7.9


def test_the_regular_leave_half_of_it_to_the_robot():
    changes = {}
    for reaction in ("regular", "impassive"):
        crowd = crowd_of(to_the_right(reaction=reaction))
        crowd.state[0, VX] = 1.0
        comes = np.array([4.0, 0.2, -1.0, 0.0, 0.3])
        changes[reaction] = walk(crowd, STEP_S, robot=comes)[-1, 0, VX : VY + 1] - [1.0, 0.0]
    np.testing.assert_allclose(changes["impassive"], 2.0 * changes["regular"])
    assert changes["regular"][1] < -0.01


def test_one_gives_way_to_what_moves_all_alone():
    comes = np.array([[10.0, 0.1, -1.0, 0.0, 0.5]])
    way = walk(crowd_of(to_the_right()), 8.0, discs=comes)[:, 0]
    thing_x = 10.0 - STEP_S * np.arange(len(way))
    assert (np.hypot(way[:, X] - thing_x, way[:, Y] - 0.1) - 0.8).min() > -1e-3


def test_a_box_that_comes_is_dodged_before_it_is_there():
    box = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    crowd = crowd_of(Person(start=(0.0, 0.1)))
    state, settings_ = crowd.state, OrcaSettings().as_array
    for step in range(160):
        place = np.array([6.0 - (step + 1) * STEP_S, 0.0])
        edges = linked_edges([box + place], [(-1.0, 0.0)])
        world = ((edges, NO_DISCS), FAR_AWAY, settings_, STEP_S, STEP_S)
        state = step_orca(read_only(state), crowd.traits, crowd.goals, *world)
        outside = np.maximum(np.abs(state[0, :2] - place) - 0.5, 0.0)
        assert np.hypot(*outside) > 0.3 - 1e-3


def test_the_heading_follows_the_way():
    way = walk(crowd_of(Person(start=(0.0, 0.0), goals=[(0.0, 9.0)])), 2.0)[:, 0]
    assert way[-1, YAW] == pytest.approx(np.pi / 2)
