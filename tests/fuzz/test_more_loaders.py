"""The same of whatever else is read: arrays, journals, definitions, suites, models of robots."""

from __future__ import annotations

import io
import warnings
import zipfile
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
from bounds import fuzz, only_input_errors
from damage import as_text, damaged, damaged_bytes, damaged_text
from hypothesis import given
from hypothesis import strategies as st
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

from drake_navbench.analysis.leaderboard.suite import read_open_suite
from drake_navbench.controllers.learned.network import Network, load_network
from drake_navbench.inputs.barn import barn_scenarios
from drake_navbench.inputs.robot_model import read_robot_model
from drake_navbench.ros2.recordings.bag_source import BagSource

BARN_WORLD = """<sdf version='1.6'><world name='default'>
<model name='unit_cylinder_1'><pose frame=''>-2.0 3.0 0.5 0 0 0</pose><link name='link'>
<collision name='collision'><geometry><cylinder><radius>0.075</radius><length>1.0</length>
</cylinder></geometry></collision></link></model>
<state world_name='default'/></world></sdf>
"""
SUITE = {
    "name": "tiny",
    "version": 1,
    "scenarios": ["empty", "doorway"],
    "trials": 2,
    "robot": "wheelchair",
    "seeds": [3, 8],
}
SEALED = {
    "name": "tiny",
    "version": 1,
    "scenarios": ["empty"],
    "trials": 2,
    "robot": "wheelchair",
    "sealed": {"sha256": "0" * 64, "count": 1},
    "revealed": {"salt": "00", "seeds": [4]},
}
URDF = """<robot name="cart">
  <link name="base_footprint"/>
  <link name="base_link">
    <inertial><mass value="12.0"/><inertia ixx="0.5" ixy="0" ixz="0" iyy="0.5" iyz="0" izz="0.8"/>
    </inertial>
    <collision><origin xyz="0 0 0.1" rpy="0 0 0"/><geometry><box size="0.6 0.4 0.2"/></geometry>
    </collision>
  </link>
  <link name="mast"><collision><geometry><cylinder radius="0.05" length="0.4"/></geometry>
    </collision></link>
  <joint name="a" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>
  <joint name="b" type="revolute"><parent link="base_link"/><child link="mast"/>
    <origin xyz="0.2 0 0.3" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
</robot>
"""
DEFINITION = """std_msgs/Header header
string<=40 child_frame_id
float64[3] position
float64[] samples
uint8 KIND=2
geometry_msgs/Point[<=4] corners
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""
IDL = """module lab_msgs { module msg {
  struct Odd { double x; sequence<double, 4> samples; string<40> name; };
}; };
"""
DEFINED = {MessageDefinitionFormat.MSG: DEFINITION, MessageDefinitionFormat.IDL: IDL}


def npy_bytes(array: np.ndarray) -> bytes:
    content = io.BytesIO()
    np.save(content, array)
    return content.getvalue()


BARN_PATH = npy_bytes(np.stack([np.arange(30.0), np.arange(30.0)], axis=1))
ODD_CELLS = st.sampled_from([np.nan, np.inf, -np.inf, 1e308, -1e300, 1e15, 0.0])
ODD_ARRAYS = st.builds(
    lambda value, shape, kind: npy_bytes(np.full(shape, value).astype(kind)),
    ODD_CELLS,
    st.sampled_from([(), (0,), (2,), (0, 2), (1, 2), (3, 2), (2, 3), (2, 2, 2), (300, 2)]),
    st.sampled_from(["float64", "float16", "complex128", "U4", "S4", "bool"]),
)


@fuzz
@given(content=damaged_bytes(BARN_PATH) | ODD_ARRAYS | damaged_bytes(b"PK\x03\x04" + b"\0" * 60))
def test_paths_of_barn(content, file):
    world = file("barn/world_0.world", BARN_WORLD)
    file("barn/path_files/path_0.npy", content)
    with only_input_errors(), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        barn_scenarios(world.parent)


@fuzz
@given(text=damaged_text(BARN_WORLD))
def test_worlds_of_barn(text, file):
    world = file("barn/world_0.world", text)
    file("barn/path_files/path_0.npy", BARN_PATH)
    with only_input_errors():
        barn_scenarios(world.parent)


def npz_bytes(arrays: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, array in arrays.items():
            archive.writestr(f"{name}.npy", array)
    return content.getvalue()


ARRAYS = {own.name: npy_bytes(np.zeros((2, 2), dtype=np.float32)) for own in fields(Network)}


@st.composite
def networks(draw: st.DrawFn) -> bytes:
    """Draws a file of weights: one array replaced or missing, or bytes damaged."""
    arrays = dict(ARRAYS)
    name = draw(st.sampled_from(sorted(arrays)))
    arrays[name] = draw(damaged_bytes(arrays[name]) | ODD_ARRAYS)
    if draw(st.booleans()):
        return npz_bytes(arrays)
    return draw(damaged_bytes(npz_bytes(arrays)) | damaged_bytes(arrays[name]))


@fuzz
@given(content=networks())
def test_weights(content, file):
    path = file("weights.npz", content)
    with only_input_errors():
        load_network(path)


class OneMessage:
    """What a reader of a bag gives: a connection with its definition, and a message of zeros."""

    def __init__(self, kind: MessageDefinitionFormat, text: str) -> None:
        definition = MessageDefinition(kind, text)
        self.connections = [
            SimpleNamespace(topic="/odom", msgtype="lab_msgs/msg/Odd", msgdef=definition)
        ]

    def messages(self, connections, start=None, stop=None):
        yield connections[0], 0, b"\0\1\0\0" + b"\0" * 200


SIZES = st.sampled_from(["50000000", "4294967296", "0", "-1", "1e9", "9" * 30, "<=1000000000", ""])


@st.composite
def definitions(draw: st.DrawFn) -> tuple[MessageDefinitionFormat, str]:
    """Draws a definition with other sizes of arrays, or with its text damaged."""
    kind = draw(st.sampled_from(list(DEFINED)))
    text = DEFINED[kind]
    for old in ("[3]", "<=40", "[<=4]", ", 4>", "<40>"):
        if old in text and draw(st.booleans()):
            text = text.replace(old, old[0] + draw(SIZES) + (old[-1] if old[-1] in "]>" else ""))
    if draw(st.booleans()):
        text = draw(damaged_text(text))
    return kind, text


@fuzz
@given(definition=definitions())
def test_definitions_of_bags(definition, tmp_path_factory):
    reader = OneMessage(*definition)
    source = BagSource(tmp_path_factory.getbasetemp() / "lab", (reader,), False)
    with only_input_errors():
        list(source.read(["/odom"]))


@fuzz
@given(document=damaged(SUITE) | damaged(SEALED))
def test_suites(document, file):
    path = file("suite.yaml", as_text(document))
    with only_input_errors():
        read_open_suite(path)


@fuzz
@given(text=damaged_text(URDF))
def test_models_of_robots(text, file):
    path = file("robot.urdf", text)
    with only_input_errors(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read_robot_model(path)
