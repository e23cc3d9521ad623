"""Nav2 files of a test's own, and what is made of them."""

import textwrap
from pathlib import Path

import pytest
import yaml
from nav2_setups import read_nav2_files
from nav2_texts import RPP, WHEELCHAIR

from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.controllers import load_parameter_file
from drake_navbench.nav2.nav2_setup import Nav2Setup


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


@pytest.fixture
def read_as(tmp_path):
    """A function from a release, a node and its parameters as text to what they make."""

    def read(release: str, node: str, parameters: str, of_plugin: str = "") -> Nav2Setup:
        file = tmp_path / "nav2.yaml"
        if node == "controller_server":
            own = of_plugin or f"plugin: {RPP!r}"
            parameters += f", controller_plugins: [F], F: {{{own}}}"
        file.write_text(f"{node}: {{ros__parameters: {{{parameters}}}}}\n")
        return read_nav2_files([file], WHEELCHAIR, "wheelchair", release=release)

    return read
