"""The replay pages: complete, small, offline, the same bytes for the same logs."""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from replay_logs import replay_log, with_diagnostics
from scenes import straight_plan

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.analysis.replay.global_plans import PLAN_PATH
from drake_navbench.analysis.replay.strip import compute_top_ms
from drake_navbench.inputs.robot import load_robot
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.plans import Plan

MAX_PAGE_BYTES = 6_000_000
RACERS = ("dwb", "rpp", "teb", "mppi", "mppi_nav2")
MODEL = load_robot("wheelchair").model_path
# A page's library holds addresses as text and in links to click; these would load something.
LOADS = re.compile(
    r"""src\s*=\s*["']?https?:|<link[^>]*https?:|url\(\s*["']?https?:|fetch\(\s*["']https?:"""
)


def race(tmp_path, logs, model=MODEL) -> str:
    path = tmp_path / "race.html"
    write_race_replay(logs, path, model=model)
    return path.read_text(encoding="utf-8")


def alone(tmp_path, log, model=MODEL) -> str:
    path = tmp_path / "alone.html"
    write_trial_replay(log, path, model=model)
    return path.read_text(encoding="utf-8")


def commands(page: str) -> list[bytes]:
    """Returns the commands to Meshcat that a page carries, in MessagePack."""
    return [base64.b64decode(text) for text in re.findall(r'base64,([^"]+)"', page)]


def animation(page: str) -> bytes:
    (command,) = [c for c in commands(page) if b"set_animation" in c]
    return command


@pytest.fixture(scope="module")
def race_page(tmp_path_factory):
    failure = {"reason": "no trajectory <left>"}
    logs = [
        replay_log("dwb"),
        replay_log("teb", outcome="aborted", end_time_s=2.0, info=failure),
        replay_log("mine:a/b=1 & more"),
    ]
    return race(tmp_path_factory.mktemp("race"), logs)


def test_race_names_every_controller_with_its_colour_and_outcome(race_page):
    assert '<span class="name">dwb</span> <span class="detail">succeeded, 4.0 s' in race_page
    assert "aborted, 2.0 s: no trajectory &lt;left&gt;" in race_page
    assert '<span class="name">mine:<wbr>a/<wbr>b=<wbr>1 &amp; more</span>' in race_page
    for name in ("dwb", "teb"):
        assert f"background: {controller_color(name)}" in race_page


def test_a_page_fits_a_telephone(race_page):
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in race_page


def test_a_page_says_how_to_get_what_it_lacks(race_page, tmp_path):
    assert "run with --replay each." in race_page
    without = alone(tmp_path, replay_log("dwb"))
    assert "is not in this log: run with --replay each." in without
    with_all = alone(tmp_path, with_diagnostics(replay_log("mppi")))
    assert "--replay each" not in with_all


def test_variants_of_a_controller_have_colours_of_their_own(tmp_path):
    names = [f"rpp:lookahead_dist={place / 10}" for place in range(1, 5)]
    page = race(tmp_path, [replay_log(name) for name in names])
    assert len(set(re.findall(r'swatch" style="background: (#\w+)"', page)[:4])) == 4


def test_floors_have_names_above_the_scene(tmp_path):
    log = replay_log("dwb")
    floors = [
        {"name": "ground", "offset_m": [0.0, 0.0], "bounds_m": [-2.0, -1.0, 4.0, 3.0]},
        {"name": "ward", "offset_m": [9.0, 0.0], "bounds_m": [7.0, -1.0, 13.0, 3.0]},
    ]
    log = dataclasses.replace(log, info=dict(log.info) | {"floors": floors})
    page = alone(tmp_path, log)
    labels = [{"name": "ground", "x": 1.0, "y": 4.0}, {"name": "ward", "x": 10.0, "y": 4.0}]
    assert json.dumps({"floors": labels}, separators=(",", ":"))[1:-1] in page


def test_a_slow_cycle_does_not_flatten_the_curve_of_compute_times():
    usual = [2.0] * 400
    assert compute_top_ms([usual]) == 2.0
    # One cycle of 170 ms among 800 of 2 ms: the axis ends at 6 ms.
    assert compute_top_ms([usual, [*usual[1:], 170.0, None]]) == 6.0
    assert compute_top_ms([[None]]) is None


def test_race_moves_every_robot(race_page):
    tracks = animation(race_page)
    for name in (b"dwb", b"teb", b"mine:a_b=1 & more"):
        assert b"/controllers/" + name + b"/robot" in tracks
        assert b"/controllers/" + name + b"/robot/left_wheel" in tracks
        assert b"/controllers/" + name + b"/scan/10" in tracks


def test_race_can_hide_every_controller(race_page):
    for name in ("dwb", "teb", "mine:a_b=1 &amp; more"):
        assert f'data-paths="[&quot;/controllers/{name}&quot;]"' in race_page


def test_race_draws_the_whole_scene(race_page):
    drawn = b" ".join(c[:200] for c in commands(race_page) if b"set_object" in c)
    for path in (b"/plan", b"/start/", b"/goal/", b"/floor/", b"/obstacles/0/0", b"/dwb/path"):
        assert path in drawn


def test_race_says_what_the_scenario_is(race_page):
    assert "<title>beside_a_box</title>" in race_page
    assert "Straight past a &lt;box&gt;" in race_page


def test_race_needs_no_network(race_page):
    assert LOADS.search(race_page) is None


def test_race_names_no_file_of_this_machine(race_page):
    assert str(MODEL.parent) not in race_page
    assert not any(str(MODEL.parent).encode() in command for command in commands(race_page))


@pytest.mark.long
def test_another_process_with_other_hashes_gives_the_same_page(tmp_path):
    code = (
        "import sys; from pathlib import Path\n"
        "sys.path[:0] = [sys.argv[1], str(Path(sys.argv[1]).parent)]\n"
        "from test_replay import MODEL, replay_log, write_race_replay\n"
        "logs = [replay_log('dwb'), replay_log('rpp', speed_mps=0.4)]\n"
        "write_race_replay(logs, Path(sys.argv[2]), model=MODEL)"
    )
    page = tmp_path / "there.html"
    subprocess.run(
        [sys.executable, "-c", code, Path(__file__).parent, page],
        check=True,
        env=os.environ | {"PYTHONHASHSEED": "1"},
    )
    assert page.read_text(encoding="utf-8") == race(
        tmp_path, [replay_log("dwb"), replay_log("rpp", speed_mps=0.4)]
    )


@pytest.mark.long
def test_five_controllers_until_the_timeout_take_at_most_the_size_of_a_page(tmp_path):
    logs = [replay_log(name, end_time_s=120.0, speed_mps=0.1) for name in RACERS]
    assert len(race(tmp_path, logs)) <= MAX_PAGE_BYTES


@pytest.mark.long
def test_a_long_trial_with_all_diagnostics_takes_at_most_the_size_of_a_page(tmp_path):
    log = with_diagnostics(replay_log("mppi", end_time_s=120.0))
    assert len(alone(tmp_path, log)) <= MAX_PAGE_BYTES


def test_trial_shows_what_the_controller_had_in_mind(tmp_path):
    page = alone(tmp_path, with_diagnostics(replay_log("mppi")))
    tracks = animation(page)
    for name, path in (
        ("prediction", "/prediction/"),
        ("samples", "/samples/"),
        ("carrot", "/carrot"),
        ("stop plan", "/stop_plan/"),
        ("groups", "/groups/"),
        ("local costmap", "/local_costmap/"),
    ):
        assert f'<span class="name">{name}</span>' in page
        assert path.encode() in tracks


def test_trial_without_diagnostics_has_no_rows_for_them(tmp_path):
    page = alone(tmp_path, replay_log("rpp"))
    for name in ("prediction", "samples", "carrot", "stop plan", "groups"):
        assert f'<span class="name">{name}</span>' not in page


def replanned(controller: str) -> TrialLog:
    """Returns a drive on which the way was planned anew after 1 s and after 2 s."""
    log = replay_log(controller)
    later = [Plan(float(t), straight_plan(2.0 - 0.5 * t, x_m=0.5 * t)) for t in (1, 2)]
    return dataclasses.replace(log, plans=(*log.plans, *later))


def drawn_plans(page: str) -> list[str]:
    """Returns the paths below /plan that are drawn, in order."""
    drawn = b" ".join(c[:200] for c in commands(page) if b"set_object" in c)
    return [path.decode() for path in re.findall(rb"/plan/\d+", drawn)]


def test_trial_shows_each_plan_while_it_is_in_force(tmp_path):
    page = alone(tmp_path, replanned("rpp"))
    # Named after the frames, of which a second has 20.
    assert drawn_plans(page) == ["/plan/0", "/plan/20", "/plan/40"]
    for path in (b"/plan/0", b"/plan/20", b"/plan/40"):
        assert path in animation(page)
    assert f'data-paths="[&quot;{PLAN_PATH}&quot;]"' in page


def test_race_shows_the_first_plans_of_a_trial_that_planned_all_its_legs(tmp_path):
    whole = replanned("rpp")
    legs = (*whole.plans, Plan(3.0, straight_plan(0.5, x_m=1.5), 1))
    page = race(tmp_path, [replanned("dwb"), dataclasses.replace(whole, plans=legs)])
    assert drawn_plans(page) == ["/plan/0", "/plan/1"]
    assert b"/plan" not in animation(page)


def test_ten_minutes_of_long_plans_take_at_most_the_size_of_a_page(tmp_path):
    log = replay_log("rpp", end_time_s=600.0)
    plans = [Plan(float(t), straight_plan(300.0 - 0.5 * t, x_m=0.5 * t)) for t in range(600)]
    page = alone(tmp_path, dataclasses.replace(log, plans=tuple(plans)))
    assert len(page) <= MAX_PAGE_BYTES
    assert len(drawn_plans(page)) == 200


def test_robot_without_a_model_file_is_replayed(tmp_path):
    page = race(tmp_path, [replay_log("rpp", robot="round_robot")], model=None)
    assert b"/controllers/rpp/robot" in animation(page)


def test_trial_that_never_began_to_move_is_replayed(tmp_path):
    log = replay_log("rpp", outcome="error", x_m=0.0, v_mps=0.0, plan=np.empty((0, 3)))
    still = TrialLog(samples=log.samples.iloc[:1], plans=log.plans, info=log.info)
    page = race(tmp_path, [still])
    assert '<span class="name">rpp</span>' in page


def page_data(page: str) -> dict:
    return json.loads(re.search(r'id="navbench-data">(.*?)</script>', page, re.S)[1])


def test_the_strip_keeps_peaks(tmp_path):
    log = replay_log("rpp", end_time_s=30.0)
    samples = log.samples.copy()
    samples.loc[700, "compute_time_ms"] = 77.0
    samples.loc[300, "clearance_m"] = 0.125
    page = alone(tmp_path, dataclasses.replace(log, samples=samples))
    (robot,) = page_data(page)["robots"]
    assert max(robot["compute"]) == 77.0
    assert min(value for value in robot["clearance"] if value is not None) == 0.125
    assert len({len(robot[name]) for name in ("time", "v", "w", "clearance", "compute")}) == 1
    assert len(robot["time"]) <= 400
    assert robot["end"] == 30.0
    assert robot["failed"] is False


def test_race_carries_the_costmaps_of_all_controllers(race_page):
    tracks = animation(race_page)
    for name in (b"dwb", b"teb"):
        assert b"/local_costmap/" + name + b"/" in tracks
