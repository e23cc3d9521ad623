"""What moved is drawn in replays and on maps, and exported, where it was."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from replay_logs import replay_log

from drake_navbench.analysis.figures.maps import course_of
from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.analysis.replay.moving_shapes import rows_of_bends
from drake_navbench.logs.log import TrialLog
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.ros2.recordings.trial_messages import TrialMessages

CART = {
    "type": "box",
    "name": "cart",
    "size_m": [1.0, 0.6],
    "waypoints": [
        {"time_s": 0.0, "position": [2.0, 3.0]},
        {"time_s": 1.0, "position": [3.0, 3.0]},
    ],
}


def with_a_cart(log: TrialLog) -> TrialLog:
    scenario = dict(log.info["scenario"])
    scenario["world"] = dict(scenario["world"]) | {"moving_obstacles": [CART]}
    return dataclasses.replace(log, info=dict(log.info) | {"scenario": scenario})


def test_replays_show_what_moves(tmp_path):
    logs = [with_a_cart(replay_log("rpp")), with_a_cart(replay_log("dwb"))]
    write_race_replay(logs, tmp_path / "race.html", model=None)
    write_trial_replay(logs[0], tmp_path / "trial.html", model=None)
    for name in ("race.html", "trial.html"):
        page = (tmp_path / name).read_text(encoding="utf-8")
        assert ">moving obstacles<" in page
    write_trial_replay(replay_log("rpp"), tmp_path / "still.html", model=None)
    assert "moving obstacles" not in (tmp_path / "still.html").read_text(encoding="utf-8")


def test_only_bends_of_a_way_are_keyed():
    x = np.array([0.0, 1.0, 2.0, 3.0, 3.0, 3.0])
    poses = np.column_stack([x, np.zeros(6), np.zeros(6)])
    assert rows_of_bends(poses).tolist() == [0, 3, 5]


def test_the_map_shows_ways_and_where_they_begin():
    course = course_of(with_a_cart(replay_log("rpp")))
    np.testing.assert_allclose(course.ways[0][[0, 5]], [[2.0, 3.0], [2.5, 3.0]])
    np.testing.assert_allclose(course.movers[0].mean(axis=0), [2.0, 3.0])
    assert course_of(replay_log("rpp")).ways == []


def test_the_export_carries_outlines_ten_times_a_second():
    log = with_a_cart(replay_log("rpp"))
    messages = TrialMessages(log, MessageMaker())
    moved = [entry for entry in messages._moving() if entry[0] is topics.MOVING]
    _, stamp_ns, message = moved[5]
    assert stamp_ns - messages.start_ns == pytest.approx(5e8, abs=1)
    points = np.array([[point.x, point.y] for point in message.markers[0].points])
    # At 0.5 s its centre is at x = 2.5 m.
    np.testing.assert_allclose(points.min(axis=0), [2.0, 2.7])
    np.testing.assert_allclose(points.max(axis=0), [3.0, 3.3])
