"""The command tune: from a line in a shell to parameter files and a page."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from test_study import planted

from drake_navbench.commands import tune as command
from drake_navbench.inputs.presets import load_preset, load_preset_file
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.studies.tuning import chance, judgement, study

ARGUMENTS = ["rpp", "--scenarios", "doorway,one_obstacle", "--held-out", "static_obstacles"]
ARGUMENTS += ["--objectives", "time,clearance", "--parameter", "lookahead_dist=0.3:1.2"]
ARGUMENTS += ["--configurations", "12", "--pairs", "8", "--fresh", "4", "--front", "2"]
ARGUMENTS += ["--jobs", "1"]


def planted_benchmark(scenarios, columns, *, trials, seed, robot, jobs, out):
    """What `run_benchmark` returns, from `planted`."""
    from drake_navbench.campaign.campaign import plan_campaign

    campaign = plan_campaign(scenarios, columns, trials=trials, seed=seed, robot=robot)
    specs = campaign.specs
    rows = [
        row | {"controller": spec.preset.name, "trial": spec.trial, "seed": spec.seed}
        for row, spec in zip(planted(specs, jobs=1), specs, strict=True)
    ]
    Path(out).mkdir(parents=True)
    ResultsFolder(Path(out)).write_manifest({"identity": campaign.identity})
    ResultsFolder(Path(out)).write_trials(pd.DataFrame(rows))

    class Results:
        trials = pd.DataFrame(rows)

    return Results()


@pytest.fixture
def planted_trials(monkeypatch):
    monkeypatch.setattr(study, "measure", planted)
    monkeypatch.setattr(chance, "measure", planted)
    monkeypatch.setattr(judgement, "run_benchmark", planted_benchmark)


def test_files_and_page_say_what_was_found(planted_trials, tmp_path, capsys):
    out = tmp_path / "tuning"
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "optimism gap (search -> fresh seeds): time -" in printed
    assert "rpp_tuned_1 beats rpp in the held-out scenarios" in printed
    result = json.loads((out / "tuning.json").read_text(encoding="utf-8"))
    assert result["winner"] == "rpp_tuned_1"
    point = result["front"][0]
    (from_nav2,) = load_parameter_file(out / "front" / "rpp_tuned_1.nav2.yaml")
    preset = load_preset_file(out / "front" / "rpp_tuned_1.preset.yaml")
    wanted = load_preset(f"rpp:lookahead_dist={point['parameters']['lookahead_dist']}")
    assert from_nav2.parameters == preset.parameters == wanted.parameters
    assert "drake-navbench tune rpp" in (out / "front" / "rpp_tuned_1.nav2.yaml").read_text(
        encoding="utf-8"
    )
    page = (out / "tuning.html").read_text(encoding="utf-8")
    assert "rpp_tuned_1 beats rpp in the held-out scenarios" in page
    assert page.count("<svg") == 2
    assert "for touches alone restricted_small_noisy and 4 random worlds" in printed
    # Of the held-out scenario 10, the fewest that can decide four tests.
    assert "rpp_tuned_1: touches nothing in 26 trials, 4 random worlds among them" in printed
    assert point["random_worlds"]["touched"] == point["closed_way"]["touched"] == [0, 0]
    # 1 - 0.05^(1/4)
    assert point["random_worlds"]["at_most"] == pytest.approx(0.527, abs=1e-3)
    assert '0 of 4 <span class="muted">(baseline 0; at most 52.7%)' in page
    # The same command finds everything done, and drives nothing.
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 0
    assert json.loads((out / "tuning.json").read_text(encoding="utf-8")) == result


def test_a_point_that_touches_in_its_judgement_is_not_on_the_front(
    planted_trials, monkeypatch, tmp_path, capsys
):
    """Whatever its objectives are: in a random world that the search has not seen."""

    def touching(scenarios, columns, **asked):
        results = planted_benchmark(scenarios, columns, **asked)
        trials = results.trials
        is_touch = (trials.scenario == "random_world_6") & (trials.controller == "rpp_tuned_1")
        trials.loc[is_touch, "outcome"] = "collided"
        return results

    monkeypatch.setattr(judgement, "run_benchmark", touching)
    out = tmp_path / "tuning"
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    told = "rpp_tuned_1: touches something in random_world_6 (1 trial): not on the front"
    assert told in printed
    result = json.loads((out / "tuning.json").read_text(encoding="utf-8"))
    assert result["winner"] != "rpp_tuned_1"
    assert "rpp_tuned_1" not in [point["name"] for point in result["front"]]
    assert [point["touches"] for point in result["touching"]] == [{"random_world_6": 1}]
    assert not (out / "front" / "rpp_tuned_1.nav2.yaml").exists()
    page = (out / "tuning.html").read_text(encoding="utf-8")
    assert "<td>random_world_6 1</td>" in page


def test_where_everything_touches_the_search_says_so(planted_trials, tmp_path, capsys):
    arguments = [a.replace("lookahead_dist=0.3:1.2", "lookahead_dist=0.2:0.3") for a in ARGUMENTS]
    arguments[0] = "rpp:lookahead_dist=0.25"
    out = tmp_path / "tuning"
    assert command.main([*arguments, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "itself touches something in restricted_small_noisy (1 trial)" in printed
    assert "12 of 12 touched something" in printed
    page = (out / "tuning.html").read_text(encoding="utf-8")
    assert "No configuration came through the race without touching anything" in page


def test_a_front_that_has_changed_is_judged_anew(planted_trials, tmp_path):
    """Its points have the names of the former ones, and other parameters."""
    first, second = (
        replace(load_preset(f"rpp:lookahead_dist={value}"), name="rpp_tuned_1")
        for value in (0.5, 0.8)
    )
    asked = {"trials": 2, "seed": 0, "robot": "wheelchair", "jobs": 1}
    times_s = [
        judgement.driven_in(tmp_path / "fresh", ["doorway"], [column], **asked)[
            "time_to_goal_s"
        ].tolist()
        for column in (first, second, second)
    ]
    assert times_s[0] != times_s[1] == times_s[2]


def test_points_of_an_earlier_front_are_not_left(planted_trials, tmp_path):
    out = tmp_path / "tuning"
    stale = out / "front" / "rpp_tuned_9.nav2.yaml"
    stale.parent.mkdir(parents=True)
    stale.touch()
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 0
    assert not stale.exists()


@pytest.mark.long
def test_other_held_out_scenarios_are_driven_anew(planted_trials, tmp_path):
    out = tmp_path / "tuning"
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 0
    others = [argument.replace("static_obstacles", "speed_zone") for argument in ARGUMENTS]
    assert command.main([*others, "--out", str(out)]) == 0
    result = json.loads((out / "tuning.json").read_text(encoding="utf-8"))
    assert list(result["front"][0]["held_out"]["by_scenario"]) == ["speed_zone"]


def test_where_none_wins_the_page_says_so(planted_trials, tmp_path, capsys):
    arguments = [a.replace("lookahead_dist=0.3:1.2", "lookahead_dist=0.3:0.5") for a in ARGUMENTS]
    assert command.main([*arguments, "--out", str(tmp_path / "tuning")]) == 0
    page = (tmp_path / "tuning" / "tuning.html").read_text(encoding="utf-8")
    assert "beats rpp in" not in page
    assert "rpp" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"doorway,one_obstacle": "dorway"}, "'dorway'"),
        (
            {"static_obstacles": "doorway"},
            "is a scenario of the search as well; expected another one",
        ),
        ({"doorway,one_obstacle": ""}, "--scenarios: expected at least one"),
        ({"8": "1000000000"}, "--pairs: got 1000000000, expected at most 100000"),
        ({"4": "1000000000"}, "--fresh: got 1000000000, expected at most 100000"),
        ({"time,clearance": "time,tme"}, "'tme' is not known"),
        ({"rpp": "rppp"}, "'rppp' is not known"),
        ({"lookahead_dist=0.3:1.2": "foo=1:2"}, "foo: unknown field"),
        ({"lookahead_dist=0.3:1.2": "max_linear_vel=-1:1"}, "should be greater than 0, got -1"),
        ({"lookahead_dist=0.3:1.2": "lookahead_dist=a,b"}, "should be a valid number, got 'a'"),
    ],
)
def test_wrong_input_is_one_line_and_writes_nothing(changed, told, tmp_path, capsys):
    out = tmp_path / "tuning"
    arguments = [changed.get(argument, argument) for argument in ARGUMENTS]
    assert command.main([*arguments, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_a_baseline_that_never_arrives_is_one_line_and_leaves_no_study(
    monkeypatch, tmp_path, capsys
):
    def aborting(specs, *, jobs):
        return [row | {"outcome": "aborted"} for row in planted(specs, jobs=jobs)]

    monkeypatch.setattr(study, "measure", aborting)
    monkeypatch.setattr(chance, "measure", planted)
    out = tmp_path / "tuning"
    assert command.main([*ARGUMENTS, "--out", str(out)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "the baseline reaches the goal in none of its trials there" in line
    assert not out.exists()


@pytest.mark.long
def test_a_real_search_is_driven_and_judged(tmp_path, capsys):
    arguments = ["rpp_bringup", "--scenarios", "doorway,one_obstacle"]
    arguments += ["--held-out", "static_obstacles", "--configurations", "3", "--pairs", "4"]
    arguments += ["--fresh", "2", "--front", "1", "--jobs", "2"]
    assert command.main([*arguments, "--out", str(tmp_path / "tuning")]) == 0
    result = json.loads((tmp_path / "tuning" / "tuning.json").read_text(encoding="utf-8"))
    assert len(result["configurations"]) == 3
    assert len(result["front"]) == 1
    # Ten pairs that all differ in one direction have p = 2 / 2^10 < 1% / 3; nine do not decide.
    told = "--fresh 2 can decide nothing about 1 point and 3 objectives; 10 pairs are driven"
    assert told in capsys.readouterr().out
    logs = tmp_path / "tuning" / "held_out" / "trials" / "static_obstacles"
    assert len(list(logs.glob("*/*.parquet"))) == 2 * 10
