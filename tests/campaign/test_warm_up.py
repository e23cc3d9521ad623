"""What is to have all kernels compiled calls the controllers, too, and once is enough."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import pytest

from drake_navbench.campaign.warm_up import (
    Compiling,
    cold_parts,
    decide_in_scenes,
    warm_up,
    warm_up_specs,
    warm_ups,
)
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.processes import compiled_parts
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate


def column(name: str) -> TrialSpec:
    scenario = load_scenario("empty")
    return TrialSpec(scenario, load_robot("wheelchair"), load_preset(name), seed=3)


@pytest.fixture
def nothing_is_known(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled_parts, "kernel_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled_parts, "brought_folders", list)


@pytest.mark.parametrize("spec", warm_up_specs(column("rpp")), ids=lambda spec: spec.scenario.name)
def test_the_controller_is_asked_in_every_trial_that_warms_up(spec):
    assert simulate(spec).samples["cycle_count"].max() > 0


def test_the_rotation_shim_is_warmed_up_turning_too():
    branches = set()
    for spec in warm_up_specs(column("rotation_shim")):
        branches |= {note.get("branch") for _, note in simulate(spec).diagnostics}
    assert "rotate_to_path" in branches


@pytest.mark.parametrize("name", ["rpp", "dwb", "rotation_shim", "vector_pursuit", "mppi_nav2"])
def test_a_controller_decides_in_scenes_with_nothing_around_it(name):
    assert decide_in_scenes(column(name)) > 0


def test_a_column_is_compiled_once(nothing_is_known):
    specs = [column("rpp"), column("rpp:lookahead_dist=0.5"), column("dwb")]
    cold = cold_parts(specs)
    assert [spec.preset.controller for spec in cold.columns] == ["rpp", "dwb"]
    assert cold.names == ("rpp", "dwb")
    warm_up(Compiling(warm_ups(cold_parts(specs[:1]))), jobs=1)
    assert cold_parts(specs).names == ("dwb",)


def test_a_trial_waits_for_the_kernels_that_it_needs_and_for_no_others(nothing_is_known):
    rpp, dwb, people = column("rpp"), column("dwb"), load_scenario("doorway_people")
    specs = [rpp, dwb, replace(rpp, scenario=people)]
    compiling = Compiling(warm_ups(cold_parts(specs)))
    assert compiling.parts == ("rpp", "people (social_force)", "dwb")
    drive_rpp, drive_people, decide_dwb, drive_dwb = compiling.tasks
    assert compiling.before(rpp) == (drive_rpp,)
    assert compiling.before(dwb) == (drive_rpp, decide_dwb, drive_dwb)
    assert compiling.before(specs[2]) == (drive_rpp, drive_people)
    assert drive_dwb.after == (drive_rpp, decide_dwb)
    # The first column and its worlds come first.
    assert [task.is_urgent for task in compiling.tasks] == [True, True, False, False]
    assert compiling.end(drive_rpp) == ("people (social_force)", "dwb")
    assert compiling.before(rpp) == ()
    assert "rpp" not in cold_parts(specs).names


def test_people_are_compiled_before_the_trials_and_told(nothing_is_known):
    """They once compiled for 36 s behind a bar that stood still."""
    with_people = replace(column("rpp"), scenario=load_scenario("doorway_people"))
    cold = cold_parts([with_people])
    assert {"rpp", "people (social_force)"} <= set(cold.names)
    steps: list[tuple[int, int]] = []
    only_world = replace(cold, columns=())
    warm_up(Compiling(warm_ups(only_world)), jobs=1, on_progress=lambda *step: steps.append(step))
    assert steps == [(0, 1), (1, 1)]
    assert "people (social_force)" not in cold_parts([with_people]).names


@pytest.mark.long
def test_after_the_warm_up_a_trial_with_people_compiles_next_to_nothing(tmp_path):
    """From an empty cache: 15 s of kernels of people and of their metrics came with the trial."""
    kernels, world = tmp_path / "kernels", "doorway_people"
    compiling = (
        "from pathlib import Path\n"
        "from drake_navbench.campaign.compiled_kernels import compile_into\n"
        f"compile_into(Path({str(kernels)!r}), ['rpp'], [{world!r}], jobs=1)\n"
    )
    ask = ["-m", "drake_navbench.run", world, "--controllers", "rpp", "--trials", "1"]

    def told(*arguments: str) -> str:
        return subprocess.check_output(
            [sys.executable, *arguments],
            env=os.environ | {"NUMBA_CACHE_DIR": str(kernels)},
            text=True,
        )

    assert "compiling for rpp, people (social_force)\n" in told("-c", compiling)
    before = set(kernels.glob("*/*.nbc"))
    assert len(before) > 100
    run = told(*ask, "--replay", "none", "--out", str(tmp_path / "results"))
    assert "Compiling" not in run
    assert len(set(kernels.glob("*/*.nbc")) - before) < 5


def test_a_controller_of_somebody_else_is_left_to_the_trials(nothing_is_known, monkeypatch):
    monkeypatch.setattr(TrialSpec, "code_owner", "theirs")
    assert cold_parts([column("rpp")]).columns == ()
