"""Up to Kilted DWB cuts the plan itself, by distances from the robot."""

from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import observe
from dwb_cases import SETUP

from drake_navbench.controller import InvalidPath, NoValidControl
from drake_navbench.controllers.dwb.controller import DynamicWindowApproach
from drake_navbench.controllers.dwb.own_plan import OwnPlan
from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters
from drake_navbench.kernels.grid import Costmap

# A pose each 0.125 m from 0 to 10 m along x.
LIMITS = {"max_vel_x": 0.5, "max_speed_xy": 0.5, "acc_lim_x": 2.5, "acc_lim_theta": 3.2}
PLAN = np.column_stack([np.arange(81) * 0.125, np.zeros(81), np.zeros(81)])


def parameters_of(release, **fields):
    """Returns parameters of a release."""
    return DynamicWindowApproachParameters(
        critics=("PathDist",), nav2_release=release, **LIMITS, **fields
    )


def costmap_at(x, size_m=6.0):
    """Returns a free costmap around (x, 0)."""
    count = int(size_m / 0.125)
    costs = np.zeros((count, count), np.uint8)
    return Costmap(costs, x - 0.5 * size_m, -0.5 * size_m, 0.125)


def cut(release, x, begin=0, size_m=6.0, **fields):
    """Returns where along x the local plan begins and ends, and where the rest begins."""
    own = OwnPlan(parameters_of(release, **fields))
    local, left = own.cut(PLAN, begin, np.array([x, 0.0, 0.0]), costmap_at(x, size_m))
    return local[0, 0], local[-1, 0], PLAN[left, 0]


def length_of(release, **fields):
    """Returns the number of poses of the local plan at (3, 0)."""
    own = OwnPlan(parameters_of(release, **fields))
    return len(own.cut(PLAN, 0, np.array([3.0, 0.0, 0.0]), costmap_at(3.0))[0])


@pytest.mark.parametrize("release", ["humble", "iron", "jazzy", "kilted"])
def test_it_reaches_two_metres_back_and_ahead(release):
    # Nearer than 2 m begins behind 2 m, no farther than 2 m ends at it; what is passed is dropped.
    assert cut(release, 3.0) == (1.125, 5.0, 1.125)


def test_it_is_no_longer_than_half_the_costmap():
    assert cut("humble", 2.0, size_m=2.0) == (1.125, 3.0, 1.125)


def test_without_pruning_the_plan_stays_whole():
    fields = {"prune_plan": False, "shorten_transformed_plan": False}
    assert cut("jazzy", 3.0, **fields) == (0.125, 6.0, 0.0)
    # Shortened, it ends where it begins: at the first pose that is farther than 2 m.
    assert length_of("jazzy", prune_plan=False) == 0


def test_without_shortening_it_ends_at_the_edge_of_the_costmap():
    assert cut("humble", 3.0, shorten_transformed_plan=False)[1] == 6.0


def test_a_robot_that_has_run_ahead_is_looked_for_only_so_far():
    # From the start no pose within 2 m of the way is nearer than 2 m: the next one begins it.
    assert cut("humble", 4.5, forward_prune_distance=9.0) == (2.125, 7.5, 2.125)
    # Since Iron it is forward_prune_distance that says how far.
    assert cut("iron", 4.5, forward_prune_distance=9.0) == (2.625, 7.5, 2.625)


def test_a_negative_forward_distance_means_all_of_it_since_iron():
    assert cut("iron", 3.0, forward_prune_distance=-1.0) == (1.125, 6.0, 1.125)
    assert length_of("humble", forward_prune_distance=-1.0) == 0


def observed(x, **fields):
    """Returns what DWB sees at (x, 0); the path handler's plan begins at the robot."""
    index = int(x / 0.125)
    known = {"pose": (x, 0.0, 0.0), "costmap": costmap_at(x), "goal": PLAN[-1]}
    return observe(PLAN[index : index + 16], global_plan=PLAN, **known, **fields)


def test_the_rest_of_the_plan_is_remembered_until_there_is_another_one():
    dwb = DynamicWindowApproach(parameters_of("humble"), SETUP)
    memory = dwb.step(observed(3.0), dwb.initial_memory()).memory
    assert memory.plan_begin == 9
    # A robot that is set back does not get back what was dropped ...
    again = dwb.step(observed(1.0), memory)
    assert again.memory.plan_begin == 9
    # ... until a new plan comes.
    new = dwb.step(replace(observed(1.0), plan_id=2), memory)
    assert new.memory.plan_begin == 0


@pytest.mark.parametrize(("release", "error"), [("humble", NoValidControl), ("iron", InvalidPath)])
def test_the_server_is_patient_in_humble_alone_where_nothing_is_near(release, error):
    dwb = DynamicWindowApproach(parameters_of(release), SETUP)
    aside = replace(observed(3.0), pose=np.array([3.0, 2.5, 0.0]))
    with pytest.raises(error, match="0 poses") as caught:
        dwb.step(aside, dwb.initial_memory())
    # The first 2 m of the way were looked at, and are dropped: 2.125 m is pose 17.
    assert caught.value.memory.plan_begin == 17
    assert dwb.step(observed(3.0), caught.value.memory).memory.plan_begin == 17


def test_a_newer_dwb_takes_the_path_handlers_plan():
    dwb = DynamicWindowApproach(parameters_of("lyrical"), SETUP)
    assert dwb.step(observed(3.0), dwb.initial_memory()).memory.plan_begin == 0


@pytest.mark.parametrize(("release", "is_idle"), [("kilted", False), ("lyrical", True)])
def test_what_cuts_the_plan_has_no_effect_in_lyrical(release, is_idle):
    values = {"nav2_release": release, "prune_distance": 1.0}
    model = DynamicWindowApproachParameters
    assert model.is_without_effect("prune_distance", values) is is_idle
