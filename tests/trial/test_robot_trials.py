"""The built-in robots drive with the Nav2 files that are written for them."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_navbench.campaign.asked import request_from_arguments
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.inputs.robot import ROBOT_FILES
from drake_navbench.log import Outcome
from drake_navbench.run import build_parser
from drake_navbench.trial.trial import simulate

REPOSITORY = Path(__file__).parents[2]
NAV2_FILES = {path.stem: path for path in (REPOSITORY / "models" / "nav2").glob("*.yaml")}
WARD = REPOSITORY / "scenarios" / "maps" / "ward.yaml"
# Speed that its Nav2 file asks for, m/s.
SPEEDS = {"turtlebot3_burger": 0.22, "turtlebot3_waffle": 0.26, "jackal": 1.0, "agv": 0.8}


def campaign_of(robot: str) -> Campaign:
    arguments = ["--nav2", str(NAV2_FILES[robot]), "--robot", robot, "--trials", "1"]
    task = ["--map", str(WARD), "--start", "0", "-1", "0", "--goal", "4", "-1", "0"]
    return request_from_arguments(build_parser().parse_args([*arguments, *task])).campaign()


@pytest.mark.parametrize("robot", sorted(NAV2_FILES))
def test_every_nav2_file_belongs_to_a_robot_and_is_taken_whole(robot):
    assert robot in ROBOT_FILES.names
    nav2 = campaign_of(robot).nav2
    assert nav2 is not None
    assert nav2.check.is_whole
    assert nav2.robot.mass_kg == campaign_of(robot).specs[0].robot.mass_kg


@pytest.mark.parametrize("robot", sorted(SPEEDS))
def test_a_robot_drives_at_the_speed_of_its_nav2_file(robot):
    # Of several columns the last one.
    spec = campaign_of(robot).specs[-1]
    log = simulate(spec)
    assert log.outcome is Outcome.SUCCEEDED
    assert log.samples["v_mps"].max() == pytest.approx(SPEEDS[robot], abs=0.03)
    assert log.info["robot"]["description"].endswith(f"drive of {robot}")
