"""A search finds what is planted, goes on where it ended, and is joined only by its equals."""

from __future__ import annotations

import math
import zlib
from pathlib import Path

import numpy as np
import pytest
import yaml

from drake_navbench import models
from drake_navbench.campaign.rows_of_trials import planned_pairs
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.studies.tuning import study as study_module
from drake_navbench.studies.tuning.guards import guard_specs, guards_for
from drake_navbench.studies.tuning.journal import JOURNAL, open_study
from drake_navbench.studies.tuning.objectives import chosen_objectives
from drake_navbench.studies.tuning.search_space import search_space
from drake_navbench.studies.tuning.study import (
    Ending,
    Sampling,
    Search,
    Trials,
    configurations_of,
    drive_baseline,
    front_of,
    importance_of,
)
from drake_navbench.studies.tuning.task import tuning_task

OBJECTIVES = ("time", "clearance")
PARAMETERS = ("lookahead_dist=0.3:1.2", "cost_scaling_gain=0.3:1.0")
PLANTED = 0.8


def planted(specs, *, jobs):
    """Trials that are best at lookahead_dist 0.8, by what they would be if they were driven.

    Above 1.1 they fail; below 0.35 they touch something in a closed way, between 0.82 and 0.9 in
    one random world.
    """
    rows = []
    for spec in specs:
        off = abs(spec.preset.parameters.lookahead_dist - PLANTED)
        noise = 0.01 * math.sin(zlib.crc32(f"{spec.seed}".encode()))
        fails = spec.preset.parameters.lookahead_dist > 1.1
        name = spec.scenario.name
        touches = (
            spec.preset.parameters.lookahead_dist < 0.35
            if name.startswith("restricted")
            else 0.82 < spec.preset.parameters.lookahead_dist < 0.9 and name == "random_world_1"
        )
        outcome = "aborted" if fails else "succeeded"
        rows.append(
            {
                "scenario": name,
                "outcome": "collided" if touches else outcome,
                "time_to_goal_s": 10.0 * (1.0 + off + noise),
                "min_clearance_m": 0.5 * (1.0 - off + noise),
            }
        )
    return rows


@pytest.fixture
def make_search(tmp_path, monkeypatch):
    monkeypatch.setattr(study_module, "measure", planted)
    baseline = load_preset("rpp")
    space = search_space(baseline, PARAMETERS)
    pairs = planned_pairs(baseline, ["doorway", "one_obstacle"], "wheelchair", 16, 0)
    guards = guards_for(baseline, "wheelchair", seed=0, first=0, worlds=3)
    trials = Trials(
        pairs,
        guard_specs(guards.closed, baseline, "wheelchair", 0),
        guard_specs(guards.worlds, baseline, "wheelchair", 0),
    )

    def make(folder="study", **changed):
        asked = {
            "searched": PARAMETERS,
            "scenarios": ("doorway", "one_obstacle"),
            "guards": guards.names,
            "robot": "wheelchair",
            "objectives": OBJECTIVES,
            "most_pairs": 16,
            "seed": 0,
        }
        told = []
        task = tuning_task(baseline, **(asked | changed))
        study = open_study(tmp_path / folder, task, told.append)
        objectives = chosen_objectives(OBJECTIVES)
        driven = drive_baseline(trials, objectives, jobs=1)
        search = Search(
            study,
            space,
            trials,
            objectives,
            baseline=driven[: len(pairs)],
            sampling=Sampling("tpe", 0),
            jobs=1,
            journal=tmp_path / folder / JOURNAL,
        )
        search.told = told
        return study, search

    return make


def test_pairs_take_the_scenarios_in_turn():
    pairs = planned_pairs(load_preset("rpp"), ["doorway", "one_obstacle"], "wheelchair", 5, 0)
    names = [spec.scenario.name for spec in pairs]
    assert names == ["doorway", "one_obstacle", "doorway", "one_obstacle", "doorway"]
    assert [spec.trial for spec in pairs] == [0, 0, 1, 1, 2]


def test_what_is_planted_is_found_and_what_is_behind_is_dropped(make_search):
    study, search = make_search()
    told = []
    search.run(25, told.append)
    driven = configurations_of(study)
    assert len(driven) == len(told) == 25
    (best, *_) = front_of(driven, 8)
    assert best.parameters["lookahead_dist"] == pytest.approx(PLANTED, abs=0.05)
    assert np.all(best.means < 0.0)
    dropped = [entry for entry in driven if entry.ending == Ending.DROPPED]
    assert dropped
    assert all(len(entry.differences) < 16 for entry in dropped)
    # The failing ones are no part of the front, however they are placed.
    assert all(entry.parameters["lookahead_dist"] <= 1.1 for entry in front_of(driven, 99))
    assert importance_of(study, 0)["lookahead_dist"] > 0.5


def test_whoever_touches_anything_is_out_and_races_against_nobody(make_search):
    """Also where its objectives are the best, and where it touches in a random world alone."""
    study, search = make_search()
    search.run(25, lambda driven: None)
    driven = configurations_of(study)
    touched = [entry for entry in driven if entry.ending == Ending.TOUCHED]
    in_closed_way = [e for e in touched if "restricted_small_noisy" in e.touches]
    in_a_world = [e for e in touched if e.touches == {"random_world_1": 1}]
    assert in_closed_way
    assert in_a_world
    # Before the second look, and after the last one.
    assert {(len(e.differences), e.trials) for e in in_closed_way} == {(8, 9)}
    assert {(len(e.differences), e.trials) for e in in_a_world} == {(16, 20)}
    found = [entry.parameters["lookahead_dist"] for entry in front_of(driven, 99)]
    assert found
    assert not any(value < 0.35 or 0.82 < value < 0.9 for value in found)
    assert all(len(e.as_rival) == 0 for e in touched)
    # The sampler takes them for the worst.
    values = {trial.number: trial.values for trial in study.trials}
    assert all(values[e.number] == [1.0, 1.0] for e in touched)


def test_a_robot_without_room_at_the_start_leaves_the_closed_way_out_and_says_why(tmp_path):
    large = tmp_path / "large.yaml"
    robot = yaml.safe_load((Path(models.__file__).parent / "wheelchair.yaml").read_text("utf-8"))
    robot["footprint"] = [[5.0, 0.4], [5.0, -0.4], [-0.4, -0.4], [-0.4, 0.4]]
    large.write_text(yaml.safe_dump(robot), encoding="utf-8")
    guards = guards_for(load_preset("rpp"), str(large), seed=0, first=0, worlds=2)
    assert guards.closed == ()
    assert "overlaps an obstacle" in guards.left_out["closed way"]


def test_worlds_of_another_seed_are_other_worlds():
    names = [
        guards_for(load_preset("rpp"), "wheelchair", seed=seed, first=4, worlds=2).names
        for seed in (0, 1)
    ]
    assert names == [
        ("restricted_small_noisy", "random_world_4", "random_world_5"),
        ("restricted_small_noisy", "random_world_1000004", "random_world_1000005"),
    ]


@pytest.mark.parametrize("missing", [1, 30])
def test_a_torn_last_line_of_the_journal_is_dropped_with_a_word(make_search, tmp_path, missing):
    """Where the line end alone is missing, nothing is lost, and nothing is said."""
    _, search = make_search()
    search.run(5, lambda driven: None)
    journal = tmp_path / "study" / JOURNAL
    content = journal.read_bytes()
    journal.write_bytes(content[:-missing])
    again, search = make_search()
    if missing == 1:
        assert journal.read_bytes().startswith(content)
        assert search.told == []
        assert len(configurations_of(again)) == 5
    else:
        (line,) = search.told
        assert "its last line was not whole" in line
        assert len(configurations_of(again)) == 4
    search.run(7, lambda driven: None)
    assert len(configurations_of(make_search()[0])) == 7


def test_a_search_goes_on_as_if_it_had_not_been_interrupted(make_search):
    whole, search = make_search("whole")
    search.run(20, lambda driven: None)
    _, first = make_search("parts")
    first.run(17, lambda driven: None)
    parts, second = make_search("parts")
    second.run(20, lambda driven: None)
    shown = [
        [(entry.number, entry.parameters, entry.differences.tolist()) for entry in found]
        for found in (configurations_of(whole), configurations_of(parts))
    ]
    assert shown[0] == shown[1]


def test_a_study_of_another_version_or_task_is_not_joined(make_search, tmp_path, monkeypatch):
    make_search()
    with pytest.raises(InputError, match=r"a study of another task, seed was 0; .* got 7"):
        make_search(seed=7)
    monkeypatch.setattr("drake_navbench.studies.tuning.task.__version__", "9.9")
    with pytest.raises(InputError, match=r"a study of version .*, this is 9\.9"):
        make_search()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / JOURNAL).write_text("no journal\n", encoding="utf-8")
    with pytest.raises(InputError, match="not the journal of a study"):
        make_search("other")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("lookahed=1:2", "unknown field; did you mean 'lookahead_"),
        ("lookahead_dist=2:1", "from a lower to a higher"),
        ("lookahead_dist=1:2:5", "without a count"),
        ("lookahead_dist=0:2:log", "begins above 0"),
        ("lookahead_dist=1", "several values"),
    ],
)
def test_a_range_that_cannot_be_searched_is_refused(text, told):
    with pytest.raises(InputError, match=told):
        search_space(load_preset("rpp"), [text])


@pytest.mark.parametrize("preset", ["rpp_bringup", "dwb_bringup", "mppi_bringup"])
def test_what_comes_with_a_controller_can_be_searched_and_leaves_the_speed(preset):
    names = [entry.name for entry in search_space(load_preset(preset)).dimensions]
    assert len(names) == len(set(names)) >= 5
    assert not any("max_" in name and "vel" in name for name in names)


@pytest.mark.parametrize(
    ("was", "damaged"),
    [
        # Optuna takes one attribute a line.
        ('"user_attr":{"task":', '"user_attr":{"more":1,"task":'),
        ('"differences":[[', '"differences":[0,[['),
        ('"ending":"', '"ending":"not '),
    ],
)
def test_a_journal_whose_lines_are_others_is_refused_in_a_line(make_search, tmp_path, was, damaged):
    _, search = make_search()
    search.run(2, lambda driven: None)
    (path,) = tmp_path.rglob(JOURNAL)
    text = path.read_text(encoding="utf-8")
    assert was in text
    path.write_text(text.replace(was, damaged, 1), encoding="utf-8")
    with pytest.raises(InputError, match="not the journal of a study"):
        configurations_of(make_search()[0])
