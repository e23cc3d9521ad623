"""The built-in robots drive with the Nav2 files that are written for them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.run import build_parser
from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.world import Box, World
from drake_navbench.kernels.grid import FREE, LETHAL, cost_at
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.outcome import Outcome
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.ports import STATE_SIZE
from drake_navbench.trial.trial import simulate

REPOSITORY = Path(__file__).parents[2]
NAV2_FILES = {path.stem: path for path in (REPOSITORY / "models" / "nav2").glob("*.yaml")}
WARD = REPOSITORY / "scenarios" / "maps" / "ward.yaml"
# Speed that its Nav2 file asks for, m/s.
SPEEDS = {"turtlebot3_burger": 0.22, "jackal": 1.0, "agv": 0.8}


def campaign_of(robot: str) -> Campaign:
    arguments = ["--nav2", str(NAV2_FILES[robot]), "--robot", robot, "--trials", "1"]
    task = ["--map", str(WARD), "--start", "0", "-1", "0", "--goal", "4", "-1", "0"]
    return request_from_arguments(build_parser().parse_args([*arguments, *task])).campaign()


@pytest.mark.parametrize("robot", sorted(NAV2_FILES))
def test_every_nav2_file_belongs_to_a_robot_and_is_taken_whole(robot):
    assert robot in ROBOT_FILES.names
    (columns,) = campaign_of(robot).nav2
    assert columns.setup.check.is_whole
    assert columns.setup.robot.mass_kg == campaign_of(robot).specs[0].robot.mass_kg


@pytest.mark.parametrize(
    "robot",
    [robot if robot == "agv" else pytest.param(robot, marks=pytest.mark.long) for robot in SPEEDS],
)
def test_a_robot_drives_at_the_speed_of_its_nav2_file(robot):
    # Of several columns the last one.
    spec = campaign_of(robot).specs[-1]
    log = simulate(spec)
    assert log.outcome is Outcome.SUCCEEDED
    assert log.samples["v_mps"].max() == pytest.approx(SPEEDS[robot], abs=0.03)
    assert log.info["robot"]["description"].endswith(f"drive of {robot}")


def test_a_scanner_at_the_rear_shows_what_stands_behind():
    robot = load_robot("agv")
    seen = local_layers(robot.navigation.local_costmap, lidar=robot.lidar, footprint=robot.outline)
    world = World((Box(type="box", min=(-2.2, -0.5), max=(-2.0, 0.5)),))
    scan = first_scan(robot, world)

    def cost_behind(scan):
        state = seen.updated(seen.initial_state(), scan=scan, pose=np.zeros(3), time_s=0.0)
        return cost_at(state.costmap.grid, -2.02, 0.0)

    # The one at the front looks 135 degrees to either side.
    assert cost_behind(scan) == LETHAL
    assert cost_behind(replace(scan, further=())) == FREE


def first_scan(robot, world) -> Scan:
    lidar = Lidar(Timeline.constant(robot.lidar), world)
    context = lidar.CreateDefaultContext()
    lidar.GetInputPort("state").FixValue(context, np.zeros(STATE_SIZE))
    simulator = Simulator(lidar, context)
    simulator.Initialize()
    simulator.AdvancePendingEvents()
    return lidar.GetOutputPort("scan").Eval(simulator.get_context())
