"""A sonar sees the glass that the lidar looks through, and so the robot stops before it."""

from __future__ import annotations

import textwrap

import pytest

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.run import build_parser
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.trial import simulate

SCENARIO = """
description: a pane of glass across the way
start: [0.0, 0.0, 0.0]
goal: [4.0, 0.0, 0.0]
world:
  obstacles:
    - {type: box, min: [2.5, -3.0], max: [2.6, 3.0], material: glass}
plan: {type: polyline, points: [[0.0, 0.0], [4.0, 0.0]]}
timeout_s: 12.0
"""
SONARS = """
description: round, with three sonars
like: round_robot
range_sensors:
  left: {pose: [0.2, 0.1, 0.4], field_of_view_rad: 0.5}
  ahead: {pose: [0.2, 0.0, 0.0], field_of_view_rad: 0.5}
  right: {pose: [0.2, -0.1, -0.4], field_of_view_rad: 0.5}
"""
LAYER = """
navigation:
  local_costmap:
    plugins: [obstacle_layer, sonars, inflation_layer]
    sonars:
      plugin: nav2_costmap_2d::RangeSensorLayer
      topics: [left, ahead, right]
"""
MONITOR = """
navigation:
  collision_monitor:
    polygons:
      zone: {type: circle, radius: 0.45, action_type: stop}
    observation_sources:
      scan: {}
      ahead: {type: range}
"""


@pytest.fixture
def outcome_of(tmp_path):
    """A function from what a robot has besides to the outcome of its trial, and its least gap."""

    def drive(*parts: str):
        scenario, robot = tmp_path / "glass.yaml", tmp_path / "robot.yaml"
        scenario.write_text(textwrap.dedent(SCENARIO))
        robot.write_text("".join(parts))
        asked = [str(scenario), "--robot", str(robot), "--controllers", "rpp", "--trials", "1"]
        (spec,) = request_from_arguments(build_parser().parse_args(asked)).campaign().specs
        log = simulate(spec)
        return log.outcome, log.samples["clearance_m"].min()

    return drive


def test_without_sonars_the_robot_drives_into_the_glass(outcome_of):
    assert outcome_of(SONARS)[0] is Outcome.COLLIDED


@pytest.mark.parametrize("who", [LAYER, MONITOR], ids=["the costmap", "the collision monitor"])
def test_with_sonars_it_stops_before_the_glass(outcome_of, who):
    outcome, least_gap_m = outcome_of(SONARS, who)
    assert outcome is not Outcome.COLLIDED
    assert least_gap_m > 0.05
