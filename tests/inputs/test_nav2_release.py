"""The release of Nav2 is told by what only some releases read, and changes what it changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_navbench.inputs.nav2_check import CheckRow
from drake_navbench.inputs.nav2_parameters import read_parameter_file
from drake_navbench.inputs.nav2_release import Found, Release, release_of, release_rows
from drake_navbench.inputs.nav2_robot import read_nav2_files
from drake_navbench.inputs.robot import load_robot
from drake_navbench.run import main

FILES = Path(__file__).parent / "nav2_files"
WHEELCHAIR = load_robot("wheelchair")


def told_by(tmp_path, *lines: str, given: str | None = None) -> Found:
    path = tmp_path / "nav2.yaml"
    indented = "".join(f"    {line}\n" for line in lines)
    path.write_text(f"some_server:\n  ros__parameters:\n    use_sim_time: true\n{indented}")
    return release_of(read_parameter_file(path).sections, given)


@pytest.mark.parametrize(
    ("lines", "release"),
    [
        (["progress_checker_plugin: a"], "humble"),
        (["FollowPath: {prune_plan: true}"], "kilted"),
        (['GridBased: {plugin: "nav2_navfn_planner/NavfnPlanner"}'], "iron"),
        (['GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner"}'], "jazzy"),
        (["progress_checker_plugins: [a]"], "iron"),
        (["error_code_name_prefixes: [a]"], "kilted"),
        (["path_handler_plugins: [a]"], "lyrical"),
        # What needs a release counts more than what was left over from an older one.
        (["costmap_update_timeout: 0.3", "progress_checker_plugin: a"], "jazzy"),
        (["costmap_update_timeout: 0.3", "service_introspection_mode: off"], "kilted"),
        ([], "lyrical"),
    ],
)
def test_a_release_is_told_by_its_marks(tmp_path, lines, release):
    assert told_by(tmp_path, *lines).release == release


def test_what_is_given_counts_more_than_any_mark(tmp_path):
    found = told_by(tmp_path, "path_handler_plugins: [a]", given="humble")
    assert found == (Release.HUMBLE, "--nav2-release")


@pytest.mark.parametrize("release", [path.stem for path in sorted(FILES.glob("*.yaml"))])
def test_our_own_files_are_of_the_release_that_they_are_named_after(release):
    rows = read_nav2_files([FILES / f"{release}.yaml"], WHEELCHAIR, "wheelchair").check.rows
    (told,) = [r for r in rows if r.node == "nav2_release" and r.remark.startswith("told by")]
    # Kilted's own marks are in no parameter that this one gives.
    assert told.parameter == {"kilted": "jazzy"}.get(release, release)


def test_the_tree_and_the_waiting_are_those_of_the_release():
    def navigation(release):
        files = [FILES / "jazzy.yaml"]
        return read_nav2_files(files, WHEELCHAIR, "chair", release=release).robot.navigation

    humble, lyrical = navigation("humble"), navigation("lyrical")
    assert not humble.behavior_tree.heeds_error_codes
    assert not humble.behavior_tree.keeps_valid_path
    assert humble.behavior_tree.wrap_around
    assert humble.behavior_tree.backup_speed == 0.05
    assert humble.controller_server.costmap_update_timeout == 0.0
    assert navigation("iron").behavior_tree.heeds_error_codes
    assert navigation("jazzy").behavior_tree.backup_speed == 0.15
    assert lyrical.behavior_tree.keeps_valid_path
    assert not lyrical.behavior_tree.wrap_around


def rows_of(release: str, follows: bool) -> list[CheckRow]:
    return release_rows(Found(Release(release), "a mark"), ["rpp"], lambda controller: follows)


def test_what_is_not_ported_is_named_for_the_controllers_that_drive():
    names = [row.parameter for row in rows_of("jazzy", follows=False)]
    assert names == ["jazzy", "rpp"]
    humble = next(row for row in rows_of("humble", follows=False) if row.parameter == "rpp")
    assert "not ported yet" in humble.remark
    assert "extrapolated" in humble.remark


def test_a_controller_that_follows_the_release_needs_no_word():
    assert [row.parameter for row in rows_of("jazzy", follows=True)] == ["jazzy"]
    assert [row.parameter for row in rows_of("lyrical", follows=False)] == ["lyrical"]


def test_a_release_without_a_nav2_file_is_refused(capsys):
    assert main(["empty", "--nav2-release", "jazzy"]) == 2
    assert "--nav2-release: expected a Nav2 file" in capsys.readouterr().err
