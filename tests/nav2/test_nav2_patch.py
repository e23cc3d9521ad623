"""A parameter is set in a Nav2 file's text; all that stands beside it stays as it was."""

from difflib import unified_diff
from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.nav2.parameters import read_parameter_file, read_parameter_text
from drake_navbench.nav2.patch import difference, patched, patched_files, place_of

FILE = Path("nav2_params.yaml")
FILES = sorted((Path(__file__).parent / "nav2_files").glob("*.yaml"))
TEXT = """\
# The robot of hall 3.
controller_server:
  ros__parameters:
    controller_frequency:   20.0   # Hz
    controller_plugins: ["FollowPath"]

    FollowPath:
      plugin: 'nav2_rpp::RPP'
      desired_linear_vel: 0.5 # slow, for the carpet
      # the rest is as it comes
      use_rotate_to_heading: yes
local_costmap:
  local_costmap:
    ros__parameters: {width: 3, inflation_layer: {inflation_radius: 0.55}}
"""


def given_value(text, place, path):
    """Returns the value that a file's text gives the parameter of one node."""
    wanted = place_of(place)
    sections = read_parameter_text(text, path).sections
    (own,) = [s for s in sections if s.name.strip("/").endswith(wanted.node)]
    return own.parameters[wanted.name].value


def changed_lines(before, after):
    """Returns the lines that a change takes away and adds, with - and + in front."""
    lines = unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=0)
    return [line for line in lines if line[:3] not in ("---", "+++") and line[0] in "+-"]


@pytest.mark.parametrize(
    ("place", "value", "lines"),
    [
        (
            "controller_server.FollowPath.desired_linear_vel",
            0.8,
            [
                "-      desired_linear_vel: 0.5 # slow, for the carpet",
                "+      desired_linear_vel: 0.8 # slow, for the carpet",
            ],
        ),
        # ROS keeps integers and floats apart: a float stays one.
        (
            "controller_server.controller_frequency",
            10,
            [
                "-    controller_frequency:   20.0   # Hz",
                "+    controller_frequency:   10.0   # Hz",
            ],
        ),
        (
            "controller_server.FollowPath.plugin",
            "a::B",
            ["-      plugin: 'nav2_rpp::RPP'", "+      plugin: 'a::B'"],
        ),
        (
            "local_costmap.inflation_layer.inflation_radius",
            0.7,
            [
                "-    ros__parameters: {width: 3, inflation_layer: {inflation_radius: 0.55}}",
                "+    ros__parameters: {width: 3, inflation_layer: {inflation_radius: 0.7}}",
            ],
        ),
        # Not there before: behind the last entry of its block, or in a new one.
        (
            "controller_server.FollowPath.lookahead_dist",
            1e-5,
            ["+      lookahead_dist: 1.0e-05"],
        ),
        (
            "controller_server.goal_checker.xy_goal_tolerance",
            0.1,
            ["+    goal_checker:", "+      xy_goal_tolerance: 0.1"],
        ),
    ],
)
def test_only_the_lines_of_the_parameter_change(place, value, lines):
    after = patched(TEXT, {place: value}, FILE)
    assert changed_lines(TEXT, after) == lines
    assert given_value(after, place, FILE) == value


def test_a_value_that_is_there_already_leaves_every_byte():
    changes = {"controller_server.FollowPath.use_rotate_to_heading": True}
    assert patched(TEXT, changes, FILE) == TEXT


@pytest.mark.parametrize("path", [FILES[0], FILES[-1]], ids=lambda path: path.stem)
def test_every_number_of_a_file_of_nav2_can_be_set_on_its_own_line(path):
    text = path.read_text()
    sections = read_parameter_file(path).sections
    section = next(s for s in sections if s.name.endswith("/local_costmap"))
    numbers = {
        name: parameter
        for name, parameter in section.parameters.items()
        if type(parameter.value) in (int, float)
    }
    assert len(numbers) > 5
    for name, parameter in numbers.items():
        place = f"local_costmap.{name}"
        after = patched(text, {place: parameter.value + 1}, path)
        assert given_value(after, place, path) == parameter.value + 1
        before, now = text.splitlines(), after.splitlines()
        changed = [
            i for i, lines in enumerate(zip(before, now, strict=True), 1) if len({*lines}) > 1
        ]
        assert changed == [parameter.line]


def test_a_merged_value_is_set_beside_the_anchor_which_others_keep():
    text = (
        "a: &shared {ros__parameters: {width: 3}}\n"
        "local_costmap:\n  local_costmap:\n    ros__parameters:\n      <<: {width: 3}\n"
        "      height: 2\n"
    )
    after = patched(text, {"local_costmap.width": 4}, FILE)
    assert changed_lines(text, after) == ["+      width: 4"]


def test_an_alias_is_replaced_by_the_value_and_its_anchor_stays():
    text = "a: {ros__parameters: {r: &r 0.5}}\nb: {ros__parameters: {r: *r}}\n"
    after = patched(text, {"b.r": 0.6}, FILE)
    assert after == "a: {ros__parameters: {r: &r 0.5}}\nb: {ros__parameters: {r: 0.6}}\n"


def test_what_is_shared_by_an_anchor_is_refused():
    text = "a: {ros__parameters: {r: &r 0.5}}\nb: {ros__parameters: {r: *r}}\n"
    with pytest.raises(InputError, match=r"a\.r: cannot be set for a alone"):
        patched(text, {"a.r": 0.6}, FILE)


def test_a_list_stays_in_its_form():
    text = "a:\n  ros__parameters:\n    plugins:\n    - x # one\n    - y\n    z: 1\n"
    after = patched(text, {"a.plugins": ["x", "w"]}, FILE)
    assert after == "a:\n  ros__parameters:\n    plugins:\n    - x\n    - w\n    z: 1\n"


@pytest.mark.parametrize("text", ["controller_server", "controller_server.", ".x", ""])
def test_a_place_names_node_and_parameter(text):
    with pytest.raises(InputError, match="expected NODE"):
        place_of(text)


def test_a_node_that_is_not_there_is_told():
    with pytest.raises(InputError, match="the file has no node planner_server"):
        patched(TEXT, {"planner_server.GridBased.tolerance": 0.5}, FILE)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[\"A\", 'B', C]", "[\"A\", 'B', C, D]"),
        ('["A", "B"]', '["A", "B", "D"]'),
        ("['A']", "['A', 'D']"),
        ("[A,  # first\n      'B']", "[A,  # first\n      'B', 'D']"),
        ('\n      - "A"\n      - B # seen', '\n      - "A"\n      - B # seen\n      - D'),
        ('\n      - "A" # first', '\n      - "A" # first\n      - "D"'),
    ],
)
def test_the_entries_of_a_list_that_is_extended_keep_their_quotes(before, after):
    text = f"n:\n  ros__parameters:\n    critics: {before}\n    rate: 5\n"
    names = [name for name in "ABC" if name in before]
    found = patched(text, {"n.critics": [*names, "D"]}, FILE)
    assert found == text.replace(before, after)


def test_the_entries_of_a_list_in_another_order_keep_their_quotes():
    text = "n:\n  ros__parameters:\n    critics: [\"A\", 'B', C]\n"
    assert "critics: [C, 'B', D]" in patched(text, {"n.critics": ["C", "B", "D"]}, FILE)


HALVES = {
    Path("controller.yaml"): TEXT.partition("local_costmap:")[0],
    Path("costmap.yaml"): "local_costmap:" + TEXT.partition("local_costmap:")[2],
    # It overrides one value of the first, and begins a block of its plugin.
    Path("mine.yaml"): (
        "controller_server:\n  ros__parameters:\n"
        "    controller_frequency: 30.0\n    FollowPath: {lookahead_dist: 0.4}\n"
    ),
}


@pytest.mark.parametrize(
    ("place", "value", "file", "lines"),
    [
        (
            "local_costmap.width",
            4,
            "costmap.yaml",
            [
                "-    ros__parameters: {width: 3, inflation_layer: {inflation_radius: 0.55}}",
                "+    ros__parameters: {width: 4, inflation_layer: {inflation_radius: 0.55}}",
            ],
        ),
        (
            "controller_server.controller_frequency",
            10.0,
            "mine.yaml",
            ["-    controller_frequency: 30.0", "+    controller_frequency: 10.0"],
        ),
        (
            "controller_server.FollowPath.desired_linear_vel",
            0.8,
            "controller.yaml",
            [
                "-      desired_linear_vel: 0.5 # slow, for the carpet",
                "+      desired_linear_vel: 0.8 # slow, for the carpet",
            ],
        ),
        # No file gives it: it comes to the block that overrides.
        (
            "controller_server.FollowPath.max_accel",
            1.5,
            "mine.yaml",
            [
                "-    FollowPath: {lookahead_dist: 0.4}",
                "+    FollowPath: {lookahead_dist: 0.4, max_accel: 1.5}",
            ],
        ),
    ],
)
def test_of_several_files_the_one_that_gives_the_parameter_is_changed(place, value, file, lines):
    ((path, after),) = patched_files(HALVES, {place_of(place): value}).items()
    assert path.name == file
    assert changed_lines(HALVES[path], after) == lines


def test_a_node_that_none_of_several_files_has_is_named():
    with pytest.raises(InputError, match="no node smoother_server"):
        patched_files(HALVES, {place_of("smoother_server.simple_smoother.tolerance"): 1.0})


def test_a_form_feed_ends_no_line_of_a_patch():
    before = "# A\x0cB\u2028C\nwidth: 3\n"
    lines = difference("a.yaml", before, before.replace("3", "4")).split("\n")
    assert lines[2:] == ["@@ -1,2 +1,2 @@", " # A\x0cB\u2028C", "-width: 3", "+width: 4", ""]


@pytest.mark.parametrize(
    "place", ["controller_server.FollowPath.min_vel", "smoother.a.b", "local_costmap.height"]
)
def test_added_lines_end_as_those_of_a_file_of_windows(place):
    text = TEXT.replace(
        "local_costmap:\n  local", "smoother: {ros__parameters: {}}\nlocal_costmap:\n  local"
    )
    plain = patched(text, {place: 1.5}, FILE)
    windows = patched(text.replace("\n", "\r\n"), {place: 1.5}, FILE)
    assert windows == plain.replace("\n", "\r\n") != text
