"""The user's own map as probes, and cycles that take as long as on the robot's computer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from doctor_texts import RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.studies.doctor import board
from drake_navbench.studies.doctor.board import (
    HERE,
    CycleTimes,
    cycle_row,
    overrides_of_board,
    read_times,
    slowness,
    write_times,
)
from drake_navbench.studies.doctor.probes import MAKERS, probes_for
from drake_navbench.studies.doctor.surroundings import Surroundings
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visit import BY_WEIGHT

BOARD = Path("board.yaml")


@pytest.fixture
def map_file(tmp_path):
    """A room of 6 x 6 m."""
    image = np.full((120, 120), 254, dtype=np.uint8)
    image[[0, -1]] = image[:, [0, -1]] = 0
    (tmp_path / "room.pgm").write_bytes(b"P5\n120 120\n255\n" + image.tobytes())
    path = tmp_path / "room.yaml"
    path.write_text(
        "image: room.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    return path


def times(median_ms, **changed):
    values = {
        "controller": "FollowPath", "parameters": {"lookahead_dist": 0.6}, "period_ms": 50.0,
        "cycles": 200, "median_ms": median_ms, "p95_ms": 2.0 * median_ms, "late_share": 0.0,
    }  # fmt: skip
    return CycleTimes.model_validate(values | changed)


def test_tasks_on_the_users_map_are_probes_with_noise_and_a_varied_start(map_file):
    robot = load_robot("turtlebot4")
    base = {"drive": {"response_time_constant_s": 0.4}}
    probes = probes_for(robot, 0.3, Surroundings(map_file, 3, base), seed=5)
    drawn = [probe for name, probe in probes.items() if name.startswith("map_")]
    assert [probe.name for probe in drawn] == ["probe_map_1", "probe_map_2", "probe_map_3"]
    for probe in drawn:
        assert probe.variation.start_xy_std_m > 0.0
        assert probe.robot_overrides["localization"]
        assert probe.robot_overrides["drive"] == base["drive"]
        assert 0.0 < probe.goal[0] < 6.0
    assert set(MAKERS) - {"slow_zone"} <= set(probes)
    places = map_file.with_name("goals.csv")
    places.write_text("dock,1,1,0\nbed,4,1,0\ndoor,4,3,1.5\n")
    probes = probes_for(robot, 0.3, Surroundings(map_file, places, base), seed=5)
    assert probes["map_2"].description == "room.yaml: from bed to door"
    assert (probes["map_2"].goal, "map_3" in probes) == ((4.0, 3.0, 1.5), False)


@pytest.mark.parametrize(("option", "value"), [("--map", "room.yaml"), ("--goals", "3")])
def test_a_map_goes_with_goals(tmp_path, capsys, option, value):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP))
    assert main([str(path), "--out", str(tmp_path / "out"), option, value]) == 2
    assert "--map: expected --goals with it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("use", "option"),
    [
        (["--read-only"], "--map"),
        (["--read-only"], "--board"),
        (["--read-only"], "--out"),
        (["--measure-board", "b.yaml"], "--symptom"),
        (["--measure-board", "b.yaml"], "--bag"),
        (["--log", "l.parquet"], "--bag"),
    ],
)
def test_an_option_that_would_do_nothing_is_refused(capsys, use, option):
    assert main(["nav2.yaml", *use, option, "x.yaml"]) == 2
    told = f"{option}: is of no use with {use[0]}; leave out one of the two\n"
    assert capsys.readouterr().err == told


def test_a_log_is_looked_at_without_a_file(capsys):
    assert main(["nav2.yaml", "--log", "trial.parquet"]) == 2
    assert capsys.readouterr().err == (
        "--log trial.parquet: a log is looked at without a Nav2 file; leave out nav2.yaml, or "
        "leave out --log to have the file examined\n"
    )


def test_a_board_is_slower_by_the_ratio_of_its_cycles():
    assert slowness(times(12.0), times(1.5), BOARD) == 8.0
    with pytest.raises(InputError, match=r"--board board.yaml: parameters: .* measure again"):
        slowness(times(12.0, parameters={"lookahead_dist": 0.9}), times(1.5), BOARD)


def test_the_same_command_drives_with_the_same_slowness(tmp_path):
    """This computer's own times are kept, or a trial that was driven would be another one."""
    write_times(times(12.0), tmp_path / "board.yaml")
    write_times(times(1.5), tmp_path / HERE)
    timing, remark = overrides_of_board(None, tmp_path / "board.yaml", tmp_path)
    assert timing == {"timing": {"compute_time": "scaled", "compute_time_scale": 8.0}}
    assert "8 times as long as here" in remark
    assert read_times(tmp_path / HERE) == times(1.5)


def test_the_first_cycles_which_load_and_compile_are_not_timed():
    # Two samples a cycle; cycle k takes k ms.
    count = np.repeat(np.arange(12), 2)
    samples = pd.DataFrame({"cycle_count": count, "compute_time_ms": count.astype(float)})
    assert cycle_row(SimpleNamespace(samples=samples)) == {
        "cycle_ms": [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]
    }


def test_the_file_of_a_board_tells_median_and_late_cycles(tmp_path, monkeypatch, capsys):
    # Of 100 cycles 10 take 60 ms, which is more than the period of 50 ms; the others 1 to 90 x 0.1.
    timed = [0.1 * k for k in range(1, 91)] + [60.0] * 10
    monkeypatch.setattr(board, "drive_each", lambda specs, kept_of, jobs: [{"cycle_ms": timed}])
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP))
    file = tmp_path / "board.yaml"
    assert main([str(path), "--measure-board", str(file)]) == 0
    found = read_times(file)
    assert (found.cycles, found.late_share, found.period_ms) == (100, 0.1, 50.0)
    assert found.median_ms == pytest.approx(5.05)
    assert found.parameters["lookahead_dist"] == 0.6
    assert "10% are late" in " ".join(capsys.readouterr().out.split())


def test_late_cycles_are_treated_last_but_for_giving_up_late():
    assert BY_WEIGHT.index(Symptom.LATE_CYCLES) == len(BY_WEIGHT) - 2


@pytest.mark.parametrize(
    "options", [["--board", "none.json"], ["--map", "none.yaml", "--goals", "2"]]
)
def test_a_file_that_cannot_be_read_is_one_line_before_the_file_is_examined(
    options, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path("nav2.yaml").write_text("controller_server:\n  ros__parameters: {}\n")
    assert main(["nav2.yaml", *options, "--out", "visit"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err == f"{options[1]}: cannot be read: No such file or directory\n"
    assert not Path("visit").exists()
