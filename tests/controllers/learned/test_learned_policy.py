"""The learned policy as a controller: what it sees, its file, how it drives."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path

import numpy as np
import pytest

from drake_navbench import run_trial
from drake_navbench.controllers.learned.features import (
    GAP_SCALE_M,
    SECTOR_COUNT,
    goal_features,
    outline_radii,
    sector_closeness,
)
from drake_navbench.controllers.learned.network import Network, load_network, save_network
from drake_navbench.controllers.learned.parameters import WEIGHTS_FOLDER
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.gymnasium.environment import NavigationEnvironment
from drake_navbench.studies.gymnasium.policy_view import PolicyView
from drake_navbench.trial.column_controller import make_controller

SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
SHIPPED = WEIGHTS_FOLDER / "navigation.npz"


def test_the_outline_reaches_as_far_as_its_edge_in_the_middle_of_each_sector():
    # Of four sectors the middles are the diagonals, of eight they lie 22.5 degrees off the axes.
    np.testing.assert_allclose(outline_radii(SQUARE, 4), math.sqrt(2.0))
    np.testing.assert_allclose(outline_radii(SQUARE, 8), 1.0 / math.cos(math.pi / 8.0))


def test_a_point_is_as_close_as_its_gap_to_the_outline_in_its_sector():
    radii = np.ones(SECTOR_COUNT)
    # The robot at (1, 1) looks north; 1.6 m ahead of it stands a point, 1.8 m another.
    points = np.array([[0.99, 2.6], [0.99, 2.8], [20.0, 1.0]])
    closeness = sector_closeness(points, 1.0, 1.0, 0.5 * math.pi, radii, 0.0)
    ahead = SECTOR_COUNT // 2
    assert closeness[ahead] == pytest.approx(math.exp(-0.6 / GAP_SCALE_M), abs=1e-3)
    assert np.count_nonzero(closeness) == 1


def test_a_scan_and_a_costmap_of_the_same_wall_look_alike():
    wall = {"type": "box", "min": [1.5, -0.6], "max": [1.9, 0.4]}
    scenario = Scenario(
        name="wall", description="a wall", world={"obstacles": [wall]}, goal=(4.0, 0.0, 0.0)
    )
    environment = NavigationEnvironment(scenario)
    seen, _ = environment.reset(seed=0)
    environment.close()
    by_scan = PolicyView(environment).inputs(seen)[:SECTOR_COUNT]
    # The front of the wall in cells of 0.05 m.
    cells = np.array([(1.525, y) for y in np.arange(-0.575, 0.4, 0.05)])
    radii = outline_radii(environment.robot.outline, SECTOR_COUNT)
    by_costmap = sector_closeness(cells, 0.0, 0.0, 0.0, radii, 0.025)
    np.testing.assert_allclose(by_costmap, by_scan, atol=0.05)
    assert by_scan.max() > 0.3


def test_within_the_outline_a_point_is_as_close_as_can_be():
    closeness = sector_closeness(np.array([[0.1, 0.0]]), 0.0, 0.0, 0.0, np.ones(4), 0.0)
    assert closeness.max() == 1.0


def test_the_direction_of_a_goal_fades_where_it_means_nothing():
    assert np.abs(goal_features(np.array([1e-9, 1e-9, 0.0]))[1:3]).max() < 1e-6
    np.testing.assert_allclose(
        goal_features(np.array([0.0, 3.0, 1.0]))[[0, 2]], [math.tanh(1.0), 3.0 / 3.1]
    )


def test_weights_come_back_as_they_were_written(tmp_path):
    network = load_network(SHIPPED)
    for name in ("one.npz", "two.npz"):
        save_network(network, tmp_path / name)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    again = load_network(tmp_path / "one.npz")
    assert again.weight_2.tobytes() == network.weight_2.tobytes()


def in_brackets(path: Path) -> bytes:
    """Returns an archive whose first array has a header of nothing but brackets."""
    header = b"\x93NUMPY\x01\x00" + (9000).to_bytes(2, "little") + b"[" * 9000
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("weight_1.npy", header)
    return file.getvalue()


def narrow(network: Network) -> Network:
    return Network(network.weight_1[:-1], *list(vars(network).values())[1:])


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda path: path.write_bytes(b"no numbers"), "expected a file of numpy.savez"),
        (lambda path: path.write_bytes(path.read_bytes()[:-30]), "expected a file of numpy.savez"),
        (lambda path: path.write_bytes(in_brackets(path)), "expected a file of numpy.savez"),
        (lambda path: np.savez_compressed(path, weight_1=np.zeros(10**7)), "has more than"),
        (lambda path: path.unlink(), "cannot be read"),
        (lambda path: np.savez(path, weight_1=np.ones(3)), "expected a file of numpy.savez"),
        (
            lambda path: save_network(narrow(load_network(SHIPPED)), path),
            "layer 1: got weights (32, 64)",
        ),
    ],
)
def test_what_is_no_network_is_one_line(spoil, told, tmp_path):
    path = tmp_path / "mine.npz"
    save_network(load_network(SHIPPED), path)
    spoil(path)
    preset, robot = load_preset(f"learned:weights={path}"), load_robot("wheelchair")
    with pytest.raises(InputError) as refused:
        make_controller(preset, robot)
    assert told in str(refused.value)


def test_it_drives_past_an_obstacle_to_its_goal_as_a_column_with_its_digest():
    scenario = Scenario(
        name="beside",
        description="an obstacle beside the way",
        world={"obstacles": [{"type": "box", "min": [1.6, 0.2], "max": [2.0, 1.0]}]},
        plan={"type": "polyline", "points": [[0.0, 0.0], [3.5, 0.0]]},
        goal=(3.5, 0.0, 0.0),
        timeout_s=20.0,
    )
    log = run_trial(scenario, "learned", seed=2)
    assert log.outcome is Outcome.SUCCEEDED
    assert set(log.info["controller_files"]) == {"navigation.npz"}
