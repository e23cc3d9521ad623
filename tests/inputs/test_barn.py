"""BARN worlds are read as they are: cylinders once, the path on their lattice, BARN's task."""

from __future__ import annotations

import io
import math
import struct
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.run import build_parser
from drake_navbench.errors import InputError
from drake_navbench.inputs.barn import barn_scenarios, reference_path
from drake_navbench.inputs.world import Cylinder

CENTRES = ((-0.075, 0.075), (-4.425, 5.175))


def model(number: int, x: float, y: float) -> str:
    return f"""<model name='unit_cylinder_{number}'><static>1</static>
      <pose frame=''>{x} {y} 0 0 0 0</pose><link name='link'><collision name='collision'>
      <geometry><cylinder><radius>0.075000</radius><length>1</length></cylinder></geometry>
      </collision></link></model>"""


def write_world(folder: Path, number: int = 7, text: str | None = None) -> Path:
    """Writes a world of two cylinders, each also in the state, and a path along column 0."""
    models = "".join(model(k, x, y) for k, (x, y) in enumerate(CENTRES))
    world = f"<sdf version='1.6'><world name='default'>{models}<state world_name='default'>"
    text = text or f"{world}{models}</state></world></sdf>"
    (folder / f"world_{number}.world").write_text(text)
    paths = folder / "path_files"
    paths.mkdir(exist_ok=True)
    # Straight ahead through the field: 30 columns in the row that is nearest to the start.
    np.save(paths / f"path_{number}.npy", np.array([[14, column] for column in range(30)]))
    return folder


def test_each_cylinder_stands_once_and_only_the_lidar_knows_it(tmp_path):
    (scenario,) = barn_scenarios(write_world(tmp_path))
    obstacles = scenario.world.obstacles
    assert all(isinstance(o, Cylinder) and o.radius_m == 0.075 for o in obstacles)
    assert tuple(o.centre for o in obstacles) == CENTRES
    assert scenario.known_world.obstacles == ()


def test_a_world_saved_again_with_double_quotes_is_the_same(tmp_path):
    folder = write_world(tmp_path)
    (scenario,) = barn_scenarios(folder)
    path = folder / "world_7.world"
    path.write_text(path.read_text().replace("'", '"'))
    (again,) = barn_scenarios(folder)
    assert again.world.obstacles == scenario.world.obstacles


def test_the_task_is_that_of_the_challenge(tmp_path):
    (scenario,) = barn_scenarios(write_world(tmp_path))
    assert scenario.name == "barn_007"
    assert scenario.goal[1] - scenario.start[1] == 10.0
    assert scenario.timeout_s == 100.0
    assert scenario.suite is not None
    assert scenario.suite.arrival_radius_m == 1.0
    assert scenario.suite.density == "15%"


def test_the_reference_length_is_that_of_the_path_with_start_and_goal(tmp_path):
    (scenario,) = barn_scenarios(write_world(tmp_path))
    # Row 14 lies at x = -2.325, 0.075 m beside the start; columns 0 and 29 at y 5.175 and 9.525.
    first, last = math.hypot(0.075, 2.175), math.hypot(0.075, 3.475)
    assert scenario.suite.reference_length_m == pytest.approx(first + 29 * 0.15 + last)


def test_a_row_is_along_x_and_a_column_along_y():
    np.testing.assert_allclose(reference_path(np.array([[2, 1]]))[1], [-4.125, 5.325])


def test_worlds_come_by_number_and_density_by_groups_of_75(tmp_path):
    for number in (75, 3, 299):
        write_world(tmp_path, number)
    scenarios = barn_scenarios(tmp_path)
    assert [s.name for s in scenarios] == ["barn_003", "barn_075", "barn_299"]
    assert [s.suite.density for s in scenarios] == ["15%", "20%", "30%"]
    assert [s.name for s in barn_scenarios(tmp_path, [299, 3])] == ["barn_003", "barn_299"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<sdf/>", "expected models named unit_cylinder, found none"),
        (model(4, 1.0, 2.0).replace("1.0 2.0", "x y"), "model unit_cylinder_4: expected a pose"),
        (model(4, 1.0, 2.0).replace("radius", "size"), "model unit_cylinder_4: expected a pose"),
    ],
)
def test_a_world_that_is_wrong_is_told_with_its_file(tmp_path, text, reason):
    write_world(tmp_path, text=text)
    with pytest.raises(InputError, match=reason) as caught:
        barn_scenarios(tmp_path)
    assert str(caught.value).startswith(str(tmp_path / "world_7.world"))


def bytes_of(save, *arrays) -> bytes:
    file = io.BytesIO()
    save(file, *arrays)
    return file.getvalue()


def header_of(text: str) -> bytes:
    """Returns a .npy file without content whose header says something."""
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"text",
        np.arange(3),
        np.array([[np.inf, 1.0]]),
        np.array([[np.nan, 1.0]]),
        np.array([[1e9, 1.0]]),
        np.array([[1j, 1.0]]),
        np.array([["a", "b"]]),
        bytes_of(np.savez, np.ones((3, 2))),
        bytes_of(np.savez, np.ones((3, 2)))[:40],
        header_of("[" * 9000),
        header_of("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 2)}"),
        header_of("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -2)}"),
        header_of("{'descr': '|O', 'fortran_order': False, 'shape': (1, 2)}"),
        header_of("{'descr': [], 'fortran_order': 3}"),
    ],
)
def test_a_path_that_is_wrong_is_told_with_its_file(tmp_path, content):
    write_world(tmp_path)
    path = tmp_path / "path_files" / "path_7.npy"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.save(path, content)
    with pytest.raises(InputError, match=r"path_7\.npy: .*expected"):
        barn_scenarios(tmp_path)


def test_worlds_are_asked_for_by_numbers_and_ranges(tmp_path):
    for number in (0, 1, 4, 6, 8):
        write_world(tmp_path, number)

    def asked(*arguments):
        parsed = build_parser().parse_args(["--barn", str(tmp_path), *arguments])
        return request_from_arguments(parsed)

    assert asked("--worlds", "1,4-8:2,4").barn.worlds == (1, 4, 6, 8)
    assert asked().barn.worlds == ()
    with pytest.raises(InputError, match=r"no world_2\.world in"):
        asked("--worlds", "0-3").campaign()
    with pytest.raises(InputError, match="expected numbers and ranges such as"):
        asked("--worlds", "1..4")


def test_a_folder_without_worlds_is_refused(tmp_path):
    with pytest.raises(InputError, match="found none"):
        barn_scenarios(tmp_path / "nowhere")
