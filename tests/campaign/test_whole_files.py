"""Whole Nav2 files beside each other: columns, names, differences, and what is refused."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from drake_navbench.analysis.compare_page import parameters_that_differ
from drake_navbench.analysis.contests import Match
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.manifest import begin
from drake_navbench.campaign.request import Request
from drake_navbench.campaign.request_arguments import file_lines, request_from_arguments
from drake_navbench.commands.run import build_parser, main
from drake_navbench.errors import InputError
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.nav2.differences import differences
from drake_navbench.nav2.patch import patched
from drake_navbench.nav2.whole_files import WholeFile, columns_of_files, names_of

REPOSITORY = Path(__file__).parents[2]
JAZZY = REPOSITORY / "tests" / "nav2" / "nav2_files" / "jazzy.yaml"
WARD = str(REPOSITORY / "scenarios" / "maps" / "ward.yaml")
RADIUS = "local_costmap.inflation_layer.inflation_radius"


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A function that writes a.yaml, and b.yaml with these changes, into the working directory."""
    monkeypatch.chdir(tmp_path)

    def write(changes):
        text = JAZZY.read_text()
        Path("a.yaml").write_text(text)
        Path("b.yaml").write_text(patched(text, changes, JAZZY))

    return write


def request_of(*arguments: str) -> Request:
    return request_from_arguments(build_parser().parse_args(arguments))


def test_each_column_drives_the_costmaps_and_planner_of_its_own_file(files):
    files({RADIUS: 0.4, "planner_server.GridBased.tolerance": 0.25})
    campaign = request_of(
        "empty", "one_obstacle", "--nav2", "a.yaml", "--against", "b.yaml", "--trials", "2"
    ).campaign()
    assert campaign.columns == ["a", "b"]
    assert len(campaign.specs) == 2 * 2 * 2
    for spec in campaign.specs:
        navigation = spec.preset.robot(spec.robot).navigation
        radius = navigation.local_costmap.inflation_layer.inflation_radius
        assert (radius, navigation.planner.tolerance) == {"a": (0.6, 0.4), "b": (0.4, 0.25)}[
            spec.preset.name
        ]
    seeds = {(spec.scenario.name, spec.trial, spec.seed) for spec in campaign.specs}
    assert len(seeds) == 2 * 2  # Both columns meet the same noise.


def test_a_file_beside_another_has_the_trials_that_it_has_alone(files):
    files({RADIUS: 0.4})
    robots = [
        request_of("empty", "--nav2", "b.yaml", "--trials", "1").campaign().specs[0].robot,
        request_of("empty", "--nav2", "a.yaml", "--against", "b.yaml", "--trials", "1")
        .campaign()
        .specs[1]
        .robot,
    ]
    assert robots[0].model_dump() == robots[1].model_dump()


def test_the_base_is_one_and_has_speed_for_the_faster_file(files):
    files({"controller_server.FollowPath.vx_max": 0.9})
    campaign = request_of("empty", "--nav2", "a.yaml", "--against", "b.yaml").campaign()
    speeds = {spec.robot.drive.max_linear_velocity_mps for spec in campaign.specs}
    assert speeds == {0.9}


def test_tasks_on_a_map_are_the_same_for_both_and_roomy_enough_for_the_larger(files):
    files({"local_costmap.robot_radius": 0.3, "global_costmap.robot_radius": 0.3})
    drawn = ["--map", WARD, "--goals", "3", "--trials", "1"]
    tasks = {}
    for pair in (("a.yaml", "b.yaml"), ("b.yaml", "a.yaml")):
        campaign = request_of("--nav2", pair[0], "--against", pair[1], *drawn).campaign()
        tasks[pair] = [spec.scenario.goal for spec in campaign.specs]
    first, second = tasks.values()
    assert first == second


def test_differences_are_told_by_parameter_and_what_has_no_effect_is_marked(files):
    files(
        {
            RADIUS: 0.4,
            "amcl.min_particles": 800,
        }
    )
    request = request_of("--nav2", "a.yaml", "--against", "b.yaml")
    found = differences(request.nav2_columns())
    assert [(entry.place, entry.values, bool(entry.reason)) for entry in found] == [
        (RADIUS, ("0.6", "0.4"), False),
        ("amcl.min_particles", ("400", "800"), True),
    ]
    lines = file_lines(request, request.nav2_columns())
    assert lines[:2] == ["a = a.yaml, b = b.yaml: 1 parameter differs", f"  {RADIUS}: 0.6 -> 0.4"]


def test_a_parameter_that_one_file_leaves_out_is_compared_by_its_default(files):
    files({})
    # MPPI's defaults: 0.3, as the file has it, and 0.5.
    left_out = ("      temperature: 0.3", "      vx_max: 0.4")
    kept = [line for line in JAZZY.read_text().splitlines() if line not in left_out]
    Path("b.yaml").write_text("\n".join(kept))
    columns = request_of("--nav2", "a.yaml", "--against", "b.yaml").nav2_columns()
    assert [(entry.place, entry.values) for entry in differences(columns)] == [
        ("controller_server.FollowPath.vx_max", ("0.4", "0.5 (default)"))
    ]


def test_two_spellings_of_a_plugin_are_no_difference(files):
    files({RADIUS: 0.4})
    text = Path("b.yaml").read_text()
    assert "nav2_behaviors::Spin" in text
    Path("b.yaml").write_text(text.replace("nav2_behaviors::Spin", "nav2_behaviors/Spin"))
    columns = request_of("--nav2", "a.yaml", "--against", "b.yaml").nav2_columns()
    assert [entry.place for entry in differences(columns)] == [RADIUS]


def test_parameters_of_another_plugin_are_counted_and_told_by_check(files, capsys):
    files({})
    humble = str(JAZZY.with_name("humble.yaml"))
    request = request_of("--nav2", "a.yaml", "--against", humble)
    lines = file_lines(request, request.nav2_columns())
    (counted,) = [line for line in lines if line.startswith("  controller_server.FollowPath: ")]
    assert "parameters that not all have: a " in counted
    assert any(line.startswith("  controller_server.FollowPath.plugin: ") for line in lines)
    assert any(line.startswith("No effect here: ") for line in lines)
    assert len(lines) < 60
    assert main(["--nav2", "a.yaml", "--against", humble, "--check"]) == 0
    assert "controller_server.FollowPath.time_steps: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, "a.yaml and b.yaml drive alike: no parameter differs; nothing was driven"),
        (
            {"amcl.min_particles": 800},
            "a.yaml and b.yaml drive alike: they differ in what has no effect here: "
            "amcl.min_particles; nothing was driven",
        ),
    ],
)
def test_files_that_drive_alike_are_one_line_and_nothing_is_driven(files, capsys, changes, told):
    files(changes)
    assert main(["empty", "--nav2", "a.yaml", "--against", "b.yaml"]) == 2
    assert capsys.readouterr().err.splitlines() == [told]
    assert not Path("results").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--name", "A=a.yaml", "--name", "A=b.yaml"], "--name 'A=b.yaml': A is given twice"),
        (["--name", "A"], "--name 'A': expected ALIAS=FILE"),
        (["--name", "A/b=b.yaml"], "the alias 'A/b' has a slash; expected none"),
        (["--name", "A=c.yaml"], "--name A=c.yaml: expected a file of --nav2 or --against"),
        (["--map", "x.yaml", "--map", "y.yaml", "--goals", "3"], "--map is given twice"),
    ],
)
def test_wrong_names_and_maps_are_one_line(files, capsys, arguments, told):
    files({RADIUS: 0.4})
    assert _status(["--nav2", "a.yaml", "--against", "b.yaml", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line


def _status(arguments):
    try:
        return main(arguments)
    except SystemExit as ended:
        return ended.code


def test_a_nav2_file_without_an_option_is_no_scenario_for_check_either(files, capsys):
    """Somebody who gives the parts of a Nav2 file after one --nav2 would miss all but the first."""
    files({})
    assert main(["--nav2", "a.yaml", "b.yaml", "--check"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "b.yaml: is a Nav2 parameter file; expected a scenario file, or --nav2 before" in line


def test_against_wants_a_file_of_nav2(files, capsys):
    files({})
    assert main(["empty", "--against", "b.yaml"]) == 2
    assert "--against b.yaml: expected --nav2 FILE beside it" in capsys.readouterr().err


def test_columns_have_the_names_that_are_asked_for(files):
    files({RADIUS: 0.4})
    request = request_of(
        *("empty", "--nav2", "a.yaml", "--against", "b.yaml", "--name", "narrow=b.yaml")
    )
    assert request.campaign().columns == ["a", "narrow"]
    assert Request.model_validate_json(request.model_dump_json()) == request


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["x/a.yaml", "x/b.yaml"], ["a", "b"]),
        (["old/nav2.yaml", "new/nav2.yaml"], ["old", "new"]),
        (["old/cfg/nav2.yaml", "new/cfg/nav2.yaml"], ["old", "new"]),
        (["a.yaml", "a.yaml"], ["a_1", "a_2"]),
    ],
)
def test_a_default_name_is_what_differs_of_the_paths(paths, names):
    assert names_of([Path(path) for path in paths]) == names


def test_a_patched_text_is_a_column_beside_the_original():
    text = patched(JAZZY.read_text(), {RADIUS: 0.4}, JAZZY)
    files = [WholeFile("before", (JAZZY,)), WholeFile("after", (JAZZY,), {JAZZY: text})]
    columns = columns_of_files(files, "wheelchair")
    presets = [preset for column in columns for preset in column.presets]
    campaign = plan_campaign(["empty"], presets, trials=1)
    radii = [
        s.robot.navigation.local_costmap.inflation_layer.inflation_radius for s in campaign.specs
    ]
    assert (campaign.columns, radii) == (["before", "after"], [0.6, 0.4])


def test_a_comparison_names_what_differs_as_the_files_do(files, tmp_path):
    files({RADIUS: 0.4, "controller_server.FollowPath.temperature": 0.2})
    request = request_of("empty", "--nav2", "a.yaml", "--against", "b.yaml")
    folder = ResultsFolder(tmp_path / "results")
    begin(folder, request.campaign(), request, jobs=1)
    trials = pd.DataFrame({"scenario": ["empty", "empty"], "controller": ["a", "b"]})
    analysis = SimpleNamespace(path=folder.path, manifest=folder.read_manifest(), trials=trials)
    assert list(parameters_that_differ((analysis, analysis), Match("a", "b"))) == [
        ("FollowPath.temperature", "0.3", "0.2"),
        (RADIUS, "0.6", "0.4"),
    ]


def test_merged_files_and_files_of_params_tell_what_is_not_used(files):
    files({RADIUS: 0.4})
    merged = request_of("--nav2", "a.yaml", "--nav2", "b.yaml")
    assert any("merged into one" in line for line in file_lines(merged, merged.nav2_columns()))
    parts = request_of("--params", "a.yaml")
    (line,) = file_lines(parts, ())
    assert line.startswith("--params a.yaml: takes the controllers only; ")
    assert "local_costmap" in line


def test_a_wrong_file_among_several_is_named(files):
    files({RADIUS: 0.4})
    Path("b.yaml").write_text("nothing: 1")
    with pytest.raises(InputError, match="no node with ros__parameters"):
        request_of("--nav2", "a.yaml", "--against", "b.yaml").campaign()
