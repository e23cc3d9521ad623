"""What is to have all kernels compiled calls the controllers, too, and once is enough."""

from __future__ import annotations

import pytest

from drake_navbench.campaign.warm_up import cold_columns, decide_in_scenes, warm_up, warm_up_specs
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.processes.cache_folder import NUMBA_VARIABLE
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate


def column(name: str) -> TrialSpec:
    scenario = load_scenario("empty")
    return TrialSpec(scenario, load_robot("wheelchair"), load_preset(name), seed=3)


@pytest.fixture
def nothing_is_known(tmp_path, monkeypatch):
    monkeypatch.setenv(NUMBA_VARIABLE, str(tmp_path))


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
    assert [spec.preset.controller for spec in cold_columns(specs)] == ["rpp", "dwb"]
    warm_up([column("rpp")], jobs=1)
    assert [spec.preset.controller for spec in cold_columns(specs)] == ["dwb"]


def test_a_controller_of_somebody_else_is_left_to_the_trials(nothing_is_known, monkeypatch):
    monkeypatch.setattr(TrialSpec, "code_owner", "theirs")
    assert cold_columns([column("rpp")]) == []
