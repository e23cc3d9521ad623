"""The command show: pictures of what run would drive, and the same words for faults."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.analysis.figures.style import figure_style
from drake_navbench.analysis.figures.views import scene_figure
from drake_navbench.analysis.html import inline_svg
from drake_navbench.campaign.robot_views import column_view, robot_view
from drake_navbench.campaign.scene_views import BELOW, UNKNOWN_TO_PLANNER, scene_view, scenes_of
from drake_navbench.commands import run, show
from drake_navbench.commands.command_line import EXIT_DONE, EXIT_WRONG_INPUT
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.nav2.whole_files import WholeFile, columns_of_files
from drake_navbench.trial.goal_sampling import sample_tasks

REPOSITORY = Path(__file__).parents[2]
JAZZY = REPOSITORY / "tests" / "nav2" / "nav2_files" / "jazzy.yaml"
WARD = REPOSITORY / "scenarios" / "maps" / "ward.yaml"


def lines_of(shapes):
    return {shape.label: shape.corners for shape in shapes}


def test_a_scene_has_the_plan_from_start_to_goal_over_the_costmap():
    view, told = scene_view([load_scenario("doorway")], load_robot("round_robot"))
    (task,) = view.tasks
    assert told == []
    assert np.allclose(task.start, [0.0, -1.0, 0.0])
    assert np.hypot(*(task.plan[-1] - task.goal)[:2]) < 0.1
    (grid,) = view.costs
    assert (grid.costs == LETHAL).any()
    # Through the door, whose middle is at y = 0.
    at_door = task.plan[np.argmin(np.abs(task.plan[:, 0] - 3.05))]
    assert abs(at_door[1]) < 0.25


def test_obstacles_that_no_map_shows_and_low_ones_are_told_apart():
    box = {"type": "box", "min": [1.0, 1.0], "max": [2.0, 2.0]}
    scenario = Scenario(
        name="boxes",
        description="Three boxes",
        goal=(5.0, 0.0, 0.0),
        world={
            "obstacles": [
                box,
                box | {"known_to_planner": False},
                box | {"height_m": 0.1},
            ]
        },
    )
    view, _ = scene_view([scenario], load_robot("round_robot"))
    assert len(view.course.obstacles) == 1
    assert [len(own) for own in view.others.values()] == [1, 1]
    unknown, low = view.others
    assert unknown == UNKNOWN_TO_PLANNER
    assert low.startswith(BELOW)


def test_every_area_of_a_kind_is_drawn():
    areas = [[[x, 1.0], [x + 1.0, 1.0], [x + 1.0, 2.0], [x, 2.0]] for x in (1.0, 3.0)]
    filters = [{"type": "keepout", "areas": [{"polygon": corners}]} for corners in areas]
    goal = {"goal": (5.0, 0.0, 0.0), "name": "areas", "description": "Two keepouts"}
    view, _ = scene_view([Scenario(**goal, filters=filters)], load_robot("round_robot"))
    assert {name: len(grids) for name, grids in view.masks.items()} == {"keepout area": 2}
    with figure_style():
        (axes,) = scene_figure(view).axes
    # The grid of the costmap, and each keepout.
    assert len(axes.images) == 3


def test_people_are_drawn_with_their_ways():
    scenario = load_scenario("ward_nurses")
    view, _ = scene_view([scenario], load_robot("wheelchair"))
    persons = scenario.true_world.people.persons
    assert len(view.course.ways) == len(persons) + len(scenario.true_world.moving)
    assert np.allclose(view.course.ways[-1][0], persons[-1].start)


def test_tasks_on_one_map_are_one_picture():
    robot = load_robot("turtlebot4")
    tasks = sample_tasks(WARD, robot, 3, seed=0)
    (together,) = scenes_of(tasks)
    view, _ = scene_view(together, robot)
    assert len(view.tasks) == 3
    assert len(scenes_of([load_scenario("empty"), load_scenario("doorway")])) == 2


def test_a_column_has_its_files_distances_to_scale():
    (columns,) = columns_of_files([WholeFile("mine", (JAZZY,))], "turtlebot4")
    view = column_view(columns.presets[0], columns.setup.robot)
    lines = lines_of(view.shapes)
    # 50 steps of 0.05 s at 0.4 m/s.
    horizon = lines["horizon 2.5 s at 0.4 m/s = 1 m"]
    assert horizon[:, 0].max() == pytest.approx(1.0, abs=1e-3)
    inflation = lines["inflation 0.6 m, cost_scaling_factor 4"]
    assert np.allclose(np.hypot(*inflation.T), 0.6)
    window = lines["local costmap 4 x 4 m, cells 0.05 m"]
    assert window.min() == -2.0
    assert window.max() == 2.0
    # An obstacle at the inscribed radius is a collision, one farther away costs less.
    assert view.graded[-1] == (pytest.approx(columns.setup.robot.radii[0]), 253)
    assert view.graded[0][1] < view.graded[-2][1]


def test_lookahead_is_that_which_the_controller_uses():
    from drake_navbench.inputs.presets import load_preset

    robot = load_robot("turtlebot4")
    fixed = load_preset("rpp:use_velocity_scaled_lookahead_dist=false:lookahead_dist=0.7")
    assert "lookahead_dist 0.7 m" in lines_of(column_view(fixed, robot).shapes)
    scaled = load_preset("rpp:use_velocity_scaled_lookahead_dist=true:min_lookahead_dist=0.4")
    names = lines_of(column_view(scaled, robot).shapes)
    assert "min_lookahead_dist 0.4 m" in names
    assert not any(name.startswith("lookahead_dist") for name in names)


def test_a_robot_has_the_fields_of_its_sensors():
    fields = {"pose": (0.2, 0.0, 0.0), "horizontal_fov_rad": 1.0, "range_max_m": 4.0}
    robot = load_robot("turtlebot4", {"depth_sensors": {"camera": fields}})
    view = robot_view(robot, "mine")
    lidar, camera = view.shapes[1].corners, view.shapes[2].corners
    assert np.hypot(*lidar.T).max() == pytest.approx(robot.lidar.range_max_m, abs=0.2)
    assert np.allclose(camera[0], [0.2, 0.0])
    assert camera[:, 0].max() == pytest.approx(4.2, abs=1e-3)
    # Half a radian to either side.
    assert camera[:, 1].max() == pytest.approx(4.0 * np.sin(0.5), abs=1e-3)


@pytest.mark.usefixtures("real_pngs")
@pytest.mark.parametrize("suffix", [".svg", ".png", ".html"])
def test_the_picture_is_written_as_it_is_asked_for(suffix, tmp_path, capsys):
    out = tmp_path / f"p{suffix}"
    asked = ["empty", "--nav2", str(JAZZY), "--out", str(out)]
    assert show.main(asked) == EXIT_DONE
    files = capsys.readouterr().out.split()
    both = [out] if suffix == ".html" else [out, tmp_path / f"p-2{suffix}"]
    assert [Path(file).name for file in files] == [file.name for file in both]
    if suffix == ".svg":
        assert "robot at the goal" in out.read_text()
        assert "cost_scaling_factor 4" in both[1].read_text()
    if suffix == ".html":
        assert out.read_text().count("<figure>") == 2
        assert 'src="http' not in out.read_text()


def test_numbers_in_a_pages_figures_are_not_cut(tmp_path):
    svg = tmp_path / "p.svg"
    svg.write_text('<svg><path d="M 1.23456 2.5"/><text>radii 0.549 m</text></svg>')
    assert "1.23 2.5" in inline_svg(svg)
    assert "radii 0.549 m" in inline_svg(svg)


def test_without_out_a_page_is_opened_and_takes_the_place_of_the_last_one(
    tmp_path, monkeypatch, capsys
):
    opened = []
    monkeypatch.setattr(show.webbrowser, "open", opened.append)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for _ in range(2):
        assert show.main(["empty"]) == EXIT_DONE
        assert opened.pop() == Path(capsys.readouterr().out.strip()).as_uri()
    assert [path.name for path in tmp_path.rglob("*.*")] == ["show.html"]


@pytest.mark.parametrize(
    "asked",
    [
        ["dorway"],
        ["--map", "no.yaml", "--goals", "3"],
        ["--map", str(WARD), "--start", "0", "0", "0"],
        ["empty", "--robot", "turtlebot44"],
        ["--against", str(JAZZY), "empty"],
        ["--nav2", str(JAZZY), "--against", str(JAZZY), "empty"],
        ["--nav2", str(WARD), "empty"],
        ["empty", "--controllers", "rpp", "dwb"],
        ["--map", str(WARD), "--start", "0", "0", "0", "--goal", "100", "100", "0"],
    ],
)
def test_faults_are_the_lines_that_run_prints(asked, tmp_path, capsys):
    assert show.main([*asked, "--out", str(tmp_path / "p.svg")]) == EXIT_WRONG_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert run.main([*asked, "--out", str(tmp_path / "run")]) == EXIT_WRONG_INPUT
    assert capsys.readouterr().err.splitlines()[-1] == line
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ([], "expected what to show: a scenario, --map, --robot, --nav2 or --controllers"),
        (["empty", "--out", "p.pdf"], "--out p.pdf: expected a name that ends in .html, .svg"),
        (["empty", "--check"], "--check: show prints no table"),
        (["empty", "--out", f"{JAZZY}/p.svg"], "/p.svg: cannot be written"),
    ],
)
def test_wrong_arguments_are_one_line(asked, told, capsys):
    assert show.main(asked) == EXIT_WRONG_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line


@pytest.mark.long
def test_pictures_load_what_they_draw_with_and_nothing_that_drives(tmp_path):
    """Two thirds of the time of `show` was spent on loading what it never used."""
    program = """
import sys
from drake_navbench.commands.show import main
heavy = ("pandas", "pydrake.systems", "py_trees", "scipy.spatial", "scipy.interpolate")
for asked in ([], ["doorway"], ["--nav2", sys.argv[1]]):
    status = main([*asked, "--robot", "turtlebot4", "--out", "p.svg", "--quiet"])
    print(asked[:1], status, [name for name in heavy if name in sys.modules])
"""
    nav2 = REPOSITORY / "models" / "nav2" / "turtlebot4.yaml"
    told = subprocess.run(
        [sys.executable, "-c", program, str(nav2)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stdout == "[] 0 []\n['doorway'] 0 []\n['--nav2'] 0 []\n"
