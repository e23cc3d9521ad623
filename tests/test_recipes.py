"""The recipes of CONTRIBUTING.md, followed in a copy of the tree: so many files, and it works."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
FOLDERS = ("analysis", "controllers", "models", "scenarios")


class Copy:
    """A copy of the tree, installed: its subpackages in the package's folder."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._touched: set[str] = set()
        ignored = shutil.ignore_patterns("__pycache__", "*.png", "recordings", "maps", "weights")
        for folder in ("drake_navbench", *FOLDERS):
            shutil.copytree(REPOSITORY / folder, self._place(folder), ignore=ignored)
        shutil.copy(REPOSITORY / "pyproject.toml", root)

    def _place(self, name: str) -> Path:
        inside = name.partition("/")[0] in FOLDERS
        return self._root / "drake_navbench" / name if inside else self._root / name

    def add(self, name: str, text: str) -> None:
        """Adds a file."""
        assert not self._place(name).exists()
        self._place(name).parent.mkdir(parents=True, exist_ok=True)
        self._place(name).write_text(text, encoding="utf-8")
        self._touched.add(name)

    def put_before(self, name: str, place: str, lines: str) -> None:
        """Puts lines before a text that occurs once in a file."""
        text = self._place(name).read_text(encoding="utf-8")
        assert text.count(place) == 1
        self._place(name).write_text(text.replace(place, lines + place), encoding="utf-8")
        self._touched.add(name)

    @property
    def touched(self) -> int:
        """The number of files that were added or changed."""
        return len(self._touched)

    def run(self, *arguments: str) -> str:
        """Returns what Python prints with the copy in place of this tree."""
        data = tomllib.loads((self._root / "pyproject.toml").read_text(encoding="utf-8"))
        metadata = self._root / "drake_navbench-0.1.0.dist-info"
        metadata.mkdir(exist_ok=True)
        (metadata / "METADATA").write_text("Name: drake-navbench\nVersion: 0.1.0\n")
        lines = []
        for group, points in data["project"]["entry-points"].items():
            lines += [f"[{group}]", *(f"{name} = {value}" for name, value in points.items())]
        (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n")
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=self._root,
            env=os.environ | {"PYTHONPATH": str(self._root), "NUMBA_DISABLE_JIT": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture
def copy(tmp_path) -> Callable[[], Copy]:
    return Copy(tmp_path)


def test_a_command_is_one_file_and_a_line(copy):
    copy.add(
        "drake_navbench/commands/planted.py",
        '"""A command."""\n\n\ndef main(argv=None):\n    print("planted", *argv)\n    return 0\n',
    )
    copy.put_before(
        "drake_navbench/commands/main.py",
        '    "completion": "',
        '    "planted": "say so",\n',
    )
    assert copy.touched == 2
    assert copy.run("-m", "drake_navbench", "planted", "here") == "planted here\n"
    assert re.search("planted +say so", copy.run("-m", "drake_navbench", "--help"))


LAYER = '''"""A layer that makes the cell under the robot lethal."""

from drake_navbench.navigation.costmaps.layer_plugin import LayerParameters, Observed
from drake_navbench.kernels.planted import put


class PlantedParameters(LayerParameters):
    cost: int = 254


class Planted:
    Parameters = PlantedParameters

    def __init__(self, parameters, setup):
        self._cost = parameters.cost

    def initial_state(self):
        return None

    def observe(self, state, seen):
        return Observed(None)

    def write(self, state, grid, seen):
        return put(grid, seen.pose, self._cost)
'''
USES_LAYER = """
import numpy as np
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.inputs.lidar import LidarSettings

settings = LocalCostmapSettings(
    plugins=["mine"], mine={"plugin": "lab::Planted", "cost": 200}, filters=[]
)
layers = local_layers(settings, lidar=LidarSettings(), footprint=np.eye(2))
state = layers.updated(layers.initial_state(), scan=None, pose=np.zeros(3), time_s=0.0)
print(sorted(set(state.costmap.costs.ravel().tolist())))
"""


@pytest.mark.long
def test_a_costmap_layer_is_three_files(copy):
    copy.add(
        "drake_navbench/kernels/planted.py",
        "def put(grid, pose, cost):\n    grid.costs[0, 0] = cost\n    return grid.costs\n",
    )
    copy.add("drake_navbench/navigation/costmaps/planted_layer.py", LAYER)
    copy.put_before(
        "drake_navbench/navigation/costmaps/layer_plugin.py",
        '            ("nav2_costmap_2d::VoxelLayer"',
        '            ("lab::Planted", "planted_layer:Planted"),\n',
    )
    assert copy.touched == 3
    assert copy.run("-c", USES_LAYER) == "[0, 200]\n"


CONTROLLER = '''"""Drives straight on."""

import numpy as np

from drake_navbench.controller import ControllerParameters, Decision


class PlantedParameters(ControllerParameters):
    speed: float = 0.1


class Planted:
    Parameters = PlantedParameters
    nav2_plugin = None

    def __init__(self, parameters, setup):
        self._speed = parameters.speed

    def initial_memory(self):
        return None

    def step(self, observation, memory):
        return Decision(np.array([self._speed, 0.0]), None)
'''
USES_CONTROLLER = """
from drake_navbench.inputs.presets import load_preset
preset = load_preset("planted:speed=0.3")
print(preset.controller, preset.parameters.speed, preset.description)
"""


@pytest.mark.long
def test_a_controller_in_the_tree_is_one_folder_and_a_row(copy):
    copy.add("controllers/planted/__init__.py", CONTROLLER)
    copy.add(
        "controllers/planted/presets/planted.yaml",
        "controller: planted\ndescription: straight on\nparameters: {speed: 0.2}\n",
    )
    copy.put_before(
        "pyproject.toml",
        'dwb = "drake_navbench.controllers.dwb:',
        'planted = "drake_navbench.controllers.planted:Planted"\n',
    )
    assert copy.touched == 3
    assert copy.run("-c", USES_CONTROLLER) == "planted 0.3 straight on\n"


USES_FAULT = """
from pydrake.systems.analysis import Simulator
from drake_navbench.inputs.faults import Fault, conditions_of
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.world import Box, World
from drake_navbench.trial.systems.lidar import Lidar

robot = Robot(description="round", robot_radius=0.2, lidar={"beam_count": 4})
faults = [Fault(at_s=0.15, lidar={"range_ratio": 0.5})]
box = Box(type="box", min=(2.0, -1.0), max=(3.0, 1.0))
lidar = Lidar(conditions_of(robot, faults).lidar, World((box,)))
simulator = Simulator(lidar)
context = simulator.get_mutable_context()
lidar.GetInputPort("state").FixValue(context, [0.0] * 6)
for time_s in (0.11, 0.21):
    simulator.AdvanceTo(time_s)
    print(float(lidar.GetOutputPort("scan").Eval(context).ranges_m[2]))
"""


def test_a_fault_of_a_scenario_is_a_field_and_its_effect(copy):
    copy.put_before(
        "drake_navbench/inputs/lidar.py",
        "    range_bias_m: Length",
        "    range_ratio: float = Field(1.0)\n",
    )
    copy.put_before(
        "drake_navbench/trial/systems/lidar.py",
        "        if settings.range_bias_m != 0.0:",
        "        ranges *= settings.range_ratio\n",
    )
    assert copy.touched == 2
    assert copy.run("-c", USES_FAULT).split() == ["2.0", "1.0"]
