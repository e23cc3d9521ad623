"""Groups are entered, passed and come near to as their geometry says; who came is told apart."""

import numpy as np
import pytest
from stub_controller import StubPreset

from drake_navbench.analysis.metrics import social
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.definition import Undefined
from drake_navbench.analysis.metrics.people import approaches_within
from drake_navbench.controller import Decision
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

HALL = """\
description: a hall
world: {people: {recording: {file: crowd.csv, max_gap_s: 99, groups: GROUPS}}}
plan: {type: polyline, points: [[0.0, 0.0], [9.0, 0.0]]}
goal: [9.0, 0.0, 0.0]
timeout_s: 8.0
"""
# The chair's outline ends so far to the sides.
SIDE_M = 0.3


def among(folder, v, places, groups="[]"):
    """Returns the log of a trial under one command among people at (name, x, y), who stand."""
    rows = [f"{time_s},{name},{x},{y}" for name, x, y in places for time_s in (0.0, 50.0)]
    return among_rows(folder, v, rows, groups)


def among_rows(folder, v, rows, groups="[]"):
    text = "\n".join(["time_s,person,x_m,y_m", *rows])
    (folder / "crowd.csv").write_text(text, encoding="utf-8")
    (folder / "hall.yaml").write_text(HALL.replace("GROUPS", groups), encoding="utf-8")
    scenario = load_scenario(str(folder / "hall.yaml"))
    step = StubPreset(lambda observation, memory: Decision(np.array([v, 0.0]), memory))
    return simulate(TrialSpec(scenario, scenario.load_robot("wheelchair"), step, seed=0))


def test_a_robot_that_drives_between_two_of_a_group_is_among_them(tmp_path):
    pair = [("a", 2.0, 1.5), ("b", 2.0, -1.5)]
    log = among(tmp_path, 0.5, pair, '[["a", "b"]]')
    assert social.groups_entered_count(log) == 1.0
    x, time_s = log.samples["x_m"].to_numpy(), log.samples["time_s"].to_numpy()
    front_m, rear_m = outline_of(log)[:, 0].max(), outline_of(log)[:, 0].min()

    def share_between(first_m, last_m):
        """Returns the share of the time with the chair's place from one x to another."""
        enters_s, leaves_s = np.interp([first_m, last_m], x, time_s)
        return (leaves_s - enters_s) / log.end_time_s

    # From its front at x = 2 m to its rear there; then the same 1.2 m before and behind.
    expected = share_between(2.0 - front_m, 2.0 - rear_m)
    assert social.group_crossing_ratio(log) == pytest.approx(expected, abs=0.02)
    expected = share_between(2.0 - front_m - 1.2, 2.0 - rear_m + 1.2)
    assert social.group_space_ratio(log) == pytest.approx(expected, abs=0.02)


def test_the_same_two_are_no_group_where_nobody_says_so(tmp_path):
    log = among(tmp_path, 0.5, [("a", 2.0, 1.5), ("b", 2.0, -1.5)])
    with pytest.raises(Undefined, match="no groups"):
        social.group_crossing_ratio(log)


@pytest.mark.parametrize(
    ("places", "entered"),
    [
        # A triangle whose one side reaches over the chair's way, and one beside it.
        ([("a", 3.0, 2.0), ("b", 5.0, 2.0), ("c", 4.0, -1.0)], 1.0),
        ([("a", 3.0, 2.0), ("b", 5.0, 2.0), ("c", 4.0, 1.0)], 0.0),
        # Too far from each other to be together.
        ([("a", 3.0, 8.0), ("b", 3.0, -8.0), ("c", 4.0, -1.0)], 0.0),
    ],
)
def test_the_hull_of_three(tmp_path, places, entered):
    log = among(tmp_path, 0.5, places, '[["a", "b", "c"]]')
    assert social.groups_entered_count(log) == entered
    assert (social.group_crossing_ratio(log) > 0.0) == bool(entered)


def test_a_group_of_whom_one_has_gone_is_that_of_the_others(tmp_path):
    rows = ["0,a,3,2", "50,a,3,2", "0,b,5,2", "50,b,5,2", "0,c,4,-1", "1,c,4,-1"]
    log = among_rows(tmp_path, 0.5, rows, '[["a", "b", "c"]]')
    assert social.groups_entered_count(log) == 0.0


def test_who_came_too_near_is_told_apart(tmp_path):
    beside_m = SIDE_M + 0.3 + 0.3
    log = among(tmp_path, 0.5, [("a", 3.0, beside_m)])
    assert social.robot_intimate_approach_count(log) == 1.0
    assert social.person_intimate_approach_count(log) == 0.0
    walks = [f"{time_s},a,{-4.0 + time_s},{beside_m}" for time_s in range(9)]
    log = among_rows(tmp_path, 0.0, walks)
    assert social.robot_intimate_approach_count(log) == 0.0
    assert social.person_intimate_approach_count(log) == 1.0


def test_who_comes_twice_counts_twice(tmp_path):
    beside_m = SIDE_M + 0.3 + 0.3
    ys = [beside_m, 3.0, beside_m, 3.0, beside_m]
    log = among_rows(tmp_path, 0.0, [f"{2 * i},a,0.0,{y}" for i, y in enumerate(ys)])
    # There from the beginning, and back two times.
    assert approaches_within(log, 0.45) == (0, 2)


def test_the_zones_are_all_of_the_time(tmp_path):
    log = among(tmp_path, 0.5, [("a", 5.05, 0.0)])
    zones = ("intimate", "personal", "social", "public")
    shares = [getattr(social, f"{zone}_space_ratio")(log) for zone in zones]
    assert sum(shares) == pytest.approx(1.0)
    assert min(shares) > 0.0
