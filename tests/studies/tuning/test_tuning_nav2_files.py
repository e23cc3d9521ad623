"""tune --nav2: a Nav2 file's own parameters are searched, and the result is a patch of it."""

from __future__ import annotations

import json
from dataclasses import replace
from difflib import unified_diff
from pathlib import Path

import pytest
from test_study import planted
from test_tune import planted_trials  # noqa: F401

from drake_navbench.commands import tune as command
from drake_navbench.errors import InputError
from drake_navbench.studies.tuning import chance, study
from drake_navbench.studies.tuning.nav2_space import current_values, file_space

REPOSITORY = Path(__file__).parents[3]
JAZZY = REPOSITORY / "tests" / "nav2" / "nav2_files" / "jazzy.yaml"
WARD = str(REPOSITORY / "scenarios" / "maps" / "ward.yaml")
RADIUS = "local_costmap.inflation_layer.inflation_radius"
FILE = """\
# Hall 3.
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      lookahead_dist: 0.6   # found by hand
local_costmap:
  local_costmap:
    ros__parameters:
      robot_radius: 0.25
      plugins: [inflation_layer]
      inflation_layer:
        plugin: nav2_costmap_2d::InflationLayer
        inflation_radius: 0.55  # m
"""


def space_of(*asked, plugin=None, path=JAZZY):
    return file_space(path, plugin, "wheelchair", asked)


def test_a_candidate_drives_the_file_with_other_values_in_any_node():
    space = space_of(f"{RADIUS}=0.3:0.9", "vx_max=0.3:0.6")
    assert current_values(space) == {RADIUS: 0.6, "vx_max": 0.4}
    candidate = space.candidate({RADIUS: 0.45, "vx_max": 0.5})
    local = candidate.stack.navigation.local_costmap
    assert local.inflation_layer.inflation_radius == 0.45
    assert candidate.parameters.vx_max == 0.5
    assert candidate.stack.drive.max_linear_velocity_mps == 0.5
    # All others as in the file.
    assert candidate.stack.navigation.planner == space.baseline.stack.navigation.planner


def test_without_parameters_the_list_of_the_controller_is_searched():
    names = [entry.name for entry in space_of().dimensions]
    assert len(names) > 2
    assert "temperature" in names


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("local_costmap.inflation_layer.inflation_radios=1:2", "no such parameter; did you mean"),
        ("amcl.min_particles=100:200", "amcl"),
        ("local_costmap.resolution=-1:2", "resolution"),
    ],
)
def test_what_is_unknown_refused_or_without_effect_is_told_before_anything_is_driven(asked, told):
    with pytest.raises(InputError, match=told):
        space_of(asked)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "expected either PRESET or --nav2 FILE"),
        (["rpp", "--nav2", str(JAZZY), "--scenarios", "empty"], "expected either PRESET or"),
        (["--nav2", str(JAZZY)], "--scenarios: expected at least one, or --map FILE"),
        (["--nav2", str(JAZZY), "--map", WARD], "--map: expected --goals with it"),
        (["--nav2", str(JAZZY), "--goals", "3"], "--map: expected --goals with it"),
        (["rpp", "--map", WARD, "--goals", "3"], "--map: expected --nav2 FILE with it"),
        (
            ["--nav2", str(JAZZY), "--controller", "Other", "--scenarios", "empty"],
            "--controller Other: expected a controller of ",
        ),
    ],
)
def test_arguments_that_do_not_go_together_are_one_line(arguments, told, tmp_path, capsys):
    assert command.main([*arguments, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line
    assert not (tmp_path / "out").exists()


def test_the_search_drives_between_the_places_of_a_file_and_holds_drawn_tasks_out(
    planted_trials,  # noqa: F811
    tmp_path,
    capsys,
):
    nav2, places = tmp_path / "mine.yaml", tmp_path / "places.yaml"
    nav2.write_text(FILE)
    lines = ["{x: 4.3, y: -1.5}", "{x: 7.6, y: -1.7}", "{x: 9.3, y: 0.1}", "{x: 2.9, y: 0.1}"]
    places.write_text("waypoints:\n" + "".join(f"- {line}\n" for line in lines))
    out = tmp_path / "out"
    arguments = ["--nav2", str(nav2), "--map", WARD, "--goals", str(places), "--out", str(out)]
    arguments += ["--parameter", "lookahead_dist=0.3:1.2", "--configurations", "2", "--jobs", "1"]
    arguments += ["--objectives", "time,clearance", "--pairs", "2", "--fresh", "4", "--front", "1"]
    assert command.main(arguments) == 0
    result = json.loads((out / "tuning.json").read_text())
    # Four places are three ways.
    assert result["task"]["scenarios"] == ["ward_1", "ward_2", "ward_3"]
    assert result["held_out"][0] == "ward_1_held_out"
    assert "The search drives the first 2 of 3 tasks, as --pairs says" in capsys.readouterr().out
    # Tasks between other places have the same names, and are another study.
    places.write_text(places.read_text().replace("x: 9.3", "x: 9.0"))
    assert command.main(arguments) == 2
    assert "a study of another task" in capsys.readouterr().err


def test_a_lidar_without_noise_gets_some_where_nothing_else_is_random(
    planted_trials,  # noqa: F811
    monkeypatch,
    tmp_path,
    capsys,
):
    def by_noise(specs, *, jobs):
        """Trials of other seeds differ where the lidar has noise."""
        return [
            row
            for spec in specs
            for row in planted([spec if spec.robot.lidar.range_std_m else replace(spec, seed=0)],
                               jobs=jobs)
        ]  # fmt: skip

    monkeypatch.setattr(study, "measure", by_noise)
    monkeypatch.setattr(chance, "measure", by_noise)
    nav2, out = tmp_path / "mine.yaml", tmp_path / "out"
    nav2.write_text(FILE)
    arguments = ["--nav2", str(nav2), "--map", WARD, "--goals", "1", "--out", str(out)]
    arguments += ["--parameter", "lookahead_dist=0.3:1.2", "--configurations", "12", "--jobs", "1"]
    arguments += ["--objectives", "time,clearance", "--pairs", "6", "--fresh", "4", "--front", "1"]
    assert command.main(arguments) == 0
    told = (
        "The lidar of wheelchair has no noise: tune drives with 0.01 m (lidar.range_std_m, as "
        "turtlebot4 has), so that trials of other seeds differ."
    )
    printed = capsys.readouterr().out
    assert printed.index(told) < printed.index("At most ")
    result = json.loads((out / "tuning.json").read_text())
    assert result["task"]["parameters"]["lidar.range_std_m"] == 0.01
    assert "The lidar of wheelchair has no noise" in (out / "tuning.html").read_text()
    patch = (out / "front" / "mine_tuned_1.patch").read_text()
    assert "# driven with noise of 0.01 m on a lidar that has none" in patch
    # The same command goes on.
    assert command.main(arguments) == 0
    assert told in capsys.readouterr().out


def test_a_patch_of_a_file_without_an_end_of_line_says_so(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(FILE.removesuffix("  # m\n"))
    space = space_of(f"{RADIUS}=0.3:0.9", path=path)
    space.write(space.baseline, {RADIUS: 0.45}, tmp_path / "new", ())
    assert (tmp_path / "new.patch").read_text().splitlines()[-4:] == [
        "-        inflation_radius: 0.55",
        "\\ No newline at end of file",
        "+        inflation_radius: 0.45",
        "\\ No newline at end of file",
    ]


def test_the_result_is_a_patch_of_the_file_with_comments_and_order_kept(
    planted_trials,  # noqa: F811
    tmp_path,
    capsys,
):
    path = tmp_path / "mine.yaml"
    path.write_text(FILE)
    out = tmp_path / "out"
    arguments = ["--nav2", str(path), "--map", WARD, "--goals", "3", "--out", str(out)]
    arguments += ["--parameter", "lookahead_dist=0.3:1.2", "--configurations", "12"]
    arguments += ["--objectives", "time,clearance", "--pairs", "6", "--fresh", "4", "--front", "1"]
    assert command.main([*arguments, "--jobs", "1"]) == 0
    result = json.loads((out / "tuning.json").read_text())
    assert result["task"]["scenarios"] == ["ward_1", "ward_2", "ward_3"]
    # Other tasks than those of the search decide: of 4, as --fresh says, no test could decide.
    assert result["held_out"] == [f"ward_{number}_held_out" for number in range(1, 10)]
    assert "--fresh 4 can decide nothing" in capsys.readouterr().out
    (point,) = result["front"]
    found = point["parameters"]["lookahead_dist"]
    after = (out / "front" / "mine_tuned_1.yaml").read_text()
    changed = [
        line
        for line in unified_diff(FILE.splitlines(), after.splitlines(), lineterm="", n=0)
        if line[0] in "+-" and line[:3] not in ("---", "+++")
    ]
    assert changed == [
        "-      lookahead_dist: 0.6   # found by hand",
        f"+      lookahead_dist: {found}   # found by hand",
    ]
    patch = (out / "front" / "mine_tuned_1.patch").read_text()
    first, second, *_ = patch.splitlines()
    verdict = "beats" if result["winner"] else "is not shown to beat"
    assert first == f"# mine_tuned_1 {verdict} mine in the held-out scenarios"
    assert second.startswith("# made by: drake-navbench tune --nav2")
    assert changed[1] in patch
    assert (out / "tuning.html").is_file()
    # The same command finds everything done.
    assert command.main([*arguments, "--jobs", "1"]) == 0
    path.write_text(FILE.replace("0.55", "0.45"))
    assert command.main([*arguments, "--jobs", "1"]) == 2
    assert "a study of another task" in capsys.readouterr().err
