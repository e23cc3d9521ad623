"""What a robot had around it is drawn around it, though its odometry drifts."""

from __future__ import annotations

import dataclasses
import math
import re
import urllib.error
import urllib.request

import numpy as np
import pytest
from replay_logs import replay_log

from drake_navbench.analysis.replay.costmaps import add_costmaps
from drake_navbench.analysis.replay.live_scene import COSTMAP_PATH, KEPT_COSTMAPS, Course, LiveScene
from drake_navbench.analysis.replay.odometry_frame import cycles_in_world
from drake_navbench.analysis.replay.stage import Stage, make_meshcat
from drake_navbench.inputs.world import World
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.moment import Moment

TURN_RAD = math.pi / 2


def drifted(log: TrialLog) -> TrialLog:
    """Returns the log with the world turned by a right angle and 1 m along x in the odometry."""
    samples = log.samples
    own = {
        "odometry_x_m": 1.0 - samples["y_m"],
        "odometry_y_m": samples["x_m"],
        "odometry_yaw_rad": samples["yaw_rad"] + TURN_RAD,
    }
    return dataclasses.replace(log, samples=samples.assign(**own))


def placed(log: TrialLog) -> list[np.ndarray]:
    """Returns where a replay puts the costmaps."""
    stage, poses = Stage(), []
    stage.pose = lambda path, pose, frame=None: poses.append(pose.GetAsMatrix4())
    add_costmaps(stage, "/local_costmap", log, 0.0)
    return poses


def test_costmaps_lie_where_the_odometry_lies_in_the_world():
    log = replay_log("rpp", end_time_s=1.0)
    assert placed(log) == []
    poses = placed(drifted(log))
    assert len(poses) == len(log.costmaps)
    for pose in poses:
        # The odometry's (1, 0) is the world's origin, and its y axis the world's x axis.
        np.testing.assert_allclose(pose @ [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0], atol=1e-9)
        np.testing.assert_allclose(pose @ [1.0, 2.0, 0.0, 1.0], [2.0, 0.0, 0.0, 1.0], atol=1e-9)


def test_intentions_lie_there_too_and_elsewhere_are_as_they_were_left():
    left = {"carrot": [1.0, 2.0], "predicted_trajectory": [[1.0, 3.0, 0.5]], "speed": 0.3}
    sampled = {"sampled_trajectories": [[[1.0, 1.0], [0.0, 0.0]]], "sampled_costs": [None]}
    log = dataclasses.replace(
        replay_log("rpp", end_time_s=1.0), diagnostics=((0.5, left), (0.6, sampled))
    )
    assert cycles_in_world(log) == log.diagnostics
    (_, first), (_, second) = cycles_in_world(drifted(log))
    assert first["carrot"] == pytest.approx([2.0, 0.0])
    assert first["predicted_trajectory"][0] == pytest.approx([3.0, 0.0, 0.5])
    assert first["speed"] == 0.3
    assert second["sampled_trajectories"][0] == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0]]))
    assert second["sampled_costs"] == [None]


def test_a_live_view_draws_the_costmap_around_the_robot():
    log = replay_log("rpp", end_time_s=1.0)
    goals = np.array([[4.0, 0.0, 0.0]])
    square = np.array([[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]])
    course = Course("square", World(()), np.zeros(3), goals, 0.25, square, None)
    scene = LiveScene(make_meshcat(), course, "rpp", subtitle="")
    poses = {}
    scene._stage.pose = lambda path, pose, frame=None: poses.update({path: pose.GetAsMatrix4()})
    frame = np.array([1.0, 0.0, TURN_RAD])
    scene.show(Moment(0.5, np.zeros(6), None, log.costmaps[0], None, {}, np.empty((0, 3)), frame))
    origin = poses[COSTMAP_PATH] @ [1.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(origin, [0.0, 0.0, 0.0, 1.0], atol=1e-9)


def test_a_slow_browser_still_gets_a_costmap_that_was_replaced():
    log = replay_log("rpp", end_time_s=1.0)
    square = np.array([[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]])
    course = Course("square", World(()), np.zeros(3), np.array([[4.0, 0, 0]]), 0.25, square, None)
    scene = LiveScene(meshcat := make_meshcat(), course, "rpp", subtitle="")
    addresses = []
    for number in range(10):
        costmap = dataclasses.replace(log.costmaps[0], origin_x=0.1 * number)
        scene.show(
            Moment(number, np.zeros(6), None, costmap, None, {}, np.empty((0, 3)), np.zeros(3))
        )
        # The corners, which differ; the texture is one.
        first, *_ = re.findall(rb"cas-v1/[0-9a-f]+", meshcat._GetPackedObject(COSTMAP_PATH))
        addresses.append(f"{meshcat.web_url()}/{first.decode()}")
    assert len(set(addresses)) == 10
    for address in addresses[-KEPT_COSTMAPS:]:
        assert urllib.request.urlopen(address).status == 200
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(addresses[0])
