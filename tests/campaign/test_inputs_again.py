"""What a results folder keeps under inputs/ can be driven again, wherever the folder lies."""

import pytest

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.manifest import begin
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import load_preset_file
from drake_navbench.logs.results import ResultsFolder


def written_inputs(campaign, path):
    """Returns the files that a run of a campaign leaves under inputs/, by their path there."""
    begin(ResultsFolder(path), campaign, None, jobs=1)
    folder = path / "inputs"
    return {
        file.relative_to(folder): file.read_bytes() for file in folder.rglob("*") if file.is_file()
    }


def again(folder, scenario, preset):
    """Returns the campaign of what an earlier one left in a folder."""
    inputs = folder / "inputs"
    return plan_campaign(
        [str(inputs / f"scenarios/{scenario}.yaml")],
        [load_preset_file(inputs / f"controllers/{preset}.yaml")],
        trials=1,
        robot=str(inputs / f"robots/{scenario}.yaml"),
    )


@pytest.mark.parametrize("scenario", SCENARIO_FILES.names)
def test_the_inputs_of_a_built_in_scenario_make_the_same_inputs(tmp_path, scenario):
    # With masks, maps, recorded people and a model: none of them is copied.
    first = written_inputs(plan_campaign([scenario], ["rpp"], trials=1), tmp_path / "first")
    second = written_inputs(again(tmp_path / "first", scenario, "rpp"), tmp_path / "second")
    assert second == first


@pytest.mark.parametrize("robot", ["turtlebot4", "wheelchair_multibody", "round_robot"])
def test_so_do_the_inputs_of_other_robots(tmp_path, robot):
    campaign = plan_campaign(["empty"], ["dwb"], trials=1, robot=robot)
    first = written_inputs(campaign, tmp_path / "first")
    assert written_inputs(again(tmp_path / "first", "empty", "dwb"), tmp_path / "second") == first
