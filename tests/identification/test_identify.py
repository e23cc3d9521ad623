"""The command identify: from a line in a shell to what is found, predicted and told."""

from __future__ import annotations

import json

import pytest
from planted import (
    TRUE_GOAL_M,
    TRUE_LAG_S,
    TRUE_LOOKAHEAD_M,
    TRUE_SIM_TIME_S,
    drive_each,
    write_problem,
)

from drake_navbench.command_line import EXIT_INTERRUPTED
from drake_navbench.commands import identify as command
from drake_navbench.identification import driving
from drake_navbench.inputs.presets import load_preset_file

# Two rounds of one fit to all, two without a scenario and two without a controller; of one
# controller, who cannot be held out, three.
ROUNDS = ["--rounds", "2"]
OWN, OWN_OF_ONE = 2 * 5, 2 * 3


@pytest.fixture
def problem(tmp_path, monkeypatch):
    """Arguments that name the planted tables and unknowns."""
    monkeypatch.setattr(driving, "drive_each", drive_each)
    tables, unknowns = write_problem(tmp_path)
    return ["--tables", str(tables), "--unknowns", str(unknowns), "--jobs", "1"]


def found_values(run) -> dict[str, dict]:
    return {value["name"]: value for block in run["blocks"] for value in block["values"]}


def result_in(folder) -> dict:
    return json.loads((folder / "identification.json").read_text(encoding="utf-8"))


def test_planted_settings_are_found_again_and_predict_what_was_held_out(problem, tmp_path, capsys):
    out = tmp_path / "out"
    budget = ["--budget", str(24 + OWN), *ROUNDS]
    arguments = [*problem, *budget, "--trials", "2", "--out", str(out)]
    assert command.main(arguments) == 0
    result = result_in(out)
    (run,) = result["runs"]
    found = found_values(run)
    truth = {
        "goal_m": (TRUE_GOAL_M, 0.02),
        "drive.response_time_constant_s": (TRUE_LAG_S, 0.04),
        "lookahead_dist": (TRUE_LOOKAHEAD_M, 0.1),
        "sim_time": (TRUE_SIM_TIME_S, 0.2),
    }
    for name, (value, room) in truth.items():
        assert found[name]["found"] == pytest.approx(value, abs=room), name
        assert found[name]["low"] <= value <= found[name]["high"], name
        assert found[name]["is_told"], name
    # No metric of the planted trials depends on it.
    assert not found["desired_linear_vel"]["is_told"]
    both = run["scores"]["both"]["together"]
    assert both["cells"] == 24
    assert both["median_error"] < 0.05
    assert both["median_error"] < run["scores"]["shipped"]["together"]["median_error"]
    page = (out / "identification.md").read_text(encoding="utf-8")
    assert "`desired_linear_vel` (rpp)" in page.split("do not tell:")[1].splitlines()[0]
    proposed = load_preset_file(out / "proposed" / "rpp_identified.yaml")
    assert proposed.parameters.lookahead_dist == found["lookahead_dist"]["found"]
    capsys.readouterr()
    # The same command finds everything done, and drives nothing.
    assert command.main(arguments) == 0
    assert result_in(out) == result


def test_an_interrupted_run_goes_on_and_comes_to_the_same_end(problem, tmp_path, monkeypatch):
    budget = ["--budget", str(16 + OWN_OF_ONE), *ROUNDS, "--trials", "1", "--controllers", "rpp"]
    assert command.main([*problem, *budget, "--out", str(tmp_path / "whole")]) == 0
    calls = []

    def interrupted(*arguments, **options):
        calls.append(1)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return drive_each(*arguments, **options)

    monkeypatch.setattr(driving, "drive_each", interrupted)
    cut = [*problem, *budget, "--out", str(tmp_path / "cut")]
    assert command.main(cut) == EXIT_INTERRUPTED
    assert command.main(cut) == 0
    results = [result_in(tmp_path / name) for name in ("whole", "cut")]
    for result in results:
        del result["command"]
    assert results[0] == results[1]


def test_cells_left_out_are_fitted_by_nobody_and_judged_apart(problem, tmp_path):
    out = tmp_path / "out"
    budget = ["--budget", str(16 + OWN_OF_ONE), *ROUNDS]
    arguments = [*problem, *budget, "--controllers", "rpp"]
    left_out = ["--leave-out", "*/time_taken/*", "--trials", "1", "--out", str(out)]
    assert command.main([*arguments, *left_out]) == 0
    result = result_in(out)
    (run,) = result["runs"]
    assert result["fitted_cells"] == 10
    assert run["scores"]["left_out"]["together"]["cells"] == 2
    assert all(row["is_fitted"] is (row["metric"] != "time_taken") for row in run["table"])


def test_two_seeds_are_side_by_side_and_come_to_the_same_as_alone(problem, tmp_path):
    out = tmp_path / "out"
    budget = ["--budget", "29", "--rounds", "1", "--trials", "1", "--out", str(out)]
    alone = []
    for seed in ("0", "1"):
        assert command.main([*problem, *budget, "--seed", seed]) == 0
        alone += result_in(out)["runs"]
    assert alone[0] != alone[1]
    # A seed comes to the same beside another one.
    assert command.main([*problem, *budget, "--seed", "0,1"]) == 0
    result = result_in(out)
    assert result["seeds"] == [0, 1]
    assert result["runs"] == alone
    told = {value["name"]: value for value in result["agreement"]["values"]}
    assert told["goal_m"]["is_told"]
    # No metric depends on it: that two seeds find something says nothing.
    assert not told["desired_linear_vel"]["is_told"]
    both = result["agreement"]["predictions"]["both"]
    assert both["all"] + both["some"] + both["none"] == 8
    page = (out / "identification.md").read_text(encoding="utf-8")
    found = [found_values(run)["desired_linear_vel"]["found"] for run in alone]
    assert f" | {found[0]:.4g} / {found[1]:.4g} | " in page
    assert "| goal | found, seed 0 | found, seed 1 |  |" in page
    assert "- Told, with every seed alike: `goal_m` (layout of empty)" in page


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["--budget", "45"],
            "--budget 45: expected at least 46: 16 to learn from, and 6 rounds of 5 fits",
        ),
        (["--budget", "45s"], "--budget 45s: expected at least 46s, 1 s for each of 46 settings"),
        (["--budget", "soon"], "--budget 'soon': expected a number of evaluations such as 600"),
        (["--budget", "0"], "--budget '0': expected a number of evaluations such as 600"),
        (
            ["--leave-out", "empty/time_taken/rp"],
            "--leave-out 'empty/time_taken/rp': 'rp' is not in the tables",
        ),
        (["--leave-out", "empty"], "--leave-out 'empty': expected SCENARIO/METRIC/CONTROLLER"),
        (["--leave-out", "*/*/*"], "identify: every cell is left out; expected some to fit to"),
        (["--scenarios", "slalom"], "--scenarios slalom: is not in the tables"),
        (["--controllers", "drw"], "--controllers drw: is not in the tables"),
        (["--robot", "hovercraft"], "hovercraft"),
        (["--seed", "one"], "--seed 'one': expected whole numbers such as 0, or 0,1"),
        (["--seed", "-1"], "--seed '-1': expected whole numbers such as 0, or 0,1"),
        (["--seed", "0,"], "--seed '0,': expected whole numbers such as 0, or 0,1"),
        (["--seed", "1,1"], "--seed '1,1': expected each seed once"),
    ],
)
def test_wrong_input_is_one_line_and_nothing_is_written(problem, tmp_path, capsys, arguments, line):
    out = tmp_path / "out"
    budget = [] if "--budget" in arguments else ["--budget", "600"]
    assert command.main([*problem, *budget, *arguments, "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert line in shown.err
    assert shown.err.count("\n") == 1
    assert shown.out == ""
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("scenario,metric,unit\n", "expected the columns scenario, metric, unit and one a contr"),
        ("scenario,metric,unit,rpp\nempty,speed,m/s,1\n", "metric 'speed' is not a published one"),
        (
            "scenario,metric,unit,rpp\nempty,time_taken,s,fast\n",
            "empty/time_taken/rpp: expected a finite number, got 'fast'",
        ),
        ("scenario,metric,unit,rpp\nempty,time_taken,s,nan\n", "expected a finite number"),
        (
            "scenario,metric,unit,who\nempty,time_taken,s,15\n",
            "controllers: 'who' of the tables is missing",
        ),
        ("scenario,metric,unit,rpp\n", "identify: every cell is left out"),
    ],
)
def test_wrong_tables_are_one_line(tmp_path, capsys, text, line):
    tables = tmp_path / "tables.csv"
    tables.write_text(text, encoding="utf-8")
    arguments = ["--tables", str(tables), "--budget", "600", "--out", str(tmp_path / "out")]
    assert command.main(arguments) == 2
    shown = capsys.readouterr().err
    assert line in shown
    assert shown.count("\n") == 1


@pytest.mark.parametrize(
    ("before", "after", "line"),
    [
        ("goal_m:", "goal:", "'goal' is not a dimension"),
        ("0.3:1.2", "1.2", "expected LOW:HIGH, or several values"),
        ("sim_time", "sim_tim", "sim_tim"),
        ("drive.response_time_constant_s", "drive.response", "base: drive.differential.response"),
        ("layouts:", "layout:", "layout"),
    ],
)
def test_wrong_unknowns_are_one_line(problem, tmp_path, capsys, before, after, line):
    path = tmp_path / "unknowns.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")
    assert command.main([*problem, "--budget", "600", "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr().err
    assert line in shown
    assert shown.count("\n") == 1
