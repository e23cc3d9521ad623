"""A map's yaw turns it about its lower left corner."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.navigation.costmaps.map_file import load_map
from drake_navbench.navigation.costmaps.map_image import OCCUPIED, UNKNOWN
from drake_navbench.navigation.costmaps.turned_map import turned_along_axes

# Two columns and three rows, the lowest first.
CELLS = np.array([[0, 100], [0, 0], [100, 0]], dtype=np.int8)


def turned(yaw, cells=CELLS, origin=(2.0, 1.0)):
    return turned_along_axes(
        cells, resolution=0.5, origin=(*origin, yaw), outside=UNKNOWN, source="map"
    )


def test_a_quarter_turn_moves_every_cell_and_changes_none():
    cells, origin_x, origin_y = turned(math.pi / 2)
    # What was to the right lies up, what was up lies to the left.
    np.testing.assert_array_equal(cells, [[100, 0, 0], [0, 0, 100]])
    assert (origin_x, origin_y) == pytest.approx((2.0 - 3 * 0.5, 1.0))


def test_half_a_turn_puts_the_origin_at_the_upper_right():
    cells, origin_x, origin_y = turned(math.pi)
    np.testing.assert_array_equal(cells, CELLS[::-1, ::-1])
    assert (origin_x, origin_y) == pytest.approx((2.0 - 2 * 0.5, 1.0 - 3 * 0.5))


@given(yaw=st.floats(-4.0, 4.0), x=st.integers(0, 7), y=st.integers(0, 5))
def test_every_centre_finds_what_lies_there(yaw, x, y):
    cells = np.zeros((6, 8), dtype=np.int8)
    cells[y, x] = OCCUPIED
    found, origin_x, origin_y = turned(yaw, cells)
    rows, columns = np.nonzero(found == OCCUPIED)
    offset = (
        np.array([origin_x + (columns + 0.5) * 0.5 - 2.0, origin_y + (rows + 0.5) * 0.5 - 1.0])
        / 0.5
    )
    back = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]]) @ offset
    # Up to rounding all marked centres lie in the one occupied cell of the turned map.
    assert np.all(np.abs(back - np.array([[x + 0.5], [y + 0.5]])) <= 0.5 + 1e-6)


def test_what_lies_off_the_map_is_unknown():
    cells, *_ = turned(math.pi / 4, np.zeros((10, 10), dtype=np.int8))
    assert cells[0, 0] == UNKNOWN
    assert cells[cells.shape[0] // 2, cells.shape[1] // 2] == 0


def test_a_map_file_with_a_yaw_is_turned_and_nav2s_way_with_it_told(tmp_path):
    # The top row of the image is the highest one of the map.
    Image.fromarray(np.where(CELLS[::-1] == OCCUPIED, 0, 254).astype(np.uint8)).save(
        tmp_path / "map.png"
    )
    data = {"image": "map.png", "resolution": 0.5, "origin": [2.0, 1.0, math.pi / 2]}
    data |= {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(data))
    with pytest.warns(InputWarning, match="costmaps ignore it"):
        grid = load_map(tmp_path / "map.yaml")
    assert grid.bounds == pytest.approx((0.5, 1.0, 2.0, 2.0))
    # The cell at the lower right has come to the upper right of the lower left corner.
    assert grid.value_at(np.array([1.75, 1.75])) == OCCUPIED
    assert grid.value_at(np.array([1.75, 1.25])) == 0


def test_a_turned_map_may_become_too_large(monkeypatch):
    monkeypatch.setattr("drake_navbench.navigation.costmaps.grid_size.MAX_GRID_CELLS", 150)
    with pytest.raises(InputError, match="map: 16 x 15 cells are too many"):
        turned(math.pi / 4, np.zeros((10, 11), dtype=np.int8))
