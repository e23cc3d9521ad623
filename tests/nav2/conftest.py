"""Nav2 files of a test's own, and what is made of them."""

import textwrap
from pathlib import Path

import pytest
import yaml
from nav2_setups import read_nav2_files

from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.controllers import load_parameter_file


@pytest.fixture
def presets_of(tmp_path: Path):
    """A function from the text of a Nav2 file to its presets."""

    def load(text: str):
        path = tmp_path / "nav2_params.yaml"
        path.write_text(textwrap.dedent(text))
        return load_parameter_file(path)

    return load


@pytest.fixture
def preset_of(presets_of):
    """A function from plugin type and parameters of FollowPath to its preset."""

    def load(plugin: str, parameters: dict | str, **server):
        if isinstance(parameters, str):
            parameters = yaml.safe_load(textwrap.dedent(parameters))
        server |= {"controller_plugins": ["FollowPath"]}
        server["FollowPath"] = {"plugin": plugin} | parameters
        text = yaml.safe_dump({"controller_server": {"ros__parameters": server}}, sort_keys=False)
        (preset,) = presets_of(text)
        return preset

    return load


@pytest.fixture
def setup_of(tmp_path):
    """A function from the texts of Nav2 files, and values to be set, to what they make."""

    def read(*texts: str, base: str = "wheelchair", **values: str):
        paths = []
        for number, text in enumerate(texts):
            paths.append(tmp_path / f"nav2_{number}.yaml")
            paths[-1].write_text(textwrap.dedent(text))
        return read_nav2_files(paths, load_robot(base), base, values)

    return read
