"""Planners of a checkout: built where they are asked for, and asked for plans."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.commands.main import main
from drake_navbench.controllers.external.client_process import ClientProcess
from drake_navbench.inputs.robot import load_robot
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.native.build import build_checkout
from drake_navbench.native.builds import Build
from drake_navbench.studies.side_by_side.likeness import Likeness
from drake_navbench.studies.side_by_side.planner_parity import (
    PlanRequest,
    compare_planners,
    request_message,
)

PLUGIN = "nav2_navfn_planner::NavfnPlanner"
ROBOT = load_robot("wheelchair")
REQUEST = PlanRequest(
    Costmap(np.zeros((40, 60), np.uint8), -1.0, 2.0, 0.05),
    np.array([-0.4, 2.3, 0.3]),
    np.array([1.5, 3.6, -2.0]),
)


@pytest.fixture
def planning(tiny, copied) -> Path:
    """A checkout with a planner besides its controller."""
    shutil.copytree(Path(__file__).parent / "planning_package", copied / "nav2_navfn_planner")
    return copied


@pytest.fixture
def planners(planning) -> Build:
    """Its build."""
    return build_checkout(planning, name="planners", wanted=["nav2_navfn_planner"])


@pytest.fixture
def ask(planners):
    """A function that asks the planner, and returns the answer."""
    process = ClientProcess([str(planners.host)])

    def answer(request: PlanRequest, **values):
        message = request_message(PLUGIN, values, ROBOT, request)
        return process.ask(message, deadline_s=10.0)

    yield answer
    process.stop()


def test_planners_are_built_where_they_are_asked_for(planning, planners):
    assert (planners.planners, planners.controllers) == ((PLUGIN,), ())
    assert build_checkout(planning, name="all").planners == ()


def test_a_plan_has_the_poses_that_the_plugin_gives(ask):
    plan = np.array(ask(REQUEST)["plan"])
    np.testing.assert_allclose(plan, [REQUEST.start, REQUEST.goal], atol=1e-15)


def test_a_planner_has_its_parameters(ask):
    assert ask(REQUEST, starts_off=0.25)["plan"][0][0] == pytest.approx(-0.15)


def test_a_planner_sees_the_map_of_its_request_alone(ask):
    costs = np.zeros((40, 60), np.uint8)
    # The cell of x in [1.5, 1.55), y in [3.6, 3.65).
    costs[32, 50] = LETHAL
    blocked = REQUEST._replace(costmap=Costmap(costs, -1.0, 2.0, 0.05))
    answer = ask(blocked)
    assert answer["failure"] == "NoValidPathCouldBeFound"
    assert answer["message"] == "straight: the goal is in a wall"
    assert "plan" in ask(REQUEST)


def test_what_is_no_planner_is_refused(ask, planners):
    process = ClientProcess([str(planners.host)])
    message = request_message("tiny::Controller", {}, ROBOT, REQUEST)
    assert "tiny::Controller" in process.ask(message, deadline_s=10.0)["error"]
    process.stop()


def test_a_port_is_held_against_it(planners):
    parities = compare_planners(planners, maps=3)
    assert [dict(parity.values) for parity in parities][:2] == [{}, {"use_astar": True}]
    # The one goes straight, the other by cells.
    assert {result.likeness for result in parities[0].results} == {Likeness.DIFFERENT}
    assert all("2 poses" in result.told for result in parities[0].results)


def test_a_package_without_plugins_is_one_line(planning, capsys):
    assert main(["nav2-build", str(planning), "--packages", "nav2_core"]) == 2
    error = capsys.readouterr().err
    assert "no package or folder of packages 'nav2_core' with a controller or planner" in error
    assert error.count("\n") == 1
