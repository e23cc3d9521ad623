"""A campaign: which trials it has, what its folder holds, how it ends when something breaks."""

import json
import pickle
import warnings
from pathlib import Path

import pandas as pd
import pytest

from drake_navbench import run_benchmark
from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.metrics.registry import unrepeatable_names
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.presets import load_preset, preset_files
from drake_navbench.inputs.robot import ROBOT_FILES
from drake_navbench.logs.outcome import Outcome
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import read_yaml

SCENARIO = "description: nothing in the way\ngoal: [1.0, 0.0, 0.0]\n"
PRESET = "controller: rpp\ndescription: slower\nparameters: {max_linear_vel: 0.3}\n"


def written(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_scenarios_of_one_name_are_refused_by_both_their_files(tmp_path):
    first = str(written(tmp_path / "a" / "s.yaml", SCENARIO))
    second = str(written(tmp_path / "b" / "s.yaml", SCENARIO))
    with pytest.raises(InputError) as caught:
        plan_campaign([first, second], ["rpp"])
    message = f"scenario 's': expected one of this name, got {first} and {second}"
    assert str(caught.value) == message


def test_a_trial_is_known_by_the_same_digest_whoever_describes_it():
    specs = plan_campaign(["empty"], ["rpp"], trials=3).specs
    alone = [
        TrialSpec(spec.scenario, spec.robot, spec.preset, seed=spec.seed, trial=spec.trial)
        for spec in specs
    ]
    assert [spec.identity for spec in specs] == [spec.identity for spec in alone]
    assert len({spec.identity for spec in specs}) == 3
    sent = pickle.loads(pickle.dumps(specs[2]))
    assert sent.identity == specs[2].identity
    assert "_shared" not in vars(pickle.loads(pickle.dumps(specs[1])))


def test_presets_of_one_name_are_refused_by_both_their_files(tmp_path):
    (mine,) = load_parameter_file(written(tmp_path / "rpp.yaml", PRESET))
    built_in = load_preset("rpp").source
    with pytest.raises(InputError) as caught:
        plan_campaign(["empty"], ["rpp", mine])
    message = f"controller 'rpp': expected one of this name, got {built_in} and {mine.source}"
    assert str(caught.value) == message


def test_what_is_given_twice_runs_once(tmp_path):
    (mine,) = load_parameter_file(written(tmp_path / "mine.yaml", PRESET))
    campaign = plan_campaign(["empty", "empty"], ["rpp", "rpp", mine, mine], trials=1)
    assert [(spec.scenario.name, spec.preset.name) for spec in campaign.specs] == [
        ("empty", "rpp"),
        ("empty", "mine"),
    ]


def test_a_parameter_file_given_twice_runs_once(tmp_path, capsys):
    # Were it refused, the message would be about it and not about the folder.
    mine = str(written(tmp_path / "mine.yaml", PRESET))
    arguments = ["empty", "--params", mine, "--params", mine, "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "is not empty" in capsys.readouterr().err


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> tuple[pd.DataFrame, Path]:
    """The table and the folder of a benchmark run in Python."""
    out = tmp_path_factory.mktemp("results") / "kept"
    results = run_benchmark(["restricted_small"], ["rpp"], trials=1, seed=7, jobs=1, out=out)
    return results.trials, out


def test_a_folder_that_is_kept_can_be_reported_and_resumed(kept):
    trials, out = kept
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["request"]["seed"] == 7
    assert manifest["controllers"] == ["rpp"]
    assert (out / "inputs" / "controllers" / "rpp.yaml").is_file()
    (analysis,) = analyse_folder(out, jobs=1).scenarios
    assert len(analysis.trials) == 1
    assert main(["--resume", str(out), "--quiet"]) == 0
    again = pd.read_parquet(out / "trials.parquet")
    varying = unrepeatable_names()
    pd.testing.assert_frame_equal(trials.drop(columns=varying), again.drop(columns=varying))


def test_a_folder_with_other_results_is_refused(kept):
    _, out = kept
    with pytest.raises(InputError, match="is not empty"):
        run_benchmark(["restricted_small"], ["rpp"], trials=1, seed=8, jobs=1, out=out)


def test_a_benchmark_of_no_trials_is_refused():
    with pytest.raises(InputError, match=r"run_benchmark: trials: .* greater than or equal to 1"):
        run_benchmark(["empty"], ["rpp"], trials=0)


def asks_sideways(preset):
    return (load_preset(preset).parameters.asked_speeds().max_lateral_mps or 0.0) > 0.0


def drive_short_way(robot, presets, folder):
    """Returns how each preset ended a drive of 0.7 m, or why it does not go with the robot."""
    scenario = str(written(folder / "short.yaml", "description: ahead\ngoal: [0.7, 0.0, 0.0]\n"))
    endings = {}
    for preset in presets:
        try:
            (spec,) = plan_campaign([scenario], [preset], trials=1, robot=robot).specs
        except InputError as error:
            endings[preset] = str(error)
        else:
            endings[preset] = simulate(spec).outcome
    return endings


@pytest.mark.parametrize(
    "robot", ["wheelchair", pytest.param("round_robot", marks=pytest.mark.long)]
)
def test_every_preset_for_a_differential_base_drives_the_first_robots(robot, tmp_path):
    presets = [name for name in preset_files() if not asks_sideways(name)]
    endings = drive_short_way(robot, presets, tmp_path)
    assert endings == dict.fromkeys(presets, Outcome.SUCCEEDED)


@pytest.mark.filterwarnings("ignore:.*rotations in place")
@pytest.mark.parametrize("robot", ROBOT_FILES.names)
def test_every_robot_is_driven(robot, tmp_path):
    assert drive_short_way(robot, ["rpp"], tmp_path) == {"rpp": Outcome.SUCCEEDED}


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:.*rotations in place")
@pytest.mark.parametrize("robot", ROBOT_FILES.names)
def test_every_preset_drives_every_robot_or_says_why_it_cannot(robot, tmp_path):
    endings = drive_short_way(robot, preset_files(), tmp_path)
    refused = {preset: why for preset, why in endings.items() if not isinstance(why, Outcome)}
    for why in refused.values():
        assert "cannot move sideways" in why or "model_dt" in why or "turns in place" in why
    assert Outcome.ERROR not in endings.values()
    assert endings["rpp"] is Outcome.SUCCEEDED


def told_of_kept_cells(preset, robot, tmp_path):
    scenario = str(written(tmp_path / "s.yaml", "description: ahead\ngoal: [0.7, 0.0, 0.0]\n"))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        plan_campaign([scenario], [preset], trials=1, robot=robot)
    return [str(w.message) for w in caught if "what moves" in str(w.message)]


def test_a_stop_for_what_moves_where_the_costmap_keeps_what_has_left_is_told(tmp_path):
    stopping = "harmony:stop_for_moving=true"
    (told,) = told_of_kept_cells(stopping, "wheelchair", tmp_path)
    assert "sees what moves only between walls within the lidar's range" in told
    assert "for open spaces set obstacle_layer.scan.inf_is_valid and clearing to true" in told
    assert told_of_kept_cells("harmony", "wheelchair", tmp_path) == []
    scan = "{inf_is_valid: true, clearing: true, max_obstacle_height: 2.0}"
    layer = f"{{obstacle_layer: {{observation_sources: {{scan: {scan}}}}}}}"
    robot = written(
        tmp_path / "r.yaml", f"like: wheelchair\nnavigation: {{local_costmap: {layer}}}\n"
    )
    assert told_of_kept_cells(stopping, str(robot), tmp_path) == []


@pytest.mark.parametrize("preset", [name for name in preset_files() if asks_sideways(name)])
def test_a_preset_for_another_kind_of_base_is_refused_in_one_line(preset):
    with pytest.raises(InputError, match="cannot move sideways") as caught:
        plan_campaign(["empty"], [preset], trials=1, robot="wheelchair")
    assert "\n" not in str(caught.value)


def test_who_lets_a_car_turn_in_place_is_told():
    with pytest.warns(InputWarning, match=r"controller rpp: .* turns on 0\.6 m stands still"):
        plan_campaign(["empty"], ["rpp"], trials=1, robot="ackermann_robot")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        steered = ["mppi_nav2_ackermann", "rpp:use_rotate_to_heading=false"]
        plan_campaign(["empty"], steered, trials=1, robot="ackermann_robot")


def test_a_preset_is_kept_as_the_robot_was_driven_with_it(tmp_path):
    scenario = str(written(tmp_path / "short.yaml", "description: ahead\ngoal: [0.7, 0.0, 0.0]\n"))
    for robot, outline in (("wheelchair", True), ("round_robot", False)):
        out = tmp_path / robot
        run_benchmark([scenario], ["mppi_nav2"], trials=1, jobs=1, robot=robot, out=out)
        kept = read_yaml(out / "inputs" / "controllers" / "mppi_nav2.yaml")
        assert kept["parameters"]["ObstaclesCritic"]["consider_footprint"] is outline


def test_a_preset_that_a_robot_cannot_be_driven_with_is_one_line_before_the_run(tmp_path, capsys):
    column = "mppi_nav2:ObstaclesCritic.consider_footprint=true"
    out = tmp_path / "out"
    arguments = ["empty", "--controllers", column, "--robot", "round_robot", "--out", str(out)]
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"controller {column}: ObstaclesCritic.consider_footprint: got true")
    assert not out.exists()


def test_a_harsher_scenario_has_the_seeds_of_its_clean_one():
    campaign = plan_campaign(["everyday", "static_obstacles", "empty"], ["rpp"], trials=3)
    seeds = {}
    for spec in campaign.specs:
        seeds.setdefault(spec.scenario.name, []).append(spec.seed)
    assert seeds["everyday"] == seeds["static_obstacles"] != seeds["empty"]
    assert campaign.clean_of == {"everyday": "static_obstacles"}
