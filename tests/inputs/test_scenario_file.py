"""A scenario file holds all that a scenario is."""

from __future__ import annotations

import json

import pytest
import yaml

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.scenario import (
    SET_BY_LOADING,
    Scenario,
    load_scenario,
    warn_of_degrees,
)

EVERY_FIELD = """
description: every field set, none to its default
world:
  map: everything_map.yaml
  obstacles:
    - {type: box, min: [2.0, 1.0], max: [2.5, 1.5], known_to_planner: false, height_m: 0.4}
    - {type: cylinder, centre: [3.0, -1.0], radius_m: 0.2, height_m: 1.5}
    - {type: polygon, vertices: [[4.0, 1.0], [4.5, 1.0], [4.2, 1.6]]}
start: [0.5, 0.1, 0.2]
goal: [5.5, 0.2, -0.1]
filters:
  - type: speed_percent
    areas: [{polygon: [[1.0, -1.9], [2.0, -1.9], [2.0, -1.5]], value: 30}]
    base: 10.0
    multiplier: 0.5
plan:
  type: planner
  smoother: {plugin: nav2_smoother/SimpleSmoother, max_its: 500, do_refinement: false}
waypoints: [[2.0, 0.0, 0.1]]
navigation_mode: navigate_to_pose
timeout_s: 77.0
expected_outcome: aborted
variation: {start_xy_std_m: 0.01, start_yaw_std_rad: 0.02}
suite: {name: halls, density: crowded, reference_length_m: 6.0, arrival_radius_m: 0.5}
faults:
  - {at_s: 2.0, duration_s: 1.0, lidar: {range_std_m: 0.1}, localization: {x_bias_m: 0.1}}
clean_scenario: empty
robot_overrides: {lidar: {range_max_m: 9.0}}
"""
MAP = """
image: everything_map.pgm
resolution: 0.1
origin: [-2.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""


def write_everything(folder) -> None:
    (folder / "everything.yaml").write_text(EVERY_FIELD)
    (folder / "everything_map.yaml").write_text(MAP)
    (folder / "everything_map.pgm").write_bytes(b"P5\n100 40\n255\n" + bytes([254] * 4000))


# What a mission has in place of world, filters, waypoints and goal.
OF_A_MISSION = {"floors", "lifts", "mission"}


def test_the_file_sets_every_field_to_another_value_than_its_default(tmp_path):
    write_everything(tmp_path)
    scenario = load_scenario(str(tmp_path / "everything.yaml"))
    for name, field in Scenario.model_fields.items():
        if name in OF_A_MISSION:
            continue
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        assert getattr(scenario, name) != default, name


def test_a_scenario_with_every_field_set_is_the_same_after_a_round_trip(tmp_path):
    write_everything(tmp_path)
    scenario = load_scenario(str(tmp_path / "everything.yaml"))
    dumped = scenario.model_dump(mode="json", exclude=set(SET_BY_LOADING))
    assert set(dumped) == set(Scenario.model_fields) - set(SET_BY_LOADING) - OF_A_MISSION
    (tmp_path / "again").mkdir()
    write_everything(tmp_path / "again")
    path = tmp_path / "again" / "everything.yaml"
    path.write_text(yaml.safe_dump(json.loads(json.dumps(dumped))))
    again = load_scenario(str(path))
    assert again == scenario.model_copy(update={"directory": str(path.parent)})
    assert again.load_robot("wheelchair").lidar.range_max_m == 9.0


def test_the_built_in_tasks_that_are_impossible_are_those_closed_in_by_walls():
    loaded = [load_scenario(name) for name in SCENARIO_FILES.names]
    assert {scenario.name for scenario in loaded if scenario.is_impossible} == {
        "restricted_small",
        "restricted_large",
        "restricted_small_noisy",
        "restricted_large_noisy",
    }


@pytest.mark.parametrize(
    ("plan", "expected"),
    [
        ("{type: polyline, points: [[1, 2], [1, 2]]}", r"points: expected two different corners"),
        ("{type: elements, elements: [{arc_deg: 0, radius_m: 1}]}", r"arc_deg: expected a turn"),
    ],
)
def test_a_plan_that_leads_nowhere_is_refused_with_its_field(plan, expected, tmp_path):
    path = tmp_path / "nowhere.yaml"
    path.write_text(f"description: a plan\nstart: [0, 0, 0]\ngoal: [1, 0, 0]\nplan: {plan}\n")
    with pytest.raises(InputError, match=expected) as refused:
        load_scenario(str(path))
    assert str(path) in str(refused.value)


TASK = "description: a task\nstart: [0.0, 0.0, 0.0]\ngoal: [4.0, 0.0, {heading}]\n"


def test_a_wrong_field_is_named_with_its_line(tmp_path):
    path = tmp_path / "task.yaml"
    path.write_text(TASK.format(heading="east"))
    with pytest.raises(InputError, match=r"task\.yaml, line 3: goal\[2\]: .*, got 'east'"):
        load_scenario(str(path))


def test_a_heading_of_more_than_a_turn_is_told_as_one_in_degrees(tmp_path):
    path = tmp_path / "task.yaml"
    path.write_text(TASK.format(heading="90"))
    with pytest.warns(InputWarning, match=r"goal: a heading of 90 rad; headings are not in deg"):
        load_scenario(str(path))


def test_a_goal_in_degrees_on_the_command_line_is_told():
    with pytest.warns(InputWarning, match=r"^--goal: a heading of 90 rad; headings are not in deg"):
        warn_of_degrees({"--start": None, "--goal": (3.0, 2.0, 90.0)})
