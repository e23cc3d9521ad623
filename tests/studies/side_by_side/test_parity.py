"""Ports beside originals: what counts as equal, and what is said of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import SHORT_DRIVE

from drake_navbench import run_trial
from drake_navbench.controller import ControllerError
from drake_navbench.controllers.external.client_process import ExternalControllerFailed
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.side_by_side.likeness import Likeness
from drake_navbench.studies.side_by_side.parity import (
    OtherDefault,
    Parity,
    compare_in_scenes,
    compare_in_trial,
    compare_trials,
    other_defaults,
    port_of_release,
)
from drake_navbench.studies.side_by_side.parity_page import to_markdown
from drake_navbench.trial.column_controller import controller_setup
from drake_navbench.trial.random_scenes import random_scenes

ROBOT = load_robot("wheelchair")
SCENARIO = Scenario(**SHORT_DRIVE)


def _scenes(first: str, second: str, count: int = 50):
    return compare_in_scenes(load_preset(first), load_preset(second), ROBOT, count)


def test_scenes_are_a_function_of_their_seed():
    setup = controller_setup(ROBOT)
    first, again = (list(random_scenes(setup, 5, seed=3)) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.plan, other.plan)
        np.testing.assert_array_equal(one.costmap.costs, other.costmap.costs)


def test_scenes_have_free_ways_and_blocked_ones():
    results = _scenes("rpp", "rpp")
    failed = sum(math.isnan(result.difference) for result in results)
    assert 0 < failed < len(results)


def test_a_controller_is_equal_to_itself():
    assert {result.likeness for result in _scenes("rpp", "rpp")} == {Likeness.EQUAL}


def test_an_original_that_hangs_or_crashes_decides_otherwise(monkeypatch):
    def crashed(*_):
        raise ExternalControllerFailed("nav2_host: was ended by signal 11\nwhat it printed")

    monkeypatch.setattr(load_preset("rotation_shim").controller_class, "step", crashed)
    (result,) = _scenes("rpp", "rotation_shim", 1)
    assert result.likeness is Likeness.DIFFERENT
    assert result.told.endswith("original: nav2_host: was ended by signal 11")

    # A port that finds no way, with the code that an error has by default, does not crash.
    def refused(*_):
        raise ControllerError("no way")

    monkeypatch.setattr(load_preset("rpp").controller_class, "step", refused)
    (result,) = _scenes("rpp", "rotation_shim", 1)
    assert result.likeness is Likeness.DIFFERENT


@pytest.mark.parametrize(
    ("change", "likeness"), [(1e-7, Likeness.CLOSE), (0.05, Likeness.DIFFERENT)]
)
def test_scenes_tell_how_far_two_are_apart(change, likeness):
    results = _scenes("rpp:desired_linear_vel=0.4", f"rpp:desired_linear_vel={0.4 + change}")
    assert (
        max(results, key=lambda result: list(Likeness).index(result.likeness)).likeness is likeness
    )


def test_a_port_drives_by_the_rules_of_the_builds_release(build_of):
    build = build_of()
    assert port_of_release("rpp", build).parameters.nav2_release == "jazzy"
    assert port_of_release("graceful", build).parameters.nav2_release == "jazzy"
    # It is of no release.
    assert port_of_release("teb", build).name == "teb"


def test_trials_are_apart_from_the_first_cycle_that_differs():
    slow, fast = (
        run_trial(SCENARIO, f"rpp:desired_linear_vel={speed}", seed=1) for speed in (0.3, 0.4)
    )
    same = compare_trials(slow, slow, "short", 1)
    assert (same.likeness, same.difference) == (Likeness.EQUAL, 0.0)
    assert math.isnan(same.apart_s)
    other = compare_trials(slow, fast, "short", 1)
    assert other.likeness is Likeness.DIFFERENT
    assert 0.0 <= other.apart_s < 0.5
    # Without one of its commands, or after a crash of both, a trial is not equal.
    gap = slow.samples.copy()
    gap.loc[gap.index[40], ["command_v_mps", "command_w_radps"]] = math.nan
    assert compare_trials(slow, replace(slow, samples=gap), "s", 1).difference == math.inf
    crashed = replace(slow, info=dict(slow.info) | {"outcome": "error"})
    assert compare_trials(crashed, crashed, "short", 1).likeness is Likeness.DIFFERENT


def _in_trial(first: str, second: str):
    return compare_in_trial(load_preset(first), load_preset(second), SCENARIO, 1, "wheelchair")


@pytest.mark.usefixtures("rehearsals")
def test_in_each_cycle_of_a_trial_both_see_the_same():
    # The cycles of a rehearsal are no trial's.
    result = _in_trial("rpp:desired_linear_vel=0.3", "rpp:desired_linear_vel=0.3001")
    alone = run_trial(SCENARIO, "rpp:desired_linear_vel=0.3", seed=1)
    assert len(result.cycles) == alone.samples["cycle_count"].max()
    # Asked where the first one is, the second wants 0.0001 m/s more, and turns as much faster as
    # the curve is tight: by at most 1.2 rad/m. Driving by itself it is soon somewhere else.
    largest = max(cycle.difference for cycle in result.cycles)
    assert 0.99e-4 < largest < 1.2e-4
    assert result.difference > 2.0 * largest


def test_a_controller_that_remembers_is_equal_to_itself_in_each_cycle():
    # Rotation shim over RPP: the memory of each goes back to itself.
    result = _in_trial("rotation_shim", "rotation_shim")
    assert {cycle.likeness for cycle in result.cycles} == {Likeness.EQUAL}
    assert result.likeness is Likeness.EQUAL


def test_the_page_counts_and_names_what_differs(build_of):
    build = build_of()
    scenes = tuple(_scenes("rpp", "rpp", 10))
    defaults = (OtherDefault("lookahead_dist", 0.6, 0.7),)
    text = to_markdown(build, [Parity("rpp", "its::Original", scenes, (), defaults, ("new_one",))])
    assert "| `rpp` | `its::Original` | 10 / 0 / 0 | 0 / 0 / 0 | 0 / 0 / 0 |" in text
    assert "| `lookahead_dist` | 0.6 | 0.7 |" in text
    assert "not read by the original: `new_one`" in text


def test_defaults_are_those_of_the_ports_release():
    older = load_preset("mppi_nav2:nav2_release=humble").parameters
    name = "ObstaclesCritic.collision_cost"
    assert other_defaults(older, {name: 1e4}, ()) == ()
    assert other_defaults(older, {name: 1e5}, ()) == (OtherDefault(name, 1e4, 1e5),)
    assert other_defaults(older, {name: 1e5}, {name}) == ()
