"""The form of a column: the typed parameters with range, unit, defaults and the file's values."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset, preset_files
from drake_navbench.studio.drawing import EMPTY_FLOOR
from drake_navbench.studio.messages import DrawnScenario
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.parameter_fields import fields_of
from drake_navbench.studio.tasks import column_fields, columns_in, spec_of
from drake_navbench.studio.tuning_desk import TuningDesk

INFLATION = "local_costmap/inflation_layer.inflation_radius"
GLOBAL_RESOLUTION = ("global_costmap", "resolution")
WAFFLE = Path(__file__).parents[2] / "models" / "nav2" / "turtlebot3_waffle.yaml"


@pytest.fixture
def tuning(tmp_path) -> TuningDesk:
    (tmp_path / "mine.yaml").write_text(WAFFLE.read_text())
    desk = TuningDesk(OpenFolder.at(tmp_path))
    desk.choose("mine.yaml", "FollowPath")
    return desk


def field(fields, name):
    (found,) = (entry for entry in fields if entry.name == name)
    return found


def test_a_field_has_unit_description_default_and_a_range_within_its_bounds():
    found = field(fields_of(load_preset("rpp:lookahead_dist=0.8")), "lookahead_dist")
    assert (found.kind, found.unit, found.default) == ("number", "m", 0.6)
    assert (found.given, found.value) == (0.8, 0.8)
    assert found.description == "Arc length from the robot to the carrot."
    assert (found.low, found.high, found.step) == pytest.approx((0.01, 2.4, 0.01))


def test_given_parameters_come_first_and_those_without_effect_not_at_all():
    names = [entry.name for entry in fields_of(load_preset("rpp"))]
    assert names[:2] == [
        "use_cost_regulated_linear_velocity_scaling",
        "approach_velocity_scaling_dist",
    ]
    assert "nav2_release" not in names
    # Of Jazzy and Kilted, which the newest release does not read.
    assert "stateful" not in names


@pytest.mark.parametrize("name", sorted(set(preset_files()) - {"learned", "live"}))
def test_every_slider_of_every_preset_holds_its_value(name):
    fields = fields_of(load_preset(name))
    assert fields
    for entry in fields:
        if entry.kind in ("number", "whole"):
            assert entry.low <= entry.value <= entry.high
            assert entry.low < entry.high
            assert entry.step > 0.0


def test_parameters_of_critics_are_fields_too():
    found = field(fields_of(load_preset("dwb")), "PathAlign.scale")
    assert (found.kind, found.value) == ("number", 32.0)


def test_a_field_of_a_nav2_file_has_the_name_that_the_file_uses(tuning):
    assert columns_in(str(WAFFLE), tuning.text, "turtlebot3_waffle") == ["FollowPath"]
    speed = field(column_fields(tuning.column(), "turtlebot3_waffle"), "max_linear_vel")
    assert (speed.given_name, speed.given) == ("desired_linear_vel", 0.26)


def test_the_costmaps_of_a_nav2_file_have_fields_too(tuning):
    fields = column_fields(tuning.column(), "turtlebot3_waffle")
    local = {entry.given_name: entry for entry in fields if entry.node == "local_costmap"}
    radius = local["inflation_layer.inflation_radius"]
    assert (radius.unit, radius.default, radius.given) == ("m", 0.55, 0.6)
    assert (local["width"].kind, local["width"].given) == ("whole", 3)
    # Nav2's default, which is not the model's.
    found = [entry for entry in fields if (entry.node, entry.name) == GLOBAL_RESOLUTION]
    assert [entry.default for entry in found] == [0.1]
    assert {"planner_server", "velocity_smoother"} <= {entry.node for entry in fields}
    for entry in fields:
        if entry.kind in ("number", "whole"):
            assert entry.low <= entry.value <= entry.high


def test_a_changed_inflation_is_a_patch_of_one_line_and_is_driven(tuning):
    fields = column_fields(tuning.column(), "turtlebot3_waffle")
    (radius,) = [entry for entry in fields if entry.key == INFLATION]
    tuning.change(radius, 0.9)
    lines = [line for line in tuning.patch().splitlines() if line[0] in "+-"][2:]
    assert [line.strip("+- ") for line in lines] == [
        "inflation_radius: 0.6",
        "inflation_radius: 0.9",
    ]
    drawn = DrawnScenario(EMPTY_FLOOR, "drawn.yaml")
    robot = spec_of(drawn, tuning.column(), "turtlebot3_waffle").robot
    navigation = robot.navigation
    assert navigation.local_costmap.inflation_layer.inflation_radius == 0.9
    assert navigation.global_costmap.inflation_layer.inflation_radius == 0.6


def test_a_change_is_a_patch_of_one_line_and_saved_with_the_comments(tuning, tmp_path):
    speed = field(column_fields(tuning.column(), "turtlebot3_waffle"), "max_linear_vel")
    tuning.change(speed, 0.2)
    lines = tuning.patch().splitlines()
    assert [line.strip("+- ") for line in lines if line[0] in "+-"][2:] == [
        "desired_linear_vel: 0.26",
        "desired_linear_vel: 0.2",
    ]
    before = tuning.text.splitlines()
    tuning.save("mine.yaml")
    after = (tmp_path / "mine.yaml").read_text().splitlines()
    assert sum(one != other for one, other in zip(before, after, strict=True)) == 1
    assert tuning.patch() == ""


def test_a_value_as_in_the_file_again_is_no_change(tuning):
    speed = field(column_fields(tuning.column(), "turtlebot3_waffle"), "max_linear_vel")
    tuning.change(speed, 0.2)
    tuning.change(speed, 0.26)
    assert tuning.changes == {}


def test_a_preset_is_not_saved(tmp_path):
    desk = TuningDesk(OpenFolder.at(tmp_path))
    with pytest.raises(InputError, match="a preset has no file to save"):
        desk.save("rpp.yaml")
