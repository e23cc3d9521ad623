"""A parameter file is read as ROS reads it: which node gets which parameter, from which line."""

import textwrap
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.errors import InputError
from drake_navbench.nav2.parameters import nodes_called, read_parameter_file


@pytest.fixture
def read(tmp_path: Path):
    """A function that writes a text to a file and reads it."""

    def read_text(text: str):
        path = tmp_path / "nav2_params.yaml"
        path.write_text(textwrap.dedent(text))
        return read_parameter_file(path)

    return read_text


def values_of(file, node="controller_server"):
    (found,) = nodes_called(node, file.sections)
    return {name: parameter.value for name, parameter in found.parameters.items()}


def below_server(text):
    """Returns a file with parameters of the controller server, from line 3 on."""
    parameters = textwrap.indent(textwrap.dedent(text), "    ")
    return f"controller_server:\n  ros__parameters:\n{parameters}"


def test_a_dotted_name_and_a_block_are_the_same_parameter(read):
    mixed = """
        FollowPath.plugin: dwb_core::DWBLocalPlanner
        FollowPath:
          PathAlign.scale: 32.0
          PathDist: {scale: 24.0}
        FollowPath.GoalDist: {scale: 20.0}
    """
    assert values_of(read(below_server(mixed))) == {
        "FollowPath.plugin": "dwb_core::DWBLocalPlanner",
        "FollowPath.PathAlign.scale": 32.0,
        "FollowPath.PathDist.scale": 24.0,
        "FollowPath.GoalDist.scale": 20.0,
    }


NAMES = st.text("abc", min_size=1, max_size=3)
TREES = st.recursive(
    st.integers(), lambda below: st.dictionaries(NAMES, below, min_size=1, max_size=3), max_leaves=8
).filter(lambda tree: isinstance(tree, dict))


def flat(tree, prefix=""):
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def dotted_at_random(tree, draw):
    """Returns the tree with some of its blocks dissolved into dotted names."""
    result = {}
    for key, value in tree.items():
        below = dotted_at_random(value, draw) if isinstance(value, dict) else None
        if below is None:
            result[key] = value
        elif draw(st.booleans()):
            result |= {f"{key}.{rest}": item for rest, item in below.items()}
        else:
            result[key] = below
    return result


@given(TREES, st.data())
def test_any_mixture_of_dotted_names_and_blocks_says_the_same(tmp_path_factory, tree, data):
    path = tmp_path_factory.getbasetemp() / "mixed.yaml"
    parameters = dotted_at_random(tree, data.draw)
    path.write_text(yaml.safe_dump({"controller_server": {"ros__parameters": parameters}}))
    file = read_parameter_file(path)
    assert values_of(file) == dict(flat(tree))
    assert file.remarks == ()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # rcl_yaml_param_parser's scalars where YAML 1.1 knows others.
        ("y", True),
        ("N", False),
        ("On", True),
        ("no", False),
        ("'true'", "true"),
        ("1e-3", 0.001),
        ("2E3", 2000.0),
        ("5.", 5.0),
        (".5", 0.5),
        ("+.5", 0.5),
        ("08", 8.0),
        ("-.inf", float("-inf")),
        ("Infinity", float("inf")),
        ("0x1p-1", 0.5),
        ("010", 8),
        ("0x1F", 31),
        ("'1.0'", "1.0"),
        ("!!str 1.0", "1.0"),
        ("1:30", "1:30"),
        ("2024-01-01", "2024-01-01"),
        ("[1.0, 2.0]", [1.0, 2.0]),
        ("[PathAlign, 'y']", ["PathAlign", "y"]),
        ("", None),
    ],
)
def test_a_value_is_what_ros_takes_it_for(read, text, value):
    found = values_of(read(below_server(f"name: {text}")))["name"]
    assert found == value
    assert type(found) is type(value)


def test_of_equal_keys_the_last_holds_and_both_lines_are_told(read, tmp_path):
    file = read(below_server("tolerance: 0.3\nFollowPath: {a: 1, a: 2}\ntolerance: 5"))
    assert values_of(file) == {"tolerance": 5, "FollowPath.a": 2}
    place = f"{tmp_path / 'nav2_params.yaml'}, line %d: controller_server.ros__parameters.%s"
    assert file.remarks == (
        place % (5, "tolerance") + " is given again; line 3 has no effect",
        place % (4, "FollowPath.a") + " is given again; line 4 has no effect",
    )


def test_a_parameter_given_dotted_and_in_a_block_is_given_twice(read):
    file = read(below_server("FollowPath: {a: 1}\nFollowPath.a: 2"))
    assert values_of(file) == {"FollowPath.a": 2}
    (remark,) = file.remarks
    assert "line 4: controller_server.ros__parameters.FollowPath.a is given again; line 3" in remark


def test_a_block_given_twice_is_the_last_one_alone(read):
    file = read(below_server("FollowPath: {a: 1, b: 1}\nFollowPath: {a: 2}"))
    assert values_of(file) == {"FollowPath.a": 2}
    assert len(file.remarks) == 1


def test_merge_keys_and_anchors_are_resolved_and_repeat_nothing(read):
    file = read(
        """
        slow: &slow {max_vel_x: 0.2, PathAlign: {scale: 8.0}}
        fast: &fast {max_vel_x: 1.0, sim_time: 1.2}
        controller_server:
          ros__parameters:
            Slow: *slow
            Both: {<<: [*slow, *fast], sim_time: 2.0}
            critics: &critics [PathAlign]
            Slow.critics: *critics
        """
    )
    assert values_of(file) == {
        "Slow.max_vel_x": 0.2,
        "Slow.PathAlign.scale": 8.0,
        # Of several the first has the last word, as in YAML's definition; own keys prevail.
        "Both.max_vel_x": 0.2,
        "Both.sim_time": 2.0,
        "Both.PathAlign.scale": 8.0,
        "critics": ["PathAlign"],
        "Slow.critics": ["PathAlign"],
    }
    assert file.remarks == ()


@pytest.mark.parametrize(
    "name", ["controller_server", "/controller_server", "/**", "/**/controller_server", "/*"]
)
def test_a_node_may_be_named_in_many_ways(read, name):
    assert values_of(read(f"{name}: {{ros__parameters: {{a: 1}}}}")) == {"a": 1}


def test_one_star_stands_for_one_part_of_a_name_and_two_for_any_number(read):
    one, two = read("/*: {ros__parameters: {}}\n/**: {ros__parameters: {}}").sections
    assert one.is_for("/planner")
    assert not one.is_for("/robot1/planner")
    assert two.is_for("/robot1/planner")


def test_later_sections_for_a_node_prevail_over_earlier_ones(read):
    file = read(
        """
        /**: {ros__parameters: {a: 1, b: 1, c: 1}}
        controller_server: {ros__parameters: {b: 2, c: 2}}
        planner_server: {ros__parameters: {c: 3}}
        /controller_server: {ros__parameters: {c: 4}}
        """
    )
    assert values_of(file) == {"a": 1, "b": 2, "c": 4}


def test_nodes_of_several_namespaces_are_kept_apart(read):
    file = read(
        """
        robot1: {controller_server: {ros__parameters: {a: 1}}}
        /robot2/controller_server: {ros__parameters: {a: 2}}
        /robot2/**: {ros__parameters: {b: 3}}
        """
    )
    first, second = nodes_called("controller_server", file.sections)
    assert (first.name, first.get("a"), first.get("b", 0)) == ("/robot1/controller_server", 1, 0)
    assert (second.name, second.get("a"), second.get("b")) == ("/robot2/controller_server", 2, 3)


def test_a_parameter_knows_its_file_and_line(read, tmp_path):
    (node,) = nodes_called("controller_server", read(below_server("FollowPath: {a: 1}")).sections)
    path = tmp_path / "nav2_params.yaml"
    assert node.where("FollowPath.a") == (
        f"{path}, line 3: controller_server.ros__parameters.FollowPath.a"
    )
    assert node.below("FollowPath") == {"a": 1}


def test_a_file_without_ros_parameters_has_no_sections(read):
    assert read("controller: rpp\nparameters: {lookahead_dist: 0.7}\n").sections == ()
    assert read("").sections == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ros__parameters: {a: 1}", "line 1: expected the name of a node above ros__parameters"),
        (below_server("? [a]\n: 1"), "line 3: expected text as the name of a parameter"),
        (below_server("a: {<<: 3}"), "expected a mapping or list of mappings for merging"),
        (below_server("a: *nowhere"), "found undefined alias 'nowhere'"),
        (below_server("a: &b {c: *b}"), ": a value that contains itself"),
        (below_server("a: !thing 3"), "could not determine a constructor for the tag '!thing'"),
        (below_server("a: [1"), "expected ',' or ']'"),
        (below_server("a: !!float ''"), "line 3: '' is no !!float"),
        (below_server("a: [1, !!int x]"), "line 3: 'x' is no !!int"),
        (below_server("a: !!timestamp soon"), "line 3: 'soon' is no !!timestamp"),
        (below_server("a: !!bool maybe"), "line 3: 'maybe' is no !!bool"),
    ],
)
def test_what_is_no_parameter_file_is_one_line(read, text, message):
    with pytest.raises(InputError) as caught:
        read(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["ros_parameters", "ros__params", "ROS__parameters"])
def test_a_misspelt_ros_parameters_is_refused(read, key):
    """ROS refuses such a file: it expects no value above ros__parameters."""
    with pytest.raises(InputError, match=rf"line 2: expected ros__parameters, got '{key}'"):
        read(f"controller_server:\n  {key}:\n    a: 1\n")


def test_a_node_without_ros_parameters_is_refused(read):
    fault = "line 2: expected ros__parameters above controller_frequency"
    with pytest.raises(InputError, match=fault):
        read("controller_server:\n  controller_frequency: 20.0\n")
    assert read("controller_server:\n  ros__parameters:\n").sections[0].parameters == {}
