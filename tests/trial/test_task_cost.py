"""What would take too much memory or time is refused before it starts, with the figure."""

import pytest

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, Scenario, load_scenario
from drake_navbench.trial.task_cost import MAX_MEMORY_BYTES, check_cost
from drake_navbench.typed_files.typed_yaml import validate

ROBOT = load_robot("wheelchair")


def scenario_of(**changes) -> Scenario:
    data = {"name": "task", "description": "a task", "goal": [5.0, 0.0, 0.0]}
    return validate(Scenario, data | changes, "task.yaml")


def refusal(robot=ROBOT, **changes) -> str:
    with pytest.raises(InputError) as caught:
        check_cost(scenario_of(**changes), robot)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize("name", [*PUBLISHED_SCENARIOS, "speed_zone", "dead_end"])
def test_what_is_shipped_is_far_from_the_limits(name, monkeypatch):
    monkeypatch.setattr("drake_navbench.trial.task_cost.MAX_MEMORY_BYTES", 0.05 * MAX_MEMORY_BYTES)
    monkeypatch.setattr("drake_navbench.trial.task_cost.MIN_WALL_CLOCK_S", 10.0)
    monkeypatch.setattr("drake_navbench.trial.task_cost.WALL_CLOCK_PER_SIMULATED_SECOND", 0.1)
    scenario = load_scenario(name)
    check_cost(scenario, scenario.load_robot("wheelchair"))


def test_a_goal_that_needs_too_large_a_map_is_refused_with_its_size():
    # 5000 m and 2 m of border on both sides, in cells of 5 cm, by 4 m: 1e5 x 81 cells are fine.
    check_cost(scenario_of(goal=[5000.0, 0.0, 0.0], timeout_s=1000.0), ROBOT)
    line = refusal(goal=[5000.0, 5000.0, 0.0])
    assert line.startswith("scenario task: global costmap: 100081 x 100081 cells are too many")
    assert line.endswith("expected at most 2.5e+07 in all")


def test_scans_that_memory_does_not_hold_are_refused_with_their_figure():
    # 1000 s at 1 kHz of 1000 beams: 1e9 ranges, of 40 bytes each by the time they are written.
    robot = load_robot("wheelchair", {"lidar": {"period_s": 0.001, "beam_count": 1000}})
    line = refusal(robot, timeout_s=1000.0)
    assert "40 GB of it for 1e+06 scans of 1000 beams; expected at most 2 GB" in line


def test_many_obstacles_are_refused_with_their_figure():
    # 170 bytes a pair: 5000 obstacles took 4.3 GB and 200 s to build.
    boxes = [{"type": "box", "min": [float(i), 5.0], "max": [i + 0.5, 6.0]} for i in range(5000)]
    line = refusal(world={"obstacles": boxes})
    assert "4.25 GB of it for 5000 obstacles" in line


def test_a_plan_of_too_many_poses_is_refused():
    plan = {"type": "polyline", "points": [[0, 0], [10_000, 0], [0, 10_000], [0, 0]]}
    line = refusal(plan=plan | {"spacing_m": 0.001}, goal=[0.5, 0.0, 0.0])
    assert "for the plan of 3.41e+07 poses" in line


def test_an_inflation_that_reaches_too_far_is_refused():
    overrides = {"navigation": {"local_costmap": {"inflation_layer": {"inflation_radius": 1e3}}}}
    assert "an inflation_radius of 1000 m in cells of 0.05 m" in refusal(
        load_robot("wheelchair", overrides)
    )


def test_what_would_take_longer_than_a_trial_may_is_refused():
    # 9e6 cells, 100 times a second for 60 s, at 20 ns.
    overrides = {
        "navigation": {
            "local_costmap": {
                "width": 30,
                "height": 30,
                "resolution": 0.01,
                "update_frequency": 100.0,
            }
        }
    }
    line = refusal(load_robot("wheelchair", overrides), timeout_s=60.0)
    assert "1080 s of it for the local costmap of 9e+06 cells; expected at most 300 s" in line


def test_a_local_costmap_of_too_many_cells_is_no_robot():
    overrides = {"navigation": {"local_costmap": {"width": 200, "height": 200, "resolution": 0.01}}}
    with pytest.raises(InputError, match="20000 x 20000 cells are too many"):
        load_robot("wheelchair", overrides)


def test_a_mask_drawn_too_far_out_is_refused():
    far = [[9000.0, 9000.0], [9001.0, 9000.0], [9001.0, 9001.0]]
    scenario = scenario_of(filters=[{"type": "keepout", "areas": [{"polygon": far}]}])
    with pytest.raises(InputError, match=r"filters: a mask drawn from areas: .* are too many"):
        _ = scenario.filter_masks


def test_a_campaign_refuses_it_before_anything_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.yaml").write_text("description: far away\ngoal: [9000.0, 9000.0, 0.0]\n")
    assert main(["far.yaml", "--controllers", "rpp"]) == 2
    assert "scenario far: global costmap: " in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["far.yaml"]
    with pytest.raises(InputError):
        plan_campaign([str(tmp_path / "far.yaml")], ["rpp"])


BEYOND_BOUNDS = {
    "goal": ({"goal": [1e7, 0.0, 0.0]}, "goal[0]: expected -10000 to 10000, got 10000000.0"),
    "spacing": (
        {"plan": {"type": "polyline", "points": [[0, 0], [1, 0]], "spacing_m": 1e-9}},
        "plan.polyline.spacing_m: expected 0.001 to 100, got 1e-09",
    ),
    "radius": (
        {"world": {"obstacles": [{"type": "cylinder", "centre": [3, 3], "radius_m": 1e15}]}},
        "radius_m: expected 0.0001 to 10000, got 1000000000000000.0",
    ),
    "timeout": ({"timeout_s": 1e12}, "timeout_s: expected -100000 to 100000, got 1000000000000.0"),
}


@pytest.mark.parametrize("case", BEYOND_BOUNDS)
def test_a_number_beyond_what_is_physical_is_refused(case):
    changes, expected = BEYOND_BOUNDS[case]
    with pytest.raises(InputError) as caught:
        scenario_of(**changes)
    assert str(caught.value).endswith(expected)


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            {"navigation": {"controller_server": {"controller_frequency": 1e9}}},
            "controller_frequency: expected 1e-05 to 1000, got 1000000000.0",
        ),
        (
            {"navigation": {"local_costmap": {"resolution": 1e-5}}},
            "resolution: expected 0.001 to 100, got 1e-05",
        ),
    ],
)
def test_a_rate_or_a_cell_beyond_what_is_physical_is_refused(overrides, expected):
    with pytest.raises(InputError) as caught:
        load_robot("wheelchair", overrides)
    assert str(caught.value).endswith(expected)
