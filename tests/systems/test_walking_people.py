"""People who walk by a model see the world as it is: walls, courts, things that move."""

import numpy as np
import pytest

from drake_navbench.inputs.moving_obstacles import (
    MovingBox,
    MovingCylinder,
    MovingObstacles,
    TimedPose,
)
from drake_navbench.inputs.people import People, Person, WalkingPeople
from drake_navbench.inputs.world import Box, Cylinder, World
from drake_navbench.kernels.orca_edges import ALONG_X, EDGE_VX, NEXT, linked_edges
from drake_navbench.kernels.walking import X, Y
from drake_navbench.trial.systems.walking_people import PEOPLE_PERIOD_S, OrcaWalk, walk_of

FOOTPRINT = np.array([[0.5, 0.3], [-0.5, 0.3], [-0.5, -0.3], [0.5, -0.3]])
FAR_STATE = np.array([100.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def box(low, high):
    return Box(type="box", min=low, max=high)


# A court of four walls that overlap at their corners, and a pillar in it.
COURT = (
    box((-4.0, 4.0), (4.0, 4.2)),
    box((-4.0, -4.2), (4.0, -4.0)),
    box((4.0, -4.2), (4.2, 4.2)),
    box((-4.2, -4.2), (-4.0, 4.2)),
    Cylinder(type="cylinder", centre=(0.0, 0.0), radius_m=0.5),
)


def signed_area(ring):
    x, y = ring.T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def test_walls_that_touch_are_one_border_with_what_is_solid_to_its_left():
    rings = World(COURT).free_rings
    # The outside of the court, its inside the other way round, and the pillar as 16 corners.
    areas = sorted(signed_area(ring) for ring in rings)
    np.testing.assert_allclose(areas[::2], [-64.0, 8.4**2])
    assert len(min(rings, key=lambda ring: abs(signed_area(ring)))) == 16
    assert areas[1] == pytest.approx(np.pi * 0.25, rel=0.03)
    assert areas[1] > np.pi * 0.25


def walked(model, people, world, duration_s=12.0):
    """Returns (T, P, 2) the places of people in a world."""
    everybody = WalkingPeople(People(model=model, persons=people))
    world = World(world.obstacles, moving=world.moving, people=everybody)
    walk, crowd = walk_of(world, FOOTPRINT), everybody.crowd(seed=0)
    rows = [crowd.state]
    for step in range(1, round(duration_s / PEOPLE_PERIOD_S)):
        time_s = step * PEOPLE_PERIOD_S
        rows.append(walk.step(rows[-1], crowd, time_s, FAR_STATE, PEOPLE_PERIOD_S))
    return np.array(rows)[:, :, [X, Y]]


@pytest.mark.parametrize("model", ["social_force", "orca"])
def test_nobody_leaves_a_court_or_walks_into_its_pillar(model):
    people = [
        Person(start=(-2.0, 0.1), goals=[(9.0, 0.1)]),
        Person(start=(0.0, 2.0), goals=[(0.1, -9.0)]),
        Person(start=(2.0, -2.0), goals=[(9.0, 9.0)]),
    ]
    places = walked(model, people, World(COURT))
    assert np.abs(places).max() < 3.71
    assert np.hypot(places[..., 0], places[..., 1]).min() > 0.5 + 0.3 - 0.02


def moving(kind, **shape):
    waypoints = [
        TimedPose(time_s=0.0, position=(6.0, 0.05)),
        TimedPose(time_s=12.0, position=(-6.0, 0.05)),
    ]
    return kind(waypoints=waypoints, **shape)


def test_by_orca_people_dodge_what_comes():
    cart = moving(MovingBox, type="box", size_m=(0.8, 0.6))
    drum = moving(MovingCylinder, type="cylinder", radius_m=0.4)
    for thing in (cart, drum):
        world = World((), moving=MovingObstacles((thing,)))
        places = walked("orca", [Person(start=(0.0, 0.0))], world, 11.0)[:, 0]
        times_s = PEOPLE_PERIOD_S * np.arange(len(places))
        centres = world.moving.tracks
        off = places - [centres.poses_at(time_s)[0, :2] for time_s in times_s]
        if thing is cart:
            gaps_m = np.hypot(*np.maximum(np.abs(off) - [0.4, 0.3], 0.0).T)
        else:
            gaps_m = np.hypot(*off.T) - 0.4
        assert gaps_m.min() > 0.3 - 5e-3


def test_edges_that_move_are_linked_among_themselves():
    cart = moving(MovingBox, type="box", size_m=(0.8, 0.6))
    people = WalkingPeople(People(model="orca", persons=[Person(start=(0.0, 3.0))]))
    world = World(COURT[:1], moving=MovingObstacles((cart,)), people=people)
    walk = walk_of(world, FOOTPRINT)
    assert isinstance(walk, OrcaWalk)
    edges, discs = walk._with_things(1.0)
    assert edges.shape == (8, linked_edges([]).shape[1])
    assert edges[4:, NEXT].tolist() == [5.0, 6.0, 7.0, 4.0]
    np.testing.assert_allclose(edges[4:, EDGE_VX], -1.0)
    np.testing.assert_allclose(edges[:4, EDGE_VX], 0.0)
    np.testing.assert_allclose(edges[4, ALONG_X], 1.0)
    assert len(discs) == 0
