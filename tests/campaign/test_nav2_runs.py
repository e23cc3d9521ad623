"""Runs from whole Nav2 files: what is asked, told, refused and driven."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drake_navbench.campaign.request import Request
from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands import doctor
from drake_navbench.commands import run as run_command
from drake_navbench.commands.run import build_parser, main
from drake_navbench.inputs.check import Status
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.trial import simulate

REPOSITORY = Path(__file__).parents[2]
FILES = REPOSITORY / "tests" / "nav2" / "nav2_files"
WARD = str(REPOSITORY / "scenarios" / "maps" / "ward.yaml")


def request_of(*arguments: str) -> Request:
    """Returns what a command line asks for."""
    return request_from_arguments(build_parser().parse_args(arguments))


def file_of(release: str) -> str:
    """Returns the path of a fixture."""
    return str(FILES / f"{release}.yaml")


@pytest.mark.parametrize("release", ["humble", pytest.param("lyrical", marks=pytest.mark.long)])
def test_a_robot_drives_as_its_nav2_file_says(release):
    campaign = request_of("empty", "--nav2", file_of(release), "--trials", "1").campaign()
    (spec,) = campaign.specs
    assert spec.robot.robot_radius == {"humble": 0.2, "lyrical": 0.22}[release]
    log = simulate(spec)
    assert log.info["outcome"] == Outcome.SUCCEEDED
    limit = spec.robot.drive.max_linear_velocity_mps
    assert log.samples["v_mps"].max() == pytest.approx(limit, abs=0.02)


def test_a_map_with_start_and_goal_is_a_scenario():
    request = request_of(
        *("--nav2", file_of("iron"), "--map", WARD),
        *("--start", "0", "-1", "0", "--goal", "11", "-1", "1.5"),
    )
    (scenario,) = {spec.scenario.name: spec.scenario for spec in request.campaign().specs}.values()
    assert scenario.name == "ward"
    assert scenario.goal == (11.0, -1.0, 1.5)
    assert scenario.navigation_mode == "navigate_to_pose"
    assert [path.name for path in scenario.files] == ["ward.yaml", "ward.png"]


def test_what_is_asked_survives_the_manifest():
    request = request_of("--nav2", file_of("iron"), "--robot", "round_robot")
    assert Request.model_validate_json(request.model_dump_json()) == request


def test_what_a_scenario_replaces_of_the_file_is_told():
    (nav2,) = request_of("one_obstacle", "--nav2", file_of("humble")).campaign().nav2
    rows = [row for row in nav2.setup.check.rows if row.node == "scenario one_obstacle"]
    assert "navigation.local_costmap.plugins" in [row.parameter for row in rows]
    assert {row.status for row in rows} == {Status.OTHER_FORM}


@pytest.mark.long
def test_check_prints_the_same_table_in_every_process_and_writes_nothing(tmp_path):
    command = [sys.executable, "-m", "drake_navbench.run", "--check", "--nav2", file_of("jazzy")]
    # Another order of sets than in this process.
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, cwd=tmp_path, env=environment
    )
    table = request_of("--nav2", file_of("jazzy")).nav2_columns()[0].setup.check.as_text()
    first, _, rest = done.stdout.partition("\n")
    assert first.startswith("The doctor's rules find 2 possible faults in the file: drake-navbench")
    assert rest == f"Columns: jazzy/FollowPath\n{table}\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--check"], "--check: expected a Nav2 file by --nav2"),
        (
            ["--set", "a=1"],
            "--set 'a=1': expected a Nav2 file by --nav2 or a xacro file by --robot as well",
        ),
        (["--nav2", "FILE", "--set", "a"], "--set 'a': expected name=value"),
        (
            ["--map", "map.yaml"],
            "--start: missing; --map needs --start and --goal, or --goals",
        ),
        (
            ["doorway", "--goals", "2"],
            "--goals: expected a map by --map, or a Gazebo world; doorway is no world",
        ),
        (
            ["--map", "map.yaml", "--goals", "1001"],
            "--goals: input should be less than or equal to 1000, got 1001",
        ),
        (
            ["--nav2", str(REPOSITORY / "models" / "wheelchair.yaml")],
            "no node with ros__parameters",
        ),
    ],
)
def test_wrong_arguments_are_one_line_and_nothing_is_written(
    arguments, told, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main([file_of("iron") if a == "FILE" else a for a in arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line
    assert list(tmp_path.iterdir()) == []


def test_check_refuses_what_the_run_would_refuse(tmp_path, capsys):
    text = Path(file_of("jazzy")).read_text().replace("footprint: false", "footprint: true")
    path = tmp_path / "nav2.yaml"
    path.write_text(text)
    # Up to jazzy Nav2 has taken a round robot's polygon.
    assert main(["--nav2", str(path), "--nav2-release", "kilted", "--check"]) == 2
    assert "CostCritic.consider_footprint" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("others", "told"),
    [
        (["--map", "gone.yaml", "--goals", "2"], "gone.yaml"),
        (["--map", WARD, "--goals", "gone_goals.yaml"], "gone_goals.yaml"),
        (["gone_scenario.yaml"], "gone_scenario.yaml"),
        (["gone.world", "--goals", "2"], "gone.world"),
        (["--map", WARD, "--start", "0", "0", "0", "--goal", "999", "0", "0"], "off the map"),
        (["--barn", "gone_barn"], "gone_barn"),
        (["--controllers", "rpp,none_such"], "none_such"),
        (["--params", "gone_params.yaml"], "gone_params.yaml"),
        (["empty", "--sweep", "FollowPath.nothing=1,2"], "nothing"),
        (["--metric", "gone.py:mine"], "gone.py"),
        (["--columns", "no_metric"], "no_metric"),
        (["--live-port", "8000"], "--live-port: expected --live as well"),
        (["--robot", "gone_robot.yaml"], "gone_robot.yaml"),
        (["--packages", "gone_folder"], "--packages gone_folder: expected a folder"),
    ],
)
def test_check_looks_at_each_input_beside_the_nav2_file_as_a_drive_does(
    others, told, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main(["--nav2", file_of("iron"), *others, "--check"]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    assert told in line
    assert list(tmp_path.iterdir()) == []


def test_check_of_a_nav2_file_on_a_map_draws_its_tasks_and_is_the_table(capsys):
    assert main(["--nav2", file_of("iron"), "--map", WARD, "--goals", "2", "--check"]) == 0
    on_map = capsys.readouterr().out
    assert main(["--nav2", file_of("iron"), "--check"]) == 0
    assert capsys.readouterr().out == on_map


def test_a_file_without_controllers_needs_them_by_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.yaml").write_text("planner_server: {ros__parameters: {use_sim_time: true}}")
    assert main(["empty", "--nav2", "part.yaml"]) == 2
    assert "no controller_server" in capsys.readouterr().err
    campaign = request_of("empty", "--nav2", "part.yaml", "--controllers", "rpp").campaign()
    # Without a word on it Nav2 plans with NavFn.
    assert campaign.specs[0].robot.navigation.planner.plugin.endswith("NavfnPlanner")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--nav2", "a b.yaml"], "doctor 'a b.yaml' --read-only"),
        (
            ["--nav2", "a.yaml", "--robot", "a.xacro", "--packages", "ws", "--set", "n=1"],
            "doctor a.yaml --read-only --robot a.xacro --packages ws --set n=1",
        ),
        (
            ["--package", "clone", "--nav2", "a.yaml", "--robot", "a.xacro", "--pick", "nav2=2"],
            "doctor --read-only --package clone --pick nav2=2",
        ),
    ],
)
def test_the_doctors_command_reads_what_the_run_reads(arguments, told):
    parsed = run_command.build_parser().parse_args(arguments)
    assert run_command._doctor_command(parsed) == f"drake-navbench {told}"
    doctor.build_parser().parse_args(told.replace("'", "").replace("a b", "ab").split()[1:])


def test_a_run_that_goes_on_tells_no_findings_again():
    parsed = run_command.build_parser().parse_args(["--resume", "results/mine"])
    columns = request_of("--nav2", file_of("jazzy")).nav2_columns()
    assert run_command._remarks(parsed, columns) == []
