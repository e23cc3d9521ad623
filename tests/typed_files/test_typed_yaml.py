"""Everything wrong in a file becomes one line that names file, field, value and expectation."""

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.typed_files.typed_yaml import MAX_FAULTS_SHOWN, parse_yaml, validate

MINIMAL = {"description": "a task", "goal": [1.0, 0.0, 0.0], "name": "task"}


def lines_of(data, model=Scenario):
    with pytest.raises(InputError) as caught:
        validate(model, data, "task.yaml")
    return str(caught.value).splitlines()


def test_a_minimal_scenario_is_enough():
    scenario = validate(Scenario, MINIMAL, "task.yaml")
    assert scenario.goal == (1.0, 0.0, 0.0)
    assert scenario.start == (0.0, 0.0, 0.0)


def test_an_unknown_field_names_the_nearest_known_one():
    (line,) = lines_of(MINIMAL | {"timout_s": 3.0})
    assert line == "task.yaml: timout_s: unknown field; did you mean 'timeout_s'?"


def test_an_unknown_nested_field_names_its_place_and_the_nearest_known_one():
    (line,) = lines_of(MINIMAL | {"variation": {"start_xy_std": 0.1}})
    assert line.startswith("task.yaml: variation.start_xy_std: unknown field; did you mean")


def test_an_unknown_field_of_a_shape_is_looked_up_in_that_shape():
    world = {"obstacles": [{"type": "cylinder", "centre": [0, 0], "radius_m": 1, "radius": 2}]}
    (line,) = lines_of(MINIMAL | {"world": world})
    assert "obstacles[0]" in line
    assert "did you mean 'radius_m'?" in line


def test_a_missing_field_is_named():
    (line,) = lines_of({"description": "a task", "name": "task"})
    assert line == "task.yaml: goal: missing, but required"


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({}, "missing, but required"),
        ({"type": "boxx"}, "got 'boxx', expected one of 'box', 'wall', 'polygon', 'cylinder'"),
    ],
)
def test_a_shape_of_no_known_type_names_the_field_type(given, text):
    world = {"obstacles": [{"centre": [0, 0], "radius_m": 1, **given}]}
    (line,) = lines_of(MINIMAL | {"world": world})
    assert line == f"task.yaml: world.obstacles[0].type: {text}"


def test_text_is_no_number():
    (line,) = lines_of(MINIMAL | {"timeout_s": "12"})
    assert line.startswith("task.yaml: timeout_s: input should be a valid number")
    assert line.endswith("got '12'")


def test_a_negative_size_names_the_bound():
    world = {"obstacles": [{"type": "cylinder", "centre": [3, 3], "radius_m": -0.1}]}
    (line,) = lines_of(MINIMAL | {"world": world})
    assert line.endswith("radius_m: expected 0.0001 to 10000, got -0.1")


def test_infinity_is_refused():
    assert "timeout_s" in lines_of(MINIMAL | {"timeout_s": float("inf")})[0]


def test_every_fault_has_a_line_of_its_own():
    assert len(lines_of(MINIMAL | {"timeout_s": -1.0, "goal": [0.0, 0.0]})) == 2


def test_a_robot_needs_exactly_one_kind_of_outline():
    (line,) = lines_of({"description": "none"}, Robot)
    assert line == "task.yaml: expected either footprint or robot_radius, and not both"


def test_a_key_given_twice_is_refused_with_its_line():
    with pytest.raises(InputError, match=r"task.yaml, line 2: key 'a' is given twice"):
        parse_yaml("a: 1\na: 2\n", "task.yaml")


def test_broken_yaml_names_the_line():
    with pytest.raises(InputError, match=r"task.yaml, line 2: did not find expected ',' or '\]'"):
        parse_yaml("a: [1, 2", "task.yaml")


def test_an_indentation_by_a_tab_is_named():
    with pytest.raises(InputError, match=r"task.yaml, line 2: is indented by a tab; expected spa"):
        parse_yaml("a:\n\tb: 1\n", "task.yaml")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("a: 1\nrate 20\nb: 2\n", r"line 2: expected 'name: value', got 'rate 20'"),
        ("a: 1\nrate:20\n\nb: 2\n", r"line 2: expected 'name: value', got 'rate:20'"),
        ("a:\n  b: 1\n\u00a0 c: 2\n  d: 3\n", "line 3: is indented by a no-break space"),
        (
            "a: 1\n<<<<<<< HEAD\nb: 1\n=======\nb: 2\n>>>>>>> theirs\n",
            "line 2: a mark of a merge conflict, got '<<<<<<< HEAD'",
        ),
    ],
)
def test_a_slip_is_named_where_it_is_and_not_where_yaml_notices_it(text, fault):
    with pytest.raises(InputError, match=f"^task.yaml, {fault}"):
        parse_yaml(text, "task.yaml")


def test_a_list_at_the_top_is_refused():
    with pytest.raises(InputError, match="expected a mapping of fields to values, got list"):
        parse_yaml("- 1", "task.yaml")


def test_of_many_faults_the_first_are_named_and_the_others_counted():
    lines = lines_of(MINIMAL | {f"unknown_{number}": 1 for number in range(MAX_FAULTS_SHOWN + 5)})
    assert len(lines) == MAX_FAULTS_SHOWN + 1
    assert lines[-1] == "task.yaml: and 5 faults more"
